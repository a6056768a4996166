"""The time for which two series of stamps both have data: pauses of either are left out."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.measurements import NS_PER_S

_GAP_PERIODS = 5.0
_STRETCH_GAP_NS = NS_PER_S


@dataclass(frozen=True, slots=True)
class SharedTime:
    """When both sensors have data.

    Attributes:
        seconds: total time [s], without gaps of more than five cycles of either sensor.
        stretches: number of stretches, separated by more than a second.
    """

    seconds: float
    stretches: int


def shared_time(a_ns: TimesNs, b_ns: TimesNs) -> SharedTime:
    """Measure the time covered by both series.

    Args:
        a_ns: (n,) stamps, ascending.
        b_ns: (m,) stamps, ascending.
    """
    both = _intersections(_stretches(a_ns), _stretches(b_ns))
    if not len(both):
        return SharedTime(0.0, 0)
    apart = both[1:, 0] - both[:-1, 1] > _STRETCH_GAP_NS
    return SharedTime(float((both[:, 1] - both[:, 0]).sum()) / NS_PER_S, 1 + int(np.count_nonzero(apart)))


def _stretches(times_ns: TimesNs) -> np.ndarray:
    """Return begin and end (k, 2) of each stretch of stamps without a gap of more than five cycles."""
    if not len(times_ns):
        return np.zeros((0, 2), dtype=np.int64)
    steps = np.diff(times_ns)
    moving = steps[steps > 0]
    cut = np.flatnonzero(steps > _GAP_PERIODS * np.median(moving)) if len(moving) else np.zeros(0, dtype=np.int64)
    return np.stack([times_ns[np.append(0, cut + 1)], times_ns[np.append(cut, len(times_ns) - 1)]], axis=1)


def _intersections(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersect two ascending lists of intervals (n, 2) and (m, 2)."""
    found = []
    first = second = 0
    while first < len(a) and second < len(b):
        begin, end = max(a[first, 0], b[second, 0]), min(a[first, 1], b[second, 1])
        if begin <= end:
            found.append((begin, end))
        if a[first, 1] <= b[second, 1]:
            first += 1
        else:
            second += 1
    return np.array(found, dtype=np.int64).reshape(-1, 2)
