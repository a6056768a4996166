"""Correlated angle errors: smooth errors of the radar that neighbouring placements share and that do not average out.

An array's calibration error changes slowly with direction, so the residuals of neighbouring placements are similar, and a
covariance that assumes independence is too small. Azimuth and elevation errors b are modelled as Gaussian processes over
direction, so that the whitened residuals of all pairs together have the covariance

    V = tau^2 I + rho^2 B B^T,   B B^T = sum over azimuth and elevation of G K G^T,                       (3)

with G = W d pixel / d angle in sigmas and K(x, x') = exp(-|x - x'|^2 / 2 l^2). The restricted marginal likelihood
of the residuals gives the probability of each level and length. The least-squares estimate is unchanged; its covariance
becomes H^-1 (J^T V J) H^-1.
"""

import numpy as np

from calib_core.arrays import Points2, Values
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.prior_rows import prior_rows
from calib_core.radar import polar_from_cartesian

_LENGTHS_RAD = (np.deg2rad(8.0), np.deg2rad(14.0), np.deg2rad(25.0))
_INDEPENDENT = (1.0, 0.6, 0.35, 0.15, 0.06)  # tau^2
_SMOOTH = (0.3, 1.0, 2.5, 6.0, 15.0)  # rho^2
_MOST_CENTRES = 40
_LEAST_PAIRS = 7.0
_INDEPENDENT_LOG_ODDS = 4.5  # prior log-odds of purely independent errors against each single split
_CLEARLY_INDEPENDENT = 0.7  # probability of purely independent errors
_NEGLIGIBLE = 1e-10


def pose_spread(refined: ErrorsInVariablesFit, information: np.ndarray) -> np.ndarray | None:
    """Return the covariance (6 + k, 6 + k) of the least-squares pose and systematic errors under smooth angle errors.

    None if the residuals do not show them.

    Every split of the noise into independent and smooth parts is weighted by its probability: a few dozen pairs determine
    the size of the smooth part only roughly, so the covariance must not rely on a single estimate of it.

    Args:
        refined: the fit.
        information: (6 + k, 6 + k) H, priors included.
    """
    if refined.weights.sum() < _LEAST_PAIRS or refined.degrees_of_freedom <= 0:
        return None
    inliers = np.flatnonzero(refined.weights > 0.5)  # an outlier's down-weighted residual would look like a perfect one
    residual, jacobian = _weighted_rows(refined, inliers)
    prior = prior_rows(refined.measurements, refined.camera_from_radar)
    levels = [(independent, smooth) for independent in _INDEPENDENT for smooth in _SMOOTH]
    nothing = np.zeros((len(residual), 0))
    likelihoods = [_log_likelihoods(residual, jacobian, prior, nothing, [(1.0, 0.0)]) + _INDEPENDENT_LOG_ODDS]
    middles = [(jacobian.T @ jacobian)[None]]
    directions = _directions(refined, inliers)
    for length_rad in _LENGTHS_RAD:
        shape = _shape(refined, inliers, directions, length_rad)
        shared = shape.T @ jacobian
        likelihoods.append(_log_likelihoods(residual, jacobian, prior, shape, levels))
        parts = np.array(levels)[:, :, None, None]
        middles.append(parts[:, 0] * (jacobian.T @ jacobian) + parts[:, 1] * (shared.T @ shared))
    probability = np.exp(np.concatenate(likelihoods) - np.concatenate(likelihoods).max())
    probability /= probability.sum()
    if probability[0] > _CLEARLY_INDEPENDENT:
        return None
    middle = np.tensordot(probability, np.concatenate(middles), axes=1) + prior[1].T @ prior[1]
    inverse = np.linalg.inv(information)
    return np.asarray(inverse @ middle @ inverse)


