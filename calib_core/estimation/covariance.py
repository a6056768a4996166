"""How sure the pose is: its covariance, what that means in pixels, and what each pair has to do with it."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Points2, Points3, Values
from calib_core.camera import Camera
from calib_core.estimation.correlated_angle_errors import pose_spread
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.estimation.gnc import normal_equations
from calib_core.estimation.linearization import with_respect_to_pose
from calib_core.estimation.unmeasured_elevation import shared_elevation_spread
from calib_core.geometry import RigidTransform
from calib_core.radar import cartesian_from_polar
from calib_core.results import Calibration

__all__ = ["LeftOut", "PoseCovariance", "leave_one_out", "pixel_covariance", "pose_covariance", "pose_jacobian"]

_LEAST_SHARE = 0.25  # of the plain information that the correction for doubtful pairs must leave
_CHI2_95_6 = 12.591587243743977


@dataclass(frozen=True, slots=True, eq=False)
class PoseCovariance:
    """The pose's error distribution.

    Attributes:
        covariance: (6, 6) of (dt, dtheta) [m, rad].
        information: (6, 6) Gauss-Newton Hessian of the fit, for moving it about.
        quantile: the factor on the covariance whose ellipsoid holds 95 %.
        condition: condition number of the information of the pairs alone, each unknown in its own scale.
        growth: by how much smooth angle errors of the radar widen the rotation's standard deviation; 1 without.
    """

    covariance: Matrix66
    information: Matrix66
    quantile: float
    condition: float
    growth: float


def pose_covariance(refined: ErrorsInVariablesFit) -> PoseCovariance:
    """Invert the observed information of the mixture at the optimum, and widen it by errors that the pairs share.

    Pairs that may be outliers (0 < w < 1) carry less than w of their Gauss-Newton information: by Louis' identity

        I = sum w J^T J - sum w (1 - w) g g^T,   g = J^T e   (whitened).
    """
    plain, _ = normal_equations(refined.measurements, refined.camera_from_radar, refined.model, refined.weights)
    gradients = (np.swapaxes(refined.model.pose_jacobian, 1, 2) @ refined.model.residual[:, :, None])[:, :, 0]
    doubt = refined.weights * (1.0 - refined.weights)
    lost = (gradients * doubt[:, None]).T @ gradients
    information = _floored(plain, lost)
    prior_jacobian = refined.measurements.prior.rows(refined.camera_from_radar)[1]
    pairs_only = plain - prior_jacobian.T @ prior_jacobian
    independent = _symmetric_inverse(information)
    spread = pose_spread(refined, plain)
    covariance = independent if spread is None else _widened(independent, plain, spread)
    growth = float(np.sqrt(np.trace(covariance[3:, 3:]) / np.trace(independent[3:, 3:])))
    shared = shared_elevation_spread(refined, plain)
    covariance = covariance if shared is None else covariance + shared
    from_pairs = 1.0 - float(np.trace(prior_jacobian @ covariance @ prior_jacobian.T)) / 6.0
    return PoseCovariance(
        covariance=covariance,
        information=plain,
        quantile=_quantile(refined.degrees_of_freedom, max(from_pairs, 0.0)),
        condition=_scaled_condition(pairs_only),
        growth=growth,
    )


def _floored(plain: Matrix66, lost: Matrix66) -> Matrix66:
    """Subtract the lost information, but leave at least a share of the plain one in every direction."""
    root = np.linalg.cholesky(plain + 1e-12 * np.diag(np.diag(plain)))
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(np.eye(6) - inverse @ lost @ inverse.T)
    kept = (vectors * np.maximum(values, _LEAST_SHARE)) @ vectors.T
    return np.asarray(root @ kept @ root.T)


def _widened(covariance: Matrix66, plain: Matrix66, spread: Matrix66) -> Matrix66:
    """Add to a covariance what smooth angle errors add to the plain one, in no direction less than nothing."""
    root = np.linalg.cholesky(plain)
    values, vectors = np.linalg.eigh(root.T @ spread @ root - np.eye(6))
    back = np.linalg.inv(root).T @ vectors
    widened = covariance + (back * np.maximum(values, 0.0)) @ back.T
    return np.asarray((widened + widened.T) / 2.0)


def _symmetric_inverse(matrix: Matrix66) -> Matrix66:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    inverse = np.linalg.inv(matrix * np.outer(scale, scale)) * np.outer(scale, scale)
    return np.asarray((inverse + inverse.T) / 2.0)


def _scaled_condition(information: Matrix66) -> float:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    values = np.linalg.eigvalsh(information * np.outer(scale, scale))
    return float(values[-1] / max(values[0], 1e-16))


def _quantile(degrees_of_freedom: float, from_pairs: float) -> float:
    """Return the 95 % quantile for 6 parameters: chi-square with the noise known, 6 F(6, nu) with it estimated.

    What a measured camera position contributes needs no estimated noise; the two are mixed by their shares.

    Args:
        degrees_of_freedom: nu, behind the noise level; 0 where it was not estimated.
        from_pairs: the share of the parameters that the pairs determine, 0 to 1.
    """
    if degrees_of_freedom <= 0:
        return _CHI2_95_6
    from scipy.special import fdtri

    return float(_CHI2_95_6 + from_pairs * (6.0 * fdtri(6.0, degrees_of_freedom, 0.95) - _CHI2_95_6))


@dataclass(frozen=True, slots=True, eq=False)
class LeftOut:
    """What happens when each pair is left out in turn.

    Attributes:
        distance_px: (n,) from the click to where the others predict it.
        influence: (n,) how far the pose moves, in standard deviations.
    """

    distance_px: Values
    influence: Values


def leave_one_out(refined: ErrorsInVariablesFit, information: Matrix66) -> LeftOut:
    """Leave each pair out by one Newton step: delta_i = -(H - w J_i^T J_i)^-1 w J_i^T e_i.

    Args:
        refined: the fit.
        information: (6, 6) of all pairs.
    """
    jacobian, residual, weights = refined.model.pose_jacobian, refined.model.residual, refined.weights
    own = weights[:, None, None] * (np.swapaxes(jacobian, 1, 2) @ jacobian)
    pull = weights[:, None] * (np.swapaxes(jacobian, 1, 2) @ residual[:, :, None])[:, :, 0]
    scale = 1.0 / np.sqrt(np.diag(information))
    rest = (information - 0.999 * own) * np.outer(scale, scale)
    moves = -np.linalg.solve(rest, (pull * scale)[:, :, None])[:, :, 0] * scale
    influence = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", moves, information, moves), 0.0))
    points = cartesian_from_polar(refined.measurements.polar[refined.rows])
    missed_px = _projected_after(refined, moves, points) - refined.measurements.pixels_px
    return LeftOut(np.linalg.norm(missed_px, axis=1), influence)


def _projected_after(refined: ErrorsInVariablesFit, moves: np.ndarray, points_radar_m: Points3) -> Points2:
    """Project each point under the pose moved by its own (dt, dtheta): pixels (n, 2), by Rodrigues' formula on vectors."""
    turned = points_radar_m @ refined.camera_from_radar.rotation.T
    angle = np.linalg.norm(moves[:, 3:], axis=1, keepdims=True)
    axis = moves[:, 3:] / np.maximum(angle, 1e-12)
    along = axis * (axis * turned).sum(axis=1, keepdims=True)
    swung = along + (turned - along) * np.cos(angle) + np.cross(axis, turned) * np.sin(angle)
    return refined.measurements.camera.project(swung + refined.camera_from_radar.translation_m + moves[:, :3])


def pixel_covariance(calibration: Calibration, points_radar_m: Points3) -> np.ndarray:
    """Return the covariance (n, 2, 2) [px^2] of where true radar points project; NaN where the lens does not see them.

    Only the pose's uncertainty counts: noise of a measured radar position comes on top.

    Args:
        calibration: with its covariance.
        points_radar_m: (n, 3).
    """
    jacobian = pose_jacobian(calibration.camera, calibration.camera_from_radar, points_radar_m)
    return np.asarray(jacobian @ calibration.covariance @ np.swapaxes(jacobian, 1, 2))


def pose_jacobian(camera: Camera, camera_from_radar: RigidTransform, points_radar_m: Points3) -> np.ndarray:
    """Return d pixel / d (dt, dtheta) at radar points (n, 3): (n, 2, 6) [px/m, px/rad]."""
    turned_m = np.asarray(points_radar_m, dtype=np.float64) @ camera_from_radar.rotation.T
    d_point = camera.project_with_jacobian(turned_m + camera_from_radar.translation_m)[1]
    return with_respect_to_pose(d_point, turned_m)
