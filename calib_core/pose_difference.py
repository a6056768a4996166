"""The difference between two poses of the same sensors, in degrees and centimetres with their standard deviations."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Values, frozen_array
from calib_core.geometry import RigidTransform, skew

_ZERO_LENGTH = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class PoseDifference:
    """How far one camera_from_radar is from another.

    Attributes:
        error: (6,) (dt, dtheta) [m, rad] that leads from the first to the second.
        rotation_deg: angle between the two rotations.
        rotation_sigma_deg: its standard deviation about its own axis; NaN if unknown.
        position_cm: distance between the two camera positions in the radar frame.
        position_sigma_cm: its standard deviation along its own direction; NaN if unknown.
        squared: squared Mahalanobis distance of the error; NaN if the covariance is unknown or singular.
    """

    error: Values
    rotation_deg: float
    rotation_sigma_deg: float
    position_cm: float
    position_sigma_cm: float
    squared: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "error", frozen_array(self.error, (6,)))


def pose_difference(first: RigidTransform, second: RigidTransform, covariance: Matrix66) -> PoseDifference:
    """Return how far the second camera_from_radar is from the first.

    Args:
        first: a camera_from_radar.
        second: another one of the same two sensors.
        covariance: (6, 6) of the error between them [m, rad]; NaN where unknown.
    """
    error = second.error_from(first)
    moved_m = second.inverse().translation_m - first.inverse().translation_m
    jacobian = camera_position_jacobian(first)
    return PoseDifference(
        error=error,
        rotation_deg=float(np.degrees(np.linalg.norm(error[3:]))),
        rotation_sigma_deg=float(np.degrees(_sigma_along(error[3:], covariance[3:, 3:]))),
        position_cm=float(np.linalg.norm(moved_m)) * 100.0,
        position_sigma_cm=_sigma_along(moved_m, jacobian @ covariance @ jacobian.T) * 100.0,
        squared=squared_distance(error, covariance),
    )


def camera_position_jacobian(camera_from_radar: RigidTransform) -> np.ndarray:
    """Return d c / d (dt, dtheta), (3, 6): how the camera centre c = -R^T t in the radar frame follows an error of the pose."""
    turned = -camera_from_radar.rotation.T
    return np.hstack([turned, turned @ skew(camera_from_radar.translation_m)])


def squared_distance(error: Values, covariance: Matrix66) -> float:
    """Return the squared Mahalanobis distance of an error (6,); NaN if its covariance is unknown or singular."""
    if not np.isfinite(covariance).all() or np.linalg.matrix_rank(covariance, hermitian=True) < 6:
        return float("nan")
    return float(error @ np.linalg.solve(covariance, error))


def _sigma_along(direction: np.ndarray, covariance: np.ndarray) -> float:
    length = float(np.linalg.norm(direction))
    variance = np.trace(covariance) / 3 if length < _ZERO_LENGTH else direction @ covariance @ direction / length**2
    return float(np.sqrt(variance)) if variance >= 0 else float("nan")
