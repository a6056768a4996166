"""Pose covariance: the inverse of the observed information, widened by errors that the pairs share.

Correlated angle errors: smooth errors of the radar that neighbouring placements share and that do not average out.

An array's calibration error changes slowly with direction, so the residuals of neighbouring placements are similar, and a
covariance that assumes independence is too small. Azimuth and elevation errors b are modelled as Gaussian processes over
direction, so that the whitened residuals of all pairs together have the covariance

    V = tau^2 I + rho^2 B B^T,   B B^T = sum over azimuth and elevation of G K G^T,                       (3)

with G = W d pixel / d angle in sigmas and K(x, x') = exp(-|x - x'|^2 / 2 l^2). How much of the stated variance is smooth no
residual can tell, since the pose absorbs it, so rho^2 is a prior; the restricted marginal likelihood of the residuals gives the
probability of each tau and length. The least-squares estimate is unchanged; its covariance
becomes H^-1 (J^T V J) H^-1.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Matrix66, Points2, Values
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import RIDGE, TINY, normal_equations
from calib_core.estimation.measurement_model import prior_rows
from calib_core.estimation.pose_posterior import LARGEST_EXPONENT
from calib_core.options import RadarOptions
from calib_core.radar import polar_from_cartesian
from calib_core.results.calibration import CHI2_95_6, CovarianceParts
from calib_core.results.radar_axes import mounting_moves
from calib_core.results.systematic_errors import LensPrior, SystematicErrorResult, SystematicErrors, shared_out

_LEAST_SHARE = 0.25  # of the plain information that must remain after the correction for uncertain weights


@dataclass(frozen=True, slots=True, eq=False)
class PoseCovariance:
    """The error distribution of the pose.

    Attributes:
        covariance: (6, 6) of (dt, dtheta) [m, rad].
        information: (6 + k, 6 + k) Gauss-Newton Hessian of the fit, the k estimated systematic errors included.
        quantile: the factor on the covariance that gives the 95 % ellipsoid.
        condition: condition number of the information of the pairs alone, after scaling each unknown.
        growth: factor by which smooth angle errors of the radar widen the rotation's standard deviation; 1 without them.
        shows_smooth: whether the residuals themselves speak for smooth angle errors, not only what is known of radars.
        parts: what of the covariance rests on stated standard deviations.
        systematic_errors: what each of them contributes.
        lens: (r, r) covariance of refined intrinsics along the axes of their prior; None if they were not refined.
    """

    covariance: Matrix66
    information: np.ndarray
    quantile: float
    condition: float
    growth: float
    shows_smooth: bool
    parts: CovarianceParts
    systematic_errors: tuple[SystematicErrorResult, ...] = ()
    lens: np.ndarray | None = None

    @property
    def pose_information(self) -> Matrix66:
        """The information about the pose alone (6, 6): the systematic errors are eliminated."""
        return np.asarray(np.linalg.inv(symmetric_inverse(self.information)[:6, :6]))


def pose_covariance(
    refined: ErrorsInVariablesFit,
    radar: RadarOptions | None = None,
    *,
    smooth: bool = True,
    doubt: Values | None = None,
) -> PoseCovariance:
    """Invert the observed information of the mixture at the optimum, and widen it by errors that the pairs share.

    Pairs that may be outliers (0 < w < 1) contribute less than w of their Gauss-Newton information: by Louis' identity

        I = sum w J^T J - sum w (1 - w) g g^T,   g = J^T e   (whitened).

    Args:
        refined: the fit.
        radar: priors of the mounting of a radar that measures no elevation; None takes the defaults.
        smooth: look for smooth angle errors of the radar.
        doubt: (6,) that not knowing whether a measured camera position is right adds to the pose's error.
    """
    plain, _ = normal_equations(refined.measurements, refined.camera_from_radar, refined.model, refined.weights)
    gradients = (np.swapaxes(refined.model.jacobian, 1, 2) @ refined.model.residual[:, :, None])[:, :, 0]
    weight_variance = refined.weights * (1.0 - refined.weights)
    lost = (gradients * weight_variance[:, None]).T @ gradients
    priors = prior_rows(refined.measurements, refined.camera_from_radar)[1]
    information = _floored(plain, lost)
    prior_information = priors.T @ priors
    independent = symmetric_inverse(information)
    spread, shows_smooth = (smooth_spread(refined, plain) if smooth else None) or (None, False)
    covariance = independent if spread is None else _widened(independent, plain, spread)
    growth = float(np.sqrt(np.trace(covariance[3:6, 3:6]) / np.trace(independent[3:6, 3:6])))
    shared = _shared_errors(refined, plain, covariance)
    pose, assumed = covariance[:6, :6] + shared.pose, shared.pose
    if doubt is not None:
        pose = pose + np.outer(doubt, doubt)
    if refined.measurements.flat:
        moves = mounting_moves(refined.camera_from_radar, refined.placements_z_m, radar or RadarOptions())
        pose = pose + moves @ moves.T
        assumed = assumed + moves @ moves.T
    noise = (independent @ (information - prior_information) @ independent)[:6, :6]
    from_pairs = float(np.trace(np.linalg.solve(pose, noise))) / 6.0
    return PoseCovariance(
        covariance=pose,
        information=plain,
        quantile=_quantile(refined.degrees_of_freedom, min(max(from_pairs, 0.0), 1.0)),
        condition=_scaled_condition(plain - prior_information),
        growth=growth,
        shows_smooth=shows_smooth,
        parts=_parts(refined, plain, assumed),
        systematic_errors=_shares(shared.found, pose),
        lens=shared.lens,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Shared:
    """What the widening errors add to the pose's covariance (6, 6), every error, and the covariance of a refined lens.

    The errors hold the variance [m^2, rad^2] that each gives the pose, until `_shares` divides it by that of the pose.
    """

    pose: Matrix66
    found: list[SystematicErrorResult]
    lens: np.ndarray | None = None


def _shared_errors(refined: ErrorsInVariablesFit, plain: np.ndarray, covariance: np.ndarray) -> _Shared:
    """Return what the errors that all pairs share do to the pose.

    An estimated error's part of the variance is what knowing it exactly would save: with C the covariance, C_pe C_ee^-1 C_ep.
    """
    errors = refined.measurements.errors
    variances = np.diag(covariance)[6:]
    results = [
        SystematicErrorResult(
            error.name,
            float(errors.values[k]),
            float(variances[k] ** 0.5),
            error.sigma,
            True,
            *_sums(covariance[:6, 6 + k] ** 2 / variances[k]),
        )
        for k, error in enumerate(errors.estimated)
        if not error.of_lens
    ]
    if not errors.widening:
        return _with_refined_lens(_Shared(np.zeros((6, 6)), results), errors, covariance, np.zeros((len(plain), 0)))
    whitened = widening_rows(refined)
    jacobian, weights = refined.model.jacobian, refined.weights[:, None, None]
    mixed = (np.swapaxes(jacobian, 1, 2) @ (weights * whitened)).sum(axis=0)
    sigma = np.array([one.sigma for one in errors.widening])
    solved = np.linalg.solve(plain, mixed)
    moves = -solved[:6] * sigma
    values, sigmas = _suggested(refined, whitened, mixed, solved)
    results += [
        SystematicErrorResult(error.name, values[k], sigmas[k], error.sigma, False, *_sums(moves[:, k] ** 2))
        for k, error in enumerate(errors.widening)
        if not error.of_lens
    ]
    lens = np.array([error.of_lens for error in errors.widening])
    if lens.any():
        known = _suggested_lens(refined, whitened[:, :, lens], mixed[:, lens], solved[:, lens])
        results += _of_lens(errors.lens, *known, moves[:, lens], np.eye(int(lens.sum())), estimated=False)
    return _with_refined_lens(_Shared(np.asarray(moves @ moves.T), results), errors, covariance, solved * sigma)


def widening_rows(refined: ErrorsInVariablesFit) -> np.ndarray:
    """Return W d pixel / d error (n, 2, e) of the errors that only widen the covariance."""
    planes, errors = refined.measurements.measured(refined.rows), refined.measurements.errors.widening
    columns = planes.columns(refined.measurements.camera, refined.camera_from_radar, errors, refined.polar)
    columns = np.where(np.isfinite(columns), columns, 0.0)  # of a position that the camera does not see
    return np.asarray(refined.model.whitening @ columns.transpose(2, 1, 0))


def _parts(refined: ErrorsInVariablesFit, plain: np.ndarray, assumed: Matrix66) -> CovarianceParts:
    """Return what of the covariance rests on stated standard deviations.

    The estimate of pose and errors x is off by H^-1 J^T r, with r the whitened errors of pairs and priors and H = J^T J. So a
    prior with rows J_p gives it the covariance H^-1 J_p^T J_p H^-1, and all of them together with the pairs give H^-1.

    Args:
        refined: the fit.
        plain: H, (6 + k, 6 + k).
        assumed: (6, 6) of the errors that are not estimated.
    """
    to_pose = symmetric_inverse(plain)[:6]
    of_errors = to_pose[:, 6:] / refined.measurements.errors.sigma
    prior = refined.measurements.prior
    of_position = to_pose[:, :6] @ prior.rows(refined.camera_from_radar)[1].T * float(prior.measured)
    return CovarianceParts(of_errors @ of_errors.T + assumed, of_position @ of_position.T)


def _with_refined_lens(
    shared: _Shared, errors: SystematicErrors, covariance: np.ndarray, widening: np.ndarray
) -> _Shared:
    """Add what is known of refined intrinsics; `widening` (6 + k, e) is how much the widening errors move all unknowns."""
    places = errors.refined
    if places.start == places.stop:
        return shared
    rows = slice(6 + places.start, 6 + places.stop)
    own = covariance[rows, rows]
    lens = own + widening[rows] @ widening[rows].T
    results = _of_lens(errors.lens, errors.values[places], lens, covariance[:6, rows], own, estimated=True)
    return _Shared(shared.pose, shared.found + results, lens)


def _of_lens(
    prior: LensPrior | None,
    values: Values,
    covariance: np.ndarray,
    mixed: np.ndarray,
    own: np.ndarray,
    *,
    estimated: bool,
) -> list[SystematicErrorResult]:
    """Say by name what is known of the lens along the r axes of its prior.

    Args:
        prior: of the lens.
        values: (r,).
        covariance: (r, r) of the values.
        mixed: (6, r) covariance of pose and lens.
        own: (r, r) the covariance of the lens that belongs to it.
        estimated: whether it was estimated with the pose.
    """
    if prior is None:
        return []
    axes, priors = prior.axes, prior.sigma
    amounts = axes @ values
    sigmas = np.sqrt(((axes @ covariance) * axes).sum(axis=1))
    variances = shared_out(mixed @ axes.T, axes @ own @ axes.T)
    return [
        SystematicErrorResult(
            name, float(amounts[k]), float(sigmas[k]), float(priors[k]), estimated, *_sums(variances[:, k])
        )
        for k, name in enumerate(prior.names)
        if priors[k] > 0.0
    ]


def _suggested(
    refined: ErrorsInVariablesFit, whitened: np.ndarray, mixed: np.ndarray, solved: np.ndarray
) -> tuple[list[float], list[float]]:
    """Estimate each widening error alone, by one step from the optimum: values and standard deviations, priors included."""
    values, sigmas = [], []
    weighted = whitened * refined.weights[:, None, None]
    squares = (weighted * whitened).sum(axis=(0, 1))
    pulls = (weighted * refined.model.residual[:, :, None]).sum(axis=(0, 1))
    taken = (mixed * solved).sum(axis=0)
    for k, error in enumerate(refined.measurements.errors.widening):
        information = max(float(squares[k] - taken[k]), 0.0) + error.sigma**-2.0
        values.append(float(pulls[k]) / information)
        sigmas.append(information**-0.5)
    return values, sigmas


def _suggested_lens(
    refined: ErrorsInVariablesFit, whitened: np.ndarray, mixed: np.ndarray, solved: np.ndarray
) -> tuple[Values, np.ndarray]:
    """Estimate the lens along all r axes of its prior together, likewise: values (r,) and their covariance (r, r)."""
    weighted = (whitened * refined.weights[:, None, None]).reshape(-1, whitened.shape[2])
    information = weighted.T @ whitened.reshape(weighted.shape) - mixed.T @ solved + np.eye(whitened.shape[2])
    known = np.linalg.inv(information)
    return known @ (weighted.T @ refined.model.residual.reshape(-1)), known


def _sums(variance: Values) -> tuple[float, float]:
    return float(variance[:3].sum()), float(variance[3:].sum())


def _shares(results: Sequence[SystematicErrorResult], pose: Matrix66) -> tuple[SystematicErrorResult, ...]:
    position, rotation = float(np.trace(pose[:3, :3])), float(np.trace(pose[3:, 3:]))
    return tuple(
        replace(
            result, position_share=result.position_share / position, rotation_share=result.rotation_share / rotation
        )
        for result in results
    )


def _floored(plain: np.ndarray, lost: np.ndarray) -> np.ndarray:
    """Subtract the lost information, but keep at least a share of the plain information in every direction."""
    root = np.linalg.cholesky(plain + RIDGE * np.diag(np.diag(plain)))
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(np.eye(len(plain)) - inverse @ lost @ inverse.T)
    kept = (vectors * np.maximum(values, _LEAST_SHARE)) @ vectors.T
    return np.asarray(root @ kept @ root.T)


def _widened(covariance: np.ndarray, plain: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Add to a covariance what smooth angle errors add to the plain one, in every direction at least zero."""
    root = np.linalg.cholesky(plain)
    values, vectors = np.linalg.eigh(root.T @ spread @ root - np.eye(len(plain)))
    back = np.linalg.inv(root).T @ vectors
    widened = covariance + (back * np.maximum(values, 0.0)) @ back.T
    return np.asarray((widened + widened.T) / 2.0)


