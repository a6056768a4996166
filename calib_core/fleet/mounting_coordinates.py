"""Coordinates of a mounting: camera centre and rotation in the radar's axes, relative to a common mounting.

A mounting scatters in where the camera is, as seen from the radar, and in how it is turned; the translation t = -R c of
camera_from_radar mixes the two. With the common mounting R_0, c_0 the six coordinates are

    (c - c_0,  R_0^T log(R R_0^T))    forward, left, up [m]; about forward, left, up [rad].

They do not depend on the camera's axes, and turn with the radar's.
"""

import numpy as np

from calib_core.arrays import Matrix66, Values
from calib_core.geometry import RigidTransform, camera_position_jacobian, rotation_exp, rotation_log, skew

_SMALL_RAD = 1e-4


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


def _log_jacobian(vector_rad: np.ndarray) -> np.ndarray:
    """Return d log(Exp(d) Exp(v)) / d d (3, 3): the inverse of the left Jacobian of the rotations."""
    angle, cross = float(np.linalg.norm(vector_rad)), skew(vector_rad)
    if angle < _SMALL_RAD:
        return np.asarray(np.eye(3) - 0.5 * cross + cross @ cross / 12.0)
    half = angle / 2.0
    factor = (1.0 - half * np.cos(half) / np.sin(half)) / angle**2
    return np.asarray(np.eye(3) - 0.5 * cross + factor * cross @ cross)
