"""Signals that end the program: Ctrl+C, SIGTERM and SIGHUP all end it in order, once."""

import signal
import threading
from types import FrameType

__all__ = ["stop_on_signals"]

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # Windows has no SIGHUP


def stop_on_signals() -> None:
    """Raise KeyboardInterrupt at the first of these signals; ignore the later ones, so that closing is not interrupted.

    A signal that whoever started the program has switched off stays off: `nohup` does that to SIGHUP, a shell to the
    SIGINT of a program in the background. The exception carries the number of the signal.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    for number in _numbers():
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)


def _stop(number: int, _: FrameType | None) -> None:
    for other in _numbers():
        signal.signal(other, signal.SIG_IGN)
    raise KeyboardInterrupt(number)


def _numbers() -> list[signal.Signals]:
    return [signal.Signals[name] for name in _NAMES if name in signal.Signals.__members__]
