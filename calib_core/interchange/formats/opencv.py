"""OpenCV's FileStorage YAML with camera, R and T; frames and check point are in keys as well as in comments."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import rotation_exp, rotation_log
from calib_core.interchange.calibration_file import EQUATION, CalibrationFile, FrameNames, stated_evidence
from calib_core.interchange.cameras.camera_format import refuse_skew
from calib_core.interchange.cameras.fields import find_cameras, floats
from calib_core.interchange.cameras.opencv import file_storage_matrix
from calib_core.interchange.format import Format, ImportedCalibration, Reads, StatedCheckPoint, WrittenPose
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.interchange.statement import hash_comment, stated_check_point, stated_frames, statement
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import quoted
from calib_core.lens_models.registry import written_lens

_OF_SECOND_CAMERA = ("M2", "K2", "cameraMatrix2", "camera_matrix_2", "R2", "P2")
_ROUNDING = 2e-3


def _write(file: CalibrationFile) -> str:
    """Write a file that cv::FileStorage of OpenCV 3, 4 and 5 reads.

    Raises:
        InputError: the camera has skew, which OpenCV's projectPoints silently ignores, or a lens OpenCV has no name for.
    """
    calibration = file.calibration
    camera, pose = calibration.camera, calibration.camera_from_radar
    refuse_skew(camera, "OpenCV's camera models have")
    lens = written_lens(camera.lens, camera.distortion, "opencv")
    function = f"cv::{(camera.lens.opencv or 'projectPoints').replace('.', '::')}"
    meaning = (
        f"R and T carry radar points into the camera, as {function} and stereoCalibrate use them; rvec is R's; "
        f"the distortion coefficients are for {function}"
    )
    check = file.check_point
    matrices = [
        ("camera_matrix", camera.matrix_px),
        ("distortion_coefficients", np.array([lens.coefficients])),
        ("R", pose.rotation),
        ("T", pose.translation_m[:, None]),
        ("rvec", rotation_log(pose.rotation)[:, None]),
    ]
    if check is not None:
        matrices += [("check_point_radar_m", check.radar_m[:, None]), ("check_point_pixel_px", check.pixel_px[:, None])]
    return (
        "%YAML:1.0\n---\n"
        + hash_comment(statement(file, meaning))
        + f"equation: {quoted(EQUATION)}\n"
        + f"radar_frame: {quoted(file.frames.radar)}\ncamera_frame: {quoted(file.frames.camera)}\n"
        + f"evidence: {quoted(file.rests_on)}\ncalibration_sha256: {quoted(calibration_sha256(file))}\n"
        + f"image_width: {camera.width_px}\nimage_height: {camera.height_px}\n"
        + f"distortion_model: {quoted(lens.name)}\nprojection_function: {quoted(function)}\n"
        + "".join(file_storage_matrix(key, matrix) for key, matrix in matrices)
    )


def _recognizes(content: Content) -> bool:
    return "R" in content.mapping and "T" in content.mapping


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read R and T, and the camera if there is one.

    Raises:
        InputError: a number is missing.
    """
    values = content.mapping
    _refuse_stereo(values, source=source)
    rotation = floats(values["R"], source=source, place="R", length=9)
    translation_m = floats(values["T"], source=source, place="T", length=3)
    cameras = find_cameras(values, source=source)
    has_size = len(cameras) == 1 and cameras[0].size_px is not None
    frames = stated_frames(content.text)
    if values.get("radar_frame") and values.get("camera_frame"):
        frames = FrameNames(str(values["radar_frame"]), str(values["camera_frame"]))
    assumptions = () if frames else ("the file does not name its frames; assumed p_camera = R p_radar + T",)
    return ImportedCalibration(
        "opencv",
        WrittenPose("matrix", np.reshape(rotation, (3, 3)), np.array(translation_m), "camera_from_radar"),
        camera=cameras[0].camera(image_size_px=None, source=source) if has_size else None,
        frames=frames,
        check_point=_check_point(values, source) or stated_check_point(content.text),
        assumptions=assumptions,
        evidence=stated_evidence(str(values["evidence"])) if values.get("evidence") else None,
        calibration_sha256=str(values.get("calibration_sha256") or "") or None,
        faults=_faults(values, np.reshape(rotation, (3, 3)), source) if frames else (),
    ).checked(source)


def _refuse_stereo(values: Mapping[str, Any], *, source: str) -> None:
    """Refuse what stereoCalibrate wrote: its R and T are between two cameras.

    Raises:
        InputError: the file has a second camera.
    """
    second = next((key for key in _OF_SECOND_CAMERA if key in values), None)
    if second is not None:
        raise InputError(
            f"{source}: a stereo pair ({second}): its R and T are between two cameras; give those between radar and camera"
        )


def _faults(values: Mapping[str, Any], rotation: np.ndarray, source: str) -> tuple[str, ...]:
    """Return what contradicts R: the rotation vector beside it, which projectPoints takes instead."""
    if "rvec" not in values:
        return ()
    stated = rotation_exp(np.array(floats(values["rvec"], source=source, place="rvec", length=3)))
    return () if np.abs(stated - rotation).max() <= _ROUNDING else ("rvec is not the rotation vector of R",)


def _check_point(values: Mapping[str, Any], source: str) -> StatedCheckPoint | None:
    try:
        radar_m = floats(values["check_point_radar_m"], source=source, place="check_point_radar_m", length=3)
        pixel_px = floats(values["check_point_pixel_px"], source=source, place="check_point_pixel_px", length=2)
    except (KeyError, InputError):
        return None
    return StatedCheckPoint(np.array(radar_m), pixel_px=np.array(pixel_px))


OPENCV = Format(
    name="opencv",
    title="OpenCV FileStorage",
    used_in="Calibration tools and arrays",
    also="cv2 C++ Python projectPoints rvec tvec",
    numbers="R, T, rvec carry radar points into the camera",
    file_name="radar_camera.yml",
    camera="lens",
    pose_for="raw",
    comment="#",
    write=_write,
    reads=Reads(_recognizes, _read),
)
