"""Posterior summary: the pose and the 95 % ellipsoid of posterior samples, and the other poses that are possible.

The fit and its covariance stand as long as their ellipsoid holds its share of the posterior and the mean is near the fit. If
not, the mean of the samples is the pose: of all estimates it has the smallest expected squared error.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Values
from calib_core.estimation.posterior.importance_sampling import WeightedSamples
from calib_core.estimation.posterior.samples import PosteriorSamples
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
        local_holds: whether the stated pose and ellipsoid describe the posterior.
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
    shift = _squared(mean.error_from(stated)[None], covariance)[0]
    errors = drawn.errors_from(mean) + moves
    bulk = _covariance(errors, weights)
    distances = _squared(errors, bulk)
    near = np.where(distances <= _quantile(distances, weights, _BULK), weights, 0.0)
    bulk = _covariance(errors, near / near.sum())
    effective = drawn.samples.effective
    return PosteriorSummary(
        local_holds=bool(effective < _LEAST_EFFECTIVE or (inside >= _LEAST_INSIDE and shift <= _LARGEST_SHIFT)),
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
    found = [
        PossiblePose(drawn.posterior.poses(centres[k][None]).transform(0), share)
        for k, share in zip(first, shares, strict=True)
        if share >= _LEAST_PROBABILITY
    ]
    return tuple(sorted(found, key=lambda one: -one.probability))


def _owned(samples: WeightedSamples) -> Values:
    """Return the share (k,) of the posterior that each component of the mixture explains."""
    each = samples.mixture.log_densities(samples.states)
    owned = np.exp(each - np.logaddexp.reduce(each, axis=1)[:, None])
    return np.asarray(samples.weights @ owned)


def _barrier(drawn: PosteriorSamples, start: Values, end: Values) -> float:
    """Return by how much the costs on the straight way between two states exceed those of the worse end."""
    costs = drawn.posterior.costs(start + _BETWEEN * (end - start))
    return float(costs.max() - max(costs[0], costs[-1]))
