"""nuScenes' sensor.json and calibrated_sensor.json: each sensor's pose in the ego frame, for rectified images."""

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import Format, ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.statement import (
    STATEMENT_KEY,
    stated_frames,
    stated_lines,
    statement,
    with_statement,
)
from calib_core.interchange.syntax.content import Content, decoded
from calib_core.interchange.syntax.strict_json import json_text
from calib_core.interchange.syntax.zip_archives import pack
from calib_core.interchange.trees.nuscenes import pose_of
from calib_core.parsing import json_value

_NOTES = (
    "translation and rotation (w x y z) are the sensor's pose in the ego frame, camera optical; "
    "the ego frame is the radar frame unless its pose is given (--parent-from-radar)",
    "unpack it into the folder of the tables; tokens are derived from the frame names: replace them with yours",
)
_SENSORS, _CALIBRATED = "sensor.json", "calibrated_sensor.json"


def _write(file: CalibrationFile) -> bytes:
    """Write the two tables with the radar frame as the ego frame."""
    return _write_in_ego(file, RigidTransform.identity())


def _write_in_ego(file: CalibrationFile, ego_from_radar: RigidTransform) -> bytes:
    """Write the two tables, zipped: what each sensor is, and its pose in the ego frame."""
    calibration, frames = file.calibration, file.frames
    ego_from_camera = ego_from_radar @ calibration.camera_from_radar.inverse()
    meaning = (
        "translation and rotation (w x y z) are the sensor's pose in the ego frame; "
        "camera_intrinsic is for rectified images"
    )
    camera = _record(frames.camera, ego_from_camera, calibration.camera)
    camera[STATEMENT_KEY] = list(statement(file, meaning, rectified=True))
    tables = {
        _SENSORS: [_sensor(frames.radar, "radar"), _sensor(frames.camera, "camera")],
        _CALIBRATED: [_record(frames.radar, ego_from_radar, None), camera],
    }
    return pack({name: json_text(records).encode() for name, records in tables.items()})


def _sensor(name: str, modality: str) -> dict[str, str]:
    return {"token": _sensor_token(name), "channel": name, "modality": modality}


def _sensor_token(name: str) -> str:
    return hashlib.sha256(f"sensor {name}".encode()).hexdigest()[:32]


def _record(name: str, ego_from_sensor: RigidTransform, camera: Camera | None) -> dict[str, Any]:
    return {
        "token": hashlib.sha256(f"calibrated_sensor {name}".encode()).hexdigest()[:32],
        "sensor_token": _sensor_token(name),
        "translation": (ego_from_sensor.translation_m + 0.0).tolist(),
        "rotation": (quaternion_wxyz_from_matrix(ego_from_sensor.rotation) + 0.0).tolist(),
        "camera_intrinsic": [] if camera is None else camera.matrix_px.tolist(),
    }


def _recognizes(content: Content) -> bool:
    one = content.json_mapping
    if content.members:
        return _member(content) is not None
    return (content.syntax == "json" and isinstance(content.value, list)) or (
        "rotation" in one and "camera_intrinsic" in one
    )


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the camera's record and the radar's, if there is one; otherwise assume that the ego frame is the radar frame.

    Raises:
        InputError: not exactly one record with camera_intrinsic, or more than one without.
    """
    value = _value(content, source=source)
    records = value if isinstance(value, list) else [value]
    posed = [record for record in records if isinstance(record, Mapping) and "rotation" in record]
    cameras = [record for record in posed if record.get("camera_intrinsic")]
    radars = [record for record in posed if not record.get("camera_intrinsic")]
    if len(cameras) != 1 or len(radars) > 1:
        raise InputError(
            f"{source}: {len(cameras)} records with camera_intrinsic and {len(radars)} without; keep one camera and one radar"
        )
    camera_pose, text = _posed(cameras[0], source=source), stated_lines(cameras[0].get(STATEMENT_KEY))
    matrix = floats(cameras[0]["camera_intrinsic"], source=source, place="camera_intrinsic", length=9)
    matrix_px = np.reshape(matrix, (3, 3))
    assumptions = ["the format names no frames and assumes undistorted images"]
    if not radars:
        assumptions.append("no radar record; assumed that the ego frame is the radar frame")
        calibration = ImportedCalibration("nuscenes", camera_pose, assumptions=tuple(assumptions), matrix_px=matrix_px)
        return with_statement(calibration, text).checked(source)
    if stated_frames(text) is None:
        assumptions.append("the sensor without camera_intrinsic is taken to be the radar")
    radar_pose, both = _posed(radars[0], source=source), None
    ego_from_radar = radar_pose.as_written()
    if np.abs(ego_from_radar.as_matrix() - np.eye(4)).max() > 0:
        both = radar_pose, camera_pose
        ego_from_camera = camera_pose.as_written()
        radar_from_camera = ego_from_radar.inverse() @ ego_from_camera
        camera_pose = WrittenPose(
            "matrix", radar_from_camera.rotation, radar_from_camera.translation_m, "radar_from_camera"
        )
    calibration = ImportedCalibration(
        "nuscenes", camera_pose, assumptions=tuple(assumptions), matrix_px=matrix_px, in_third_frame=both
    )
    return with_statement(calibration, text).checked(source)


def _member(content: Content) -> bytes | None:
    """Return the table with the poses in a zip archive, in whichever folder it is."""
    return next((data for name, data in content.members.items() if name.rsplit("/", 1)[-1] == _CALIBRATED), None)


def _value(content: Content, *, source: str) -> Any:
    member = _member(content)
    return content.value if member is None else json_value(decoded(member, source=source), source=source)


def _posed(record: Mapping[str, Any], *, source: str) -> WrittenPose:
    pose = pose_of(record, source=source)
    ImportedCalibration("nuscenes", pose).checked(source)
    return pose


NUSCENES = Format(
    name="nuscenes",
    title="nuScenes sensor and calibrated_sensor",
    used_in="Data sets and viewers",
    also="dataset devkit MMDetection3D",
    numbers="pose of each sensor in the ego frame, quaternion w x y z; images undistorted",
    file_name="nuscenes.zip",
    camera="matrix",
    comment="keys",
    notes=_NOTES,
    write=_write,
    write_in_parent=_write_in_ego,
    reads=Reads(_recognizes, _read),
)
