"""Warnings about the intrinsics: contradicted by the residuals, changed too far by refining, or not told apart from the radar.

Score test of the given ones: how much of the residuals another focal length or radial distortion would explain, or angles of
the radar that change with the range, as where floor or walls reflect it, or a turn of a sensor on the way (`_turn_test`).

To first order, a focal length longer by a share a moves a pixel by a d, with d its offset from the principal point; a
radial distortion that is off by b moves it by b |d / f|^2 d, whatever the lens model; an angle that changes by c per metre
moves the pixel as an angle larger by c (r - mean r) does. With whitened residuals e, whitened
Jacobians J of the pose and of the estimated errors, priors included, g of such an unknown, and M = I - J (J^T J)^-1 J^T,
which removes what these can explain,

    a = g^T M e / g^T M g,    var a = 1 / g^T M g,    F(1, nu - 1) = (a^2 / var a) (nu - 1) / (nu - a^2 / var a),       (8)

because the noise was estimated with nu degrees of freedom from residuals that the wrong intrinsics had made larger. A score
test takes one step from the optimum and needs no second fit. A wrong principal point cannot be detected: the rotation
absorbs it. A scale of the radar's azimuths looks like a focal length and has a prior of its own, so it is not blamed on the
lens (the warning of `systematic_errors` names both). A radar without elevation is not tested: its own residuals grow towards
the near placements.

Refined ones: a focal length longer by a share a moves every pixel almost as angles reported too large by a share -a, so pairs
show the sum of the two well, and how it divides only by the priors. With C the covariance of all unknowns, f the focal length
and s the scales,

    C_fs C_ss^-1 C_sf / C_ff

is the part of the focal length's variance that knowing the scales would remove.
"""

import re
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Values
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.covariance import smooth_rows, weighted_rows
from calib_core.estimation.measurement_model import prior_rows
from calib_core.measurements import Facts
from calib_core.results import DataWarning
from calib_core.results.systematic_errors import LensPrior, is_beyond_its_prior

_LEVEL = 0.0025  # false-alarm probability of each unknown
_LEAST_PAIRS = 10
_LEAST_SQUARED = 8.0  # a smaller statistic is never significant, whatever the degrees of freedom
_LEAST_REDUNDANCY = 0.05  # share of the residual's degrees of freedom that must stay unexplained
_TURN_LEVEL = 0.015  # of all splits together, which share most pairs: alarms are five times rarer
_MOST_SPLITS, _LEAST_PLACEMENTS = 15, 4  # tried; on each side
_SMOOTH_RAD, _SMOOTH_VARIANCE = np.deg2rad(14.0), 4.0  # of errors that neighbouring placements share; over the noise's


@dataclass(frozen=True, slots=True)
class ScoreTest:
    """The estimate of an error that is no unknown of the fit.

    Attributes:
        amount: to be added to the given value; a share of the focal length, a radial coefficient, or an angle's slope [rad/m].
        sigma: its standard deviation.
        chance: probability of an amount as large if the intrinsics were as right as their covariance says (p-value).
        allowed: standard deviation of the amount that this covariance alone would make; 0 if they have none.
    """

    amount: float
    sigma: float
    chance: float
    allowed: float = 0.0


@dataclass(frozen=True, slots=True)
class TurnTest:
    """A turn of camera or radar between two placements: its angle [rad], the pairs before and after, and its p-value."""

    angle_rad: float = 0.0
    before: int = 0
    after: int = 0
    chance: float = 1.0


def intrinsics(fit: SolvedFit) -> list[DataWarning]:
    """Warn of focal length, distortion, angles that change with the range, or a turn, whichever explains most of the residuals.

    The given intrinsics are tested, not refined ones; who refines those that come without a covariance expects them wrong.
    """
    if fit.inliers.sum() < _LEAST_PAIRS or fit.measurements.flat:
        return []
    if fit.options.refining.intrinsics and fit.measurements.camera.covariance is None:
        return []
    focal, radial, *angles = _score_tests(fit)
    of_lens, of_angles = min(focal.chance, radial.chance), min(angle.chance for angle in angles)
    turn = _turn_test(fit)
    if turn.chance < min(_TURN_LEVEL, of_lens, of_angles):
        return [_turned(fit, turn)]
    if min(of_lens, of_angles) >= _LEVEL:
        return []
    if of_angles < of_lens:
        return [_by_range(*angles)]
    facts = _focal_facts(fit, focal) if focal.chance <= radial.chance else _radial_facts(fit, radial)
    return [DataWarning("intrinsics-suspected", facts)]


