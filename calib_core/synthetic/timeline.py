"""Stamps of two sensors that are not synchronised, with jitter and an occasional dropped message."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, TimesNs, Values, freeze
from calib_core.measurements import NS_PER_S

_ISLAND_S = (2.0, 15.0)
_GAP_S = (60.0, 300.0)
START_NS = 1_760_000_000 * NS_PER_S
"""When every recording begins."""
_JITTER_S, _DROPPED_SHARE = 0.002, 0.01
"""Standard deviation of a measurement's time [s], and the share of measurements that are lost."""


@dataclass(frozen=True, slots=True, eq=False)
class SensorTimes:
    """When a sensor measured, its stamps, and when the recorder received them.

    Attributes:
        moment_s: (m,) true times of measurement from the start [s].
        header_ns: (m,) stamps in the messages, strictly ascending.
        receive_ns: (m,) stamps of the recorder, strictly ascending.
    """

    moment_s: Values
    header_ns: TimesNs
    receive_ns: TimesNs

    def __post_init__(self) -> None:
        m = len(self.moment_s)
        freeze(self, moment_s=(m,))
        freeze(self, np.int64, header_ns=(m,), receive_ns=(m,))

    def __len__(self) -> int:
        return len(self.moment_s)


@dataclass(frozen=True, slots=True, eq=False)
class RecordedSegments:
    """The parts of the story that are recorded, and how much later than in the story each is.

    Attributes:
        starts_s: (k,) where each begins in the story, ascending.
        ends_s: (k,) where it ends; the next one begins there or later.
        delays_s: (k,) what is added to times of the story to get times of the recording.
    """

    starts_s: Values
    ends_s: Values
    delays_s: Values

    def __post_init__(self) -> None:
        k = len(self.starts_s)
        freeze(self, starts_s=(k,), ends_s=(k,), delays_s=(k,))

    def recorded(self, times_s: Values) -> Flags:
        """Return which times of the story are recorded."""
        island = np.searchsorted(self.starts_s, times_s, side="right") - 1
        return np.asarray((island >= 0) & (times_s < self.ends_s[np.maximum(island, 0)]))

    def delay_s(self, times_s: Values) -> Values:
        """Return the delay of each recorded time."""
        return np.asarray(self.delays_s[np.searchsorted(self.starts_s, times_s, side="right") - 1])

    def first_after_s(self, time_s: float) -> float:
        """Return when the recording first shows what is there from a time of the story on."""
        island = min(int(np.searchsorted(self.ends_s, time_s, side="right")), len(self.ends_s) - 1)
        return max(time_s, float(self.starts_s[island])) + float(self.delays_s[island])

    def last_before_s(self, time_s: float) -> float:
        """Return when the recording last shows what is there up to a time of the story."""
        island = max(int(np.searchsorted(self.starts_s, time_s, side="left")) - 1, 0)
        return min(time_s, float(self.ends_s[island])) + float(self.delays_s[island])


def draw_segments(rng: np.random.Generator, middles_s: Values) -> RecordedSegments:
    """Draw an island around each middle: 2 to 15 s, but not beyond half way to the next, and gaps of minutes between.

    Args:
        rng: the only source of randomness.
        middles_s: (k,) ascending, in the story.
    """
    half_s = 0.5 * rng.uniform(*_ISLAND_S, len(middles_s))
    between_s = 0.5 * (middles_s[1:] + middles_s[:-1])
    starts_s = np.maximum(middles_s - half_s, np.concatenate([[0.0], between_s]))
    ends_s = np.minimum(middles_s + half_s, np.concatenate([between_s, [np.inf]]))
    gaps_s = np.concatenate([[0.0], rng.uniform(*_GAP_S, len(between_s))])
    passed_s = np.concatenate([[0.0], starts_s[1:] - ends_s[:-1]])
    return RecordedSegments(starts_s, ends_s, np.cumsum(gaps_s - passed_s) - starts_s[0])


EVERYTHING = RecordedSegments(np.zeros(1), np.full(1, np.inf), np.zeros(1))
"""The whole story, as it was."""


def draw_times(
    rng: np.random.Generator,
    duration_s: float,
    rate_hz: float,
    *,
    latency_s: float,
    transfer_s: float,
    segments: RecordedSegments = EVERYTHING,
) -> SensorTimes:
    """Draw one sensor's times.

    Args:
        rng: the only source of randomness.
        duration_s: length of the recording [s].
        rate_hz: measurements per second.
        latency_s: from the measurement to its stamp [s].
        transfer_s: mean delay from the stamp to the recorder [s].
        segments: what of the story is recorded.
    """
    moments = np.arange(rng.uniform(0.05, 0.05 + 1.0 / rate_hz), duration_s, 1.0 / rate_hz)
    jitter = np.clip(_JITTER_S * rng.standard_normal(len(moments)), -0.3 / rate_hz, 0.3 / rate_hz)
    moments = (moments + jitter)[rng.uniform(size=len(moments)) >= _DROPPED_SHARE]
    moments = moments[segments.recorded(moments)]
    header = START_NS + np.round((moments + segments.delay_s(moments) + latency_s) * NS_PER_S).astype(np.int64)
    delay_s = transfer_s * rng.gamma(4.0, 0.25, len(moments))
    receive = np.maximum.accumulate(header + np.round(delay_s * NS_PER_S).astype(np.int64))
    return SensorTimes(moments, header, receive + np.arange(len(moments)))
