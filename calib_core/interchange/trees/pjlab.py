"""The joints of PJLab's SensorsCalibration: each matrix carries the points of a sensor into its target."""

from collections.abc import Mapping
from typing import Any

from calib_core.errors import InputError
from calib_core.interchange.format import WrittenPose, looks_like_camera, looks_like_radar
from calib_core.interchange.pose_parts import AXES_ASSUMED, rigid_rows
from calib_core.interchange.statement import STATEMENT_KEY, stated_lines
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Joint, Place, Sensor, TreePart


def recognizes_extrinsics(content: Content) -> bool:
    """Return whether JSON holds extrinsics of such sensors."""
    return bool(_extrinsics(content))


def _extrinsics(content: Content) -> list[Mapping[str, Any]]:
    return [
        entry
        for entry in content.json_mapping.values()
        if isinstance(entry, Mapping) and isinstance(entry.get("param"), Mapping) and "sensor_calib" in entry["param"]
    ]


def read_extrinsics(content: Content, source: str) -> TreePart:
    """Read the only extrinsic, or of several the one between a radar and a camera.

    Raises:
        InputError: there is none, or more than one, or the matrix is not rigid.
    """
    entries = _extrinsics(content)
    between = entries if len(entries) == 1 else list(filter(_is_between_both, entries))
    if len(between) != 1:
        named = ", ".join(" to ".join(_sensors(entry)) for entry in entries[:6])
        raise InputError(
            f"{source}: contains {named}, {len(between)} of them between a radar and a camera by sensor_name and "
            "target_sensor_name; give the extrinsic of the radar to the camera"
        )
    sensor, target = _sensors(between[0])
    rows = rigid_rows(between[0]["param"]["sensor_calib"], source=source, place="param.sensor_calib.data")
    written = WrittenPose("matrix", rows[:, :3], rows[:, 3], "radar_from_camera")
    text = stated_lines(between[0].get(STATEMENT_KEY))
    return TreePart(
        "pjlab",
        (Joint.posed(target, sensor, written, Place(source)),),
        tuple(Sensor(name, "camera", "optical") for name in (sensor, target) if looks_like_camera(name)),
        assumptions=() if text else (AXES_ASSUMED,),
        statement=text,
    )


def _sensors(entry: Mapping[str, Any]) -> tuple[str, str]:
    return str(entry.get("sensor_name") or ""), str(entry.get("target_sensor_name") or "")


def _is_between_both(entry: Mapping[str, Any]) -> bool:
    return any(map(looks_like_radar, _sensors(entry))) and any(map(looks_like_camera, _sensors(entry)))