def _by_range(azimuth: ScoreTest, elevation: ScoreTest) -> DataWarning:
    name, found = min(("azimuth", azimuth), ("elevation", elevation), key=lambda one: one[1].chance)
    slope, sigma = np.rad2deg((-found.amount, found.sigma))
    return DataWarning(
        "shared-error-suspected",
        {"angle": name, "slope_deg_per_m": float(slope), "slope_sigma_deg_per_m": float(sigma)},
    )


def _turned(fit: SolvedFit, turn: TurnTest) -> DataWarning:
    return DataWarning(
        "shared-error-suspected",
        {
            "turned_deg": float(np.rad2deg(turn.angle_rad)),
            "before": fit.ids[turn.before],
            "after": fit.ids[turn.after],
            "by_number": not _is_timed(fit),
        },
    )


def _focal_facts(fit: SolvedFit, focal: ScoreTest) -> Facts:
    stated = focal.allowed if fit.measurements.camera.covariance is not None else None
    return {"focal_length": focal.amount, "sigma": focal.sigma, "stated_sigma": stated}


def _radial_facts(fit: SolvedFit, radial: ScoreTest) -> Facts:
    offset_px, share = _offsets(fit)
    outermost = int(np.argmax(np.where(fit.inliers, share, 0.0)))
    reach_px = float(share[outermost] * np.linalg.norm(offset_px[outermost]))
    stated_px = radial.allowed * reach_px if fit.measurements.camera.covariance is not None else None
    return {
        "distortion_px": abs(radial.amount) * reach_px,
        "sigma": radial.sigma * reach_px,
        "stated_sigma": stated_px,
    }


def _score_tests(fit: SolvedFit) -> tuple[ScoreTest, ...]:
    """Estimate the errors of focal length and radial distortion, and slopes of azimuth and elevation, each as if alone."""
    refined = fit.refined
    offset_px, share = _offsets(fit)
    root = np.sqrt(refined.weights)[:, None]
    jacobian, residual, lens = _as_if_given(fit)
    prior_residual, prior_jacobian = prior_rows(refined.measurements, refined.camera_from_radar)
    kept = _not_of_lens(fit)
    of_pose = np.ones(len(prior_residual) - len(kept[6:]), dtype=np.bool_)
    rows = np.concatenate([of_pose, kept[6:]])
    prior_residual, prior_jacobian = prior_residual[rows], prior_jacobian[rows][:, kept]
    moves_px = np.stack([offset_px, offset_px * share[:, None]], axis=2)
    from_mean_m = refined.polar[0] - refined.polar[0].mean()
    by_range = from_mean_m[:, None, None] * refined.model.point_jacobian[:, :, 1:]
    moves = np.concatenate([refined.model.whitening @ moves_px, by_range], axis=2)
    gains = (moves * root[:, :, None]).reshape(-1, 4)
    unknowns = prior_jacobian.shape[1]
    fitted = np.concatenate([(jacobian * root[:, :, None]).reshape(-1, unknowns), prior_jacobian])
    residual = np.concatenate([(residual * root).reshape(-1), prior_residual])
    explained, _ = np.linalg.qr(fitted)
    gains = np.concatenate([gains, np.zeros((len(prior_residual), 4))])
    gains = gains - explained @ (explained.T @ gains)
    of_lens = np.zeros((len(gains), lens.shape[2]))
    of_lens[: 2 * len(lens)] = (lens * root[:, :, None]).reshape(2 * len(lens), -1)
    return tuple(_score_test(gain, residual, of_lens, refined.degrees_of_freedom) for gain in gains.T)


def _not_of_lens(fit: SolvedFit) -> Flags:
    """Return which unknowns (6 + k,) are not errors of refined intrinsics."""
    errors = fit.refined.measurements.errors
    kept = np.ones(6 + len(errors), dtype=np.bool_)
    kept[6 + errors.refined.start : 6 + errors.refined.stop] = False
    return kept


