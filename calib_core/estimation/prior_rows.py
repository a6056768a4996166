"""The priors of a fit as rows of the least-squares problem: those of the pose, and those of the estimated errors."""

import numpy as np

from calib_core.arrays import Values
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.geometry import RigidTransform


def prior_rows(measurements: PairMeasurements, camera_from_radar: RigidTransform) -> tuple[Values, np.ndarray]:
    """Return the whitened residuals (p + k,) and Jacobian (p + k, 6 + k) of the p rows of the pose's prior and k errors."""
    errors = measurements.errors
    residual, jacobian = measurements.prior.rows(camera_from_radar)
    count = len(residual)
    rows = np.zeros((count + len(errors), 6 + len(errors)))
    rows[:count, :6] = jacobian
    if not len(errors):
        return residual, rows
    rows[count:, 6:] = np.diag(1.0 / errors.sigma)
    return np.concatenate([residual, -errors.values / errors.sigma]), rows
