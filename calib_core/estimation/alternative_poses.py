"""Beyond the fit: the posterior away from the fitted peak, at the systematic errors that the fit found.

Agreeing outliers: pairs that were set aside, but agree among themselves on another pose.

Wrong pairs are wrong in different ways. If several agree, something stands where they say: a companion of the reflector such
as a cart, or a second reflector; or the pairs that were used are the wrong ones. Whether the agreement is more than chance is
told by the ratio of two probabilities of the outliers' pixels, with a common pose and without one. The first is integrated
over the pose by Laplace's method, from a prior in which all rotations are equally likely:

    log B = log p(pixels | pose, prior of the camera) - log(8 pi^2) + 3 log(2 pi) - log det(H) / 2.                     (7)

Outliers without a common pose reach a ratio of B in at most one of B sets.

Posterior summary: the pose and the 95 % ellipsoid of posterior samples, and the other poses that are possible.

The fit and its covariance stand as long as their ellipsoid holds its share of the posterior and the mean is near the fit. If
not, the mean of the samples is the pose: of all estimates it has the smallest expected squared error.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Matrix66, Values
from calib_core.estimation.covariance import PoseCovariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import GncSolution, solve_gnc
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.estimation.pose_posterior import batch_of, pose_posterior
from calib_core.estimation.posterior_samples import (
    Modes,
    PosteriorSamples,
    WeightedSamples,
    refine_poses,
    sample_posterior,
)
from calib_core.geometry import RigidTransform

_LEAST_INSIDE = 0.91  # of the posterior inside an ellipsoid that is stated to hold 0.95; the samples tell it to 0.01
_LARGEST_SHIFT = 0.5  # squared distance of the mean from the fit, in standard deviations
_BULK = 0.99  # of the samples that shape the ellipsoid; the farthest would stretch it
_LEAST_EFFECTIVE = 60.0
_LEAST_PROBABILITY = 0.02
_BARRIER = 4.0  # by how much the costs rise between two peaks
_BETWEEN = np.linspace(0.0, 1.0, 9)[:, None]


@dataclass(frozen=True, slots=True, eq=False)
class PosteriorSummary:
    """The answer of the samples, and whether the local one stands.

    Attributes:
        local_holds: whether the stated pose and ellipsoid describe the posterior; with too few samples they are what is returned.
        camera_from_radar: the mean pose.
        covariance: (6, 6) about it, of the nearest 99 %.
        quantile: the factor on the covariance that gives the 95 % ellipsoid.
        inside: share of the posterior inside the stated ellipsoid.
        effective: effective number of samples.
    """

    local_holds: bool
    camera_from_radar: RigidTransform
    covariance: Matrix66
    quantile: float
    inside: float
    effective: float


def summarize_posterior(
    drawn: PosteriorSamples,
    stated: RigidTransform,
    covariance: Matrix66,
    quantile: float,
    *,
    shared: Matrix66 | None = None,
    rng: "np.random.Generator",
) -> PosteriorSummary:
    """Compare samples with a stated pose and ellipsoid, and describe them by a pose and an ellipsoid of their own.

    Args:
        drawn: the samples.
        stated: the pose of the local answer.
        covariance: (6, 6) of it.
        quantile: of its 95 % ellipsoid.
        shared: (6, 6) the part of that covariance from errors that the samples do not contain, such as those that all pairs
            share; each sample is moved by a draw from it.
        rng: random generator of these draws.
    """
    weights, mean = drawn.samples.weights, drawn.mean()
    moves = np.zeros((len(weights), 6)) if shared is None else _draws(shared, len(weights), rng)
    squared = _squared(drawn.errors_from(stated) + moves, covariance)
    inside = float(weights @ (squared <= quantile))
    effective = drawn.samples.effective
    if effective < _LEAST_EFFECTIVE:  # too few to shape an ellipsoid: that of a single one has no volume
        return PosteriorSummary(True, stated, covariance, quantile, inside, effective)
    shift = _squared(mean.error_from(stated)[None], covariance)[0]
    errors = drawn.errors_from(mean) + moves
    bulk = _covariance(errors, weights)
    distances = _squared(errors, bulk)
    near = np.where(distances <= _quantile(distances, weights, _BULK), weights, 0.0)
    bulk = _covariance(errors, near / near.sum())
    return PosteriorSummary(
        local_holds=bool(inside >= _LEAST_INSIDE and shift <= _LARGEST_SHIFT),
        camera_from_radar=mean,
        covariance=bulk,
        quantile=_quantile(_squared(errors, bulk), weights, 0.95),
        inside=inside,
        effective=effective,
    )


def _draws(covariance: Matrix66, count: int, rng: "np.random.Generator") -> np.ndarray:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(rng.standard_normal((count, 6)) * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)


def _covariance(errors: np.ndarray, weights: Values) -> Matrix66:
    return np.asarray((errors * weights[:, None]).T @ errors)


def _squared(errors: np.ndarray, covariance: Matrix66) -> Values:
    """Return squared Mahalanobis distances (s,)."""
    return np.asarray((errors * np.linalg.solve(covariance, errors.T).T).sum(axis=1))


def _quantile(values: Values, weights: Values, share: float) -> float:
    order = np.argsort(values)
    reached = int(np.searchsorted(np.cumsum(weights[order]), share))
    return float(values[order[min(reached, len(order) - 1)]])


@dataclass(frozen=True, slots=True, eq=False)
class PossiblePose:
    """A peak of the posterior that is separate from the others.

    Attributes:
        camera_from_radar: its pose.
        probability: its share of the posterior.
    """

    camera_from_radar: RigidTransform
    probability: float


def possible_poses(drawn: PosteriorSamples) -> tuple[PossiblePose, ...]:
    """Return the separate peaks of the posterior, the most probable first.

    Two components of the fitted mixture belong to one peak if the posterior does not fall between them.
    """
    mixture = drawn.samples.mixture
    order = np.argsort(-mixture.weights, kind="stable")
    centres, weights = mixture.centres[order], _owned(drawn.samples)[order]
    first: list[int] = []
    shares: list[float] = []
    for k in range(len(centres)):
        joined = [_barrier(drawn, centres[k], centres[j]) < _BARRIER for j in first]
        if any(joined):
            shares[joined.index(True)] += float(weights[k])
        else:
            first.append(k)
            shares.append(float(weights[k]))
    poses = [
        PossiblePose(drawn.posterior.poses(centres[k][None]).transform(0), share)
        for k, share in zip(first, shares, strict=True)
        if share >= _LEAST_PROBABILITY
    ]
    return tuple(sorted(poses, key=lambda pose: -pose.probability))


def _owned(samples: WeightedSamples) -> Values:
    """Return the share (k,) of the posterior that each component of the mixture explains."""
    each = samples.mixture.log_densities(samples.states)
    owned = np.exp(each - np.logaddexp.reduce(each, axis=1)[:, None])
    return np.asarray(samples.weights @ owned)


def _barrier(drawn: PosteriorSamples, start: Values, end: Values) -> float:
    """Return by how much the costs on the straight way between two states exceed those of the worse end."""
    costs = drawn.posterior.costs(start + _BETWEEN * (end - start))
    return float(costs.max() - max(costs[0], costs[-1]))


_LEAST_PAIRS = 4  # three always agree
_LEAST_LOG_RATIO = float(np.log(100.0))
_STARTS = 12
_ROUNDS = 15
_SHARE = 0.5  # of the outliers that may belong to the group
_MOST_OUTLIERS = 150


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
    if not _LEAST_PAIRS <= len(outliers) <= _MOST_OUTLIERS:
        return None
    # a companion's camera may be anywhere
    free = replace(measurements, prior=measurements.prior.weakened()).some(outliers)
    starts = _starts(free, refined.camera_from_radar, rng)
    used = np.ones((len(starts), len(free)), dtype=bool)
    posterior = pose_posterior(free, refined.camera_from_radar, np.zeros(3))
    as_assumed = np.zeros((len(starts), 4))
    modes = refine_poses(posterior, batch_of(starts), as_assumed, share=_SHARE, used=used, rounds=_ROUNDS)
    agree = modes.inlier > 0.5
    ratios = np.where(agree.sum(axis=1) >= _LEAST_PAIRS, _log_ratios(modes, free.prior.sigma_m), -np.inf)
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


def _starts(
    outliers: PairMeasurements, fitted: RigidTransform, rng: "np.random.Generator"
) -> tuple[RigidTransform, ...]:
    """Return hypotheses from few pairs, as drawn and refined, and the fit: a companion's pose is often near it."""
    drawn = initial_poses(outliers, most=_STARTS, rng=rng)
    return (fitted, *drawn, *(one.camera_from_radar for one in solve_gnc(outliers, drawn, estimate_scale=False)))


