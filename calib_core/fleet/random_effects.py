"""The mean and the scatter of vectors that are each known with a covariance of their own: a random-effects model.

    y_k = mu + b_k + e_k,   b_k ~ N(0, S),   e_k ~ N(0, N_k + q T_k),   k = 1 .. n;
    N_k and T_k known, mu, S and q unknown, 0 < q <= 1.

N_k was estimated from data. T_k rests on what somebody stated of the errors of instruments, such as "1 cm", which is an upper
limit rather than a measurement: q is how much of that variance there is. If q were taken for 1, vectors whose errors are
smaller than stated would show too little scatter.

The level of S is integrated out, and q with it: over S_0 = diag(p^2 I, r^2 I), p of the positions and r of the rotations, with a
flat prior on p, r and the root of q and the restricted likelihood of the data, on a grid; S_0 is its posterior mean. Its shape
follows by EM: restricted maximum likelihood with an inverse-Wishart prior that counts as `PRIOR_VECTORS` vectors scattered by
S_0, q at its posterior mean. Where the errors hide the scatter, S stays at S_0, which the flat prior keeps from collapsing to
zero.

"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Values, frozen_array

PRIOR_VECTORS = 8.0
"""Vectors that the prior on the shape of the scatter counts for."""

_NODES, _PARTS = 12, 4
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
        of_stated: how much of the stated variances there is, 0 to 1: the posterior mean; 1 if nothing was stated.
    """

    mean: Values
    mean_covariance: Matrix66
    scatter: Matrix66
    informative: float
    of_stated: float = 1.0

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


def random_effects(vectors: np.ndarray, covariances: np.ndarray, stated: np.ndarray | None = None) -> RandomEffects:
    """Estimate mean and scatter.

    Args:
        vectors: (n, 6) [m, rad], n at least 3; positions first.
        covariances: (n, 6, 6) of each.
        stated: (n, 6, 6) what of it is an upper limit that somebody stated; None if nothing is.
    """
    levels = _levels(vectors, covariances, np.zeros((1, 6, 6)) if stated is None else stated)
    if stated is not None:
        covariances = covariances - (1.0 - levels.of_stated) * stated
    level = np.repeat(levels.variances, 3)
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
        of_stated=levels.of_stated,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Levels:
    """What the data say of the level.

    Attributes:
        variances: (2,) per axis of position and rotation, posterior means.
        of_stated: how much of the stated variances there is, posterior mean.
    """

    variances: np.ndarray
    of_stated: float


def _levels(vectors: np.ndarray, covariances: np.ndarray, stated: np.ndarray) -> _Levels:
    """Integrate over the level and the part of the stated variances by a grid that zooms in on the level."""
    count = len(vectors)
    parts = ((np.arange(_PARTS) + 0.5) / _PARTS) ** 2 if stated.any() else np.ones(1)
    centred = vectors - vectors.mean(axis=0)
    spread = np.array([np.sqrt((centred[:, block] ** 2).mean() * count / (count - 1)) for block in _BLOCKS])
    low, high = np.zeros(2), _REACH * np.maximum(spread, _LEAST_SPREAD)
    for _ in range(_PASSES):
        steps = (high - low) / _NODES
        axes = low[:, None] + steps[:, None] * (np.arange(_NODES) + 0.5)
        grid = np.stack(np.meshgrid(*axes, parts, indexing="ij"), axis=-1)
        likelihood = _log_likelihood(centred, covariances, stated, grid.reshape(-1, 3)).reshape(grid.shape[:3])
        density = np.exp(likelihood - likelihood.max())
        for block in range(2):
            marginal = density.sum(axis=(1 - block, 2))
            kept = np.flatnonzero(marginal > _NEGLIGIBLE * marginal.max())
            low[block] = max(0.0, axes[block, kept[0]] - steps[block])
            high[block] = axes[block, kept[-1]] + steps[block]
    density /= density.sum()
    return _Levels(
        variances=(density[..., None] * grid[..., :2] ** 2).sum(axis=(0, 1, 2)),
        of_stated=float((density * grid[..., 2]).sum()),
    )


def _log_likelihood(vectors: np.ndarray, covariances: np.ndarray, stated: np.ndarray, levels: np.ndarray) -> Values:
    """Return what the data say (g,) of levels (g, 3), with the mean integrated out.

    Args:
        vectors: (n, 6).
        covariances: (n, 6, 6) of each.
        stated: (n, 6, 6) what of it is an upper limit.
        levels: (g, 3) standard deviations of position and rotation, and how much of the stated variances there is.
    """
    variances = np.repeat(levels[:, :2] ** 2, 3, axis=1)
    unused = (1.0 - levels[:, 2])[:, None, None, None] * stated
    total = covariances - unused + variances[:, None, :, None] * np.eye(6)
    weights = np.linalg.inv(total)
    information = weights.sum(axis=1)
    weighted = np.einsum("gnij,nj->gi", weights, vectors)
    means = np.einsum("gij,gj->gi", np.linalg.inv(information), weighted)
    squared = np.einsum("ni,gnij,nj->g", vectors, weights, vectors, optimize=True) - (weighted * means).sum(axis=1)
    log_volume = np.linalg.slogdet(total)[1].sum(axis=1) + np.linalg.slogdet(information)[1]
    return np.asarray(-0.5 * (log_volume + squared))
