"""The mean and the scatter of vectors that are each known with a covariance of their own: a random-effects model.

    y_k = mu + b_k + e_k,   b_k ~ N(0, S),   e_k ~ N(0, C_k),   k = 1 .. n;   C_k known, mu and S unknown.

The level of S is integrated out: over S_0 = diag(p^2 I, r^2 I), p of the positions and r of the rotations, with a flat prior on p
and r and the restricted likelihood of the data, on a grid; S_0 is its posterior mean. Its shape follows by EM: restricted
maximum likelihood with an inverse-Wishart prior that counts as `PRIOR_VECTORS` vectors scattered by S_0. Where the C_k hide
the scatter, S stays at S_0, which the flat prior keeps from collapsing to zero.

A further vector is farther out than S + cov(mu) says, for two reasons. Given the data, it is a mixture of normal vectors, one for
each level, with wider tails than one normal vector with the mixture's covariance. And the shape of S is a guess: with exactly
known vectors it is (8 S_0 + n S_data) / (n + 8), which varies as a covariance from (n + 8)^2 / n vectors does, and Hotelling's
T^2 with these degrees of freedom says how far out a vector then is. Each reason gives one factor.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Values, frozen_array
from calib_core.fleet.tails import DIMENSIONS, mixture_quantile, quantile

__all__ = ["PRIOR_VECTORS", "RandomEffects", "random_effects"]

PRIOR_VECTORS = 8.0
"""Vectors that the prior on the shape of the scatter counts for."""

_NODES = 12
_PASSES = 3
_REACH = 5.0  # times the root mean square of the vectors
_NEGLIGIBLE = 1e-5
_LEAST_SPREAD = 1e-6  # m and rad: below what anything is mounted to
_ITERATIONS, _CONVERGED = 60, 1e-4
_INSIDE = 0.95
_LEAST_GROWN = 1e-9
_BLOCKS = (slice(0, 3), slice(3, 6))


@dataclass(frozen=True, slots=True, eq=False)
class RandomEffects:
    """The estimated distribution.

    Attributes:
        mean: (6,).
        mean_covariance: (6, 6) of the mean.
        scatter: (6, 6) of the vectors about it.
        informative: how many exactly known vectors say as much about the scatter, 0 to n.
        level_widened: the 95 % quantile of a further vector's squared distance with all levels that the data allow, over that
            with one level: the covariance is wider by that much because the level is not known.
        shape_freedom: degrees of freedom with which the shape of `covariance` varies.
    """

    mean: Values
    mean_covariance: Matrix66
    scatter: Matrix66
    informative: float
    level_widened: float = 1.0
    shape_freedom: float = float("inf")

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
    def widened(self) -> float:
        """By how much `covariance` is to be wider, so that its 95 % ellipsoid contains a further vector in 95 % of cases."""
        known = quantile(_INSIDE, float("inf"))
        return self.level_widened * quantile(_INSIDE, self.shape_freedom, whole=DIMENSIONS - 1.0) / known


def random_effects(vectors: np.ndarray, covariances: np.ndarray) -> RandomEffects:
    """Estimate mean and scatter.

    Args:
        vectors: (n, 6) [m, rad], n at least 3; positions first.
        covariances: (n, 6, 6) of each.
    """
    variances, level_widened = _levels(vectors, covariances)
    level = np.repeat(variances, 3)
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
        level_widened=level_widened,
        shape_freedom=_shape_freedom(scatter, weights),
    )


def _shape_freedom(scatter: np.ndarray, weights: np.ndarray) -> float:
    """Return with how many degrees of freedom the shape of a further vector's covariance varies.

    Along the axes in which the mean's information is diagonal, m_ij vectors tell the scatter's element ij, so it varies with
    (m_ij + 8)^2 / m_ij degrees of freedom; in the covariance of a further vector it counts by its share s_i s_j. A squared
    distance grows by the sum of (1 + d_ij) s_i s_j m_ij / (m_ij + 8)^2, and by p (p + 1) / nu if all have nu.

    Args:
        scatter: (6, 6).
        weights: (n, 6, 6) inverse covariances of the vectors about their mean.
    """
    root = np.linalg.cholesky(scatter)
    shares = root.T @ weights @ root  # of the scatter in what each vector varies by
    information, axes = np.linalg.eigh(shares.sum(axis=0))
    along = np.einsum("ai,nab,bi->ni", axes, shares, axes)
    vectors = along.T @ along
    of_scatter = information / (information + 1.0)
    grown = np.outer(of_scatter, of_scatter) * vectors / (vectors + PRIOR_VECTORS) ** 2 * (1.0 + np.eye(DIMENSIONS))
    return DIMENSIONS * (DIMENSIONS + 1) / max(float(grown.sum()), _LEAST_GROWN)


def _levels(vectors: np.ndarray, covariances: np.ndarray) -> tuple[np.ndarray, float]:
    """Integrate over the level by a grid that zooms in.

    Returns:
        the posterior means (2,) of the variances per axis of position and rotation, and by how much the tails are wider.
    """
    count = len(vectors)
    centred = vectors - vectors.mean(axis=0)
    spread = np.array([np.sqrt((centred[:, block] ** 2).mean() * count / (count - 1)) for block in _BLOCKS])
    low, high = np.zeros(2), _REACH * np.maximum(spread, _LEAST_SPREAD)
    for _ in range(_PASSES):
        steps = (high - low) / _NODES
        axes = low[:, None] + steps[:, None] * (np.arange(_NODES) + 0.5)
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        nodes = _Nodes.at(centred, covariances, grid.reshape(-1, 2))
        likelihood = nodes.log_likelihood.reshape(_NODES, _NODES)
        density = np.exp(likelihood - likelihood.max())
        for block in range(2):
            marginal = density.sum(axis=1 - block)
            kept = np.flatnonzero(marginal > _NEGLIGIBLE * marginal.max())
            low[block] = max(0.0, axes[block, kept[0]] - steps[block])
            high[block] = axes[block, kept[-1]] + steps[block]
    density /= density.sum()
    return (density[..., None] * grid**2).sum(axis=(0, 1)), nodes.widened(density.ravel())


@dataclass(frozen=True, slots=True, eq=False)
class _Nodes:
    """Levels of the scatter, and what the data say with each.

    Attributes:
        log_likelihood: (g,) with the mean integrated out.
        variances: (g, 6) of the scatter.
        means: (g, 6) estimated means.
        mean_covariances: (g, 6, 6) of these.
    """

    log_likelihood: np.ndarray
    variances: np.ndarray
    means: np.ndarray
    mean_covariances: np.ndarray

    @classmethod
    def at(cls, vectors: np.ndarray, covariances: np.ndarray, levels: np.ndarray) -> "_Nodes":
        """Weigh scatters with these standard deviations of position and rotation (g, 2)."""
        variances = np.repeat(levels**2, 3, axis=1)
        total = covariances + variances[:, None, :, None] * np.eye(6)
        weights = np.linalg.inv(total)
        information = weights.sum(axis=1)
        weighted = np.einsum("gnij,nj->gi", weights, vectors)
        mean_covariances = np.linalg.inv(information)
        means = np.einsum("gij,gj->gi", mean_covariances, weighted)
        squared = np.einsum("ni,gnij,nj->g", vectors, weights, vectors, optimize=True) - (weighted * means).sum(axis=1)
        log_volume = np.linalg.slogdet(total)[1].sum(axis=1) + np.linalg.slogdet(information)[1]
        return cls(-0.5 * (log_volume + squared), variances, means, mean_covariances)

    def widened(self, probabilities: np.ndarray) -> float:
        """Return the 95 % quantile of a further vector's squared distance over that of a normal vector.

        Args:
            probabilities: (g,) of the levels, given the data.
        """
        each = self.mean_covariances + self.variances[:, :, None] * np.eye(6)
        away = self.means - probabilities @ self.means
        covariance = np.einsum("g,gij->ij", probabilities, each + away[:, :, None] * away[:, None, :])
        scale = np.sqrt(np.diag(covariance))
        whitening = np.linalg.inv(np.linalg.cholesky(covariance / np.outer(scale, scale))) / scale
        squares = np.linalg.eigvalsh(whitening @ each @ whitening.T)
        return max(1.0, mixture_quantile(_INSIDE, squares, probabilities) / quantile(_INSIDE, float("inf")))
