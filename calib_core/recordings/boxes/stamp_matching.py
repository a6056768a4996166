"""Which recorded frame a stamp belongs to: the one within 1 ms of it."""

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.errors import InputError
from calib_core.measurements import NS_PER_S

STAMP_TOLERANCE_NS = 1_000_000
"""Times in names of files are often rounded to milliseconds; frames are further apart."""
_LEAST_MATCHING = 0.5


def frames_of_stamps(stamps: TimesNs, source: str, image_times: TimesNs) -> tuple[Indices, tuple[str, ...]]:
    """Return the recorded frame of each stamp, -1 for stamps at which there is none, and what to know about them.

    Args:
        stamps: (n,) of annotated frames, in any order; at least one.
        source: where they are from, for messages.
        image_times: (m,) stamps of the recorded frames, ascending; at least one.

    Raises:
        InputError: most stamps within the recorded time are of no frame, or none is within it.
    """
    after = np.clip(np.searchsorted(image_times, stamps), 0, len(image_times) - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.abs(image_times[before] - stamps) <= np.abs(image_times[after] - stamps)
    nearest = np.where(nearer, before, after).astype(np.int64)
    matches = np.abs(image_times[nearest] - stamps) <= STAMP_TOLERANCE_NS
    within = (stamps >= image_times[0] - STAMP_TOLERANCE_NS) & (stamps <= image_times[-1] + STAMP_TOLERANCE_NS)
    if not within.any():
        raise InputError(
            f"{source}: its frames are from {_shown(stamps.min())} to {_shown(stamps.max())}, the recorded ones from "
            f"{_shown(image_times[0])} to {_shown(image_times[-1])}; is it of another recording?"
        )
    if np.count_nonzero(matches) < _LEAST_MATCHING * np.count_nonzero(within):
        raise InputError(
            f"{source}: {np.count_nonzero(within & ~matches)} of {np.count_nonzero(within)} annotated frames have the "
            f"stamp of no recorded frame (within {STAMP_TOLERANCE_NS // 1_000_000} ms); is it of another recording? If "
            "the recording is read by receive times and the boxes have header stamps, add --clock header"
        )
    missing = int(np.count_nonzero(~matches))
    note = f"{missing} of {len(stamps)} annotated frames are not in the recording and are left out"
    return np.where(matches, nearest, -1), (note,) if missing else ()


def _shown(time: int) -> str:
    return f"{int(time) / NS_PER_S:.3f} s"
