"""The joints of a DriveWorks rig: each sensor's pose in the rig with its corrections, all with body axes."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import WrittenPose
from calib_core.interchange.rotations import matrix_from_rpy
from calib_core.interchange.statement import STATEMENT_KEY, stated_lines
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Joint, Place, Sensor, SensorKind, TreePart

POSE_KEY = "nominalSensor2Rig_FLU"
_RIG = "rig"
_ROTATION_CORRECTION, _POSITION_CORRECTION = "correction_sensor_R_FLU", "correction_rig_T"
_CORRECTED = (
    f"the format's description does not say how corrections apply; {_ROTATION_CORRECTION} was applied in the sensor's frame "
    f"(nominal times correction) and {_POSITION_CORRECTION} added in the rig's, as published readers of such rigs do"
)
_NOTE = "the format defines the camera axes as body axes (x forward, y left, z up)"


def recognizes_driveworks(content: Content) -> bool:
    """Return whether JSON is a rig file."""
    rig = content.json_mapping.get("rig")
    return isinstance(rig, Mapping) and isinstance(rig.get("sensors"), list)


def read_driveworks(content: Content, source: str) -> TreePart:
    """Read every sensor with a pose; a joint whose numbers or corrections cannot be read cannot be used."""
    sensors = [one for one in content.mapping["rig"]["sensors"] if isinstance(one, Mapping) and one.get("name")]
    posed = [one for one in sensors if isinstance(one.get(POSE_KEY), Mapping) or _kind(one) != "other"]
    kept = (sensor.get("properties") for sensor in posed)
    stated = (stated_lines(one.get(STATEMENT_KEY)) for one in kept if isinstance(one, Mapping))
    return TreePart(
        "driveworks",
        tuple(_joint(one, content.text, source) for one in posed),
        tuple(map(_sensor, posed)),
        notes=(_NOTE,),
        assumptions=(_CORRECTED,) if any(map(_is_corrected, posed)) else (),
        statement=next(filter(None, stated), ""),
    )


def _joint(sensor: Mapping[str, Any], text: str, source: str) -> Joint:
    name = str(sensor["name"])
    at = text.find(f'"{name}"')
    place = Place(source, text.count("\n", 0, at) + 1 if at >= 0 else None)
    try:
        written = _posed(sensor, source=source)
    except InputError as error:  # only of importance if this joint is used
        return Joint(_RIG, name, None, place, problem=str(error).removeprefix(f"{source}: "))
    return Joint.posed(_RIG, name, replace(written, axes="optical"), place)


def _sensor(sensor: Mapping[str, Any]) -> Sensor:
    kind = _kind(sensor)
    return Sensor(str(sensor["name"]), kind, "link" if kind == "camera" else None)


def _kind(sensor: Mapping[str, Any]) -> SensorKind:
    protocol = str(sensor.get("protocol", "")).lower()
    return "camera" if protocol.startswith("camera") else "radar" if protocol.startswith("radar") else "other"


def _posed(sensor: Mapping[str, Any], *, source: str) -> WrittenPose:
    """Return a sensor's pose in the rig with its corrections applied, as written if it has none.

    Raises:
        InputError: a number is missing, or a correction is of an unknown kind.
    """
    place = f"rig.sensors {sensor.get('name')!r}"
    known = (_ROTATION_CORRECTION, _POSITION_CORRECTION)
    for key in sensor:
        if str(key).startswith("correction_") and key not in known and any(_numbers(sensor[key])):
            raise InputError(f"{source}: {place}: {key} is not zero; apply the correction to {POSE_KEY} first")
    pose = sensor.get(POSE_KEY)
    if not isinstance(pose, Mapping):
        raise InputError(f"{source}: {place}: no {POSE_KEY}; add the sensor's pose in the rig")
    angles_deg = floats(pose.get("roll-pitch-yaw"), source=source, place=f"{place}.roll-pitch-yaw", length=3)
    position_m = floats(pose.get("t"), source=source, place=f"{place}.t", length=3)
    nominal = WrittenPose("rpy", np.deg2rad(angles_deg), np.array(position_m), "radar_from_camera", "link", "deg")
    if not _is_corrected(sensor):
        return nominal
    turn_deg = _correction(sensor, _ROTATION_CORRECTION, source=source, place=place)
    shift_m = _correction(sensor, _POSITION_CORRECTION, source=source, place=place)
    rotation = matrix_from_rpy(np.deg2rad(angles_deg)) @ matrix_from_rpy(np.deg2rad(turn_deg))
    return WrittenPose("matrix", rotation, np.array(position_m) + shift_m, "radar_from_camera", "link")


def _is_corrected(sensor: Mapping[str, Any]) -> bool:
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
