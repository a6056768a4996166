"""The joints of a DriveWorks rig: each sensor's pose in the rig with its corrections, all with body axes."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from calib_core.errors import InputError
from calib_core.interchange.formats.driveworks import CORRECTED, is_corrected, posed_sensor
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Joint, Place, Sensor, TreePart

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
    protocols = [str(sensor.get("protocol", "")).lower() for sensor in sensors]
    return all(sum(name.startswith(kind) for name in protocols) == 1 for kind in ("radar", "camera"))


def read_driveworks(content: Content, source: str) -> TreePart:
    """Read every sensor with a pose; a joint whose numbers or corrections cannot be read cannot be used."""
    sensors = [one for one in content.mapping["rig"]["sensors"] if isinstance(one, Mapping) and one.get("name")]
    posed = [sensor for sensor in sensors if isinstance(sensor.get(_POSE), Mapping)]
    joints = tuple(_joint(one, content.text, source) for one in posed)
    corrected = any(is_corrected(one) for one in posed)
    return TreePart(
        "driveworks", joints, tuple(map(_sensor, posed)), notes=(_NOTE, CORRECTED) if corrected else (_NOTE,)
    )


def _joint(sensor: Mapping[str, Any], text: str, source: str) -> Joint:
    name = str(sensor["name"])
    at = text.find(f'"{name}"')
    place = Place(source, text.count("\n", 0, at) + 1 if at >= 0 else None)
    try:
        written = posed_sensor(sensor, source=source)
    except InputError as error:  # only of importance if this joint is used
        return Joint(_RIG, name, None, place, problem=str(error).removeprefix(f"{source}: "))
    return Joint.posed(_RIG, name, replace(written, axes="optical"), place)


def _sensor(sensor: Mapping[str, Any]) -> Sensor:
    protocol = str(sensor.get("protocol", "")).lower()
    if protocol.startswith("camera"):
        return Sensor(str(sensor["name"]), "camera", "link")
    return Sensor(str(sensor["name"]), "radar" if protocol.startswith("radar") else "other")
