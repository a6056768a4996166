"""Leave-one-out: each pair predicted from all others by one Newton step, for its inlier probability and the held-out figures.

A pair with high leverage pulls the pose towards itself, and one with a large residual raises the noise level it is judged
by. Both hide an outlier. Pair i is therefore judged by the pose and the noise of the others, each found by one Newton step
from the fit of all. With H the information, w the weights, J and e whitened as in `measurement_model`,

    P = (H - w_i J_i^T J_i)^-1,    d = P (g - w_i J_i^T e_i),    e_i - J_i d ~ N(0, S_i + J_i P J_i^T),      (7)

where g is the gradient of all pairs, and S_i uses the noise scales of the others at the pose moved by d. No 6 x 6 matrix
is inverted per pair: with C = H^-1, B = C J^T, G = J C J^T and N = (I - w G)^-1, which is 2 x 2, Woodbury's identity gives

    P = C + w B N B^T,    J P = N J C,    J P J^T = N G.

`leave_one_out` gives the held-out figures and each pair's influence.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, Matrix66, Points3, Values
from calib_core.estimation.gnc import RIDGE, normal_equations
from calib_core.estimation.measurement_model import Linearization, PairMeasurements
from calib_core.geometry import RigidTransform
from calib_core.radar import cartesian_from_polar

PSEUDO_REDUNDANCY = 6.0
"""Pseudo-degrees of freedom that shrink each noise scale towards its prior value."""

PSEUDO_SHARED = 4.0
"""The same for the level that range, azimuth and elevation share."""

COMPONENTS = np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], dtype=np.float64)
"""Which of (click, range, azimuth, elevation) each of the five columns of noise belongs to."""

_SCALE_LIMITS = (0.1, 12.0)  # times the assumed noise, a choice: pairs that agree exactly, or hardly, end there
_MANY_DEGREES = 1e9  # of freedom, in place of infinitely many, which make the density NaN
_OWN_SHARE = 0.999  # of its own information that is removed with a pair; removing all of it makes four pairs singular


@dataclass(frozen=True, slots=True, eq=False)
class NoiseParts:
    """The whitened noise of each pair by component: its covariance is the sum of c c^T over the columns c.

    Attributes:
        planes: (5, 2, n) W Q^(1/2) of click u, click v, range, azimuth, elevation; they add up to the identity.
        along: (5, n) residual along each.
    """

    planes: np.ndarray
    along: np.ndarray

    @property
    def columns(self) -> np.ndarray:
        """The planes by pair: (n, 2, 5)."""
        return np.asarray(self.planes.T)

    def squared_lengths(self, matrix: "Symmetric") -> np.ndarray:
        """Return c^T M c (5, n) of every column c, for a symmetric M per pair."""
        u, v = self.planes[:, 0], self.planes[:, 1]
        return np.asarray(u * u * matrix.uu + 2.0 * (u * v) * matrix.uv + v * v * matrix.vv)


@dataclass(frozen=True, slots=True, eq=False)
class Symmetric:
    """A symmetric 2 x 2 matrix for each pair, by its entries (n,)."""

    uu: Values
    uv: Values
    vv: Values

    @classmethod
    def between(cls, jacobian: np.ndarray, back: np.ndarray) -> "Symmetric":
        """Return J C J^T from J (6, 2, n) and C J^T (6, 2, n)."""
        uu, vv = (jacobian * back).sum(axis=0)
        return cls(uu, (jacobian[:, 0] * back[:, 1]).sum(axis=0), vv)

    def determinant(self) -> Values:
        """Return the determinants (n,)."""
        return np.asarray(self.uu * self.vv - self.uv * self.uv)

    def distance(self, residual: np.ndarray) -> Values:
        """Return r^T M^-1 r (n,) of residuals (2, n)."""
        u, v = residual
        return np.asarray((self.vv * u * u - 2.0 * self.uv * u * v + self.uu * v * v) / self.determinant())

    def of(self, vectors: np.ndarray) -> np.ndarray:
        """Return M r (2, n)."""
        u, v = vectors
        return np.array([self.uu * u + self.uv * v, self.uv * u + self.vv * v])


@dataclass(frozen=True, slots=True, eq=False)
class LeaveOneOutPrediction:
    """The prediction of each pair from the others, whitened by the noise of all.

    Attributes:
        residual_planes: (2, n) under the pose of the others.
        noise: S by the noise of the others.
        propagated: J P J^T, the pose covariance of the others propagated to the pixel.
        degrees_of_freedom: (n,) of that noise; infinite if it was not estimated.
    """

    residual_planes: np.ndarray
    noise: Symmetric
    propagated: Symmetric
    degrees_of_freedom: Values

    @property
    def residual(self) -> np.ndarray:
        """The residual by pair: (n, 2)."""
        return np.asarray(self.residual_planes.T)

    def squared(self, noise_factor: float = 1.0) -> Values:
        """Return the squared Mahalanobis distance (n,) of the residual, with the pair's own noise multiplied by a factor."""
        return self._spread(noise_factor).distance(self.residual_planes)

    def log_density(self, noise_factor: float = 1.0) -> Values:
        """Return the log density (n,) of the whitened residual under Student's t, the pair's own noise times a factor.

        In two dimensions the density is (1 + T^2 / nu)^(-(nu + 2) / 2) / (2 pi sqrt(det)); with nu infinite, the normal one.
        """
        spread, nu = self._spread(noise_factor), np.minimum(self.degrees_of_freedom, _MANY_DEGREES)
        tail = (nu + 2.0) / 2.0 * np.log1p(spread.distance(self.residual_planes) / nu)
        return np.asarray(-tail - 0.5 * np.log(spread.determinant()) - np.log(2.0 * np.pi))

    def _spread(self, noise_factor: float) -> Symmetric:
        noise, propagated, factor = self.noise, self.propagated, noise_factor**2
        return Symmetric(
            factor * noise.uu + propagated.uu, factor * noise.uv + propagated.uv, factor * noise.vv + propagated.vv
        )


