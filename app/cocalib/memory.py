"""How the process handles freed memory."""

import ctypes
import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8  # as <malloc.h> has them
_KEPT_BYTES = 64 << 20
_LARGEST_BYTES = 32 << 20


def keep_freed_memory() -> bool:
    """Make the C library keep up to 64 MB of freed memory instead of returning it to the system at once.

    A picture's pixels take megabytes that are allocated and freed with every frame. Getting them from the system each time,
    page by page, takes as long as decoding the picture. All threads share what is kept, or each would keep as much.

    Returns:
        False if the C library has no such setting (it is not glibc).
    """
    if not sys.platform.startswith("linux"):
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return False
    kept = mallopt(_TRIM_THRESHOLD, _KEPT_BYTES) == 1 and mallopt(_ARENA_MAX, 1) == 1
    return bool(mallopt(_MMAP_THRESHOLD, _LARGEST_BYTES) == 1 and kept)
