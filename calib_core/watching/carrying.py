"""A calibration carried forward: the old pose, then the change that was watched, with both covariances added."""

from dataclasses import replace

import msgspec
import numpy as np

from calib_core.arrays import Matrix66
from calib_core.errors import NoAnswerError
from calib_core.geometry import RigidTransform, rotation_exp, skew
from calib_core.interchange.calibration_file import CalibrationFile, CarriedFrom, choose_check_point
from calib_core.measurements import DataWarning
from calib_core.results.calibration import CovarianceParts
from calib_core.watching.witnesses import AXES, Verdict

MOST_RAD = np.deg2rad(3.0)
"""Beyond it small angles, matches and images that register are not to be relied on: calibrate again."""


def carried_forward(file: CalibrationFile, verdict: Verdict, sha256: str) -> CalibrationFile:
    """Return a calibration with the change that was watched.

    The pairs and metrics stay those of the older solve, and a warning says so; the check point is computed again.

    Args:
        file: the older calibration.
        verdict: of a watch since then.
        sha256: of the older file.

    Raises:
        NoAnswerError: no turn of the camera against the radar was seen, or it is too large.
    """
    change, old = verdict.change, file.calibration
    if verdict.finding != "turned" or change is None or not np.isfinite(change.covariance_rad2[:2, :2]).all():
        raise NoAnswerError(
            f"nothing to carry forward: the watch says '{verdict.finding}', and not that camera and radar turned against each "
            "other by more than would have been noticed, about pitch and yaw; the calibration stays as it is"
        )
    size = float(np.linalg.norm(change.rotation_rad))
    if size > MOST_RAD:
        raise NoAnswerError(
            f"the turn of {np.rad2deg(size):.2g}° is beyond {np.rad2deg(MOST_RAD):.0f}°, where it is not known well enough to "
            "carry a calibration forward; calibrate again"
        )
    turn = rotation_exp(change.rotation_rad)
    pose = RigidTransform(turn, np.zeros(3)) @ old.camera_from_radar
    kept = np.kron(np.eye(2), turn)
    by_turn = np.concatenate([-skew(pose.translation_m), np.eye(3)])
    added = by_turn @ change.covariance_rad2 @ by_turn.T
    turned = {axis: float(np.rad2deg(one)) for axis, one in zip(AXES, change.rotation_rad, strict=True)}
    warning = DataWarning("carried-forward", {"turned_deg": turned, "sha256": sha256})
    calibration = replace(
        old,
        camera_from_radar=pose,
        covariance=_moved(old.covariance, kept) + added,
        covariance_parts=_moved_parts(old.covariance_parts, kept),
        warnings=(*(one for one in old.warnings if one.code != warning.code), warning),
    )
    carried = msgspec.convert(
        {
            "sha256": sha256,
            "turn_rad": change.rotation_rad.tolist(),
            "covariance_rad2": change.covariance_rad2.tolist(),
        },
        CarriedFrom,
    )
    return replace(
        file,
        calibration=calibration,
        check_point=choose_check_point(calibration),
        kept=(),
        evidence="carried",
        carried_from=carried,
    )


def _moved(covariance: Matrix66, kept: Matrix66) -> Matrix66:
    return np.asarray(kept @ covariance @ kept.T)


def _moved_parts(parts: CovarianceParts | None, kept: Matrix66) -> CovarianceParts | None:
    return (
        parts if parts is None else CovarianceParts(_moved(parts.systematic, kept), _moved(parts.camera_position, kept))
    )