def noise_parts(measurements: PairMeasurements, model: Linearization, sigma_polar: np.ndarray) -> NoiseParts:
    """Split the whitened noise of each pair into its components.

    Args:
        measurements: with the noise that whitened the model.
        model: at the current pose.
        sigma_polar: (n, 3) of the chosen candidates.
    """
    planes = np.empty((5, *model.planes.shape[1:]))
    planes[0] = model.whitening_planes[:2] * measurements.sigma_px  # the first column of W, which is triangular
    planes[1, 0], planes[1, 1] = 0.0, model.whitening_planes[2] * measurements.sigma_px
    np.multiply(model.polar_planes, sigma_polar.T[:, None, :], out=planes[2:])
    return NoiseParts(planes, (planes * model.planes[0]).sum(axis=1))


def predict_left_out(
    measurements: PairMeasurements,
    pose: RigidTransform,
    model: Linearization,
    weights: Values,
    parts: NoiseParts,
    scale: Values | None,
) -> LeaveOneOutPrediction:
    """Predict each pair from the others.

    Args:
        measurements: with the noise that whitened the model.
        pose: the current one.
        model: at that pose.
        weights: (n,) of all pairs.
        parts: of the noise.
        scale: (4,) estimated over assumed noise; None if the noise is as assumed.
    """
    hessian, gradient = normal_equations(measurements, pose, model, weights)
    residual, jacobian = model.planes[0], model.unknown_planes
    inverse = np.linalg.inv(hessian + RIDGE * np.diag(np.diag(hessian)))
    back = (inverse @ jacobian.reshape(len(hessian), -1)).reshape(jacobian.shape)  # B
    leverage = Symmetric.between(jacobian, back)  # G
    own = _OWN_SHARE * weights
    factor = _woodbury_factor(leverage, own)  # N
    # C (g - w J^T e), mapped to the pair by J, and the same with P instead of C
    step = (inverse @ gradient)[:, None] - weights * (back * residual).sum(axis=1)
    seen = factor.of((jacobian * step[:, None]).sum(axis=0))
    left = residual - seen
    propagated = Symmetric(
        factor.uu * leverage.uu + factor.uv * leverage.uv,
        factor.uu * leverage.uv + factor.uv * leverage.vv,
        factor.uv * leverage.uv + factor.vv * leverage.vv,
    )
    growth, degrees = np.ones((len(weights), 4)), np.full(len(weights), np.inf)
    if scale is not None:
        moves = step + (back * (own * seen)).sum(axis=1)
        others = _Others(parts, weights, jacobian, moves, left, propagated, inverse, back, _scaled_by(factor, own))
        found, degrees = _scales_of_others(others, scale)
        growth = found / scale
        propagated = _scaled_by(propagated, growth.min(axis=1) ** 2)
    return LeaveOneOutPrediction(left, _noise(parts, growth, model), propagated, degrees)


