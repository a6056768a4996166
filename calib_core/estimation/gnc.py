"""Graduated non-convexity (GNC): the pose that most pairs agree on, candidates being associated in each step.

Residuals are whitened by S = C + J V J^T, so one radius in standard deviations suits every radar, range and lens; a
threshold in pixels cannot. The radius of the Geman-McClure loss shrinks from nearly least squares to one that ignores outliers.
All starts are iterated together as one batch of arrays: for a few dozen pairs, call overhead dominates the run time.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Indices, Values
from calib_core.association.clustering import CLUSTER_SCALE
from calib_core.association.exclusive_returns import exclusive_rows, taken_twice
from calib_core.estimation.measurement_model import Linearization, MeasurementPlanes, PairMeasurements
from calib_core.geometry import Poses, RigidTransform
from calib_core.radar import cartesian_from_polar, direction_cosines

RADII = (12.0, 8.0, 5.5, 4.0, 3.0)
"""Radii of the Geman-McClure loss in standard deviations, in order of use."""

INLIER_SHARE = 0.8
"""Of the pairs, before any is looked at. A choice: one wrong pair in five."""

LEAST_INFORMATION, RIDGE, TINY = 1e-12, 1e-12, 1e-300
"""Guards against zero, far below what a pair contributes: the least information about an unknown [1/m^2 or 1/rad^2], the share
of its diagonal that keeps a singular matrix invertible (float64 rounds to 1e-16), a divisor whose inverse is finite."""

_STEPS_PER_RADIUS = 2
_SAME_POSE = 0.25  # squared distance, in standard deviations
# times the assumed noise, in factors of sqrt(2); the end is a choice
_NOISE_SCALES = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0)
_BEYOND = 1e-6  # share that counts of what a cost exceeds that of an outlier by: it only orders outliers
_SCALE_PENALTY = 4.0  # how much better a larger noise level must explain the pairs than the assumed one


@dataclass(frozen=True, slots=True, eq=False)
class GncSolution:
    """A pose that a set of pairs agrees on.

    Attributes:
        camera_from_radar: the pose.
        cost: twice the negative log-likelihood of pose and pairs under the inlier / outlier mixture.
        noise_scale: the factor on the assumed noise that explains the residuals; at least 1.
    """

    camera_from_radar: RigidTransform
    cost: float
    noise_scale: float


def solve_gnc(
    measurements: PairMeasurements, starts: Sequence[RigidTransform], *, estimate_scale: bool
) -> tuple[GncSolution, ...]:
    """Refine every start by graduated non-convexity; return the most likely pose first.

    Args:
        measurements: the pairs.
        starts: initial poses.
        estimate_scale: allow a larger noise than assumed.
    """
    if not starts:
        return ()
    scales = _NOISE_SCALES if estimate_scale else _NOISE_SCALES[:1]
    measurements = measurements.without_errors()
    poses = _graduated(measurements, Poses.of(starts))
    costs = _mixture_costs(measurements, poses, scales)
    best = costs.argmin(axis=1)
    solutions = [
        GncSolution(pose, float(costs[i, k]), scales[k])
        for i, (pose, k) in enumerate(zip(poses.transforms(), best.tolist(), strict=True))
    ]
    return tuple(sorted(solutions, key=lambda solution: solution.cost))


def _graduated(measurements: PairMeasurements, poses: Poses) -> Poses:
    """Run all radii from all starts at once; of the starts that end in the same pose, keep only the first."""
    measured = _of_candidates(measurements)
    for radius in RADII:
        for _ in range(_STEPS_PER_RADIUS):
            _, model = _associated(measurements, measured, poses)
            weights = (1.0 + model.squared / radius**2) ** -2.0
            hessians, gradients = _normal_equations(measurements, poses, model, weights)
            # a choice: larger steps leave what one linearization describes
            poses = poses.perturbed(damped_steps(hessians, gradients, largest_turn_rad=0.5, largest_shift_m=2.0))
    return poses.some(_distinct(poses, hessians))


def _distinct(poses: Poses, hessians: np.ndarray) -> list[int]:
    """Return the indices of the poses that differ from all earlier ones."""
    kept: list[int] = []
    for i in range(len(hessians)):
        turned = poses.rotations[kept] @ poses.rotations[i].T
        sines = 0.5 * (np.swapaxes(turned, 1, 2) - turned)[:, (1, 2, 0), (2, 0, 1)]  # the rotation vector, where small
        errors = np.concatenate([poses.translations_m[kept] - poses.translations_m[i], sines], axis=1)
        near = np.trace(turned, axis1=1, axis2=2) > 1.0  # less than a quarter turn apart
        if not (near & (((errors @ hessians[i]) * errors).sum(axis=1) < _SAME_POSE)).any():
            kept.append(i)
    return kept


def associate(measurements: PairMeasurements, pose: RigidTransform) -> tuple[Indices, Linearization]:
    """Choose for each pair the candidate row that explains its pixel best: rows (n,) and the model of those rows.

    The choice maximises log score + log N(e; 0, S).
    """
    return _associated(measurements, _of_candidates(measurements), Poses(pose.rotation, pose.translation_m))


def _of_candidates(measurements: PairMeasurements) -> MeasurementPlanes:
    """Return every candidate row with its pair's click."""
    each = measurements if measurements.one_to_one else measurements.candidates_apart()
    return each.measured(np.arange(len(each.reported)))


