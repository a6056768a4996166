"""When a session was recorded, for people."""

from datetime import UTC, datetime


def recorded_text(recorded_ns: int | None, *, unknown: str = "–") -> str:
    """Write when a recording began, in UTC, to the minute.

    Args:
        recorded_ns: its first stamp [ns]; None if that is not known.
        unknown: what to write then.
    """
    if recorded_ns is None:
        return unknown
    try:
        return f"{datetime.fromtimestamp(recorded_ns // 1_000_000_000, UTC):%Y-%m-%d %H:%M}"
    except (OverflowError, ValueError, OSError):  # a stamp that no calendar has
        return unknown
