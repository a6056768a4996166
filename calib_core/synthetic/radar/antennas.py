"""The radar's antennas: one, or one for near and one for far ranges that scan in turn."""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.measurements import NS_PER_S
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.radar.profiles import RadarProfile
from calib_core.synthetic.timeline import Islands, SensorTimes, draw_times

_NEAR_HZ, _NEAR_END_M = 25.0, 10.0
_FAR_HZ, _FAR_BEGIN_M = 20.0, 5.0
_NEAR_BEAM_DEG, _FAR_BEAM_DEG = 60.0, 20.0
_NEAR_GAIN_DB, _FAR_GAIN_DB = -4.0, 8.0
_NEAR_COARSER = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Antenna:
    """One antenna with scans of its own.

    Attributes:
        name: "near" or "far"; "" for the only one.
        profile: what it resolves.
        times: when it scanned.
        min_range_m: nearest object in its scans [m].
        max_range_m: farthest [m].
    """

    name: str
    profile: RadarProfile
    times: SensorTimes
    min_range_m: float = 0.0
    max_range_m: float = np.inf


def antennas_of(
    options: SimulationOptions,
    profile: RadarProfile,
    rngs: tuple[np.random.Generator, np.random.Generator],
    *,
    duration_s: float,
    islands: Islands | None,
) -> tuple[Antenna, ...]:
    """Return the antennas with their times; of two the far one first.

    Args:
        options: what to simulate.
        profile: of the radar.
        rngs: the only source of randomness of the first and the second antenna.
        duration_s: of the story.
        islands: what of it is recorded.
    """

    def times(rng: np.random.Generator, rate_hz: float) -> SensorTimes:
        return draw_times(
            rng,
            duration_s=duration_s,
            rate_hz=rate_hz,
            jitter_s=options.stamp_jitter_s,
            dropped_share=options.dropped_share,
            latency_s=profile.latency_s + options.clock_offset_s,
            transfer_s=0.003,
            start_ns=options.start_s * NS_PER_S,
            islands=islands,
        )

    if not options.defects.near_and_far:
        return (Antenna("", profile, times(rngs[0], options.radar_rate_hz)),)
    near, far = _near_and_far(profile)
    return (
        Antenna("far", far, times(rngs[0], _FAR_HZ), min_range_m=_FAR_BEGIN_M),
        Antenna("near", near, times(rngs[1], _NEAR_HZ), max_range_m=_NEAR_END_M),
    )


def _near_and_far(profile: RadarProfile) -> tuple[RadarProfile, RadarProfile]:
    near = replace(
        profile,
        beam_azimuth_deg=_NEAR_BEAM_DEG,
        snr_at_10_m_db=profile.snr_at_10_m_db + _NEAR_GAIN_DB,
        azimuth_sigma=_NEAR_COARSER * profile.azimuth_sigma,
        resolution_azimuth=_NEAR_COARSER * profile.resolution_azimuth,
    )
    far = replace(profile, beam_azimuth_deg=_FAR_BEAM_DEG, snr_at_10_m_db=profile.snr_at_10_m_db + _FAR_GAIN_DB)
    return near, far
