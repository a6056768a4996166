"""Beyond the fit: the posterior away from the fitted peak, at the systematic errors that the fit found.

Agreeing outliers: pairs that were set aside, but agree among themselves on another pose.

Wrong pairs are wrong in different ways. If several agree, something stands where they say: a companion of the reflector such
as a cart, or a second reflector; or the pairs that were used are the wrong ones. Whether the agreement is more than chance is
told by the ratio of two probabilities of the outliers' pixels, with a common pose and without one. The first is integrated
over the pose as in equation (8) of `marginal_likelihood`.

Outliers without a common pose reach a ratio of B in at most one of B sets.

Other peaks: where a parabola about the fit may not describe the posterior, the distance to its other peaks, each weighed by its
share, joins the covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Matrix66, Values
from calib_core.estimation.covariance import PoseCovariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import GncSolution, solve_gnc
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.marginal_likelihood import log_determinant, log_pose_prior
from calib_core.estimation.measurement_model import CameraPrior, PairMeasurements
from calib_core.estimation.pose_posterior import pose_posterior
from calib_core.estimation.posterior_peaks import Modes, posterior_peaks, refine_poses
from calib_core.geometry import Poses, RigidTransform

_LEAST_PROBABILITY = 0.05
"""A peak of less need not lie in a 95 % region."""


@dataclass(frozen=True, slots=True, eq=False)
class PossiblePose:
    """A peak of the posterior that is separate from the others.

    Attributes:
        camera_from_radar: its pose.
        probability: its share of the posterior.
        sigmas: its distance from the fit, in standard deviations about the fit alone.
    """

    camera_from_radar: RigidTransform
    probability: float
    sigmas: float


_LEAST_PAIRS = 4  # three always agree
# a ratio that outliers without a common pose reach in at most one set of 100, whatever their distribution (Markov)
_LEAST_LOG_RATIO = float(np.log(100.0))
_STARTS, _ROUNDS = 12, 8
"""Number of starts, and of steps from each. A choice: a group of few is found more surely with more, which take longer."""
_SHARE = 0.5  # of the outliers that may belong to the group
_MOST_PAIRS = 150
"""A search among more takes seconds; the posterior of larger sets has one peak."""


@dataclass(frozen=True, slots=True, eq=False)
class AgreeingOutliers:
    """Outliers with a pose in common.

    Attributes:
        pairs: their indices in the measurements.
        camera_from_radar: their pose.
        difference: (6,) of that pose from the fit, (dt, dtheta) [m, rad].
        camera_move_m: distance between the two camera centres.
        log_ratio: logarithm of the ratio of their probabilities with and without a common pose.
    """

    pairs: Indices
    camera_from_radar: RigidTransform
    difference: Values
    camera_move_m: float
    log_ratio: float


def find_agreeing_outliers(
    measurements: PairMeasurements, refined: ErrorsInVariablesFit, *, rng: "np.random.Generator"
) -> AgreeingOutliers | None:
    """Look among the outliers of a fit for pairs that agree on another pose.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
        rng: random generator of the hypotheses.
    """
    outliers = np.flatnonzero(~refined.inliers)
    if not _LEAST_PAIRS <= len(outliers) <= _MOST_PAIRS:
        return None
    # a companion's camera may be anywhere
    free = replace(measurements, prior=measurements.prior.weakened()).some(outliers)
    drawn = initial_poses(free, most=_STARTS, rng=rng)
    fitted = refined.camera_from_radar  # a companion's pose is often near it
    starts = (fitted, *(one.camera_from_radar for one in solve_gnc(free, drawn, estimate_scale=False)))
    posterior = pose_posterior(free, refined.camera_from_radar)
    as_assumed = np.zeros((len(starts), 4))
    modes = refine_poses(posterior, Poses.of(starts), as_assumed, share=_SHARE, rounds=_ROUNDS)
    agree = modes.inlier > 0.5
    ratios = np.where(agree.sum(axis=1) >= _LEAST_PAIRS, _log_ratios(modes, free.prior), -np.inf)
    best = int(np.argmax(ratios))
    if not ratios[best] > _LEAST_LOG_RATIO:
        return None
    pose = modes.poses.transform(best)
    centres = [one.inverse().translation_m for one in (pose, refined.camera_from_radar)]
    return AgreeingOutliers(
        pairs=outliers[agree[best]],
        camera_from_radar=pose,
        difference=pose.error_from(refined.camera_from_radar),
        camera_move_m=float(np.linalg.norm(centres[0] - centres[1])),
        log_ratio=float(ratios[best]),
    )


def _log_ratios(modes: Modes, free: CameraPrior) -> Values:
    """Return equation (8) of each mode."""
    prior = log_pose_prior(free)
    return np.asarray(modes.log_likelihood + prior - 0.5 * log_determinant(modes.hessians))


_CLEARLY_ENOUGH, _CLEARLY_AGREEING = 12, 0.75
"""Inliers, and their share of the pairs, beyond which other peaks never changed an answer."""

NARROW_CONDITION = 5e5
"""Above it the placements lie in too narrow a strip: ratio of the largest to the smallest eigenvalue of the pairs' information
about the pose, scaled to a unit diagonal. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseAlternatives:
    """What the fit and its covariance do not show.

    Attributes:
        uncertainty: of the fitted pose, the distance to other peaks of the posterior included.
        possible: separate poses, the most probable first; empty if no other peaks were sought.
        agreeing: outliers that agree among themselves on another pose.
    """

    uncertainty: PoseCovariance
    possible: tuple[PossiblePose, ...] = ()
    agreeing: AgreeingOutliers | None = None


def find_alternatives(
    measurements: PairMeasurements,
    refined: ErrorsInVariablesFit,
    uncertainty: PoseCovariance,
    others: Sequence[GncSolution],
    *,
    seed: int,
) -> PoseAlternatives:
    """Find other peaks of the posterior, and outliers that agree.

    The posterior is that of the pose at the fitted systematic errors; these add to the covariance as they do without other peaks.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
        uncertainty: of its pose.
        others: the solutions of other starts.
        seed: of the random draws.
    """
    rng = np.random.default_rng(seed)
    corrected = measurements.with_errors(refined.measurements.errors.values)
    agreeing = find_agreeing_outliers(corrected, refined, rng=rng)
    enough = refined.inliers.sum() >= _CLEARLY_ENOUGH and refined.inliers.mean() >= _CLEARLY_AGREEING
    clear = enough and uncertainty.condition <= NARROW_CONDITION
    if clear or measurements.prior.measured or measurements.flat or len(measurements) > _MOST_PAIRS:
        return PoseAlternatives(uncertainty, agreeing=agreeing)
    alone = np.linalg.inv(uncertainty.information[:6, :6])
    peaks = posterior_peaks(corrected, refined, alone, [one.camera_from_radar for one in others], rng=rng)
    likely = peaks.of_at_least(_LEAST_PROBABILITY)
    beyond = _positive(likely.spread_about(refined.camera_from_radar) - alone)
    possible = tuple(
        PossiblePose(pose, share, _sigmas(pose.error_from(refined.camera_from_radar), uncertainty.covariance))
        for pose, share in zip(likely.poses.transforms(), likely.probabilities.tolist(), strict=True)
    )
    return PoseAlternatives(replace(uncertainty, covariance=uncertainty.covariance + beyond), possible, agreeing)


def _sigmas(error: Values, covariance: Matrix66) -> float:
    return float(np.sqrt(error @ np.linalg.solve(covariance, error)))


def _positive(covariance: Matrix66) -> Matrix66:
    """Return the nearest covariance without negative variances."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)