def _associated(
    measurements: PairMeasurements, candidates: MeasurementPlanes, poses: Poses
) -> tuple[Indices, Linearization]:
    """Associate at each pose: rows (..., n), and their model."""
    model = candidates.linearize(measurements.camera, poses.rotations, poses.translations_m)
    count = len(measurements.reported)
    if measurements.one_to_one:
        return np.arange(count), model
    cost = model.squared + model.log_determinant - 2.0 * measurements.log_score
    first = measurements.first[:-1]
    cheapest = np.minimum.reduceat(cost, first, axis=-1)[..., measurements.owner] == cost
    rows = np.minimum.reduceat(np.where(cheapest, np.arange(count), count), first, axis=-1)  # of equals, the first
    twice = taken_twice(measurements.returns[rows])
    if twice.any():
        fits = 2.0 * _log_odds(measurements, np.zeros(1), np.zeros(1), INLIER_SHARE)[measurements.owner]
        cost = np.minimum(
            cost, fits + _BEYOND * (cost - fits)
        )  # an outlier does not take the return of a pair that fits
        rows[twice] = [exclusive_rows(one, measurements.first, measurements.returns) for one in cost[twice]]
    return rows, model.rows(rows)


_AS_WELL = 4.0
"""How much larger -2 log-likelihood may be for another choice of returns to explain the clicks as well: odds of 1 to 7."""

_ELSEWHERE = 3.0  # steps between two returns that are not parts of one
_RULED_OUT = 1e9  # in units of -2 log-likelihood: more than any return costs, and finite, so that sums of it are


def rival_rows(measurements: PairMeasurements, pose: RigidTransform, asked: Flags) -> Indices:
    """Find for each pair another return that explains its click about as well, while the other pairs give way.

    Args:
        measurements: the pairs, with the noise of the fit.
        pose: of the fit.
        asked: (n,) of which pairs.

    Returns:
        rows (n,) of candidates; -1 for none.
    """
    found = np.full(len(measurements), -1)
    if measurements.one_to_one:
        return found
    candidates, first = _of_candidates(measurements), measurements.first
    rows, _ = _associated(measurements, candidates, Poses(pose.rotation, pose.translation_m))
    model = candidates.linearize(measurements.camera, pose.rotation, pose.translation_m)
    cost = model.squared + model.log_determinant - 2.0 * measurements.log_score
    places = direction_cosines(cartesian_from_polar(measurements.reported)) / CLUSTER_SCALE
    same = ((places - places[rows][measurements.owner]) ** 2).sum(axis=1) <= _ELSEWHERE**2
    others = np.minimum.reduceat(np.where(same, _RULED_OUT, cost), first[:-1])
    for pair in np.flatnonzero(asked & (others - cost[rows] < _AS_WELL)).tolist():
        own = np.arange(*first[pair : pair + 2])
        without = cost.copy()
        without[own[same[own]]] = _RULED_OUT
        again = exclusive_rows(without, first, measurements.returns)
        worse = float(without[again].sum() - cost[rows].sum())
        if worse < _AS_WELL and not taken_twice(measurements.returns[again]):
            found[pair] = again[pair]
    return found


