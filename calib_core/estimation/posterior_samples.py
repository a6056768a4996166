"""Posterior samples: pose, covariance and 95 % ellipsoid where the local covariance does not describe the posterior.

Samples are drawn about the fit, about poses that other starts end in, and about the poses without each pair in turn. If the
stated ellipsoid holds its share of the posterior, nothing is changed.

Modes of the posterior: poses that many pairs agree on, each refined with inlier probabilities of its own.

All poses are refined together as one batch, and each may use another set of pairs: without one pair in turn, or only some.

Adaptive importance sampling: weighted samples of a density that is known up to a factor, from a mixture that learns.

Samples are drawn from a mixture of Student's t distributions, whose heavy tails keep the weights bounded, and weighted by
density over mixture. After each round the mixture is fitted to the weighted samples of all rounds (population Monte Carlo,
Cappe et al. 2008), which then share one mixture (Owen and Zhou 2000): early, badly placed samples do no harm.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import lgamma

import numpy as np

from calib_core.arrays import Flags, Matrix66, Values, Vector3
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.estimation.pose_posterior import (
    NEAR_OUTLIER_FACTOR,
    PairTerms,
    PosePosterior,
    Poses,
    batch_of,
    joined_poses,
    pose_posterior,
)
from calib_core.geometry import RigidTransform, rotation_log
from calib_core.radar import cartesian_from_polar

_DEGREES = 5.0  # of Student's t
_LEAST_PER_DIMENSION = 4.0  # effective samples to learn from; weights are flattened until there are as many
_LEAST_WEIGHT = 0.05  # of all components together, shared equally, so that none is ever forgotten
_LARGEST_RATIO_KEPT = 1e-300


@dataclass(frozen=True, slots=True, eq=False)
class Mixture:
    """Student's t distributions in d dimensions.

    Attributes:
        weights: (k,) adding up to 1.
        centres: (k, d).
        spreads: (k, d, d) scale matrices.
    """

    weights: Values
    centres: np.ndarray
    spreads: np.ndarray

    def draw(self, count: int, rng: "np.random.Generator") -> np.ndarray:
        """Draw samples (count, d), from each component as many as its weight says."""
        which = np.searchsorted(np.cumsum(self.weights), (np.arange(count) + rng.random()) / count * (1.0 - 1e-12))
        which = np.minimum(which, len(self.weights) - 1)
        normal = rng.standard_normal((count, self.centres.shape[1]))
        roots = np.linalg.cholesky(self.spreads)
        wide = np.sqrt(_DEGREES / rng.chisquare(_DEGREES, count))
        return np.asarray(self.centres[which] + (roots[which] @ normal[:, :, None])[:, :, 0] * wide[:, None])

    def log_densities(self, samples: np.ndarray) -> np.ndarray:
        """Return log weight plus log density (s, k) of each component at each sample."""
        dimensions = samples.shape[1]
        roots = np.linalg.cholesky(self.spreads)
        inverse = np.linalg.inv(roots)
        whitened = (samples[None] - self.centres[:, None]) @ np.swapaxes(inverse, 1, 2)
        squared = (whitened**2).sum(axis=2).T
        volume = np.log(np.diagonal(roots, axis1=1, axis2=2)).sum(axis=1)
        half = 0.5 * (_DEGREES + dimensions)
        constant = lgamma(half) - lgamma(0.5 * _DEGREES) - 0.5 * dimensions * np.log(_DEGREES * np.pi)
        return np.asarray(constant + np.log(self.weights) - volume - half * np.log1p(squared / _DEGREES))

    def log_density(self, samples: np.ndarray) -> Values:
        """Return the log density (s,) of the mixture."""
        return np.asarray(np.logaddexp.reduce(self.log_densities(samples), axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class WeightedSamples:
    """Samples of a density.

    Attributes:
        states: (s, d).
        weights: (s,) adding up to 1.
        costs: (s,) twice the negative log density.
        mixture: fitted to the samples.
    """

    states: np.ndarray
    weights: Values
    costs: Values
    mixture: Mixture

    @property
    def effective(self) -> float:
        """The effective sample size: 1 over the sum of the squared weights."""
        return _effective(self.weights)


def importance_samples(
    costs: Callable[[np.ndarray], Values],
    start: Mixture,
    *,
    per_round: int,
    rounds: tuple[int, int],
    enough: float,
    rng: "np.random.Generator",
) -> WeightedSamples:
    """Sample the density exp(-costs / 2).

    Args:
        costs: of states (s, d), up to a constant.
        start: the first mixture: a component for each known peak.
        per_round: samples in each round.
        rounds: the smallest and the largest number.
        enough: effective samples at which to stop.
        rng: random generator.
    """
    mixtures = [start]
    states = start.draw(per_round, rng)
    found, drawn = costs(states), start.log_density(states)[:, None]
    log_weights = -0.5 * found - drawn[:, 0]
    for round_ in range(1, rounds[1]):
        if round_ >= rounds[0] and _effective(_normalised(log_weights)) >= enough:
            break
        mixtures.append(_fitted(mixtures[-1], states, log_weights))
        new = mixtures[-1].draw(per_round, rng)
        drawn = np.concatenate([drawn, np.stack([mixture.log_density(new) for mixture in mixtures[:-1]], axis=1)])
        states, found = np.concatenate([states, new]), np.concatenate([found, costs(new)])
        drawn = np.concatenate([drawn, mixtures[-1].log_density(states)[:, None]], axis=1)
        log_weights = -0.5 * found - np.logaddexp.reduce(drawn, axis=1)
    return WeightedSamples(states, _normalised(log_weights), found, _fitted(mixtures[-1], states, log_weights))


def _effective(weights: Values) -> float:
    return float(1.0 / (weights**2).sum())


def _normalised(log_weights: Values) -> Values:
    weights = np.exp(log_weights - log_weights.max())
    return np.asarray(weights / weights.sum())


def _flattened(log_weights: Values, least: float) -> Values:
    """Raise the weights to the largest power up to 1 that leaves enough effective samples."""
    low, high = 0.0, 1.0
    weights = _normalised(log_weights)
    if _effective(weights) >= least:
        return weights
    for _ in range(12):
        power = 0.5 * (low + high)
        weights = _normalised(power * log_weights)
        low, high = (power, high) if _effective(weights) >= least else (low, power)
    return _normalised(low * log_weights)


def _fitted(mixture: Mixture, states: np.ndarray, log_weights: Values) -> Mixture:
    """Fit the mixture to weighted samples by one step of expectation-maximisation, held back where few samples count."""
    count, dimensions = mixture.centres.shape
    weights = _flattened(log_weights, _LEAST_PER_DIMENSION * dimensions)
    each = mixture.log_densities(states)
    owned = np.exp(each - np.logaddexp.reduce(each, axis=1)[:, None]) * weights[:, None]
    total = np.maximum(owned.sum(axis=0), _LARGEST_RATIO_KEPT)
    effective = total**2 / np.maximum((owned**2).sum(axis=0), _LARGEST_RATIO_KEPT)
    trust = (effective / (effective + dimensions))[:, None]
    means = (owned.T @ states) / total[:, None]
    apart = states[None] - means[:, None]
    spreads = np.swapaxes(apart * (owned.T / total[:, None])[:, :, None], 1, 2) @ apart
    spreads = trust[:, :, None] * spreads + (1.0 - trust[:, :, None]) * mixture.spreads
    shares = (1.0 - _LEAST_WEIGHT) * total / total.sum() + _LEAST_WEIGHT / count
    return Mixture(shares / shares.sum(), trust * means + (1.0 - trust) * mixture.centres, spreads)


MOST_ROWS = 300
"""Candidate rows up to which samples take a fraction of a second; of more pairs, the local covariance describes the posterior."""

_PER_ROUND, _ROUNDS = 500, (3, 10)
_ENOUGH = 600.0  # effective samples: the share inside the 95 % ellipsoid is then known to 0.9 %
_WIDER = 1.2  # factor on the covariance of a peak to start from
_EVENING = 0.25  # power of the peaks' probabilities
_UNLIKELY = 25.0  # a peak less likely than the best by this log factor is not sampled
_HYPOTHESES, _REFINED_HYPOTHESES = 80, 16
_MOST_PEAKS = 8
_SAME = 4.0  # squared distance, in standard deviations
_REFINING_ROUNDS = 8
_LEAST_DEGREES = 3.0  # of each noise scale
_SINGULAR, _LEAST_INFORMATION = 1e-12, 1e-12
"""The smallest eigenvalue of a Hessian with a unit diagonal that is more than rounding, and the least entry of a diagonal."""


@dataclass(frozen=True, slots=True, eq=False)
class PosteriorSamples:
    """Weighted poses.

    Attributes:
        posterior: the density that they were drawn from.
        samples: its states, with weights.
    """

    posterior: PosePosterior
    samples: WeightedSamples

    def mean(self) -> RigidTransform:
        """Return the mean pose."""
        state = self.samples.weights @ self.samples.states[:, :6]
        return self.posterior.poses(state[None]).transform(0)

    def errors_from(self, camera_from_radar: RigidTransform) -> np.ndarray:
        """Return the errors (s, 6) of a pose, (dt, dtheta) [m, rad], if each sample in turn is the truth."""
        states = self.samples.states
        turned = rotation_log(camera_from_radar.rotation @ self.posterior.reference.rotation.T)
        shifts_m = self.posterior.poses(states).translations_m - camera_from_radar.translation_m
        return np.concatenate([shifts_m, _differences(states[:, 3:6], turned)], axis=1)


def sample_posterior(
    measurements: PairMeasurements,
    refined: ErrorsInVariablesFit,
    covariance: Matrix66,
    others: Sequence[RigidTransform],
    *,
    rng: "np.random.Generator",
) -> PosteriorSamples:
    """Draw weighted samples of pose and noise level.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
        covariance: (6, 6) of its pose.
        others: other poses to look at, such as those that other starts end in.
        rng: random generator.
    """
    points_m = cartesian_from_polar(measurements.polar[refined.rows])
    pivot_m = refined.weights @ points_m / refined.weights.sum()
    posterior = pose_posterior(measurements, refined.camera_from_radar, pivot_m)
    others = (*others, *_hypotheses(posterior, rng))
    peaks = _likeliest(posterior, _peaks(posterior, refined, covariance, others))
    posterior = posterior.about(peaks.poses.transform(0))
    start = _mixture(posterior, peaks, refined.degrees_of_freedom)
    samples = importance_samples(posterior.costs, start, per_round=_PER_ROUND, rounds=_ROUNDS, enough=_ENOUGH, rng=rng)
    return PosteriorSamples(posterior, samples)


def _hypotheses(posterior: PosePosterior, rng: "np.random.Generator") -> tuple[RigidTransform, ...]:
    """Draw poses from few pairs each, and keep the most likely."""
    drawn = initial_poses(posterior.measurements, most=_HYPOTHESES, rng=rng)
    if not drawn:
        return ()
    costs = posterior.pose_costs(batch_of(drawn), np.zeros((len(drawn), 4)))
    return tuple(drawn[k] for k in np.argsort(costs, kind="stable")[:_REFINED_HYPOTHESES])


def _differences(rotation_vectors: np.ndarray, subtracted: Vector3) -> np.ndarray:
    """Return the rotation vectors (s, 3) of Exp(v) Exp(u)^T, by quaternions, which keep their precision near a half turn."""
    w, xyz = _quaternions(rotation_vectors)
    w0, xyz0 = _quaternions(subtracted[None])
    real = w * w0 + (xyz * xyz0).sum(axis=1)
    imaginary = xyz * w0[:, None] - w[:, None] * xyz0 - np.cross(xyz, xyz0)
    imaginary = np.where(real[:, None] < 0.0, -imaginary, imaginary)
    sine = np.linalg.norm(imaginary, axis=1)
    factor = np.where(sine > 1e-9, 2.0 * np.arctan2(sine, np.abs(real)) / np.maximum(sine, 1e-9), 2.0)
    return np.asarray(imaginary * factor[:, None])


def _quaternions(rotation_vectors: np.ndarray) -> tuple[Values, np.ndarray]:
    """Return the real part (s,) and the imaginary parts (s, 3)."""
    half = 0.5 * np.linalg.norm(rotation_vectors, axis=1)
    return np.cos(half), 0.5 * np.sinc(half / np.pi)[:, None] * rotation_vectors


@dataclass(frozen=True, slots=True, eq=False)
class _Peaks:
    """Where to look.

    Attributes:
        poses: k of them.
        covariances: (k, 6, 6) of (dt, dtheta); zeros where there is no peak.
        log_scales: (k, 4) of the noise; (k, 0) if it is known.
    """

    poses: Poses
    covariances: np.ndarray
    log_scales: np.ndarray

    def some(self, which: list[int]) -> "_Peaks":
        return _Peaks(self.poses.some(np.array(which)), self.covariances[which], self.log_scales[which])


def _peaks(
    posterior: PosePosterior,
    refined: ErrorsInVariablesFit,
    covariance: Matrix66,
    others: Sequence[RigidTransform],
) -> _Peaks:
    """Return the fit, and refined: the other solutions, and the fit without each pair in turn, the other pairs judged anew.

    The other solutions are refined at the fit's noise level and at the assumed one: a wrong fit has a wrong noise level.
    """
    inliers = np.flatnonzero(refined.inliers)
    others = [refined.camera_from_radar, *others]
    starts = batch_of([*others, *[refined.camera_from_radar] * len(inliers), *others])
    log_scales = np.zeros((len(starts), 4))
    log_scales[: -len(others)] = np.log(refined.noise_scale)
    used = np.ones((len(starts), len(posterior.measurements)), dtype=bool)
    used[len(others) + np.arange(len(inliers)), inliers] = False
    modes = refine_poses(posterior, starts, log_scales, share=refined.inlier_share, used=used, rounds=_REFINING_ROUNDS)
    log_scales = np.concatenate([log_scales[:1], log_scales])
    return _Peaks(
        joined_poses([batch_of(others[:1]), modes.poses]),
        np.concatenate([covariance[None], _covariances(modes.hessians)]),
        log_scales if refined.degrees_of_freedom > 0 else log_scales[:, :0],
    )


def _covariances(hessians: np.ndarray) -> np.ndarray:
    """Return the inverses (k, 6, 6) of Hessians; zeros for one that is singular to rounding: no peak is there."""
    scale = np.sqrt(np.maximum(np.diagonal(hessians, axis1=1, axis2=2), _LEAST_INFORMATION))
    scaled = hessians / (scale[:, :, None] * scale[:, None, :])
    values, vectors = np.linalg.eigh(scaled)
    peaked = values[:, 0] > _SINGULAR
    inverse = (vectors / np.where(peaked[:, None], values, 1.0)[:, None, :]) @ vectors.swapaxes(1, 2)
    return np.where(peaked[:, None, None], inverse / (scale[:, :, None] * scale[:, None, :]), 0.0)


def _likeliest(posterior: PosePosterior, peaks: _Peaks) -> _Peaks:
    """Keep the few peaks that hold most of the posterior and differ from one another, the largest first."""
    log_volumes = 0.5 * np.linalg.slogdet(peaks.covariances)[1]
    costs = posterior.pose_costs(peaks.poses, peaks.log_scales)
    likely = np.where(np.isfinite(costs), log_volumes - 0.5 * costs, -np.inf)
    kept: list[int] = []
    for k in np.argsort(-likely, kind="stable").tolist():
        if likely[k] < likely.max() - _UNLIKELY or len(kept) == _MOST_PEAKS:
            break
        pose = peaks.poses.transform(k)
        errors = [pose.error_from(peaks.poses.transform(j)) for j in kept]
        apart = [
            float(error @ np.linalg.solve(peaks.covariances[j], error)) for j, error in zip(kept, errors, strict=True)
        ]
        if not any(one < _SAME for one in apart):
            kept.append(k)
    return peaks.some(kept)


def _mixture(posterior: PosePosterior, peaks: _Peaks, degrees_of_freedom: float) -> Mixture:
    """Return a mixture with a component for each peak; the less likely ones get more than their share."""
    poses = [peaks.poses.transform(k) for k in range(len(peaks.poses))]
    jacobians = np.array([posterior.state_jacobian(pose) for pose in poses])
    states = np.concatenate([[posterior.state_of(pose) for pose in poses], peaks.log_scales], axis=1)
    spreads = np.zeros((len(poses), states.shape[1], states.shape[1]))
    spreads[:, :6, :6] = _WIDER * jacobians @ peaks.covariances @ np.swapaxes(jacobians, 1, 2)
    scales = range(6, states.shape[1])
    spreads[:, scales, scales] = 1.0 / (2.0 * max(degrees_of_freedom / 4.0, _LEAST_DEGREES))
    likely = 0.5 * np.linalg.slogdet(spreads)[1] - 0.5 * posterior.costs(states)
    weights = np.exp(_EVENING * (likely - likely.max()))
    return Mixture(weights / weights.sum(), states, spreads)


_LARGEST_TURN_RAD, _LARGEST_SHIFT_M = 0.3, 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """Refined poses.

    Attributes:
        poses: k of them.
        hessians: (k, 6, 6) Gauss-Newton Hessians, camera prior included.
        inlier: (k, n) probability that each pair is an inlier, whether or not it was used.
        evidence: (k,) log likelihood of the pairs that were used, relative to all being outliers, camera prior included.
    """

    poses: Poses
    hessians: np.ndarray
    inlier: np.ndarray
    evidence: Values


def refine_poses(
    posterior: PosePosterior,
    poses: Poses,
    log_scales: np.ndarray,
    *,
    share: float,
    used: Flags | None = None,
    rounds: int,
) -> Modes:
    """Refine poses at given noise levels by expectation-maximisation, with one Gauss-Newton step per round.

    Args:
        posterior: of the pairs.
        poses: where to start, k of them.
        log_scales: (k, 4) logarithm of the noise over the assumed one.
        share: of inliers, before any pair is looked at.
        used: (k, n) the pairs that count for each pose; None uses all.
        rounds: number of steps.
    """
    counts = np.ones((len(poses), len(posterior.measurements)), dtype=bool) if used is None else used
    for _ in range(rounds):
        terms = posterior.pair_terms(poses, log_scales)
        hessians, gradients = _normal_equations(posterior, poses, terms, share, counts)
        poses = poses.perturbed(_steps(hessians, gradients))
    terms = posterior.pair_terms(poses, log_scales)
    hessians, _ = _normal_equations(posterior, poses, terms, share, counts)
    mixed = np.log1p(share * np.expm1(np.minimum(terms.pair, 500.0)))
    evidence = np.where(counts, mixed, 0.0).sum(axis=1) - 0.5 * posterior.prior_costs(poses)
    return Modes(poses, hessians, 1.0 - terms.outlier_probabilities(share), evidence)


def _normal_equations(
    posterior: PosePosterior, poses: Poses, terms: PairTerms, share: float, counts: Flags
) -> tuple[np.ndarray, np.ndarray]:
    """Return Hessians (k, 6, 6) and right-hand sides (k, 6), every candidate row weighted by its probability."""
    outlier = terms.outlier_probabilities(share) / (1.0 - share) * share * counts
    per_row = outlier if posterior.measurements.one_to_one else outlier[:, posterior.measurements.owner]
    kinds = np.exp(np.minimum(terms.inlier, 500.0)) + np.exp(np.minimum(terms.near, 500.0)) / NEAR_OUTLIER_FACTOR**2
    rows = terms.whitened() * np.sqrt(per_row * kinds)[:, None, None, :]
    rows = rows.reshape(*rows.shape[:2], -1)
    product = rows @ np.swapaxes(rows, 1, 2)
    prior_hessians, prior_gradients = posterior.prior_information(poses)
    return product[:, 1:, 1:] + prior_hessians, product[:, 1:, 0] + prior_gradients


def _steps(hessians: np.ndarray, gradients: np.ndarray) -> np.ndarray:
    """Solve for steps (k, 6) of limited length, slightly damped."""
    scale = np.sqrt(np.maximum(np.diagonal(hessians, axis1=1, axis2=2), 1e-12))
    scaled = hessians / (scale[:, :, None] * scale[:, None, :]) + 1e-9 * np.eye(6)
    steps = np.linalg.solve(scaled, (gradients / scale)[:, :, None])[:, :, 0] / scale
    turns, shifts = np.linalg.norm(steps[:, 3:], axis=1), np.linalg.norm(steps[:, :3], axis=1)
    longest = np.maximum(np.maximum(turns / _LARGEST_TURN_RAD, shifts / _LARGEST_SHIFT_M), 1.0)
    return np.asarray(steps / longest[:, None])
