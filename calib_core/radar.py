"""Radar polar coordinates, and the noise of a return.

Radar frame: x forward, y left, z up (docs/conventions.md). Azimuth is positive to the left, elevation upwards.
"""

import numpy as np

from calib_core.arrays import Points3

__all__ = [
    "cartesian_from_polar",
    "cartesian_jacobian",
    "covariance_from_sigma_polar",
    "direction_cosines",
    "polar_from_cartesian",
    "position_planes",
]


def cartesian_from_polar(polar: Points3) -> Points3:
    """Turn (range [m], azimuth [rad], elevation [rad]) rows into x, y, z [m] (paper section III: polar to Cartesian)."""
    polar = np.asarray(polar, dtype=np.float64)
    range_m, azimuth_rad, elevation_rad = polar[..., 0], polar[..., 1], polar[..., 2]
    across = range_m * np.cos(elevation_rad)
    return np.stack(
        [across * np.cos(azimuth_rad), across * np.sin(azimuth_rad), range_m * np.sin(elevation_rad)], axis=-1
    )


def position_planes(polar: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Turn polar planes (3, n) into positions (3, n) [m] and d position / d polar (3, 3, n), position first.

    The same as `cartesian_from_polar` and `cartesian_jacobian`, laid out for speed: one row per coordinate.
    """
    range_m = polar[0]
    (cos_azimuth, cos_elevation), (sin_azimuth, sin_elevation) = np.cos(polar[1:]), np.sin(polar[1:])
    direction = np.array([cos_elevation * cos_azimuth, cos_elevation * sin_azimuth, sin_elevation])
    position = range_m * direction
    jacobian = np.zeros((3, 3, polar.shape[1]))
    jacobian[:, 0] = direction
    jacobian[0, 1], jacobian[1, 1] = -position[1], position[0]
    jacobian[0, 2], jacobian[1, 2] = -position[2] * cos_azimuth, -position[2] * sin_azimuth
    jacobian[2, 2] = range_m * cos_elevation
    return position, jacobian


def polar_from_cartesian(points_radar_m: Points3) -> Points3:
    """Turn x, y, z [m] rows into (range [m], azimuth [rad], elevation [rad]); the origin becomes zeros."""
    points = np.asarray(points_radar_m, dtype=np.float64)
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    across = np.hypot(x, y)
    return np.stack([np.hypot(across, z), np.arctan2(y, x), np.arctan2(z, across)], axis=-1)


def direction_cosines(points_radar_m: Points3) -> Points3:
    """Turn x, y, z [m] rows into (r [m], u, w): u = y / r, w = z / r, in which a radar's errors are about constant."""
    points = np.asarray(points_radar_m, dtype=np.float64)
    range_m = np.linalg.norm(points, axis=-1)
    safe_m = np.where(range_m > 0, range_m, 1.0)
    return np.stack([range_m, points[..., 1] / safe_m, points[..., 2] / safe_m], axis=-1)


def cartesian_jacobian(polar: Points3) -> np.ndarray:
    """Return d(x, y, z) / d(range, azimuth, elevation) at each row: (n, 3, 3)."""
    polar = np.asarray(polar, dtype=np.float64)
    range_m, azimuth_rad, elevation_rad = polar[..., 0], polar[..., 1], polar[..., 2]
    ca, sa, ce, se = np.cos(azimuth_rad), np.sin(azimuth_rad), np.cos(elevation_rad), np.sin(elevation_rad)
    zero = np.zeros_like(range_m)
    rows = [
        np.stack([ce * ca, -range_m * ce * sa, -range_m * se * ca], axis=-1),
        np.stack([ce * sa, range_m * ce * ca, -range_m * se * sa], axis=-1),
        np.stack([se, zero, range_m * ce], axis=-1),
    ]
    return np.stack(rows, axis=-2)


def covariance_from_sigma_polar(points_radar_m: Points3, sigma_polar: Points3) -> np.ndarray:
    """Carry standard deviations of range [m], azimuth and elevation [rad] into (n, 3, 3) Cartesian covariances [m^2]."""
    jacobian = cartesian_jacobian(polar_from_cartesian(points_radar_m))
    scaled = jacobian * np.asarray(sigma_polar, dtype=np.float64)[..., None, :]
    return scaled @ np.swapaxes(scaled, -1, -2)