def _weighted_rows(refined: ErrorsInVariablesFit, inliers: np.ndarray) -> tuple[Values, np.ndarray]:
    root = np.sqrt(refined.weights[inliers])[:, None]
    jacobian = refined.model.jacobian[inliers] * root[:, :, None]
    return (refined.model.residual[inliers] * root).reshape(-1), jacobian.reshape(2 * len(inliers), -1)


def _shape(refined: ErrorsInVariablesFit, inliers: np.ndarray, directions: Points2, length_rad: float) -> np.ndarray:
    """Return B (2 n, 2 k) of the inliers, with the kernel's square root taken on at most _MOST_CENTRES directions (Nystrom)."""
    chosen = np.linspace(0, len(inliers) - 1, min(len(inliers), _MOST_CENTRES)).round().astype(np.int64)
    centres = directions[chosen]
    values, vectors = np.linalg.eigh(_kernel(centres, centres, length_rad))
    kept = values > 1e-6 * values[-1]
    features = _kernel(directions, centres, length_rad) @ (vectors[:, kept] / np.sqrt(values[kept]))
    sigma = refined.measurements.sigma_polar[refined.rows[inliers]] * np.sqrt(refined.weights[inliers])[:, None]
    parts = []
    for angle in (1, 2):
        gain = refined.model.point_jacobian[inliers, :, angle] * sigma[:, None, angle]  # G, (n, 2)
        parts.append((gain[:, :, None] * features[:, None, :]).reshape(2 * len(directions), -1))
    return np.concatenate(parts, axis=1)


def _directions(refined: ErrorsInVariablesFit, inliers: np.ndarray) -> Points2:
    """Return azimuth and elevation (n, 2) of each inlier from its click: the measured angles contain the errors in question."""
    rays = refined.measurements.rays[inliers] @ refined.camera_from_radar.rotation
    directions = polar_from_cartesian(rays)[:, 1:]
    return np.where(np.isfinite(directions), directions, refined.polar[1:, inliers].T)


def _kernel(a: Points2, b: Points2, length_rad: float) -> np.ndarray:
    squared = ((a[:, None] - b[None]) ** 2).sum(axis=2)
    return np.asarray(np.exp(-0.5 * squared / length_rad**2))


def _log_likelihoods(
    residual: Values,
    jacobian: np.ndarray,
    prior: tuple[Values, np.ndarray],
    shape: np.ndarray,
    levels: list[tuple[float, float]],
) -> Values:
    """Return the restricted log-likelihood of the residuals for each (tau^2, rho^2).

    In the singular basis of B, V is diagonal: tau^2 + rho^2 s^2 along it, tau^2 everywhere else.
    """
    squared, vectors = np.linalg.eigh(shape.T @ shape)  # B's singular values, squared
    kept = squared > _NEGLIGIBLE * squared.max(initial=0.0)
    squared, to_basis = squared[kept], vectors[:, kept] / np.sqrt(squared[kept])
    along, along_pose = to_basis.T @ (shape.T @ residual), to_basis.T @ (shape.T @ jacobian)
    rest = residual @ residual - along @ along
    rest_pose = jacobian.T @ jacobian - along_pose.T @ along_pose
    rest_mixed = jacobian.T @ residual - along_pose.T @ along
    prior_information, prior_mixed = prior[1].T @ prior[1], prior[1].T @ prior[0]
    independent, smooth = np.array(levels).T
    precision = 1.0 / (independent[:, None] + smooth[:, None] * squared)  # (levels, k)
    information = rest_pose / independent[:, None, None] + prior_information
    information = information + (along_pose.T[None] * precision[:, None, :]) @ along_pose
    mixed = rest_mixed / independent[:, None] + (precision * along) @ along_pose + prior_mixed
    explained = (mixed * np.linalg.solve(information, mixed[:, :, None])[:, :, 0]).sum(axis=1)
    squares = rest / independent + precision @ along**2 - explained
    log_volume = (len(residual) - len(squared)) * np.log(independent) - np.log(precision).sum(axis=1)
    return np.asarray(-0.5 * (squares + log_volume + np.linalg.slogdet(information)[1]))
