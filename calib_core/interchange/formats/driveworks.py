"""NVIDIA DriveWorks rig JSON: each sensor's pose in the rig, angles in degrees, every sensor with body axes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import Format, ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.formats.statement import STATEMENT_KEY, stated_lines, statement, with_statement
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, matrix_from_rpy, rpy_from_matrix
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.strict_json import json_text

_NOTES = (
    "nominalSensor2Rig_FLU is the sensor's pose in the rig: metres, roll-pitch-yaw in degrees about fixed axes, the camera with "
    "body axes (x forward, y left, z up); the radar is at the rig's origin unless its pose is given (--parent-from-radar)",
    "contains the pose only: copy the two poses into your own rig file; the check point, the evidence and the calibration's "
    "hash are in the camera's properties, as a text that DriveWorks does not read",
)
_POSE = "nominalSensor2Rig_FLU"
_ROTATION_CORRECTION, _POSITION_CORRECTION = "correction_sensor_R_FLU", "correction_rig_T"
CORRECTED = (
    f"the format's description does not say how corrections apply; {_ROTATION_CORRECTION} was applied in the sensor's frame "
    f"(nominal times correction) and {_POSITION_CORRECTION} added in the rig's, as published readers of such rigs do"
)
"""What reading takes for granted where a sensor has corrections."""


def _write(file: CalibrationFile) -> str:
    """Write rig.json with the radar at the rig's origin."""
    return _write_in_rig(file, RigidTransform.identity())


def _write_in_rig(file: CalibrationFile, rig_from_radar: RigidTransform) -> str:
    """Write rig.json: a radar and a camera, each posed in the rig."""
    rig_from_link = rig_from_radar @ file.calibration.camera_from_radar.inverse() @ LINK_FROM_OPTICAL.inverse()
    meaning = (
        f"{_POSE} is each sensor's pose in the rig, roll-pitch-yaw in degrees about fixed axes, "
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
    return {"name": name, "protocol": protocol, "parameter": "", "properties": properties, _POSE: pose}


def _recognizes(content: Content) -> bool:
    rig = content.json_mapping.get("rig")
    return isinstance(rig, Mapping) and "sensors" in rig


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read a rig that contains one radar and one camera, by protocol.

    Raises:
        InputError: it contains more or fewer sensors, a number is missing, or a correction is of an unknown kind.
    """
    listed = content.mapping["rig"]["sensors"]
    sensors = [sensor for sensor in listed if isinstance(sensor, Mapping)] if isinstance(listed, list) else []
    radars, cameras = (
        [sensor for sensor in sensors if str(sensor.get("protocol", "")).startswith(kind)]
        for kind in ("radar", "camera")
    )
    if len(radars) != 1 or len(cameras) != 1:
        raise InputError(
            f"{source}: rig.sensors: {len(radars)} radars and {len(cameras)} cameras by protocol; keep one of each"
        )
    rig_from_radar, rig_from_link = (posed_sensor(sensor, source=source) for sensor in (radars[0], cameras[0]))
    pose, both, note = rig_from_link, None, "the format defines the camera axes as body axes (x forward, y left, z up)"
    if np.abs(rig_from_radar.as_written().as_matrix() - np.eye(4)).max() > 0:
        radar_from_link = rig_from_radar.as_written().inverse() @ rig_from_link.as_written()
        pose = WrittenPose(
            "matrix", radar_from_link.rotation, radar_from_link.translation_m, "radar_from_camera", "link"
        )
        both = rig_from_radar, rig_from_link
    assumptions = (CORRECTED,) if any(is_corrected(sensor) for sensor in (radars[0], cameras[0])) else ()
    properties = cameras[0].get("properties")
    text = stated_lines(properties.get(STATEMENT_KEY)) if isinstance(properties, Mapping) else ""
    calibration = ImportedCalibration("driveworks", pose, notes=(note,), assumptions=assumptions, in_third_frame=both)
    return with_statement(calibration, text).checked(source)


def posed_sensor(sensor: Mapping[str, Any], *, source: str) -> WrittenPose:
    """Return a sensor's pose in the rig with its corrections applied, as written if it has none.

    Raises:
        InputError: a number is missing, or a correction is of an unknown kind.
    """
    place = f"rig.sensors {sensor.get('name')!r}"
    known = (_ROTATION_CORRECTION, _POSITION_CORRECTION)
    for key in sensor:
        if str(key).startswith("correction_") and key not in known and any(_numbers(sensor[key])):
            raise InputError(f"{source}: {place}: {key} is not zero; apply the correction to {_POSE} first")
    pose = sensor.get(_POSE)
    if not isinstance(pose, Mapping):
        raise InputError(f"{source}: {place}: no {_POSE}; add the sensor's pose in the rig")
    angles_deg = floats(pose.get("roll-pitch-yaw"), source=source, place=f"{place}.roll-pitch-yaw", length=3)
    position_m = floats(pose.get("t"), source=source, place=f"{place}.t", length=3)
    nominal = WrittenPose("rpy", np.deg2rad(angles_deg), np.array(position_m), "radar_from_camera", "link", "deg")
    if not is_corrected(sensor):
        return nominal
    turn_deg = _correction(sensor, _ROTATION_CORRECTION, source=source, place=place)
    shift_m = _correction(sensor, _POSITION_CORRECTION, source=source, place=place)
    rotation = matrix_from_rpy(np.deg2rad(angles_deg)) @ matrix_from_rpy(np.deg2rad(turn_deg))
    return WrittenPose("matrix", rotation, np.array(position_m) + shift_m, "radar_from_camera", "link")


def is_corrected(sensor: Mapping[str, Any]) -> bool:
    """Return whether a sensor has a correction that is not zero."""
    return any(any(_numbers(sensor[key])) for key in (_ROTATION_CORRECTION, _POSITION_CORRECTION) if key in sensor)


def _correction(sensor: Mapping[str, Any], key: str, *, source: str, place: str) -> np.ndarray:
    """Return a correction's three numbers, zeros if there is none."""
    if key not in sensor:
        return np.zeros(3)
    return np.array(floats(_numbers(sensor[key]), source=source, place=f"{place}.{key}", length=3))


def _numbers(value: Any) -> list[Any]:
    inner = value.get("roll-pitch-yaw") if isinstance(value, Mapping) else value
    return list(inner) if isinstance(inner, list) else [inner]


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
    reads=Reads(_recognizes, _read),
)
