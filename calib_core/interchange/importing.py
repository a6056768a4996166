"""Read a calibration back from whatever format it is in."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import find_cameras
from calib_core.interchange.formats.colmap import read_colmap
from calib_core.interchange.formats.datasets import read_kitti, read_nuscenes
from calib_core.interchange.formats.driveworks import is_rig, read_driveworks
from calib_core.interchange.formats.foxglove import read_foxglove
from calib_core.interchange.formats.matrices import read_matlab, read_matrix, read_numpy
from calib_core.interchange.formats.opencv import read_opencv
from calib_core.interchange.formats.ros import read_launch_python, read_launch_xml, read_tf2_command
from calib_core.interchange.formats.urdf import read_urdf
from calib_core.interchange.formats.yaml_files import read_autoware, read_kalibr, read_transform_stamped
from calib_core.interchange.imported import TRUTH_FORMAT, ImportedCalibration, StatedCheckPoint, WrittenPose
from calib_core.interchange.own.calibration_json import calibration_file_of, kept_results, transform_of
from calib_core.interchange.own.documents import CalibrationDocument, TransformDocument
from calib_core.interchange.syntax.opencv_xml import load_opencv_xml, parse_xml
from calib_core.interchange.syntax.strict_json import checked, json_value, parse_document
from calib_core.interchange.syntax.yaml_text import load_yaml
from calib_core.interchange.syntax.zip_archives import unpack

__all__ = ["imported", "read_any", "read_any_file"]

_TRUTH = "cocalib/truth-1"
_MAX_BYTES = 256 * 1024 * 1024
_KNOWN = (
    "known are calibration-1, static_transform_publisher in a command or launch file, URDF, Autoware, Apollo and "
    "stamped transforms, Kalibr with T_cam_radar, OpenCV with R and T, KITTI, nuScenes, DriveWorks, Foxglove, "
    "COLMAP, mat, npz, matrix"
)


def read_any_file(path: str | Path) -> ImportedCalibration:
    """Read a calibration from a file of any format we write.

    Raises:
        InputError: the file cannot be read, or holds no pose.
    """
    file = Path(path)
    try:
        if file.stat().st_size > _MAX_BYTES:
            raise InputError(f"{file}: too large for a calibration; is it the right file?")
        return read_any(file.read_bytes(), str(file))
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror or error}); check the path") from None


def read_any(content: str | bytes, source: str = "calibration") -> ImportedCalibration:
    """Read a calibration from the content of a file of any format we write; the content tells the format.

    Raises:
        InputError: it holds no pose that we know how to read; what was looked for.
    """
    try:
        return _read(content, source)
    except InputError as error:
        if str(error).startswith(f"{source}: "):
            raise
        raise InputError(f"{source}: {error}") from None  # a frame's name is refused without knowing the file


def _read(content: str | bytes, source: str) -> ImportedCalibration:
    if isinstance(content, bytes):
        if content.startswith(b"PK"):
            names = unpack(content, source=source)
            return (read_colmap if any("images.txt" in name for name in names) else read_numpy)(content, source)
        if content.startswith(b"MATLAB"):
            return read_matlab(content, source)
        content = _decoded(content, source)
    return _read_text(content.replace("\r\n", "\n"), source)


def _decoded(content: bytes, source: str) -> str:
    """Return text of UTF-8, or of UTF-16 as Windows' shell writes what is sent to a file."""
    try:
        return content.decode("utf-16" if content.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{source}: neither text nor an archive; {_KNOWN}") from None


def imported(file: CalibrationFile) -> ImportedCalibration:
    """Return a calibration of ours as if it had been read from its file."""
    pose, check = file.calibration.camera_from_radar, file.check_point
    return ImportedCalibration(
        "json",
        WrittenPose("matrix", pose.rotation, pose.translation_m, "camera_from_radar"),
        camera=file.calibration.camera,
        frames=file.frames,
        check_point=StatedCheckPoint(check.radar_m, pixel_px=check.pixel_px) if check else None,
        file=file,
    )


def _read_text(text: str, source: str) -> ImportedCalibration:
    start = text.lstrip()[:1]
    if start in ("{", "["):
        return _read_json(text, source)
    if start == "<":
        return _read_xml(text, source)
    if "generate_launch_description" in text:
        return read_launch_python(text, source)
    code = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if any("static_transform_publisher" in line for line in code):
        return read_tf2_command(text, source)
    if any(line.startswith(("Tr_velo_to_cam:", "Tr_radar_to_cam:", "Tr_velo_cam:")) for line in code):
        return read_kitti(text, source)
    if code and _all_numbers(code[0]):
        return read_matrix(text, source)
    return _read_mapping(load_yaml(text, source=source), text, source)


def _all_numbers(line: str) -> bool:
    try:
        return len(np.array(line.replace(",", " ").split(), dtype=np.float64)) > 1
    except ValueError:
        return False


def _read_json(text: str, source: str) -> ImportedCalibration:
    content = json_value(text, source=source)
    if isinstance(content, list):
        return read_nuscenes(content, source)
    if str(content.get("schema", "")).startswith("cocalib/calibration-"):
        return _read_ours(text, source)
    if content.get("schema") == _TRUTH:
        return _read_truth(content, source)
    if is_rig(content):
        return read_driveworks(content, source)
    if "FrameTransform" in content or "parent_frame_id" in content:
        return read_foxglove(content, source)
    if "rotation" in content and "camera_intrinsic" in content:
        return read_nuscenes([content], source)
    return _read_mapping(content, text, source)


def _read_xml(text: str, source: str) -> ImportedCalibration:
    tag = parse_xml(text, source=source).tag
    if tag == "robot":
        return read_urdf(text, source)
    if tag == "launch":
        return read_launch_xml(text, source)
    return _read_mapping(load_opencv_xml(text, source=source), text, source)


def _read_mapping(content: Any, text: str, source: str) -> ImportedCalibration:
    if isinstance(content, dict):
        if "R" in content and "T" in content:
            return read_opencv(content, text, source)
        if "child_frame_id" in content or "transforms" in content:
            return read_transform_stamped(content, text, source)
        inner = [value for value in content.values() if isinstance(value, dict)]
        if any("T_cam_radar" in value for value in inner):
            return read_kalibr(content, text, source)
        if any(isinstance(entry, dict) and "yaw" in entry for value in inner for entry in value.values()):
            return read_autoware(content, text, source)
    found = ", ".join(map(str, list(content)[:12])) if isinstance(content, dict) else type(content).__name__
    raise InputError(f"{source}: no pose of a camera and a radar in it (found {found or 'nothing'}); {_KNOWN}")


def _read_truth(content: dict[str, Any], source: str) -> ImportedCalibration:
    """Read what is true about a simulated recording, to compare a calibration with."""
    stated = checked(
        content.get("camera_from_radar") or {}, TransformDocument, source=source, place="camera_from_radar"
    )
    pose = transform_of(stated, source=source, place="camera_from_radar")
    cameras = find_cameras(content, source=source)
    return ImportedCalibration(
        TRUTH_FORMAT,
        WrittenPose("matrix", pose.rotation, pose.translation_m, "camera_from_radar"),
        camera=cameras[0].camera(image_size_px=None, source=source) if cameras else None,
    )


def _read_ours(text: str, source: str) -> ImportedCalibration:
    """Read calibration-1 with its contradictions, so that a check can tell which part is wrong."""
    document = parse_document(text, CalibrationDocument, source=source)
    stated = document.camera_from_radar
    bare = TransformDocument(stated.rotation, stated.translation_m)
    pose = transform_of(bare, source=source, place="camera_from_radar")
    faults = []
    try:
        transform_of(stated, source=source, place="camera_from_radar")
    except InputError:
        faults.append("camera_from_radar.quaternion_wxyz is another rotation than camera_from_radar.rotation")
    if document.radar_from_camera is not None:
        try:
            inverse = transform_of(document.radar_from_camera, source=source, place="radar_from_camera").inverse()
            if np.abs(inverse.as_matrix() - pose.as_matrix()).max() > 1e-5:
                faults.append("radar_from_camera is not the inverse of camera_from_radar")
        except InputError:
            faults.append("radar_from_camera holds two rotations, or none")
    file = replace(calibration_file_of(document, pose, source=source), unknown=kept_results(text, source=source))
    base = imported(file)
    return ImportedCalibration(
        "json", base.pose, base.camera, base.frames, base.check_point, faults=tuple(faults), file=file
    )
