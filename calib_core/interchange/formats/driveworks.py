"""NVIDIA DriveWorks rig JSON: each sensor's pose in the rig, angles in degrees, every sensor with body axes."""

from typing import Any

import numpy as np

from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, rpy_from_matrix
from calib_core.interchange.statement import STATEMENT_KEY, statement
from calib_core.interchange.syntax.strict_json import json_text
from calib_core.interchange.trees.driveworks import POSE_KEY, recognizes_driveworks
from calib_core.interchange.trees.posed_in_tree import read_joints

_NOTES = (
    "nominalSensor2Rig_FLU is the sensor's pose in the rig: meters, roll-pitch-yaw in degrees about fixed axes, the camera with "
    "body axes (x forward, y left, z up); the radar is at the rig's origin unless its pose is given (--parent-from-radar)",
    "contains the pose only: copy the two poses into your own rig file; the check point, the evidence and the calibration's "
    "hash are in the camera's properties, as a text that DriveWorks does not read",
)


def _write(file: CalibrationFile) -> str:
    """Write rig.json with the radar at the rig's origin."""
    return _write_in_rig(file, RigidTransform.identity())


def _write_in_rig(file: CalibrationFile, rig_from_radar: RigidTransform) -> str:
    """Write rig.json: a radar and a camera, each posed in the rig."""
    rig_from_link = rig_from_radar @ file.calibration.camera_from_radar.inverse() @ LINK_FROM_OPTICAL.inverse()
    meaning = (
        f"{POSE_KEY} is each sensor's pose in the rig, roll-pitch-yaw in degrees about fixed axes, "
        f"R = Rz(yaw) Ry(pitch) Rx(roll); {file.frames.camera_link} has body axes (x forward, y left, z up)"
    )
    stated = {STATEMENT_KEY: "\n".join(statement(file, meaning))}
    sensors = [
        _sensor(file.frames.radar, "radar.virtual", rig_from_radar, {}),
        _sensor(file.frames.camera_link, "camera.virtual", rig_from_link, stated),
    ]
    return json_text({"rig": {"sensors": sensors}, "version": 7})


def _sensor(name: str, protocol: str, rig_from_sensor: RigidTransform, properties: dict[str, str]) -> dict[str, Any]:
    angles_deg = np.rad2deg(rpy_from_matrix(rig_from_sensor.rotation))
    pose = {"roll-pitch-yaw": (angles_deg + 0.0).tolist(), "t": (rig_from_sensor.translation_m + 0.0).tolist()}
    return {"name": name, "protocol": protocol, "parameter": "", "properties": properties, POSE_KEY: pose}


DRIVEWORKS = Format(
    name="driveworks",
    title="NVIDIA DriveWorks rig",
    used_in="Vehicle stacks",
    also="NVIDIA DRIVE Isaac vehicle",
    numbers="pose of each sensor in the rig, roll pitch yaw in degrees about fixed axes; the camera with body axes",
    file_name="rig.json",
    camera="none",
    comment="keys",
    notes=_NOTES,
    write=_write,
    write_in_parent=_write_in_rig,
    reads=Reads(recognizes_driveworks, read_joints),
)