def normal_equations(
    measurements: PairMeasurements, pose: RigidTransform, model: Linearization, weights: Values
) -> tuple[np.ndarray, np.ndarray]:
    """Return the Gauss-Newton Hessian (6 + k, 6 + k) and the right-hand side (6 + k,) of the normal equations.

    The priors of the camera centre and of the k systematic errors are included.
    """
    return _normal_equations(measurements, Poses(pose.rotation, pose.translation_m), model, weights)


def _normal_equations(
    measurements: PairMeasurements, poses: Poses, model: Linearization, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return Hessians (..., 6 + k, 6 + k) and right-hand sides, both blocks of one product of (residual, Jacobian) rows."""
    rows = model.planes[..., :-3, :, :] * np.sqrt(weights)[..., None, None, :]
    rows = rows.reshape(*rows.shape[:-2], -1)
    product = rows @ np.swapaxes(rows, -1, -2)
    hessian, gradient = product[..., 1:, 1:], product[..., 1:, 0]
    prior_hessian, prior_gradient = measurements.prior.information(poses.rotations, poses.translations_m)
    hessian[..., :6, :6] += prior_hessian
    gradient[..., :6] += prior_gradient
    if len(measurements.errors):
        information = measurements.errors.prior_information
        hessian[..., 6:, 6:] += information
        gradient[..., 6:] -= information @ measurements.errors.values
    return hessian, gradient


def damped_steps(
    hessians: np.ndarray, gradients: np.ndarray, *, largest_turn_rad: float, largest_shift_m: float
) -> np.ndarray:
    """Solve for steps (s, 6) of limited length, slightly damped for directions that the pairs do not determine."""
    scale = np.sqrt(np.maximum(np.diagonal(hessians, axis1=1, axis2=2), LEAST_INFORMATION))
    # share of the diagonal, a choice: it does not move the optimum, and singular matrices can be solved
    scaled = hessians / (scale[:, :, None] * scale[:, None, :]) + 1e-9 * np.eye(6)
    steps = np.linalg.solve(scaled, (gradients / scale)[:, :, None])[:, :, 0] / scale
    turns, shifts = np.linalg.norm(steps[:, 3:], axis=1), np.linalg.norm(steps[:, :3], axis=1)
    return np.asarray(steps / np.maximum(np.maximum(turns / largest_turn_rad, shifts / largest_shift_m), 1.0)[:, None])


def log_odds_of(measurements: PairMeasurements, model: Linearization, log_score: Values, inlier_share: float) -> Values:
    """Return log odds (n,) of inlier against outlier: normal noise against a click of another place."""
    return np.asarray(_log_odds(measurements, model.squared + model.log_determinant, log_score, inlier_share))


def _log_odds(
    measurements: PairMeasurements, deviance: np.ndarray, log_score: np.ndarray, inlier_share: float
) -> np.ndarray:
    """Return the same from the deviance: squared distance plus log det S."""
    prior = np.log(inlier_share) - np.log1p(-inlier_share)
    return np.asarray(log_score - 0.5 * deviance + (prior - np.log(2.0 * np.pi) - measurements.log_outlier))


def mixture_cost(measurements: PairMeasurements, pose: RigidTransform) -> float:
    """Return twice the negative log-likelihood of the mixture relative to "all are outliers", priors included."""
    return float(_mixture_costs(measurements, Poses.of([pose]), (1.0,))[0, 0]) + measurements.errors.squared


def _mixture_costs(measurements: PairMeasurements, poses: Poses, scales: Sequence[float]) -> np.ndarray:
    """Return the costs (s, k) with all noise multiplied by each scale: S grows by its square, log det S by 4 log scale."""
    rows, model = _associated(measurements, _of_candidates(measurements), poses)
    factors = np.array(scales)[:, None]
    # S is 2 x 2: its determinant grows by the fourth power of the factor
    deviance = model.squared[:, None, :] / factors**2 + model.log_determinant[:, None, :] + 4.0 * np.log(factors)
    odds = _log_odds(measurements, deviance, measurements.log_score[rows][..., None, :], INLIER_SHARE)
    costs = -2.0 * np.logaddexp(0.0, odds).sum(axis=-1) + _SCALE_PENALTY * (factors[:, 0] > 1.0)
    return np.asarray(costs + measurements.prior.costs(poses.rotations, poses.translations_m)[:, None])
