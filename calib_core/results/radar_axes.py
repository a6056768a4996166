"""The uncertainty of a pose in the radar's axes: what a radar without elevation determines, and what it leaves open."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Vector3, freeze
from calib_core.geometry import RigidTransform, camera_position_jacobian
from calib_core.options import RadarOptions


@dataclass(frozen=True, slots=True, eq=False)
class RadarAxesSigma:
    """One standard deviation of the camera's place and orientation, in the radar's axes; NaN if unknown.

    A radar without elevation determines forward, left and the rotation about up; the others come from assumptions.

    Attributes:
        position_m: (3,) of the camera center: forward, left, up.
        rotation_rad: (3,) about forward (roll), left (pitch) and up (yaw).
    """

    position_m: Vector3
    rotation_rad: Vector3

    def __post_init__(self) -> None:
        freeze(self, position_m=(3,), rotation_rad=(3,))


def sigma_in_radar_axes(camera_from_radar: RigidTransform, covariance: Matrix66) -> RadarAxesSigma:
    """Turn the covariance (6, 6) of (dt, dtheta) into standard deviations in the radar's axes."""
    turned, centre = camera_from_radar.rotation.T, camera_position_jacobian(camera_from_radar)
    position_m2 = np.diag(centre @ covariance @ centre.T)
    rotation_rad2 = np.diag(turned @ covariance[3:, 3:] @ turned.T)
    return RadarAxesSigma(np.sqrt(np.maximum(position_m2, 0.0)), np.sqrt(np.maximum(rotation_rad2, 0.0)))


def mounting_moves(camera_from_radar: RigidTransform, height_m: float, radar: RadarOptions) -> np.ndarray:
    """Return by how much (6, 5) one sigma of a radar's unknown mounting moves the pose, if it measures no elevation.

    These are roll, pitch and height, and the lever between the places where bearings meet and where ranges start: the radar's
    up axis and the normal of the plane of the placements reach that plane tilt times height apart, forward and left. The
    radar is taken to be about as high as the camera.

    Args:
        camera_from_radar: the pose; the columns of its rotation are the radar's axes in the camera frame.
        height_m: z of the plane of the placements as reported.
        radar: with the priors of tilt and height.
    """
    rotation, tilt_rad = camera_from_radar.rotation, np.deg2rad(radar.tilt_sigma_deg)
    above_m = abs(float(camera_from_radar.inverse().translation_m[2]) - height_m)
    moves = np.zeros((6, 5))
    moves[3:, :2] = rotation[:, :2] * tilt_rad
    moves[:3, 2] = rotation[:, 2] * radar.height_sigma_m
    moves[:3, 3:] = rotation[:, :2] * (tilt_rad * above_m)
    return moves


def without_mounting(
    camera_from_radar: RigidTransform, covariance: Matrix66, height_m: float, radar: RadarOptions
) -> Matrix66:
    """Return the covariance (6, 6) that remains if the mounting of a radar without elevation is left out.

    It is that of the map from reported positions to the image: in the plane of the placements the pairs determine it.
    """
    moves = mounting_moves(camera_from_radar, height_m, radar)
    values, vectors = np.linalg.eigh(covariance - moves @ moves.T)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def bias_moves(camera_from_radar: RigidTransform, radar: RadarOptions) -> np.ndarray:
    """Return by how much (6, 2) one sigma of constant azimuth and elevation errors turns the radar's housing.

    Such an error is a rotation about up, or nearly one about left, so the pose of the reported axes contains it.
    """
    moves = np.zeros((6, 2))
    biases_deg = np.array([radar.azimuth_bias_sigma_deg, radar.elevation_bias_sigma_deg])
    moves[3:] = camera_from_radar.rotation[:, [2, 1]] * np.deg2rad(biases_deg)
    return moves