def _woodbury_factor(leverage: Symmetric, weights: Values) -> Symmetric:
    """Return N = (I - w G)^-1."""
    uu, uv, vv = 1.0 - weights * leverage.uu, weights * leverage.uv, 1.0 - weights * leverage.vv
    determinant = uu * vv - uv * uv
    return Symmetric(vv / determinant, uv / determinant, uu / determinant)


def _scaled_by(matrix: Symmetric, factors: Values) -> Symmetric:
    return Symmetric(factors * matrix.uu, factors * matrix.uv, factors * matrix.vv)


def _noise(parts: NoiseParts, growth: np.ndarray, model: Linearization) -> Symmetric:
    """Recombine the columns, each multiplied by the growth (n, 4) of its scale."""
    planes = parts.planes * (COMPONENTS @ growth.T)[:, None, :]
    uu, vv = (planes**2).sum(axis=0)
    uv = (planes[:, 0] * planes[:, 1]).sum(axis=0)
    unseen = model.whitening_planes[0] == 0.0
    return Symmetric(np.where(unseen, 1.0, uu), uv, np.where(unseen, 1.0, vv))


@dataclass(frozen=True, slots=True, eq=False)
class _Others:
    """The inputs of the noise scales without each pair; letters as in Woodbury's identity above."""

    parts: NoiseParts
    weights: Values
    jacobian: np.ndarray
    """(6 + k, 2, n)"""
    moves: np.ndarray
    """(6 + k, n) d"""
    left: np.ndarray
    """(2, n) e - J d"""
    propagated: Symmetric
    inverse: np.ndarray
    """(6 + k, 6 + k) C"""
    back: np.ndarray
    """(6 + k, 2, n) B"""
    factor: Symmetric
    """w N"""


def _scales_of_others(o: _Others, scale: Values) -> tuple[np.ndarray, Values]:
    """Return the noise scales (n, 4) without each pair, at the pose without it, and their degrees of freedom (n,)."""
    columns, along, weights = o.parts.planes, o.parts.along, o.weights
    jacobian = (columns[:, None] * o.jacobian).sum(axis=2)  # of the residual along each column, (5, 6 + k, n)
    turned = np.swapaxes(jacobian, 1, 2)
    weighted = jacobian * weights
    linear = (weighted @ along[:, :, None])[:, :, 0]
    quadratic, taken = weighted @ turned, (weighted * weights) @ turned  # (5, 6 + k, 6 + k)
    own = (columns * o.left).sum(axis=1) ** 2
    second_order = (_by_component(quadratic) @ o.moves * o.moves).sum(axis=1)
    squares = COMPONENTS.T @ ((weights * along**2).sum(axis=1, keepdims=True) - 2.0 * linear @ o.moves - weights * own)
    squares = np.maximum(squares + second_order, 0.0)
    lengths = weights * (columns**2).sum(axis=1)
    lost = COMPONENTS.T @ (
        lengths.sum(axis=1, keepdims=True) - lengths + weights**2 * o.parts.squared_lengths(o.propagated)
    )
    redundant = np.maximum(lost - _traces(_by_component(taken), o), 0.0).T
    return shrunk_scales(squares.T * scale**2, redundant), redundant.sum(axis=1) + PSEUDO_SHARED


def _by_component(five: np.ndarray) -> np.ndarray:
    """Sum the columns of each of (click, range, azimuth, elevation): (5, ...) to (4, ...)."""
    return np.concatenate([five[:1] + five[1:2], five[2:]])


