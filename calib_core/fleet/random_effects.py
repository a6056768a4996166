"""The mean and the scatter of vectors that are each known with a covariance of their own: a random-effects model.

    y_k = mu + b_k + e_k,   b_k ~ N(0, S),   e_k ~ N(0, C_k),   k = 1 .. n;   C_k known, mu and S unknown.

The level of S is integrated out: over S_0 = diag(p^2 I, r^2 I), p of the positions and r of the rotations, with a flat prior on p
and r and the restricted likelihood of the data, on a grid; S_0 is its posterior mean. Its shape follows by EM: restricted
maximum likelihood with an inverse-Wishart prior that counts as `PRIOR_VECTORS` vectors scattered by S_0. Where the C_k hide
the scatter, S stays at S_0, which the flat prior keeps from collapsing to zero.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Values, frozen_array

__all__ = ["PRIOR_VECTORS", "RandomEffects", "random_effects"]

PRIOR_VECTORS = 8.0
"""Vectors that the prior on the shape of the scatter counts for."""

_NODES = 12
_PASSES = 3
_REACH = 5.0  # times the root mean square of the vectors
_NEGLIGIBLE = 1e-5
_LEAST_SPREAD = 1e-6  # m and rad: below what anything is mounted to
_ITERATIONS, _CONVERGED = 60, 1e-4
_BLOCKS = (slice(0, 3), slice(3, 6))


@dataclass(frozen=True, slots=True, eq=False)
class RandomEffects:
    """The estimated distribution.

    Attributes:
        mean: (6,).
        mean_covariance: (6, 6) of the mean.
        scatter: (6, 6) of the vectors about it.
        informative: how many exactly known vectors say as much about the scatter, 0 to n.
    """

    mean: Values
    mean_covariance: Matrix66
    scatter: Matrix66
    informative: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "mean", frozen_array(self.mean, (6,)))
        object.__setattr__(self, "mean_covariance", frozen_array(self.mean_covariance, (6, 6)))
        object.__setattr__(self, "scatter", frozen_array(self.scatter, (6, 6)))

    @property
    def covariance(self) -> Matrix66:
        """Covariance (6, 6) of a further vector about the estimated mean, if the scatter were exactly as estimated."""
        return np.asarray(self.scatter + self.mean_covariance)

    @property
    def freedom(self) -> float:
        """Degrees of freedom of the estimated scatter."""
        return PRIOR_VECTORS + max(self.informative - 1.0, 0.0)

    @property
    def whole(self) -> float:
        """How much of the shape comes from the data: 0 if all of it is the prior's, 5 (of `tails.quantile`) if none is."""
        return 5.0 * (self.informative / (self.informative + PRIOR_VECTORS)) ** 3


def random_effects(vectors: np.ndarray, covariances: np.ndarray) -> RandomEffects:
    """Estimate mean and scatter.

    Args:
        vectors: (n, 6) [m, rad], n at least 3; positions first.
        covariances: (n, 6, 6) of each.
    """
    level = np.repeat(_levels(vectors, covariances), 3)
    prior = np.diag(level)
    scatter, count = prior, len(vectors)
    for _ in range(_ITERATIONS):
        weights = np.linalg.inv(scatter + covariances)
        mean_covariance = np.linalg.inv(weights.sum(axis=0))
        residuals = vectors - mean_covariance @ np.einsum("nij,nj->i", weights, vectors)
        effects = np.einsum("ij,njk,nk->ni", scatter, weights, residuals)
        known = weights.sum(axis=0) - np.einsum("nij,jk,nkl->il", weights, mean_covariance, weights)
        squares = effects.T @ effects + count * scatter - scatter @ known @ scatter
        found = (PRIOR_VECTORS * prior + squares) / (count + PRIOR_VECTORS)
        found = (found + found.T) / 2.0
        step = np.abs((found - scatter) / np.sqrt(np.outer(level, level))).max()
        scatter = found
        if step < _CONVERGED:
            break
    weights = np.linalg.inv(scatter + covariances)
    mean_covariance = np.linalg.inv(weights.sum(axis=0))
    shares = scatter @ weights
    return RandomEffects(
        mean=mean_covariance @ np.einsum("nij,nj->i", weights, vectors),
        mean_covariance=(mean_covariance + mean_covariance.T) / 2.0,
        scatter=scatter,
        informative=float(np.einsum("nij,nji->", shares, shares)) / vectors.shape[1],
    )


def _levels(vectors: np.ndarray, covariances: np.ndarray) -> np.ndarray:
    """Return the posterior means (2,) of the variances per axis of position and rotation, by a grid that zooms in."""
    count = len(vectors)
    centred = vectors - vectors.mean(axis=0)
    spread = np.array([np.sqrt((centred[:, block] ** 2).mean() * count / (count - 1)) for block in _BLOCKS])
    low, high = np.zeros(2), _REACH * np.maximum(spread, _LEAST_SPREAD)
    for _ in range(_PASSES):
        steps = (high - low) / _NODES
        axes = low[:, None] + steps[:, None] * (np.arange(_NODES) + 0.5)
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        likelihood = _restricted_log_likelihood(centred, covariances, grid.reshape(-1, 2)).reshape(_NODES, _NODES)
        density = np.exp(likelihood - likelihood.max())
        for block in range(2):
            marginal = density.sum(axis=1 - block)
            kept = np.flatnonzero(marginal > _NEGLIGIBLE * marginal.max())
            low[block] = max(0.0, axes[block, kept[0]] - steps[block])
            high[block] = axes[block, kept[-1]] + steps[block]
    return np.asarray((density[..., None] * grid**2).sum(axis=(0, 1)) / density.sum())


def _restricted_log_likelihood(vectors: np.ndarray, covariances: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Return the log-likelihood (g,) of scatters with these levels (g, 2), the mean integrated out."""
    variances = np.repeat(levels**2, 3, axis=1)
    total = covariances + variances[:, None, :, None] * np.eye(6)
    weights = np.linalg.inv(total)
    information = weights.sum(axis=1)
    weighted = np.einsum("gnij,nj->gi", weights, vectors)
    means = np.linalg.solve(information, weighted[..., None])[..., 0]
    squared = np.einsum("ni,gnij,nj->g", vectors, weights, vectors, optimize=True) - (weighted * means).sum(axis=1)
    log_volume = np.linalg.slogdet(total)[1].sum(axis=1) + np.linalg.slogdet(information)[1]
    return np.asarray(-0.5 * (log_volume + squared))
