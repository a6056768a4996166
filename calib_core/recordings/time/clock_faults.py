"""Why one of a topic's two clocks cannot be used: stamps in the messages, receive times of the recorder."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.measurements import NS_PER_S

YEAR_2000_NS = 946_684_800 * NS_PER_S
_YEAR_2100_NS = 4_102_444_800 * NS_PER_S
MANY = 0.01
HALF_DISTINCT, RETURNS_DISTINCT = 0.5, 0.0
"""Plausible shares of different stamps: of pictures and scans, which some drivers send twice; of messages of one return."""

_RECEIVE_DISTINCT = 0.9
_WORST_BACK_S = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Stamps:
    """Both clocks of one topic, message by message in the order received.

    Attributes:
        topic: its name.
        receive_ns: (n,) the recorder's clock.
        header_ns: (n,) the stamps in the messages; None if they carry none.
        distinct: the least share of different stamps that is plausible: a few pictures may be sent twice, and the returns
            of one scan may share one.
        written: (n,) the messages in the order of the file, which shows a recorder's clock that was set back; None if unknown.
    """

    topic: str
    receive_ns: TimesNs
    header_ns: TimesNs | None
    distinct: float = HALF_DISTINCT
    written: Indices | None = None

    @property
    def offset_ns(self) -> float:
        """Median of receive time minus stamp [ns]."""
        assert self.header_ns is not None
        return float(np.median(self.receive_ns - self.header_ns))


def header_fault(stamps: Stamps) -> str | None:
    """Explain why the header stamps of a topic cannot be used, as a phrase that follows its name; None if they can."""
    header, n = stamps.header_ns, len(stamps.receive_ns)
    if header is None:
        return "has no stamps"
    if n == 0:
        return None
    zero = int(np.count_nonzero(header == 0))
    if zero == n:
        return f"has only zero stamps ({n} messages)"
    if n > 1 and np.all(header == header[0]):
        return f"has the same stamp in all {n} messages"
    if zero > MANY * n:
        return f"has {zero} zero stamps in {n} messages"
    if ancient(header) and not ancient(stamps.receive_ns):
        seconds = float(np.median(header)) / NS_PER_S
        return f"has stamps from the year 1970 ({seconds:.3f} s), which count from the start of a device"
    if np.median(header) > _YEAR_2100_NS:
        return "has stamps later than the year 2100"
    return _repeats(header, stamps) or _wrong_order(header, stamps)


def receive_fault(stamps: Stamps) -> str | None:
    """Explain why the receive times of a topic cannot be used, as a phrase; None if they can."""
    receive, n = stamps.receive_ns, len(stamps.receive_ns)
    if n == 0:
        return None
    if not receive.any():
        return f"all {n} receive times are zero"
    if n > 1 and np.all(receive == receive[0]):
        return f"all {n} receive times are equal"
    zero = int(np.count_nonzero(receive == 0))
    if zero > MANY * n:
        return f"{zero} of {n} receive times are zero"
    header = stamps.header_ns
    if header is None or not header.any():
        return None
    if stamps.distinct and distinct_times(receive) < _RECEIVE_DISTINCT * distinct_times(header):
        return f"{n} messages have only {distinct_times(receive)} different receive times"
    if (
        stamps.written is not None
        and disorder(receive[stamps.written])
        and not disorder(_dated(header[stamps.written]))
    ):
        return "the receive times go backwards within the file: the recorder's clock was set back"
    return None


def distinct_times(times_ns: TimesNs) -> int:
    """Return how many different times there are."""
    return len(np.unique(times_ns))


def ancient(times_ns: TimesNs) -> bool:
    """Return whether times lie before the year 2000, so that they are no dates."""
    return bool(np.median(times_ns) < YEAR_2000_NS)


def disorder(times_ns: TimesNs) -> str | None:
    """Describe times that go backwards often or far, as a phrase; None for a few small steps."""
    steps = np.diff(times_ns)
    back = int(np.count_nonzero(steps < 0))
    worst_s = -float(steps.min(initial=0)) / NS_PER_S
    if back > max(1, MANY * len(steps)) or worst_s > _WORST_BACK_S:
        return f"has {back} of {len(times_ns)} stamps that go backwards, by up to {worst_s:.3f} s"
    return None


def _dated(header: TimesNs) -> TimesNs:
    return header[header != 0]


def _repeats(header: TimesNs, stamps: Stamps) -> str | None:
    """Describe stamps that several messages share although their receive times tell them apart."""
    here, there = distinct_times(header), distinct_times(stamps.receive_ns)
    if here >= stamps.distinct * there:
        return None
    return f"has only {here} different stamps in {len(header)} messages"


def _wrong_order(header: TimesNs, stamps: Stamps) -> str | None:
    found = disorder(_dated(header))
    if found is not None and stamps.written is not None and disorder(_dated(header[stamps.written])) is None:
        return None  # the order received is wrong, not the stamps
    return found
