"""Marginal likelihood: how likely the clicks are under a reading of the measurements, whatever the pose.

Other readings of the same pairs, such as returns of the placements before or a mirrored radar axis, are compared by the
probability of the clicks with the pose integrated out, by Laplace's method about the fit to each:

    log L = log p(pixels | pose, noise) + log p(pose, noise, errors) + (6 / 2) log(2 pi) - log det(H) / 2,        (8)

with the mixture of inliers and outliers of `pose_posterior`, and relative to the pairs being outliers all. A reading whose prior
odds are o is the likelier one if its log L exceeds the other's by -log o.
"""

import numpy as np

from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import normal_equations
from calib_core.estimation.measurement_model import CameraPrior, PairMeasurements
from calib_core.estimation.pose_posterior import pose_posterior
from calib_core.geometry import Poses

_ALL_ROTATIONS_RAD3 = 8.0 * np.pi**2  # their volume in rotation vectors [rad^3], by Haar's measure


def log_marginal_likelihood(measurements: PairMeasurements, fit: ErrorsInVariablesFit) -> float:
    """Return equation (8) of a reading.

    Args:
        measurements: all pairs as they are read, with the assumed noise.
        fit: to these.
    """
    errors = fit.measurements.errors
    posterior = pose_posterior(measurements.with_errors(errors.values), fit.camera_from_radar)
    (cost,) = posterior.pose_costs(Poses.of([fit.camera_from_radar]), np.log(fit.noise_scale)[None])
    hessian, _ = normal_equations(fit.measurements, fit.camera_from_radar, fit.model, fit.weights)
    volume = log_determinant(hessian) - log_determinant(errors.prior_information)
    return float(log_pose_prior(measurements.prior) - 0.5 * (cost + errors.squared + volume))


def log_determinant(information: np.ndarray) -> np.ndarray:
    """Return log det (...) of each information (..., k, k); infinite where it is singular to rounding, as nothing peaks there."""
    with np.errstate(divide="ignore"):
        sign, logarithm = np.linalg.slogdet(information)
    return np.where(sign > 0.0, logarithm, np.inf)


def log_pose_prior(prior: CameraPrior) -> float:
    """Return the logarithm of the density of a pose at the camera prior's position, times the (2 pi)^3 of Laplace's method.

    All rotations are equally likely; the density of a weak prior is 1 / (pi^2 sigma^3).
    """
    return float(-np.log(_ALL_ROTATIONS_RAD3) - np.log(np.pi**2 * prior.sigma_m**3) + 3.0 * np.log(2.0 * np.pi))
