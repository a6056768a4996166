"""Leave-one-out: each pair predicted by a fit without it, for the held-out figures and each pair's influence."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66, Points2, Points3, Values
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.radar import cartesian_from_polar


@dataclass(frozen=True, slots=True, eq=False)
class LeaveOneOut:
    """The effect of leaving out each pair in turn.

    Attributes:
        distance_px: (n,) from the click to its prediction by the others.
        influence: (n,) how far the pose moves, in standard deviations.
    """

    distance_px: Values
    influence: Values


def leave_one_out(refined: ErrorsInVariablesFit, information: np.ndarray, pose_information: Matrix66) -> LeaveOneOut:
    """Leave out each pair by one Newton step: delta_i = -(H - w J_i^T J_i)^-1 w J_i^T e_i.

    Args:
        refined: the fit.
        information: (6 + k, 6 + k) of all pairs.
        pose_information: (6, 6) of them about the pose alone.
    """
    jacobian, residual, weights = refined.model.jacobian, refined.model.residual, refined.weights
    own = weights[:, None, None] * (np.swapaxes(jacobian, 1, 2) @ jacobian)
    pull = weights[:, None] * (np.swapaxes(jacobian, 1, 2) @ residual[:, :, None])[:, :, 0]
    scale = 1.0 / np.sqrt(np.diag(information))
    rest = (information - 0.999 * own) * np.outer(scale, scale)
    moves = -np.linalg.solve(rest, (pull * scale)[:, :, None])[:, :, 0] * scale
    turned = moves[:, :6] @ pose_information
    influence = np.sqrt(np.maximum((turned * moves[:, :6]).sum(axis=1), 0.0))
    polar = refined.measurements.measured(refined.rows).polar
    polar = polar + refined.measurements.errors.polar_change(polar, moves[:, 6:])
    missed_px = _projected_after(refined, moves[:, :6], cartesian_from_polar(polar.T)) - refined.measurements.pixels_px
    return LeaveOneOut(np.linalg.norm(missed_px, axis=1), influence)


def _projected_after(refined: ErrorsInVariablesFit, moves: np.ndarray, points_radar_m: Points3) -> Points2:
    """Project each point under the pose moved by its own (dt, dtheta): pixels (n, 2), by Rodrigues' formula on vectors."""
    turned = points_radar_m @ refined.camera_from_radar.rotation.T
    angle = np.linalg.norm(moves[:, 3:], axis=1, keepdims=True)
    axis = moves[:, 3:] / np.maximum(angle, 1e-12)
    along = axis * (axis * turned).sum(axis=1, keepdims=True)
    rotated = along + (turned - along) * np.cos(angle) + np.cross(axis, turned) * np.sin(angle)
    return refined.measurements.camera.project(rotated + refined.camera_from_radar.translation_m + moves[:, :3])
