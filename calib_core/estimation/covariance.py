"""Pose covariance: the inverse of the observed information, widened by errors that the pairs share."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.estimation.correlated_angle_errors import pose_spread
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import normal_equations
from calib_core.estimation.unmeasured_elevation import shared_elevation_spread

__all__ = ["PoseCovariance", "pose_covariance"]

_LEAST_SHARE = 0.25  # of the plain information that must remain after the correction for uncertain weights
_CHI2_95_6 = 12.591587243743977


@dataclass(frozen=True, slots=True, eq=False)
class PoseCovariance:
    """The error distribution of the pose.

    Attributes:
        covariance: (6, 6) of (dt, dtheta) [m, rad].
        information: (6, 6) Gauss-Newton Hessian of the fit, for Newton steps from it.
        quantile: the factor on the covariance that gives the 95 % ellipsoid.
        condition: condition number of the information of the pairs alone, after scaling each unknown.
        growth: factor by which smooth angle errors of the radar widen the rotation's standard deviation; 1 without them.
    """

    covariance: Matrix66
    information: Matrix66
    quantile: float
    condition: float
    growth: float


def pose_covariance(refined: ErrorsInVariablesFit) -> PoseCovariance:
    """Invert the observed information of the mixture at the optimum, and widen it by errors that the pairs share.

    Pairs that may be outliers (0 < w < 1) contribute less than w of their Gauss-Newton information: by Louis' identity

        I = sum w J^T J - sum w (1 - w) g g^T,   g = J^T e   (whitened).
    """
    plain, _ = normal_equations(refined.measurements, refined.camera_from_radar, refined.model, refined.weights)
    gradients = (np.swapaxes(refined.model.pose_jacobian, 1, 2) @ refined.model.residual[:, :, None])[:, :, 0]
    weight_variance = refined.weights * (1.0 - refined.weights)
    lost = (gradients * weight_variance[:, None]).T @ gradients
    information = _floored(plain, lost)
    prior_jacobian = refined.measurements.prior.rows(refined.camera_from_radar)[1]
    pairs_only = plain - prior_jacobian.T @ prior_jacobian
    independent = _symmetric_inverse(information)
    spread = pose_spread(refined, plain)
    covariance = independent if spread is None else _widened(independent, plain, spread)
    growth = float(np.sqrt(np.trace(covariance[3:, 3:]) / np.trace(independent[3:, 3:])))
    shared = shared_elevation_spread(refined, plain)
    covariance = covariance if shared is None else covariance + shared
    from_pairs = 1.0 - float(np.trace(prior_jacobian @ covariance @ prior_jacobian.T)) / 6.0
    return PoseCovariance(
        covariance=covariance,
        information=plain,
        quantile=_quantile(refined.degrees_of_freedom, max(from_pairs, 0.0)),
        condition=_scaled_condition(pairs_only),
        growth=growth,
    )


def _floored(plain: Matrix66, lost: Matrix66) -> Matrix66:
    """Subtract the lost information, but keep at least a share of the plain information in every direction."""
    root = np.linalg.cholesky(plain + 1e-12 * np.diag(np.diag(plain)))
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(np.eye(6) - inverse @ lost @ inverse.T)
    kept = (vectors * np.maximum(values, _LEAST_SHARE)) @ vectors.T
    return np.asarray(root @ kept @ root.T)


def _widened(covariance: Matrix66, plain: Matrix66, spread: Matrix66) -> Matrix66:
    """Add to a covariance what smooth angle errors add to the plain one, in every direction at least zero."""
    root = np.linalg.cholesky(plain)
    values, vectors = np.linalg.eigh(root.T @ spread @ root - np.eye(6))
    back = np.linalg.inv(root).T @ vectors
    widened = covariance + (back * np.maximum(values, 0.0)) @ back.T
    return np.asarray((widened + widened.T) / 2.0)


def _symmetric_inverse(matrix: Matrix66) -> Matrix66:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    inverse = np.linalg.inv(matrix * np.outer(scale, scale)) * np.outer(scale, scale)
    return np.asarray((inverse + inverse.T) / 2.0)


def _scaled_condition(information: Matrix66) -> float:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    values = np.linalg.eigvalsh(information * np.outer(scale, scale))
    return float(values[-1] / max(values[0], 1e-16))


def _quantile(degrees_of_freedom: float, from_pairs: float) -> float:
    """Return the 95 % quantile for 6 parameters: chi-square with the noise known, 6 F(6, nu) with it estimated.

    The contribution of a measured camera position does not depend on the estimated noise; the two are mixed by their shares.

    Args:
        degrees_of_freedom: nu of the noise level; 0 if it was not estimated.
        from_pairs: the share of the parameters that the pairs determine, 0 to 1.
    """
    if degrees_of_freedom <= 0:
        return _CHI2_95_6
    from scipy.special import fdtri

    return float(_CHI2_95_6 + from_pairs * (6.0 * fdtri(6.0, degrees_of_freedom, 0.95) - _CHI2_95_6))
