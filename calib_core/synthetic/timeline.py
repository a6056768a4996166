"""Stamps of two sensors that are not synchronised, with jitter and an occasional dropped message."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import TimesNs, Values, frozen_array
from calib_core.measurements import NS_PER_S

__all__ = ["SensorTimes", "draw_times"]


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
        object.__setattr__(self, "moment_s", frozen_array(self.moment_s, (m,)))
        for name in ("header_ns", "receive_ns"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (m,), dtype=np.int64))

    def __len__(self) -> int:
        return len(self.moment_s)


def draw_times(
    rng: np.random.Generator,
    *,
    duration_s: float,
    rate_hz: float,
    jitter_s: float,
    dropped_share: float,
    latency_s: float,
    transfer_s: float,
    start_ns: int,
) -> SensorTimes:
    """Draw one sensor's times.

    Args:
        rng: the only source of randomness.
        duration_s: length of the recording [s].
        rate_hz: measurements per second.
        jitter_s: standard deviation of each measurement's time [s].
        dropped_share: share of measurements that are lost.
        latency_s: from the measurement to its stamp, clock offset included [s].
        transfer_s: mean delay from the stamp to the recorder [s].
        start_ns: the recording's start.
    """
    first_s = rng.uniform(0.05, 0.05 + 1.0 / rate_hz)
    moments = np.arange(first_s, duration_s, 1.0 / rate_hz)
    jitter = np.clip(jitter_s * rng.standard_normal(len(moments)), -0.3 / rate_hz, 0.3 / rate_hz)
    moments = (moments + jitter)[rng.uniform(size=len(moments)) >= dropped_share]
    header = start_ns + np.round((moments + latency_s) * NS_PER_S).astype(np.int64)
    delay_s = transfer_s * rng.gamma(4.0, 0.25, len(moments))
    receive = np.maximum.accumulate(header + np.round(delay_s * NS_PER_S).astype(np.int64))
    return SensorTimes(moments, header, receive + np.arange(len(moments)))
