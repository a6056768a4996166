"""Unmeasured elevation: what a radar without elevation adds to the covariance of the pose.

Such a radar reports elevation 0 whatever the reflector's height. The true elevations are not noise about 0: the radar is
tilted up or down by a constant angle, and the reflector is above or below it by the same height at every placement. With
g_tilt = 1 and g_height = 1 / range the elevation errors of all pairs have the covariance

    V = V_own + sigma_tilt^2 g_tilt g_tilt^T + sigma_height^2 g_height g_height^T,                              (6)

whose shared parts do not average out, however many pairs there are. Such an error moves the least-squares pose by B = H^-1
J^T W d pixel / d elevation times the error; the covariance grows by the outer products.
"""

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.measurement_model import PairMeasurements

__all__ = ["TILT_SIGMA_RAD", "is_flat", "shared_elevation_spread"]

TILT_SIGMA_RAD = np.deg2rad(10.0)
"""Standard deviation of the radar's tilt up or down."""

HEIGHT_SIGMA_M = 1.0
"""Standard deviation of the reflector's height above or below the radar, the same at every placement."""


def is_flat(measurements: PairMeasurements) -> bool:
    """Return whether every radar position has elevation 0."""
    return bool(len(measurements)) and not measurements.polar[:, 2].any()


def shared_elevation_spread(refined: ErrorsInVariablesFit, information: Matrix66) -> Matrix66 | None:
    """Return what shared elevation errors add to the covariance (6, 6) of the pose; None for a radar that measures elevation.

    Args:
        refined: the fit.
        information: (6, 6) H, prior included.
    """
    if not is_flat(refined.measurements):
        return None
    range_m = refined.measurements.polar[refined.rows, 0]
    shared = np.stack([np.full_like(range_m, TILT_SIGMA_RAD), HEIGHT_SIGMA_M / range_m], axis=1)  # (n, 2)
    pulls = np.swapaxes(refined.model.pose_jacobian, 1, 2) @ refined.model.point_jacobian[:, :, 2, None]  # (n, 6, 1)
    moves = np.linalg.solve(information, (refined.weights[:, None] * pulls[:, :, 0]).T @ shared)
    return np.asarray(moves @ moves.T)