def _traces(taken: np.ndarray, o: _Others) -> np.ndarray:
    """Return tr(P T) (4, n) of each T (4, 6 + k, 6 + k): tr(C T) + tr(w N B^T T B)."""
    through = (taken @ o.back.reshape(len(o.back), -1)).reshape(4, *o.back.shape)  # T B
    straight = (o.back * through).sum(axis=1)  # (4, 2, n)
    across = (o.back[:, 0] * through[:, :, 1]).sum(axis=1)
    plain = np.trace(o.inverse @ taken, axis1=1, axis2=2)[:, None]
    return np.asarray(plain + o.factor.uu * straight[:, 0] + o.factor.vv * straight[:, 1] + 2.0 * o.factor.uv * across)


def shrunk_scales(squares: np.ndarray, redundant: np.ndarray) -> np.ndarray:
    """Convert sums of squares (..., 4), in assumed sigmas, to scales, each shrunk towards a better-known value.

    The click is shrunk towards its assumed sigma; range, azimuth and elevation towards the level they share, and that
    towards 1.
    """
    shared = (squares[..., 1:].sum(axis=-1) + PSEUDO_SHARED) / (redundant[..., 1:].sum(axis=-1) + PSEUDO_SHARED)
    towards = np.stack([np.ones_like(shared), shared, shared, shared], axis=-1)
    variance = (squares + PSEUDO_REDUNDANCY * towards) / (redundant + PSEUDO_REDUNDANCY)
    return np.clip(np.sqrt(variance), *_SCALE_LIMITS)


@dataclass(frozen=True, slots=True, eq=False)
class LeaveOneOut:
    """The effect of leaving out each pair in turn.

    Attributes:
        distance_px: (n,) from the click to its prediction by the others.
        influence: (n,) how far the pose moves, in standard deviations.
    """

    distance_px: Values
    influence: Values


def leave_one_out(
    measurements: PairMeasurements,
    pose: RigidTransform,
    model: Linearization,
    weights: Values,
    rows: Indices,
    *,
    information: np.ndarray,
    pose_information: Matrix66,
) -> LeaveOneOut:
    """Leave out each pair by one Newton step: delta_i = -(H - w J_i^T J_i)^-1 w J_i^T e_i.

    Args:
        measurements: of all pairs, with the noise and the errors of their fit.
        pose: camera_from_radar of the fit.
        model: linearized there.
        weights: (n,) inlier probabilities.
        rows: (n,) candidate of each pair.
        information: (6 + k, 6 + k) of all pairs.
        pose_information: (6, 6) of them about the pose alone.
    """
    jacobian, residual = model.jacobian, model.residual
    own = weights[:, None, None] * (np.swapaxes(jacobian, 1, 2) @ jacobian)
    pull = weights[:, None] * (np.swapaxes(jacobian, 1, 2) @ residual[:, :, None])[:, :, 0]
    scale = 1.0 / np.sqrt(np.diag(information))
    rest = (information - _OWN_SHARE * own) * np.outer(scale, scale)
    moves = -np.linalg.solve(rest, (pull * scale)[:, :, None])[:, :, 0] * scale
    turned = moves[:, :6] @ pose_information
    influence = np.sqrt(np.maximum((turned * moves[:, :6]).sum(axis=1), 0.0))
    polar = measurements.measured(rows).polar
    polar = polar + measurements.errors.polar_change(polar, moves[:, 6:])
    moved_m = _moved(pose, moves[:, :6], cartesian_from_polar(polar.T))
    missed_px = measurements.camera.project(moved_m) - measurements.pixels_px
    return LeaveOneOut(np.linalg.norm(missed_px, axis=1), influence)


def _moved(pose: RigidTransform, moves: np.ndarray, points_radar_m: Points3) -> Points3:
    """Return each point (n, 3) in the camera frame under the pose moved by its own (dt, dtheta), by Rodrigues' formula."""
    turned = points_radar_m @ pose.rotation.T
    angle = np.linalg.norm(moves[:, 3:], axis=1, keepdims=True)
    axis = moves[:, 3:] / np.maximum(angle, 1e-12)  # [rad] a smaller turn moves no point; float64 rounds to 1e-16
    along = axis * (axis * turned).sum(axis=1, keepdims=True)
    rotated = along + (turned - along) * np.cos(angle) + np.cross(axis, turned) * np.sin(angle)
    return np.asarray(rotated + pose.translation_m + moves[:, :3])