def _log_ratios(modes: Modes, sigma_m: float) -> Values:
    """Return equation (7) of each mode; the camera prior's density is 1 / (pi^2 sigma^3) at its centre."""
    prior = -np.log(8.0 * np.pi**2) - np.log(np.pi**2 * sigma_m**3)
    return np.asarray(modes.evidence + prior + 3.0 * np.log(2.0 * np.pi) - 0.5 * np.linalg.slogdet(modes.hessians)[1])


_MOST_PAIRS = 150  # in larger sets the posterior has one peak, and samples cost seconds
_CLEARLY_ENOUGH, _CLEARLY_AGREEING = 12, 0.75  # inliers, and their share, beyond which samples never changed an answer

NARROW_CONDITION = 5e5
"""The scaled condition number above which the placements lie in too narrow a strip."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseAlternatives:
    """What the fit and its covariance do not show.

    Attributes:
        refined: the fit, at the mean of the posterior where the peak does not describe it.
        uncertainty: of its pose, from the samples where the local one does not hold.
        possible: separate poses, the most probable first; empty if the posterior was not sampled.
        agreeing: outliers that agree among themselves on another pose.
    """

    refined: ErrorsInVariablesFit
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
    """Sample the posterior, and find outliers that agree.

    The posterior is that of the pose at the fitted systematic errors; what these add to the covariance is added to each sample.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
        uncertainty: of its pose.
        others: the solutions of other starts.
        seed: of the random draws.
    """
    rng = np.random.default_rng(seed)
    corrected = measurements.with_errors(refined.measurements.errors.values)
    beyond = PoseAlternatives(refined, uncertainty, agreeing=find_agreeing_outliers(corrected, refined, rng=rng))
    enough = refined.inliers.sum() >= _CLEARLY_ENOUGH and refined.inliers.mean() >= _CLEARLY_AGREEING
    clear = enough and uncertainty.condition <= NARROW_CONDITION
    if clear or measurements.prior.measured or measurements.flat or len(measurements) > _MOST_PAIRS:
        return beyond
    alone = np.linalg.inv(uncertainty.information[:6, :6])
    poses = [solution.camera_from_radar for solution in others]
    drawn = sample_posterior(corrected, refined, alone, poses, rng=rng)
    shared = _positive(uncertainty.covariance - alone)
    summary = summarize_posterior(
        drawn, refined.camera_from_radar, uncertainty.covariance, uncertainty.quantile, shared=shared, rng=rng
    )
    beyond = replace(beyond, possible=possible_poses(drawn))
    if summary.local_holds:
        return beyond
    return replace(
        beyond,
        refined=replace(refined, camera_from_radar=summary.camera_from_radar),
        uncertainty=replace(uncertainty, covariance=summary.covariance, quantile=summary.quantile),
    )


def _positive(covariance: Matrix66) -> Matrix66:
    """Return the nearest covariance without negative variances."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)
