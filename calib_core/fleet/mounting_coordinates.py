"""Coordinates of a mounting: camera centre and rotation in the radar's axes, relative to a common mounting.

A mounting scatters in where the camera is, as seen from the radar, and in how it is turned; the translation t = -R c of
camera_from_radar mixes the two. With the common mounting R_0, c_0 the six coordinates are

    (c - c_0,  R_0^T log(R R_0^T))    forward, left, up [m]; about forward, left, up [rad].

They do not depend on the camera's axes, and turn with the radar's. The common mounting is the one that most vehicles are near: a
robust start, before anything is estimated.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Matrix66, Values
from calib_core.geometry import RigidTransform, camera_position_jacobian, rotation_exp, rotation_log, skew

_SMALL_RAD = 1e-4
_STEPS = 30
_MEDIAN_CHI2_3 = 2.365973884375338
_LEAST_SPREAD = 1e-6  # m and rad
_BLOCKS = (slice(0, 3), slice(3, 6))


def coordinates(camera_from_radar: RigidTransform, common: RigidTransform) -> Values:
    """Return the six coordinates of a mounting (6,) [m, rad].

    Args:
        camera_from_radar: the mounting.
        common: the mounting it is relative to.
    """
    moved_m = camera_from_radar.inverse().translation_m - common.inverse().translation_m
    turned_rad = common.rotation.T @ rotation_log(camera_from_radar.rotation @ common.rotation.T)
    return np.concatenate([moved_m, turned_rad])


def pose_from_coordinates(values: Values, common: RigidTransform) -> RigidTransform:
    """Return the mounting with these coordinates (6,) [m, rad]: the inverse of `coordinates`."""
    position_m = common.inverse().translation_m + values[:3]
    rotation = rotation_exp(common.rotation @ values[3:]) @ common.rotation
    return RigidTransform(rotation, -rotation @ position_m)


def coordinate_jacobian(camera_from_radar: RigidTransform, common: RigidTransform) -> Matrix66:
    """Return d coordinates / d (dt, dtheta) (6, 6) for an error of the mounting's pose, `Calibration.covariance`'s convention."""
    turned_rad = rotation_log(camera_from_radar.rotation @ common.rotation.T)
    jacobian = np.zeros((6, 6))
    jacobian[:3] = camera_position_jacobian(camera_from_radar)
    jacobian[3:, 3:] = common.rotation.T @ _log_jacobian(turned_rad)
    return jacobian


def common_mounting(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Return the geometric median of poses: positions and rotations each in units of their median distance.

    Args:
        poses: camera_from_radar of at least one vehicle.
    """
    centre = _central(poses)
    for _ in range(2):  # coordinates are straight lines only near their origin
        vectors = np.array([coordinates(one, centre) for one in poses])
        centre = pose_from_coordinates(_geometric_median(vectors), centre)
    return centre


def robust_distances(vectors: np.ndarray, covariances: np.ndarray) -> Values:
    """Return squared distances (n,) from the origin: the scatter by the median length of positions and of rotations.

    Args:
        vectors: (n, 6) coordinates relative to the common mounting.
        covariances: (n, 6, 6) of each.
    """
    total = covariances + np.diag(np.repeat(_spreads(vectors) ** 2 / _MEDIAN_CHI2_3, 3))
    return np.asarray(np.einsum("ni,ni->n", vectors, np.linalg.solve(total, vectors[..., None])[..., 0]))


def _central(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Return the one of the poses with the smallest sum of distances to the others, in radians plus metres."""
    rotations = np.array([one.rotation for one in poses])
    positions_m = np.array([one.inverse().translation_m for one in poses])
    flat = rotations.reshape(len(poses), 9)
    angles_rad = np.arccos(np.clip((flat @ flat.T - 1.0) / 2.0, -1.0, 1.0))
    distances_m = np.linalg.norm(positions_m[:, None] - positions_m[None], axis=2)
    return poses[int(np.argmin((angles_rad + distances_m).sum(axis=1)))]


def _spreads(vectors: np.ndarray) -> np.ndarray:
    lengths = np.array([np.median(np.linalg.norm(vectors[:, block], axis=1)) for block in _BLOCKS])
    return np.maximum(lengths, _LEAST_SPREAD)


def _geometric_median(vectors: np.ndarray) -> Values:
    """Return the point (6,) with the smallest sum of distances to vectors (n, 6), by Weiszfeld's iteration."""
    median = np.zeros(6)
    for _ in range(_STEPS):
        away = vectors - median
        scaled = away / np.repeat(_spreads(away), 3)
        weights = 1.0 / np.maximum(np.linalg.norm(scaled, axis=1), 1e-3)
        median = weights @ vectors / weights.sum()
    return np.asarray(median)


def _log_jacobian(vector_rad: np.ndarray) -> np.ndarray:
    """Return d log(Exp(d) Exp(v)) / d d (3, 3): the inverse of the left Jacobian of the rotations."""
    angle, cross = float(np.linalg.norm(vector_rad)), skew(vector_rad)
    if angle < _SMALL_RAD:
        return np.asarray(np.eye(3) - 0.5 * cross + cross @ cross / 12.0)
    half = angle / 2.0
    factor = (1.0 - half * np.cos(half) / np.sin(half)) / angle**2
    return np.asarray(np.eye(3) - 0.5 * cross + factor * cross @ cross)
