"""How well the other pairs predict each pair: whether to believe it must not be asked of a fit it has bent itself.

A pair with much leverage pulls the pose to itself, and one with a large residual raises the noise level that judges it.
Both hide it. So pair i is judged by the pose and the noise that the others give, each by one Newton step from the fit of
all. With H the information, w the weights, J and e whitened as in `evidence`,

    P = (H - w_i J_i^T J_i)^-1,    d = P (g - w_i J_i^T e_i),    e_i - J_i d ~ N(0, S_i + J_i P J_i^T),      (4)

g being the gradient of all pairs, and S_i built from the noise scales that the others have at the pose moved by d.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values
from calib_core.consensus import normal_equations
from calib_core.evidence import Evidence, Linearised
from calib_core.geometry import RigidTransform

__all__ = [
    "COMPONENTS",
    "PSEUDO_SHARED",
    "NoiseParts",
    "Predicted",
    "noise_parts",
    "predict",
    "shrunk_scales",
    "tail_chance",
]

PSEUDO_REDUNDANCY = 6.0
"""Pseudo-degrees of freedom that pull each noise scale to what it leans on."""

PSEUDO_SHARED = 4.0
"""The same of the level that range, azimuth and elevation share."""

COMPONENTS = np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=np.float64)
"""Which of (click, range, azimuth, elevation) each of the five columns of noise belongs to."""

_SCALE_LIMITS = (0.1, 12.0)
_MANY_DEGREES = 1e9  # as good as infinite
_OWN_SHARE = 0.999  # of its own information that a pair loses; with all of it, four pairs leave nothing to invert


@dataclass(frozen=True, slots=True, eq=False)
class NoiseParts:
    """The whitened noise of each pair taken apart: S = sum of its columns' squares.

    Attributes:
        columns: (n, 2, 5) W Q^(1/2) of click u, click v, range, azimuth, elevation; they add up to the identity.
        along: (n, 5) residual along each.
        pose_jacobian: (n, 5, 6) the same of the residual's Jacobian.
    """

    columns: np.ndarray
    along: np.ndarray
    pose_jacobian: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Predicted:
    """What the other pairs say about each pair, whitened by the noise of all.

    Attributes:
        residual: (n, 2) under the pose of the others.
        noise: (n, 2, 2) S by the noise of the others.
        doubt: (n, 2, 2) J P J^T, what the others leave open.
        degrees_of_freedom: (n,) behind that noise; infinite where it was not estimated.
    """

    residual: np.ndarray
    noise: np.ndarray
    doubt: np.ndarray
    degrees_of_freedom: Values

    def squared(self, noise_factor: float = 1.0) -> Values:
        """Return the squared Mahalanobis distance (n,) of the residual, the pair's own noise larger by a factor."""
        spread = noise_factor**2 * self.noise + self.doubt
        return np.asarray((self.residual * np.linalg.solve(spread, self.residual[:, :, None])[:, :, 0]).sum(axis=1))

    def log_density(self, noise_factor: float = 1.0) -> Values:
        """Return the logarithm (n,) of Student's density of the whitened residual, the pair's own noise larger by a factor.

        In two dimensions it is (1 + T^2 / nu)^(-(nu + 2) / 2) / (2 pi sqrt(det)); with nu infinite the normal one.
        """
        spread = noise_factor**2 * self.noise + self.doubt
        determinant = spread[:, 0, 0] * spread[:, 1, 1] - spread[:, 0, 1] * spread[:, 1, 0]
        return np.asarray(-self._log_tail(noise_factor) - 0.5 * np.log(determinant) - np.log(2.0 * np.pi))

    def _log_tail(self, noise_factor: float) -> Values:
        squared, nu = self.squared(noise_factor), np.minimum(self.degrees_of_freedom, _MANY_DEGREES)
        return np.asarray((nu + 2.0) / 2.0 * np.log1p(squared / nu))


def tail_chance(squared: Values, degrees_of_freedom: Values) -> Values:
    """Return the probability (n,) of a squared distance as large or larger in two dimensions: 2 F(2, nu), or chi-square.

    Args:
        squared: (n,) Mahalanobis distances.
        degrees_of_freedom: (n,) nu; infinite where the noise is known.
    """
    nu = np.minimum(degrees_of_freedom, _MANY_DEGREES)
    return np.asarray(np.exp(-0.5 * nu * np.log1p(squared / nu)))