def symmetric_inverse(matrix: np.ndarray) -> np.ndarray:
    """Return the inverse of a positive definite matrix whose unknowns have different units, symmetric to the last bit."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), TINY))
    inverse = np.linalg.inv(matrix * np.outer(scale, scale)) * np.outer(scale, scale)
    return np.asarray((inverse + inverse.T) / 2.0)


def _scaled_condition(information: np.ndarray) -> float:
    pose = information[:6, :6]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(pose), TINY))
    values = np.linalg.eigvalsh(pose * np.outer(scale, scale))
    # of a matrix with a unit diagonal: an eigenvalue below the rounding of float64
    return float(values[-1] / max(values[0], 1e-16))


def _quantile(degrees_of_freedom: float, from_pairs: float) -> float:
    """Return the 95 % quantile for 6 parameters: chi-square with the noise known, 6 F(6, nu) with it estimated.

    The contribution of the priors does not depend on the estimated noise; the two are mixed by their shares.

    Args:
        degrees_of_freedom: nu of the noise level; 0 if it was not estimated.
        from_pairs: the share of the pose's variance that is the pairs' noise, 0 to 1.
    """
    if degrees_of_freedom <= 0:
        return CHI2_95_6
    from scipy.special import fdtri

    # the share inside, as of CHI2_95_6
    return float(CHI2_95_6 + from_pairs * (6.0 * fdtri(6.0, degrees_of_freedom, 0.95) - CHI2_95_6))


# degrees, a quarter of a decade apart: a choice; a shorter one is nearly independent noise, a longer one nearly a turn
_LENGTHS_RAD = (np.deg2rad(10.0), np.deg2rad(18.0), np.deg2rad(32.0))
_SMOOTH_SHARE = 0.8  # of an angle's variance: a radar's stated accuracy is mostly that of its array's calibration
_INDEPENDENT = (1.0, 0.6, 0.35, 0.15)  # variance of the rest beside it, over the estimated one
_SMOOTH_PROBABILITY = 0.8  # before any residual, spread evenly over lengths and variances of the rest
_SHOWN = 0.95  # probability of smooth errors from which the residuals show them
_MOST_CENTERS = 40  # number of directions, a choice: the time of the decomposition is its cube
_LEAST_PAIRS = 7.0  # a choice: 14 residuals, of which the pose leaves 8
_NEGLIGIBLE = 1e-10  # share of the largest eigenvalue, above its rounding in float64: smaller ones are noise


def smooth_spread(refined: ErrorsInVariablesFit, information: np.ndarray) -> tuple[np.ndarray, bool] | None:
    """Return the covariance (6 + k, 6 + k) of the least-squares pose and systematic errors under smooth angle errors, and
    whether the residuals show them.

    None if there are too few pairs. Every split of the noise into independent and smooth parts is weighted by its probability:
    what the pose absorbs of a smooth error no residual shows, so quiet residuals must not rule it out.

    Args:
        refined: the fit.
        information: (6 + k, 6 + k) H, priors included.
    """
    if refined.weights.sum() < _LEAST_PAIRS or refined.degrees_of_freedom <= 0:
        return None
    inliers = np.flatnonzero(refined.weights > 0.5)  # an outlier's down-weighted residual would look like a perfect one
    residual, jacobian = weighted_rows(refined, inliers)
    prior = prior_rows(refined.measurements, refined.camera_from_radar)
    levels = [(independent, _SMOOTH_SHARE) for independent in _INDEPENDENT]
    own = jacobian.T @ jacobian
    likelihoods, middles = [], [own]
    for length_rad in _LENGTHS_RAD:
        shape = smooth_rows(refined, inliers, length_rad)
        shared = shape.T @ jacobian
        likelihoods.append(_log_likelihoods(residual, jacobian, prior, shape, levels))
        middles += [part * own + share * (shared.T @ shared) for part, share in levels]
    alone = [(independent, 0.0) for independent in _INDEPENDENT]
    likelihoods.append(_log_likelihoods(residual, jacobian, prior, np.zeros((len(residual), 0)), alone))
    *smooth, quiet = np.exp(np.minimum(np.array(likelihoods) - likelihoods[-1][0], LARGEST_EXPONENT))
    weights = _SMOOTH_PROBABILITY * np.concatenate(smooth) / np.size(smooth)
    weights = np.concatenate([[1.0 - _SMOOTH_PROBABILITY], weights])
    middle = np.tensordot(weights / weights.sum(), np.array(middles), axes=1) + prior[1].T @ prior[1]
    inverse = np.linalg.inv(information)
    of_independent = (
        weights[0] * quiet.mean()
    )  # as quiet as beside smooth errors: a radar better than stated shows none
    shown = of_independent < (1.0 - _SHOWN) * (of_independent + weights[1:].sum())
    return np.asarray(inverse @ middle @ inverse), bool(shown)


def weighted_rows(refined: ErrorsInVariablesFit, inliers: Indices) -> tuple[Values, np.ndarray]:
    """Return residuals (2 n,) and Jacobian (2 n, 6 + k) of n inliers, whitened and weighted."""
    root = np.sqrt(refined.weights[inliers])[:, None]
    jacobian = refined.model.jacobian[inliers] * root[:, :, None]
    return (refined.model.residual[inliers] * root).reshape(-1), jacobian.reshape(2 * len(inliers), -1)


def smooth_rows(refined: ErrorsInVariablesFit, inliers: Indices, length_rad: float) -> np.ndarray:
    """Return B (2 n, 2 k) of the inliers, with the kernel's square root taken on at most _MOST_CENTERS directions (Nystrom).

    Its size is that of the stated sigmas, or of the estimated ones where these are larger: a fit to smooth errors absorbs most of
    them, so that the rest seems quieter than stated, down to the share of the variance that is not smooth.
    """
    # azimuth and elevation (n, 2) of each inlier from its click: the measured angles contain the errors in question
    rays = refined.measurements.rays[inliers] @ refined.camera_from_radar.rotation
    directions = polar_from_cartesian(rays)[:, 1:]
    directions = np.where(np.isfinite(directions), directions, refined.polar[1:, inliers].T)
    chosen = np.linspace(0, len(inliers) - 1, min(len(inliers), _MOST_CENTERS)).round().astype(np.int64)
    centers = directions[chosen]
    values, vectors = np.linalg.eigh(_kernel(centers, centers, length_rad))
    # share of the largest eigenvalue, a choice: such a part has a thousandth of the largest standard deviation
    kept = values > 1e-6 * values[-1]
    features = _kernel(directions, centers, length_rad) @ (vectors[:, kept] / np.sqrt(values[kept]))
    absorbed = np.clip(refined.noise_scale[1:], (1.0 - _SMOOTH_SHARE) ** 0.5, 1.0)
    sigma = refined.measurements.sigma_polar[refined.rows[inliers]] / absorbed
    sigma = sigma * np.sqrt(refined.weights[inliers])[:, None]
    parts = []
    for angle in (1, 2):
        gain = refined.model.point_jacobian[inliers, :, angle] * sigma[:, None, angle]  # G, (n, 2)
        parts.append((gain[:, :, None] * features[:, None, :]).reshape(2 * len(directions), -1))
    return np.concatenate(parts, axis=1)


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
