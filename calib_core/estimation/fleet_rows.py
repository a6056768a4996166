"""The fleet's prior of the pose as rows of the least-squares problem, at one pose or at many."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Values, frozen_array
from calib_core.fleet_prior import FleetPrior
from calib_core.geometry import RigidTransform, rotation_log

_NEAR_HALF_TURN = 1e-3  # below this sine the skew part of a rotation says too little of a large angle


@dataclass(frozen=True, slots=True, eq=False)
class FleetRows:
    """A normal prior of the pose error (dt, dtheta) from the fleet's mean pose.

    Attributes:
        mean: the mean camera_from_radar of the fleet.
        whitening: (6, 6) lower triangular W with W^T W the inverse of the prior's covariance.
    """

    mean: RigidTransform
    whitening: Matrix66

    def __post_init__(self) -> None:
        object.__setattr__(self, "whitening", frozen_array(self.whitening, (6, 6)))

    @classmethod
    def of(cls, prior: FleetPrior) -> "FleetRows":
        """Prepare a fleet's prior; its covariance must be positive definite."""
        sigma = np.sqrt(np.diagonal(prior.covariance))
        correlation = prior.covariance / sigma[:, None] / sigma
        return cls(prior.camera_from_radar, np.linalg.inv(np.linalg.cholesky(correlation)) / sigma)

    def rows(self, rotations: np.ndarray, translations_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the whitened residuals (..., 6) and Jacobians (..., 6, 6) for (dt, dtheta) at poses (..., 3, 3), (..., 3).

        As in all rows here, the residual is expected minus present, so that its derivative is minus the Jacobian.
        """
        vectors = _rotation_logs(rotations @ self.mean.rotation.T)
        errors = np.concatenate([translations_m - self.mean.translation_m, vectors], axis=-1)
        jacobian = np.zeros((*errors.shape, 6))
        jacobian[..., :3, :3] = np.eye(3)
        jacobian[..., 3:, 3:] = _inverse_left_jacobians(vectors)
        return -errors @ self.whitening.T, np.asarray(self.whitening @ jacobian)

    def information(self, rotations: np.ndarray, translations_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return J^T J (..., 6, 6) and J^T residual (..., 6) of `rows`."""
        residual, jacobian = self.rows(rotations, translations_m)
        turned = np.swapaxes(jacobian, -1, -2)
        return turned @ jacobian, (turned @ residual[..., None])[..., 0]

    def costs(self, rotations: np.ndarray, translations_m: np.ndarray) -> Values:
        """Return the squared distance (...,) of each pose from the mean, in standard deviations of the prior."""
        vectors = _rotation_logs(rotations @ self.mean.rotation.T)
        errors = np.concatenate([translations_m - self.mean.translation_m, vectors], axis=-1)
        return np.asarray(((errors @ self.whitening.T) ** 2).sum(axis=-1))


def _rotation_logs(rotations: np.ndarray) -> np.ndarray:
    """Return the rotation vectors (..., 3) of rotations (..., 3, 3)."""
    flat = rotations.reshape(-1, 3, 3)
    axes = 0.5 * (flat - np.swapaxes(flat, 1, 2))[:, (2, 0, 1), (1, 2, 0)]
    sines = np.linalg.norm(axes, axis=1)
    cosines = 0.5 * (np.trace(flat, axis1=1, axis2=2) - 1.0)
    small = sines < 1e-9
    vectors = axes * np.where(small, 1.0, np.arctan2(sines, cosines) / np.where(small, 1.0, sines))[:, None]
    for i in np.flatnonzero((sines < _NEAR_HALF_TURN) & (cosines < 0.0)):
        vectors[i] = rotation_log(flat[i])
    return np.asarray(vectors.reshape(rotations.shape[:-1]))


def _inverse_left_jacobians(vectors: np.ndarray) -> np.ndarray:
    """Return d log(Exp(dtheta) Exp(v)) / d dtheta (..., 3, 3) at rotation vectors (..., 3)."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    cross = np.zeros((*vectors.shape, 3))
    cross[..., 0, 1], cross[..., 0, 2], cross[..., 1, 2] = -z, y, -x
    cross[..., 1, 0], cross[..., 2, 0], cross[..., 2, 1] = z, -y, x
    angles = np.linalg.norm(vectors, axis=-1)[..., None, None]
    small = angles < 1e-4
    safe = np.where(small, 1.0, angles)
    second = np.where(small, 1.0 / 12.0, (1.0 - 0.5 * safe / np.tan(0.5 * safe)) / safe**2)
    return np.asarray(np.eye(3) - 0.5 * cross + second * cross @ cross)
