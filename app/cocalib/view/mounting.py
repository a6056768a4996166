"""How the camera is mounted, as one would measure it: position and tilt relative to the radar."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix33, Vector3, frozen_array
from calib_core.geometry import skew
from calib_core.results import Calibration

OPTICAL_FROM_BODY: Matrix33 = frozen_array([[0, -1, 0], [0, 0, -1], [1, 0, 0]], (3, 3))
"""A camera that looks forward: its optical axes (x right, y down, z forward) from x forward, y left, z up."""


@dataclass(frozen=True, slots=True, eq=False)
class Mounting:
    """The position and orientation of the camera relative to the radar.

    Attributes:
        position_m: (3,) camera centre in the radar frame.
        position_sigma_m: (3,) its standard deviations; NaN if unknown.
        roll_pitch_yaw_rad: (3,) rotations about the radar's x, y, z axes, Rz(yaw) Ry(pitch) Rx(roll), relative to looking
            straight forward. Positive roll tips the camera to its right, positive pitch looks down, positive yaw looks left.
        roll_pitch_yaw_sigma_rad: (3,) their standard deviations; NaN if unknown.
    """

    position_m: Vector3
    position_sigma_m: Vector3
    roll_pitch_yaw_rad: Vector3
    roll_pitch_yaw_sigma_rad: Vector3


def mounting_of(calibration: Calibration) -> Mounting:
    """Turn camera_from_radar and its covariance into a mounting.

    With t = t_hat + dt and R = Exp(dtheta) R_hat the centre c = -R^T t moves by -R^T dt - R^T [t]x dtheta,
    and the mounted body turns about its own axes by -(optical_from_body)^T dtheta, to first order.
    """
    rotation = calibration.camera_from_radar.rotation
    translation_m = calibration.camera_from_radar.translation_m
    radar_from_body = rotation.T @ OPTICAL_FROM_BODY
    roll, pitch, yaw = _roll_pitch_yaw(radar_from_body)
    position_jacobian = np.hstack([-rotation.T, -rotation.T @ skew(translation_m)])
    angle_jacobian = np.hstack([np.zeros((3, 3)), -_angle_rates(roll, pitch) @ OPTICAL_FROM_BODY.T])
    return Mounting(
        position_m=-rotation.T @ translation_m,
        position_sigma_m=_sigmas(position_jacobian, calibration.covariance),
        roll_pitch_yaw_rad=np.array([roll, pitch, yaw]),
        roll_pitch_yaw_sigma_rad=_sigmas(angle_jacobian, calibration.covariance),
    )


def _roll_pitch_yaw(radar_from_body: Matrix33) -> tuple[float, float, float]:
    m = radar_from_body
    pitch = np.arctan2(-m[2, 0], np.hypot(m[0, 0], m[1, 0]))
    return float(np.arctan2(m[2, 1], m[2, 2])), float(pitch), float(np.arctan2(m[1, 0], m[0, 0]))


def _angle_rates(roll: float, pitch: float) -> Matrix33:
    """Return d(roll, pitch, yaw) / d(rotation about the body's own axes); it grows without bound as pitch nears 90 degrees."""
    s, c = np.sin(roll), np.cos(roll)
    cos_pitch = max(float(np.cos(pitch)), 1e-9)
    tan_pitch = np.sin(pitch) / cos_pitch
    return np.array([[1.0, s * tan_pitch, c * tan_pitch], [0.0, c, -s], [0.0, s / cos_pitch, c / cos_pitch]])


def _sigmas(jacobian: np.ndarray, covariance: np.ndarray) -> Vector3:
    return np.sqrt(np.maximum(np.diag(jacobian @ covariance @ jacobian.T), 0.0))
