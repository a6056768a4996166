"""Resolution and noise of two kinds of radar, and what the options change of them; one antenna, or two that scan in turn.

The values are assumptions in line with vendors' figures and with an array simulation; no real radar was measured.
"""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.measurements import NS_PER_S
from calib_core.synthetic.options import RadarDefects, RadarName, SimulationOptions
from calib_core.synthetic.timeline import Islands, SensorTimes, draw_times


@dataclass(frozen=True, slots=True)
class RadarProfile:
    """A radar in its measurement coordinates: range, sines of the angles, Doppler."""

    range_bin_m: float
    """Width of a range bin [m]; positions lie on bins."""
    angle_bins: int
    """Bins over the sine of the azimuth from -1 to 1 (64 gives a lattice of 1/32); 0 interpolates."""
    doppler_bin_mps: float
    """Width of a Doppler bin [m/s]; a speed below half of it has Doppler exactly 0."""
    doppler_bins: int
    """Bins from the fastest approaching to the fastest receding; beyond these, speeds wrap around."""
    range_sigma_m: float
    """Noise of one scan's range, before binning [m]."""
    azimuth_sigma: float
    """Noise of one scan's sine of azimuth."""
    elevation_sigma: float
    """Noise of one scan's sine of elevation."""
    azimuth_bias_sigma: float
    """Standard deviation of the part of the azimuth error that is constant for each object (multipath, clutter below it)."""
    elevation_bias_sigma: float
    """The same for the elevation."""
    calibration_azimuth: float
    """Amplitude of the smooth azimuth error over the field of view."""
    calibration_elevation: float
    """The same for the elevation."""
    snr_at_10_m_db: float
    """SNR of a 0 dBsm object at 10 m on the axis [dB]."""
    threshold_db: float
    """Least SNR of a return [dB]."""
    beam_azimuth_deg: float
    """Half-power half-width of the antenna in azimuth [deg], two-way."""
    beam_elevation_deg: float
    """The same for the elevation [deg]."""
    resolution_azimuth: float
    """Two objects in one range bin closer than this in sine of azimuth give one return."""
    false_alarms: float
    """Mean number of false returns per scan."""
    latency_s: float
    """Delay from the measurement to its stamp [s]."""
    elevation_bins: int = 0
    """Bins over the sine of the elevation from -1 to 1; 0 interpolates."""


RADAR_PROFILES: dict[RadarName, RadarProfile] = {
    "awr1843": RadarProfile(
        range_bin_m=0.0436,
        angle_bins=64,
        doppler_bin_mps=0.1256,
        doppler_bins=32,
        range_sigma_m=0.012,
        azimuth_sigma=0.0035,
        elevation_sigma=0.010,
        azimuth_bias_sigma=0.0025,
        elevation_bias_sigma=0.012,
        calibration_azimuth=0.0025,
        calibration_elevation=0.004,
        snr_at_10_m_db=16.0,
        threshold_db=11.0,
        beam_azimuth_deg=38.0,
        beam_elevation_deg=18.0,
        resolution_azimuth=0.25,
        false_alarms=0.12,
        latency_s=0.018,
    ),
    "imaging": RadarProfile(
        range_bin_m=0.03,
        angle_bins=0,
        doppler_bin_mps=0.05,
        doppler_bins=256,
        range_sigma_m=0.015,
        azimuth_sigma=0.0012,
        elevation_sigma=0.003,
        azimuth_bias_sigma=0.0012,
        elevation_bias_sigma=0.003,
        calibration_azimuth=0.0008,
        calibration_elevation=0.0015,
        snr_at_10_m_db=22.0,
        threshold_db=10.0,
        beam_azimuth_deg=50.0,
        beam_elevation_deg=22.0,
        resolution_azimuth=0.02,
        false_alarms=0.5,
        latency_s=0.030,
    ),
}


def profile_with(name: RadarName, defects: RadarDefects) -> RadarProfile:
    """Return a radar's profile with the bins and the scatter that the options ask for."""
    usual = RADAR_PROFILES[name]
    fastest_mps = defects.max_speed_mps
    changes: dict[str, float | int | None] = {
        "range_bin_m": defects.range_bin_m,
        "angle_bins": defects.azimuth_bins,
        "elevation_bins": defects.elevation_bins,
        "range_sigma_m": defects.scatter_range_m,
        "azimuth_sigma": _sine(defects.scatter_azimuth_deg),
        "elevation_sigma": _sine(defects.scatter_elevation_deg),
        "azimuth_bias_sigma": _sine(defects.constant_azimuth_deg),
        "elevation_bias_sigma": _sine(defects.constant_elevation_deg),
        "threshold_db": defects.threshold_db,
        "snr_at_10_m_db": usual.snr_at_10_m_db + defects.gain_db,
        "doppler_bin_mps": None if fastest_mps is None else 2.0 * fastest_mps / usual.doppler_bins,
    }
    return replace(usual, **{key: value for key, value in changes.items() if value is not None})  # type: ignore[arg-type]


def _sine(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else float(np.sin(np.deg2rad(angle_deg)))


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
