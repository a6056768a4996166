"""Format stamps and durations as text."""

from datetime import UTC, datetime

from calib_core.measurements import NS_PER_S, TimeNs


def utc(time: TimeNs) -> str:
    """Format a stamp as UTC date and time with milliseconds."""
    seconds, rest = divmod(int(time), NS_PER_S)
    try:
        moment = datetime.fromtimestamp(seconds, tz=UTC)
    except (OverflowError, ValueError, OSError):
        return f"{seconds}.{rest // 1_000_000:03d} s"
    return f"{moment:%Y-%m-%d %H:%M:%S}.{rest // 1_000_000:03d} UTC"


def span_text(seconds: float) -> str:
    """Format a time difference in seconds, minutes, hours or days."""
    seconds = abs(seconds)
    for size, unit in ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.3f} s"
