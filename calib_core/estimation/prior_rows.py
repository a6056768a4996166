"""The priors of a fit as rows of the least-squares problem: the camera centre's, and those of the estimated errors."""

import numpy as np

from calib_core.arrays import Values
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.geometry import RigidTransform

__all__ = ["prior_rows"]


def prior_rows(measurements: PairMeasurements, camera_from_radar: RigidTransform) -> tuple[Values, np.ndarray]:
    """Return the whitened residuals (3 + k,) and Jacobian (3 + k, 6 + k) of the priors of camera centre and k errors."""
    errors = measurements.errors
    residual, jacobian = measurements.prior.rows(camera_from_radar)
    rows = np.zeros((3 + len(errors), 6 + len(errors)))
    rows[:3, :6] = jacobian
    if not len(errors):
        return residual, rows
    rows[3:, 6:] = np.diag(1.0 / errors.sigma)
    return np.concatenate([residual, -errors.values / errors.sigma]), rows
