"""Stamps as dates, for people."""

from datetime import UTC, datetime

from calib_core.measurements import NS_PER_S, TimeNs

__all__ = ["utc"]


def utc(time: TimeNs) -> str:
    """Write a stamp as date and time with milliseconds, UTC."""
    seconds, rest = divmod(int(time), NS_PER_S)
    try:
        moment = datetime.fromtimestamp(seconds, tz=UTC)
    except (OverflowError, ValueError, OSError):
        return f"{seconds}.{rest // 1_000_000:03d} s"
    return f"{moment:%Y-%m-%d %H:%M:%S}.{rest // 1_000_000:03d} UTC"