def _as_if_given(fit: SolvedFit) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Jacobian (n, 2, u) and residual (n, 2) of the fit with the given intrinsics, whitened, and what the lens may do.

    The last (n, 2, r) is how a standard deviation along each axis of the intrinsics' covariance moves the clicks.
    """
    refined = fit.refined
    measurements, errors = refined.measurements, refined.measurements.errors
    kept, jacobian = _not_of_lens(fit), refined.model.jacobian
    if not kept.all():
        lens = jacobian[:, :, ~kept]
        return jacobian[:, :, kept], refined.model.residual + lens @ errors.values[errors.refined], lens
    along = [one for one in errors.widening if one.of_lens]
    if not along:
        return jacobian, refined.model.residual, np.zeros((*jacobian.shape[:2], 0))
    planes = measurements.measured(refined.rows)
    columns = planes.columns(measurements.camera, refined.camera_from_radar, along, refined.polar)
    lens = refined.model.whitening @ np.nan_to_num(columns).transpose(2, 1, 0)
    return jacobian, refined.model.residual, np.asarray(lens)


def _offsets(fit: SolvedFit) -> tuple[np.ndarray, Values]:
    """Return each click's offset from the principal point (n, 2) [px], and the square (n,) of that in focal lengths."""
    matrix_px = fit.measurements.camera.matrix_px
    offset_px = fit.measurements.pixels_px - matrix_px[:2, 2]
    return offset_px, np.asarray(((offset_px / matrix_px[[0, 1], [0, 1]]) ** 2).sum(axis=1))


def _score_test(gain: Values, residual: Values, lens: np.ndarray, degrees_of_freedom: float) -> ScoreTest:
    """Evaluate equation (8); with the noise known, nu is infinite. What the lens may do (n, r) is added to the variance."""
    information = float(gain @ gain)
    if information <= 0.0:
        return ScoreTest(0.0, float("inf"), 1.0)
    amount = float(gain @ residual) / information
    squared, shrink = amount**2 * information, 1.0
    if degrees_of_freedom > 2.0:
        left = max(degrees_of_freedom - squared, _LEAST_REDUNDANCY * degrees_of_freedom)
        shrink = left / (degrees_of_freedom - 1.0)
    own, allowed = shrink / information, float((((gain @ lens) / information) ** 2).sum())
    tested = squared / shrink if not allowed else amount**2 / (own + allowed)
    return ScoreTest(amount, float(np.sqrt(own)), _chance(tested, degrees_of_freedom), float(np.sqrt(allowed)))


def _chance(squared: float, degrees_of_freedom: float, count: float = 1.0) -> float:
    if squared < _LEAST_SQUARED:
        return 1.0
    from scipy.special import chdtrc, fdtrc

    nu = degrees_of_freedom
    return float(fdtrc(count, nu - count, squared / count) if nu > count + 1.0 else chdtrc(count, squared))


def _is_timed(fit: SolvedFit) -> bool:
    return any(time is not None for time in fit.times)


def _times(fit: SolvedFit) -> np.ndarray:
    """Return the times (n,) of the pairs, 0 where unknown; of pairs without any the numbers at the end of their ids, unless these
    follow a column: pairs sorted by range are in no order of time."""
    if _is_timed(fit):
        return np.array([time or 0 for time in fit.times], dtype=np.int64)
    ends = [re.search(r"(\d{1,9})$", name) for name in fit.ids]
    numbers = np.array([int(end[1]) if end else 0 for end in ends], dtype=np.int64)
    columns = np.column_stack([fit.refined.polar.T, fit.measurements.pixels_px, fit.measurements.rays])
    steps = np.diff(columns[np.argsort(numbers, kind="stable")], axis=0)
    is_sorted = ((steps >= 0.0).all(axis=0) | (steps <= 0.0).all(axis=0)).any()
    return np.zeros_like(numbers) if is_sorted else numbers


