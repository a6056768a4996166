"""The joints of a DriveWorks rig: each sensor's nominal pose in the rig, angles in degrees, all with body axes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.imported import WrittenPose
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Sensor
from calib_core.interchange.trees.joint import Joint, Place
from calib_core.interchange.trees.tree_part import TreePart

__all__ = ["has_one_of_each", "read_driveworks", "recognizes_driveworks"]

_POSE = "nominalSensor2Rig_FLU"
_RIG = "rig"
_NOTE = "the format defines the camera axes as body axes (x forward, y left, z up)"


def recognizes_driveworks(content: Content) -> bool:
    """Return whether JSON is a rig file."""
    rig = content.json_mapping.get("rig")
    return isinstance(rig, Mapping) and isinstance(rig.get("sensors"), list)


def has_one_of_each(content: Content) -> bool:
    """Return whether a rig has exactly one radar and one camera, which the format's own reader reads."""
    sensors = [one for one in content.mapping["rig"]["sensors"] if isinstance(one, Mapping)]
    protocols = [str(one.get("protocol", "")).lower() for one in sensors]
    return all(sum(name.startswith(kind) for name in protocols) == 1 for kind in ("radar", "camera"))


def read_driveworks(content: Content, source: str) -> TreePart:
    """Read every sensor with a pose.

    Raises:
        InputError: a number is missing, or is none.
    """
    sensors = [one for one in content.mapping["rig"]["sensors"] if isinstance(one, Mapping) and one.get("name")]
    posed = [one for one in sensors if isinstance(one.get(_POSE), Mapping)]
    joints = tuple(_joint(one, content.text, source) for one in posed)
    return TreePart("driveworks", joints, tuple(map(_sensor, posed)), notes=(_NOTE,))


def _joint(sensor: Mapping[str, Any], text: str, source: str) -> Joint:
    name, pose = str(sensor["name"]), sensor[_POSE]
    at = text.find(f'"{name}"')
    place = Place(source, text.count("\n", 0, at) + 1 if at >= 0 else None)
    corrected = [key for key in sensor if key.startswith("correction_") and any(_numbers(sensor[key]))]
    if corrected:
        problem = f"{corrected[0]} is not zero; apply the correction to {_POSE} first"
        return Joint(_RIG, name, None, place, problem=problem)
    angles_deg = floats(pose.get("roll-pitch-yaw"), source=source, place=f"{name}.roll-pitch-yaw", length=3)
    position_m = floats(pose.get("t"), source=source, place=f"{name}.t", length=3)
    written = WrittenPose("rpy", np.deg2rad(angles_deg), np.array(position_m), "radar_from_camera")
    return Joint.posed(_RIG, name, written, place)


def _sensor(sensor: Mapping[str, Any]) -> Sensor:
    protocol = str(sensor.get("protocol", "")).lower()
    if protocol.startswith("camera"):
        return Sensor(str(sensor["name"]), "camera", "link")
    return Sensor(str(sensor["name"]), "radar" if protocol.startswith("radar") else "other")


def _numbers(value: Any) -> list[Any]:
    inner = value.get("roll-pitch-yaw") if isinstance(value, Mapping) else value
    return list(inner) if isinstance(inner, list) else [inner]