def noise_parts(evidence: Evidence, model: Linearised, sigma_polar: np.ndarray) -> NoiseParts:
    """Take the whitened noise of each pair apart.

    Args:
        evidence: with the noise that whitened the model.
        model: at the present pose.
        sigma_polar: (n, 3) of the chosen candidates.
    """
    click = model.whitening * evidence.sigma_px[:, None, None]
    columns = np.concatenate([click, model.point_jacobian * sigma_polar[:, None, :]], axis=2)
    turned = np.swapaxes(columns, 1, 2)
    return NoiseParts(columns, (turned @ model.residual[:, :, None])[:, :, 0], turned @ model.pose_jacobian)


def predict(
    evidence: Evidence,
    pose: RigidTransform,
    model: Linearised,
    weights: Values,
    parts: NoiseParts,
    scale: Values | None,
) -> Predicted:
    """Predict each pair from the others.

    Args:
        evidence: with the noise that whitened the model.
        pose: the present one.
        model: at that pose.
        weights: (n,) of all pairs.
        parts: of the noise.
        scale: (4,) estimated over assumed noise; None where the noise is as assumed.
    """
    hessian, gradient = normal_equations(evidence, pose, model, weights)
    turned = np.swapaxes(model.pose_jacobian, 1, 2)
    own = weights[:, None, None] * (turned @ model.pose_jacobian)
    pull = weights[:, None] * (turned @ model.residual[:, :, None])[:, :, 0]
    unit = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-12))
    rest = (hessian - _OWN_SHARE * own) * np.outer(unit, unit) + 1e-12 * np.eye(6)
    doubt = np.linalg.inv(rest) * np.outer(unit, unit)
    moves = (doubt @ (gradient - pull)[:, :, None])[:, :, 0]
    grown, degrees = np.ones((len(weights), 4)), np.full(len(weights), np.inf)
    if scale is not None:
        found, degrees = _scales_of_others(parts, weights, doubt, moves, scale)
        grown = found / scale
    noise = (parts.columns * (grown**2 @ COMPONENTS.T)[:, None, :]) @ np.swapaxes(parts.columns, 1, 2)
    unseen = ~model.whitening.any(axis=(1, 2))
    noise[unseen] = np.eye(2)
    return Predicted(
        residual=model.residual - (model.pose_jacobian @ moves[:, :, None])[:, :, 0],
        noise=noise,
        doubt=model.pose_jacobian @ doubt @ turned,
        degrees_of_freedom=degrees,
    )


def _scales_of_others(
    parts: NoiseParts, weights: Values, doubt: np.ndarray, moves: np.ndarray, scale: Values
) -> tuple[np.ndarray, Values]:
    """Return the noise scales (n, 4) without each pair, at the pose without it, and their degrees of freedom (n,)."""
    along, jacobian = parts.along, parts.pose_jacobian
    weighted = weights[:, None] * along
    linear = np.einsum("nc,nca->ca", weighted, jacobian)
    quadratic = np.einsum("nca,ncb->cab", weights[:, None, None] * jacobian, jacobian)
    own = (along - (jacobian @ moves[:, :, None])[:, :, 0]) ** 2
    moved = moves[:, :, None] * moves[:, None, :]
    squares = (weighted * along).sum(axis=0) - 2.0 * moves @ linear.T
    squares += moved.reshape(-1, 36) @ quadratic.reshape(-1, 36).T - weights[:, None] * own
    lengths = weights[:, None] * (parts.columns**2).sum(axis=1)
    taken = np.einsum("nca,ncb->cab", (weights**2)[:, None, None] * jacobian, jacobian)
    taken_own = (weights**2)[:, None] * ((jacobian @ doubt) * jacobian).sum(axis=2)
    redundant = lengths.sum(axis=0) - lengths - doubt.reshape(-1, 36) @ taken.reshape(-1, 36).T + taken_own
    redundant = np.maximum(redundant @ COMPONENTS, 0.0)
    scales = shrunk_scales(np.maximum(squares @ COMPONENTS, 0.0) * scale**2, redundant)
    return scales, redundant.sum(axis=1) + PSEUDO_SHARED


def shrunk_scales(squares: np.ndarray, redundant: np.ndarray) -> np.ndarray:
    """Turn sums of squares (..., 4), in assumed sigmas, into scales, each leaning on what is known better than itself.

    The click leans on its assumed sigma; range, azimuth and elevation lean on the level they share, and that on 1.
    """
    shared = (squares[..., 1:].sum(axis=-1) + PSEUDO_SHARED) / (redundant[..., 1:].sum(axis=-1) + PSEUDO_SHARED)
    towards = np.stack([np.ones_like(shared), shared, shared, shared], axis=-1)
    variance = (squares + PSEUDO_REDUNDANCY * towards) / (redundant + PSEUDO_REDUNDANCY)
    return np.clip(np.sqrt(variance), *_SCALE_LIMITS)
