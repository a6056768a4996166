"""KITTI (and View-of-Delft, which keeps KITTI's keys for its radar) and nuScenes: data sets of rectified images."""

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.imported import ImportedCalibration, WrittenPose
from calib_core.interchange.syntax.json_text import json_text
from calib_core.interchange.syntax.yaml_text import numbers_text

__all__ = [
    "KITTI_NOTES",
    "NUSCENES_NOTES",
    "read_kitti",
    "read_nuscenes",
    "write_kitti",
    "write_nuscenes",
    "write_nuscenes_in_ego",
]

KITTI_NOTES = (
    "Tr_velo_to_cam carries radar points into the camera: p_camera = R p_radar + t (View-of-Delft keeps this key too)",
    "a comment would break its readers, so the check point is only in calibration.json",
)
NUSCENES_NOTES = (
    "translation and rotation (w x y z) are the sensor's pose in the ego frame, camera optical; "
    "the radar's frame is taken for the ego frame (parent_from_radar places it elsewhere)",
    "tokens are made from the frames' names: put yours in; JSON has no comments, so the check point is only in calibration.json",
)


def write_kitti(file: CalibrationFile) -> str:
    """Write the seven lines of KITTI's object calibration, in the order some readers count on."""
    calibration = file.calibration
    projection = numbers_text(np.hstack([calibration.camera.matrix_px, np.zeros((3, 1))]).ravel(), " ")
    identity = numbers_text(np.eye(3, 4).ravel(), " ")
    pose = numbers_text(calibration.camera_from_radar.as_matrix()[:3].ravel(), " ")
    return (
        "".join(f"P{index}: {projection}\n" for index in range(4))
        + f"R0_rect: {numbers_text(np.eye(3).ravel(), ' ')}\n"
        + f"Tr_velo_to_cam: {pose}\nTr_imu_to_velo: {identity}\n"
    )


def read_kitti(text: str, source: str) -> ImportedCalibration:
    """Read a KITTI or View-of-Delft calibration: P2, R0_rect and Tr_velo_to_cam.

    Raises:
        InputError: a line is missing or has another number of numbers.
    """
    lines = dict(line.split(":", 1) for line in text.splitlines() if ":" in line and not line.startswith("#"))
    key = next((key for key in ("Tr_velo_to_cam", "Tr_radar_to_cam", "Tr_velo_cam") if key in lines), None)
    if key is None:
        raise InputError(f"{source}: no Tr_velo_to_cam in it; add that line")
    pose = np.reshape(floats(lines[key].split(), source=source, place=key, length=12), (3, 4))
    notes = ["the format names no frames and assumes undistorted images"]
    rectified = "R0_rect" in lines
    if rectified:
        rotation = np.reshape(floats(lines["R0_rect"].split(), source=source, place="R0_rect", length=9), (3, 3))
        if np.abs(rotation - np.eye(3)).max() > 0:
            pose = rotation @ pose
            notes.append("R0_rect was applied: the camera is the rectified one")
    if "P2" in lines:
        offset = np.reshape(floats(lines["P2"].split(), source=source, place="P2", length=12), (3, 4))[:, 3]
        if offset.any():
            notes.append("P2 holds an offset between cameras, which was left out: the camera is the reference one")
    return ImportedCalibration(
        "kitti", WrittenPose("matrix", pose[:, :3], pose[:, 3], "camera_from_radar"), notes=tuple(notes)
    ).checked(source)


def write_nuscenes(file: CalibrationFile) -> str:
    """Write calibrated_sensor.json with the radar's frame for the ego frame."""
    return write_nuscenes_in_ego(file, RigidTransform.identity())


def write_nuscenes_in_ego(file: CalibrationFile, ego_from_radar: RigidTransform) -> str:
    """Write calibrated_sensor.json: one record for the radar and one for the camera, each posed in the ego frame."""
    calibration = file.calibration
    ego_from_camera = ego_from_radar @ calibration.camera_from_radar.inverse()
    records = [
        _record(file.frames.radar, ego_from_radar, None),
        _record(file.frames.camera, ego_from_camera, calibration.camera),
    ]
    return json_text(records)


def _record(name: str, ego_from_sensor: RigidTransform, camera: Camera | None) -> dict[str, Any]:
    return {
        "token": hashlib.sha256(f"calibrated_sensor {name}".encode()).hexdigest()[:32],
        "sensor_token": hashlib.sha256(f"sensor {name}".encode()).hexdigest()[:32],
        "translation": (ego_from_sensor.translation_m + 0.0).tolist(),
        "rotation": (quaternion_wxyz_from_matrix(ego_from_sensor.rotation) + 0.0).tolist(),
        "camera_intrinsic": [] if camera is None else camera.matrix_px.tolist(),
    }


def read_nuscenes(records: list[Any], source: str) -> ImportedCalibration:
    """Read the camera's record, and the radar's where there is one; without it the ego frame is taken for the radar's.

    Raises:
        InputError: not exactly one record with camera_intrinsic, or more than one without.
    """
    posed = [record for record in records if isinstance(record, Mapping) and "rotation" in record]
    cameras = [record for record in posed if record.get("camera_intrinsic")]
    radars = [record for record in posed if not record.get("camera_intrinsic")]
    if len(cameras) != 1 or len(radars) > 1:
        raise InputError(
            f"{source}: {len(cameras)} records with camera_intrinsic and {len(radars)} without; keep one camera and one radar"
        )
    camera_pose = _posed(cameras[0], source=source)
    notes = ["the format names no frames and assumes undistorted images"]
    if not radars:
        notes.append("no record of a radar; took the ego frame for the radar's")
        return ImportedCalibration("nuscenes", camera_pose, notes=tuple(notes)).checked(source)
    ego_from_radar = _posed(radars[0], source=source).as_written()
    if np.abs(ego_from_radar.as_matrix() - np.eye(4)).max() > 0:
        ego_from_camera = camera_pose.as_written()
        radar_from_camera = ego_from_radar.inverse() @ ego_from_camera
        camera_pose = WrittenPose(
            "matrix", radar_from_camera.rotation, radar_from_camera.translation_m, "radar_from_camera"
        )
    return ImportedCalibration("nuscenes", camera_pose, notes=tuple(notes)).checked(source)


def _posed(record: Mapping[str, Any], *, source: str) -> WrittenPose:
    translation_m = floats(record.get("translation"), source=source, place="translation", length=3)
    rotation = floats(record.get("rotation"), source=source, place="rotation", length=4)
    pose = WrittenPose("quaternion_wxyz", np.array(rotation), np.array(translation_m), "radar_from_camera")
    ImportedCalibration("nuscenes", pose).checked(source)
    return pose
