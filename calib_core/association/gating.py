"""Gating: keep the returns that can be the reflector, that is static, in range and with a finite position."""

import numpy as np

from calib_core.arrays import Flags
from calib_core.measurements import RadarScans
from calib_core.options import GatingOptions

__all__ = ["static_returns"]


def static_returns(scans: RadarScans, options: GatingOptions) -> RadarScans:
    """Keep the static returns in range (Algorithm 1: range filter and velocity filter).

    A return without a Doppler speed is kept. A return without a finite position is dropped, along with its Doppler and
    SNR. Every scan is kept, even if it becomes empty, so that the stamps stay the same.

    Args:
        scans: as the radar reported them.
        options: largest speed [m/s], smallest and largest range [m].
    """
    return _keep(scans, _can_be_the_reflector(scans, options))


def _can_be_the_reflector(scans: RadarScans, options: GatingOptions) -> Flags:
    range_m = np.linalg.norm(scans.points_radar_m, axis=1)
    with np.errstate(invalid="ignore"):
        moving = np.abs(scans.doppler_mps) > options.max_speed_mps  # False for NaN
        within = (range_m >= options.min_range_m) & (range_m <= options.max_range_m)  # False for NaN
    return within & ~moving


def _keep(scans: RadarScans, kept: Flags) -> RadarScans:
    kept_before = np.concatenate([[0], np.cumsum(kept)])
    return RadarScans(
        times_ns=scans.times_ns,
        first_return=kept_before[scans.first_return],
        points_radar_m=scans.points_radar_m[kept],
        doppler_mps=scans.doppler_mps[kept],
        snr_db=scans.snr_db[kept],
        sigma_polar=scans.sigma_polar[kept],
    )
