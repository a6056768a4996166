"""Influential pairs: pairs that the pose depends on and that the other pairs contradict.

A wrong pair that few others check can be too close to their prediction to be rejected as an outlier: near the camera and
at the edge of the picture, the pose follows it. Each pair is tested against its prediction from the others. The
false-alarm probability is divided among the pairs by leverage, so the test is most sensitive where an error would do most harm.

A wrong pair can also agree with a few others, right or wrong, on a wrong pose and so have pairs set aside that contradict it.
Leaving it out by one Newton step, or with the weights of the others kept, does not show that. The pivotal pair is the one without
which the others, judged anew, agree on another pose: every pair is left out in turn, all fits run as one batch, and in each the
others decide again which of them are inliers.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Values
from calib_core.estimation.covariance import PoseCovariance, pose_covariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution, associate
from calib_core.estimation.leave_one_out import noise_parts, predict_left_out, tail_chance
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.estimation.pose_posterior import batch_of, pose_posterior
from calib_core.estimation.posterior_samples import refine_poses

_LEVEL = 0.055  # false-alarm probability per set of pairs
_LARGEST_SHARE = 0.25  # of that level for one pair
_SCREENING = 4.0  # factor by which the screening by one Newton step is more lenient
_MOST_REFITS = 2
_LEAST_PAIRS = 8.0  # fewer cannot check one another
_LEAST_MOVE = 2.0  # standard deviations; a pair that moves the pose less does little harm


@dataclass(frozen=True, slots=True, eq=False)
class InfluentialPair:
    """One pair, and the fit without it.

    Attributes:
        pair: its index in the measurements.
        move: (6,) change of the pose without it, (dt, dtheta) [m, rad].
        camera_move_m: distance by which the camera centre moves.
        standard_deviations: distance of the pair from the prediction of the others; of a pivotal pair, length of the move
            under the covariance without it.
        switched: indices of the pairs that are inliers either with it or without it, but not both; of a pivotal pair only.
    """

    pair: int
    move: Values
    camera_move_m: float
    standard_deviations: float
    switched: tuple[int, ...] = ()


def find_influential_pairs(
    measurements: PairMeasurements, refined: ErrorsInVariablesFit, uncertainty: PoseCovariance
) -> tuple[InfluentialPair, ...]:
    """Find the influential pairs: screen all pairs by one Newton step, then refit without each suspect.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
        uncertainty: of that fit.
    """
    inliers = refined.inliers
    if refined.weights.sum() < _LEAST_PAIRS:
        return ()
    scale = refined.noise_scale if refined.degrees_of_freedom > 0 else None
    parts = noise_parts(refined.measurements, refined.model, refined.measurements.sigma_polar[refined.rows])
    one = predict_left_out(
        refined.measurements, refined.camera_from_radar, refined.model, refined.weights, parts, scale
    )
    levels = _LEVEL * np.where(inliers, _shares(refined, uncertainty.information), 0.0)
    chances = tail_chance(one.squared(), one.degrees_of_freedom)
    suspects = np.flatnonzero(chances < _SCREENING * levels)
    worst = suspects[np.argsort(chances[suspects] / levels[suspects], kind="stable")][:_MOST_REFITS]
    information = uncertainty.pose_information
    refits = [_left_out(measurements, refined, int(pair)) for pair in worst]
    return tuple(
        influential
        for influential, chance in refits
        if chance < levels[influential.pair] and influential.move @ information @ influential.move > _LEAST_MOVE**2
    )


def _shares(refined: ErrorsInVariablesFit, information: np.ndarray) -> Values:
    """Divide the level among the pairs by squared leverage w tr(J H^-1 J^T), with a limit per pair."""
    jacobian = refined.model.jacobian
    leverage = refined.weights * ((jacobian @ np.linalg.inv(information)) * jacobian).sum(axis=(1, 2))
    return np.minimum(leverage**2 / (leverage**2).sum(), _LARGEST_SHARE)


def _left_out(
    measurements: PairMeasurements, refined: ErrorsInVariablesFit, pair: int
) -> tuple[InfluentialPair, float]:
    """Fit all pairs but one and predict that one; return also the probability of a residual as large."""
    others = measurements.some(np.delete(np.arange(len(measurements)), pair))
    start = GncSolution(refined.camera_from_radar, 0.0, 1.0)
    fit = fit_errors_in_variables(others, start, estimate_scale=refined.degrees_of_freedom > 0)
    own = measurements.some(np.array([pair])).scaled(fit.noise_scale).with_errors(fit.measurements.errors.values)
    model = associate(own, fit.camera_from_radar)[1]
    residual, jacobian = model.residual[0], model.pose_jacobian[0]
    spread = np.eye(2) + jacobian @ pose_covariance(fit).covariance @ jacobian.T
    squared = float(residual @ np.linalg.solve(spread, residual))
    before, after = (one.camera_from_radar.inverse().translation_m for one in (refined, fit))
    influential = InfluentialPair(
        pair=pair,
        move=fit.camera_from_radar.error_from(refined.camera_from_radar),
        camera_move_m=float(np.linalg.norm(after - before)),
        standard_deviations=float(np.sqrt(squared)),
    )
    degrees = fit.degrees_of_freedom if fit.degrees_of_freedom > 0 else np.inf
    return influential, float(tail_chance(np.array([squared]), np.array([degrees]))[0])


def average_over_influential_pairs(
    refined: ErrorsInVariablesFit, uncertainty: PoseCovariance, influential_pairs: Sequence[InfluentialPair]
) -> tuple[ErrorsInVariablesFit, PoseCovariance]:
    """Move the pose midway between those with and without each influential pair, and widen the covariance to cover both.

    Of two equally likely values m apart, the midpoint has the smallest expected squared error, m m^T / 4.
    """
    if not influential_pairs:
        return refined, uncertainty
    move = np.sum([0.5 * pair.move for pair in influential_pairs], axis=0)
    covariance = uncertainty.covariance + sum(0.25 * np.outer(pair.move, pair.move) for pair in influential_pairs)
    moved = replace(refined, camera_from_radar=refined.camera_from_radar.perturbed(move))
    return moved, replace(uncertainty, covariance=covariance)


_PIVOTAL_MOVE = 2.6  # standard deviations without the pair; sets of right pairs exceed it in at most one of a hundred
_LEAST_PAIRS_OF_PIVOT = 6.0
_MOST_PAIRS_OF_PIVOT = 100  # in larger sets no single pair matters
_ROUNDS = 8


def find_pivotal_pair(measurements: PairMeasurements, refined: ErrorsInVariablesFit) -> InfluentialPair | None:
    """Return the pair on which the pose depends most, if the pose moves far without it.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
    """
    inliers = np.flatnonzero(refined.inliers)
    if refined.weights.sum() < _LEAST_PAIRS_OF_PIVOT or len(measurements) > _MOST_PAIRS_OF_PIVOT:
        return None
    posterior = pose_posterior(measurements, refined.camera_from_radar, np.zeros(3))
    used = np.ones((len(inliers) + 1, len(measurements)), dtype=bool)
    used[1 + np.arange(len(inliers)), inliers] = False
    log_scales = np.tile(np.log(refined.noise_scale), (len(used), 1))
    starts = batch_of([refined.camera_from_radar] * len(used))
    modes = refine_poses(posterior, starts, log_scales, share=refined.inlier_share, used=used, rounds=_ROUNDS)
    whole = modes.poses.transform(0)
    moves = np.array([modes.poses.transform(1 + k).error_from(whole) for k in range(len(inliers))])
    lengths = np.sqrt(np.einsum("ki,kij,kj->k", moves, modes.hessians[1:], moves))
    most = int(np.argmax(lengths))
    if not lengths[most] > _PIVOTAL_MOVE:
        return None
    agree = modes.inlier > 0.5
    switched = np.flatnonzero(agree[0] != agree[1 + most])
    centres = [modes.poses.transform(k).inverse().translation_m for k in (0, 1 + most)]
    return InfluentialPair(
        pair=int(inliers[most]),
        move=moves[most],
        camera_move_m=float(np.linalg.norm(centres[1] - centres[0])),
        standard_deviations=float(lengths[most]),
        switched=tuple(switched[switched != inliers[most]].tolist()),
    )
