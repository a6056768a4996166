"""Adaptive importance sampling: weighted samples of a density that is known up to a factor, from a mixture that learns.

Samples are drawn from a mixture of Student's t distributions, whose heavy tails keep the weights bounded, and weighted by
density over mixture. After each round the mixture is fitted to the weighted samples of all rounds (population Monte Carlo,
Cappe et al. 2008), which then share one mixture (Owen and Zhou 2000): early, badly placed samples do no harm.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import lgamma

import numpy as np

from calib_core.arrays import Values

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
        drawn = np.concatenate([drawn, np.stack([one.log_density(new) for one in mixtures[:-1]], axis=1)])
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
