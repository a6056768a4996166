"""Unmeasured elevation: what a radar without elevation determines, and what it leaves open.

Such a radar reports one elevation, or one height, for whatever it sees. A pitch or a roll of the radar against the plane of
the placements is then exactly a rotation, and the height of that plane above or below the radar a shift along its up axis, but
for the range along the plane, sqrt(r^2 - h^2). So each elevation is taken as reported, with a small noise of its own, h^2 is
estimated with the pose (`systematic_errors`), and pitch, roll and height are added to the covariance afterwards
(`radar_axes.mounting_moves`): the pose is the one that maps reported positions to pixels, its covariance that of the radar's
housing.
"""

import numpy as np

from calib_core.arrays import Points3, Values

OWN_SIGMA_RAD = np.deg2rad(0.5)
"""Standard deviation of each placement's elevation above or below the common plane: uneven ground."""

_SAME_ELEVATION_RAD = np.deg2rad(0.01)
_SAME_HEIGHT_M = 0.001
_LEAST_POSITIONS = 2
_NEARLY_ALL = 0.9


def is_flat(points_radar_m: Points3) -> bool:
    """Return whether nearly all radar positions (n, 3) have one elevation or one height, up to rounding."""
    if len(points_radar_m) < _LEAST_POSITIONS:
        return False
    height_m = points_radar_m[:, 2]
    elevation_rad = np.arctan2(height_m, np.hypot(points_radar_m[:, 0], points_radar_m[:, 1]))
    return _apart(height_m) < _SAME_HEIGHT_M or _apart(elevation_rad) < _SAME_ELEVATION_RAD


def _apart(values: Values) -> float:
    """Return how far from their median all but a few of the values lie."""
    return float(np.quantile(np.abs(values - np.median(values)), _NEARLY_ALL))
