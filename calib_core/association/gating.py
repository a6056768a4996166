"""Gating: keep the returns that can be the reflector, that is static, in range and with a finite position."""

import numpy as np

from calib_core.arrays import Flags
from calib_core.measurements import RadarScans
from calib_core.options import GatingOptions


def static_returns(scans: RadarScans, options: GatingOptions) -> RadarScans:
    """Keep the static returns in range (Algorithm 1: range filter and velocity filter).

    A return without a Doppler speed is kept. A return without a finite position is dropped, along with its Doppler and
    SNR. Every scan is kept, even if it becomes empty, so that the stamps stay the same.

    Args:
        scans: as the radar reported them.
        options: largest speed [m/s], smallest and largest range [m].
    """
    return scans.take(np.flatnonzero(_can_be_the_reflector(scans, options)))


def _can_be_the_reflector(scans: RadarScans, options: GatingOptions) -> Flags:
    range_m = np.linalg.norm(scans.points_radar_m, axis=1)
    with np.errstate(invalid="ignore"):
        moving = np.abs(scans.doppler_mps) > options.max_speed_mps  # False for NaN
        within = (range_m >= options.min_range_m) & (range_m <= options.max_range_m)  # False for NaN
    return within & ~moving
