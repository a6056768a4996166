"""How the process ends at a signal (Ctrl+C, SIGTERM, SIGHUP: in order, once), handles freed memory, and shares the processor."""

import ctypes
import os
import signal
import sys
import threading
from collections.abc import Callable
from functools import partial
from types import FrameType

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP
_AGAIN_S = 0.02
_GRACE_S = 10.0
"""How long closing may take after SIGTERM."""
_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8  # as <malloc.h> has them
_KEPT_BYTES = 64 << 20
_LARGEST_BYTES = 32 << 20
_BACKGROUND = 10  # niceness


def stop_on_signals() -> None:
    """Raise KeyboardInterrupt at the first of these signals; ignore the later ones, so that closing is not interrupted.

    At a SIGTERM, be it the first or a later one, a timer starts with which the system ends what is then still running.

    A signal that whoever started the program has switched off stays off: `nohup` does that to SIGHUP, a shell to the
    SIGINT of a program in the background. The exception carries the number of the signal.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    heard = [number for number in _numbers() if signal.getsignal(number) is not signal.SIG_IGN]
    for number in heard:
        signal.signal(number, _stop)
    sys.unraisablehook = partial(_unraisable, sys.unraisablehook, heard)


def _stop(number: int, frame: FrameType | None) -> None:
    for other in _numbers():
        if signal.getsignal(other) is _stop:
            signal.signal(other, _end_in_time if other == signal.SIGTERM else signal.SIG_IGN)
    if number == signal.SIGTERM:
        _end_in_time(number, frame)
    raise KeyboardInterrupt(number)


def _end_in_time(_number: int, _: FrameType | None) -> None:
    """Let the system end the process soon, whatever a parser, a C call or a thread is at."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, _GRACE_S)


def _unraisable(
    usual: Callable[["sys.UnraisableHookArgs"], object],
    heard: list[signal.Signals],
    args: "sys.UnraisableHookArgs",
) -> None:
    """Send a signal again that came while an object was being deleted: Python drops what is raised there."""
    interrupt = args.exc_value
    if not isinstance(interrupt, KeyboardInterrupt) or not interrupt.args:
        usual(args)
        return
    for number in heard:
        signal.signal(number, _stop)
    again = threading.Timer(_AGAIN_S, partial(_send_again, interrupt.args[0]))
    again.daemon = True
    again.start()


def _send_again(number: int) -> None:
    """Send a signal to the main thread; it also wakes it, where the system can do that."""
    main = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main is not None:
        signal.pthread_kill(main, number)
    else:
        signal.raise_signal(number)


def _numbers() -> list[signal.Signals]:
    return [signal.Signals[name] for name in _NAMES if name in signal.Signals.__members__]


def keep_freed_memory() -> bool:
    """Make the C library keep up to 64 MB of freed memory instead of returning it to the system at once.

    An image's pixels take megabytes that are allocated and freed with every frame. Getting them from the system each time,
    page by page, takes as long as decoding the image. All threads share what is kept, or each would keep as much.

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


def go_last() -> None:
    """Let other threads and programs, such as the browser, go before this thread, where the system can do that for one."""
    if sys.platform == "linux":
        thread = threading.get_native_id()
        os.setpriority(os.PRIO_PROCESS, thread, max(_BACKGROUND, os.getpriority(os.PRIO_PROCESS, thread)))
