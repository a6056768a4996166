"""Resolution and noise of two kinds of radar, and what the options change of them.

The values are assumptions in line with vendors' figures and with an array simulation; no real radar was measured.
"""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.synthetic.radar_options import RadarDefects, RadarName


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
