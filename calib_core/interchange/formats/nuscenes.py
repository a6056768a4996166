"""nuScenes' sensor.json and calibrated_sensor.json: each sensor's pose in the ego frame, for rectified images."""

import hashlib
from typing import Any

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.statement import STATEMENT_KEY, statement
from calib_core.interchange.syntax.strict_json import json_text
from calib_core.interchange.syntax.zip_archives import pack
from calib_core.interchange.trees.nuscenes import CALIBRATED, SENSORS, recognizes_nuscenes
from calib_core.interchange.trees.posed_in_tree import read_joints

_NOTES = (
    "translation and rotation (w x y z) are the sensor's pose in the ego frame, camera optical; "
    "the ego frame is the radar frame unless its pose is given (--parent-from-radar)",
    "unpack it into the folder of the tables; tokens are derived from the frame names: replace them with yours",
)


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
        SENSORS: [_sensor(frames.radar, "radar"), _sensor(frames.camera, "camera")],
        CALIBRATED: [_record(frames.radar, ego_from_radar, None), camera],
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
    reads=Reads(recognizes_nuscenes, read_joints),
)