def _turn_test(fit: SolvedFit) -> TurnTest:
    """Estimate a turn by equation (8) with three unknowns, after each of some placements in time, and return the likeliest.

    Where the placements walk across the view, an error of the angles that changes with direction looks like a turn. So the
    score's variance grows by what smooth errors (`covariance`), twice the noise, add to it over independent ones.
    """
    refined, inliers = fit.refined, np.flatnonzero(fit.inliers)
    times = _times(fit)[inliers]
    inliers, times = inliers[np.argsort(times, kind="stable")], np.sort(times)
    residual, jacobian = weighted_rows(refined, inliers)
    priors, prior_jacobian = prior_rows(refined.measurements, refined.camera_from_radar)
    residual = np.concatenate([residual, priors])
    explained, _ = np.linalg.qr(np.concatenate([jacobian, prior_jacobian]))
    smooth = smooth_rows(refined, inliers, _SMOOTH_RAD).reshape(len(inliers), 2, -1)
    nu, test = refined.degrees_of_freedom, TurnTest()
    tried = np.linspace(_LEAST_PLACEMENTS, len(inliers) - _LEAST_PLACEMENTS, _MOST_SPLITS).round().astype(np.int64)
    splits = [k for k in np.unique(tried).tolist() if 0 < times[k - 1] < times[k]]
    for k in splits:
        gain = np.zeros((len(residual), 3))
        gain[2 * k : len(jacobian)] = jacobian[2 * k :, 3:6]
        gain = gain - explained @ (explained.T @ gain)
        information = gain.T @ gain
        white = np.linalg.inv(np.linalg.cholesky(information + 1e-9 * np.trace(information) * np.eye(3)))
        score = white @ (gain.T @ residual)
        each = np.einsum("nrk,nrs->nks", smooth, (gain[: len(jacobian)] @ white.T).reshape(-1, 2, 3))
        shared = each.sum(axis=0)
        added, axes = np.linalg.eigh(shared.T @ shared - np.einsum("nks,nkt->st", each, each))
        left = max(nu - float(score @ score), _LEAST_REDUNDANCY * nu)
        shrink = left / (nu - 3.0) if nu > 4.0 else 1.0
        tested = float(((score @ axes) ** 2 / (shrink + _SMOOTH_VARIANCE * np.maximum(added, 0.0))).sum())
        chance = len(splits) * _chance(tested, nu, 3.0)
        if chance < test.chance:
            angle_rad = float(np.linalg.norm(white.T @ score))
            test = TurnTest(angle_rad, int(inliers[k - 1]), int(inliers[k]), chance)
    return test


_SCALES = ("azimuth_scale", "elevation_scale")
_UNTOLD_SHARE = 0.5  # of the focal length's variance
_NOTABLE_FOCAL = 0.002  # a focal length known better than this is no concern


@dataclass(frozen=True, slots=True)
class _Focal:
    """The refined focal length: change of the given one as a share, its standard deviation, and the part of the scales."""

    change: float
    sigma: float
    scale_share: float


def lens_or_scale(fit: SolvedFit) -> list[DataWarning]:
    """Warn that the refined focal length and the radar's angle scale cannot be told apart."""
    focal = _focal(fit)
    if focal is None or focal.sigma < _NOTABLE_FOCAL or focal.scale_share < _UNTOLD_SHARE:
        return []
    scales = [error for error in fit.uncertainty.systematic_errors if error.name in _SCALES]
    return [
        DataWarning(
            "lens-or-radar-scale",
            {"change": focal.change, "sigma": focal.sigma, "scales": scales},
        )
    ]


def refined_too_far(fit: SolvedFit) -> list[DataWarning]:
    """Warn of refined intrinsics so far from the given ones that these, or what was stated of them, cannot be right."""
    errors = fit.refined.measurements.errors
    if errors.refined.start == errors.refined.stop:
        return []
    beyond = [error for error in fit.uncertainty.systematic_errors if error.of_lens and is_beyond_its_prior(error)]
    if not beyond:
        return []
    return [DataWarning("intrinsics-suspected", {"refined_too_far": beyond})]


def _focal(fit: SolvedFit) -> _Focal | None:
    """Return what is known of the refined focal length; None if it was not refined together with a scale."""
    errors = fit.refined.measurements.errors
    scales = [6 + k for k, one in enumerate(errors.estimated) if one.name in _SCALES]
    places = errors.refined
    if errors.lens is None or places.start == places.stop or not scales:
        return None
    along = _focal_along(errors.lens)
    covariance = np.linalg.inv(fit.uncertainty.information)
    lens = list(range(6 + places.start, 6 + places.stop))
    variance = float(along @ covariance[np.ix_(lens, lens)] @ along)
    if variance <= 0.0:
        return None
    mixed = covariance[np.ix_(scales, lens)] @ along
    removed = float(mixed @ np.linalg.solve(covariance[np.ix_(scales, scales)], mixed))
    stated = fit.uncertainty.lens
    sigma = float(np.sqrt(variance if stated is None else along @ stated @ along))
    return _Focal(float(along @ errors.values[places]), sigma, removed / variance)


def _focal_along(lens: LensPrior) -> Values:
    """Return by what share both focal lengths together change along each axis of the prior: (r,)."""
    return np.asarray((lens.along_axes[:2] / lens.camera.parameters[:2, None]).mean(axis=0))
