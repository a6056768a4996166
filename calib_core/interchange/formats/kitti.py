"""KITTI's object calibration, for rectified images; View-of-Delft uses the same keys for its radar."""

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.imported import ImportedCalibration, WrittenPose
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import numbers_text

__all__ = ["KITTI"]

_NOTES = (
    "Tr_velo_to_cam maps radar points to the camera frame: p_camera = R p_radar + t (as in View-of-Delft)",
    "a comment would break KITTI readers, so the check point is only in calibration.json",
)
_ASSUMPTION = "the format names no frames and assumes undistorted images"
_POSE_KEYS = ("Tr_velo_to_cam", "Tr_radar_to_cam", "Tr_velo_cam")


def _write(file: CalibrationFile) -> str:
    """Write the seven lines of KITTI's object calibration, in the order that some readers rely on."""
    calibration = file.calibration
    projection = numbers_text(np.hstack([calibration.camera.matrix_px, np.zeros((3, 1))]).ravel(), " ")
    identity = numbers_text(np.eye(3, 4).ravel(), " ")
    pose = numbers_text(calibration.camera_from_radar.as_matrix()[:3].ravel(), " ")
    return (
        "".join(f"P{index}: {projection}\n" for index in range(4))
        + f"R0_rect: {numbers_text(np.eye(3).ravel(), ' ')}\n"
        + f"Tr_velo_to_cam: {pose}\nTr_imu_to_velo: {identity}\n"
    )


def _recognizes(content: Content) -> bool:
    return any(line.startswith(tuple(f"{key}:" for key in _POSE_KEYS)) for line in content.lines)


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read a KITTI or View-of-Delft calibration: P2, R0_rect and Tr_velo_to_cam.

    Raises:
        InputError: a line is missing or has too few or too many numbers.
    """
    lines = dict(line.split(":", 1) for line in content.text.splitlines() if ":" in line and not line.startswith("#"))
    key = next((key for key in _POSE_KEYS if key in lines), None)
    if key is None:
        raise InputError(f"{source}: no Tr_velo_to_cam in it; add that line")
    pose = np.reshape(floats(lines[key].split(), source=source, place=key, length=12), (3, 4))
    notes = []
    rectified = "R0_rect" in lines
    if rectified:
        rotation = np.reshape(floats(lines["R0_rect"].split(), source=source, place="R0_rect", length=9), (3, 3))
        if np.abs(rotation - np.eye(3)).max() > 0:
            pose = rotation @ pose
            notes.append("R0_rect was applied; the camera is the rectified one")
    matrix_px = None
    if "P2" in lines:
        projection = np.reshape(floats(lines["P2"].split(), source=source, place="P2", length=12), (3, 4))
        matrix_px = projection[:, :3]
        if projection[:, 3].any():
            pose = pose + np.column_stack([np.zeros((3, 3)), _offset_m(projection, source=source)])
            notes.append("the offset in P2 was applied; the camera is the one of image_2")
    written = WrittenPose("matrix", pose[:, :3], pose[:, 3], "camera_from_radar")
    return ImportedCalibration(
        "kitti", written, assumptions=(_ASSUMPTION,), notes=tuple(notes), matrix_px=matrix_px
    ).checked(source)


def _offset_m(projection: np.ndarray, *, source: str) -> np.ndarray:
    """Return where the reference camera stands in the frame of camera 2 [m]: P2 = K [I | t].

    Raises:
        InputError: the left part of P2 is not a camera matrix.
    """
    try:
        offset_m: np.ndarray = np.linalg.solve(projection[:, :3], projection[:, 3])
    except np.linalg.LinAlgError:
        raise InputError(f"{source}: P2 is not a projection of a camera; correct it") from None
    return offset_m


KITTI = Format(
    name="kitti",
    title="KITTI and View-of-Delft calibration",
    used_in="Data sets and viewers",
    also="VoD dataset OpenPCDet MMDetection3D",
    numbers="Tr_velo_to_cam carries radar points into the camera; images undistorted",
    file_name="calib.txt",
    camera="matrix",
    comment="none",
    notes=_NOTES,
    write=_write,
    reads=Reads(_recognizes, _read),
)
