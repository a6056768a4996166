"""Standard deviations of range, azimuth and elevation from a tracker's position covariance."""

import numpy as np

from calib_core.arrays import Points3
from calib_core.radar import polar_from_cartesian

_UPPER = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])


def full_covariance(rows: np.ndarray) -> np.ndarray:
    """Return (n, 3, 3) position covariances [m^2] from the rows in messages.

    Args:
        rows: (n, 6) xx, xy, xz, yy, yz, zz; (n, 9) row-major; or (n, 36) of x, y, z and three rotations, row-major.
    """
    if rows.shape[1] == 6:
        return np.asarray(rows[:, _UPPER])
    side = 6 if rows.shape[1] == 36 else 3
    return np.asarray(rows.reshape(-1, side, side)[:, :3, :3])


def sigma_polar_from_covariance(points_radar_m: Points3, covariance_m2: np.ndarray) -> Points3:
    """Return (n, 3) standard deviations of range [m], azimuth and elevation [rad]; NaN where a variance is not positive.

    Trackers write 0 or -1 for unknown variances.

    Args:
        points_radar_m: (n, 3).
        covariance_m2: (n, 3, 3).
    """
    range_m, azimuth, elevation = polar_from_cartesian(points_radar_m).T
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    along = np.stack([ce * ca, ce * sa, se], axis=1)
    across = np.stack([-sa, ca, np.zeros_like(sa)], axis=1)
    upward = np.stack([-se * ca, -se * sa, ce], axis=1)
    lengths = np.stack([np.ones_like(range_m), range_m * ce, range_m], axis=1)
    axes = np.stack([along, across, upward], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        variance = np.einsum("nai,nij,naj->na", axes, covariance_m2, axes)
        known = np.stack([covariance_m2[:, i, i] > 0 for i in range(3)], axis=1)
        known[:, 0] &= known[:, 1]
        return np.where(known & (variance > 0) & (lengths > 0), np.sqrt(np.abs(variance)) / lengths, np.nan)
