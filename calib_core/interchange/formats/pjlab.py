"""SensorsCalibration of PJLab (OpenCalib): one JSON per pair of sensors, a 4x4 matrix from the sensor to its target."""

from collections.abc import Mapping
from typing import Any

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames
from calib_core.interchange.format import (
    Direction,
    Format,
    ImportedCalibration,
    Reads,
    WrittenPose,
    looks_like_camera,
    looks_like_radar,
)
from calib_core.interchange.formats.pose_parts import AXES_ASSUMED, rigid_matrix
from calib_core.interchange.statement import (
    POSE_ONLY,
    STATEMENT_KEY,
    stated_check_point,
    stated_frames,
    stated_lines,
    statement,
)
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.strict_json import json_text

_NUMBERS = "sensor_calib.data carries radar points into the camera (p_target = matrix p_sensor)"
_CV_64F = 6


def _write(file: CalibrationFile) -> str:
    """Write the extrinsic of the radar to the camera; the statement is inside, because readers take the first key."""
    frames = file.frames
    entry = {
        "sensor_name": frames.radar,
        "target_sensor_name": frames.camera,
        "device_type": "relational",
        "param_type": "extrinsic",
        "param": {
            "time_lag": 0,
            "sensor_calib": {
                "rows": 4,
                "cols": 4,
                "type": _CV_64F,
                "continuous": True,
                "data": (file.calibration.camera_from_radar.as_matrix() + 0.0).tolist(),
            },
        },
        STATEMENT_KEY: list(statement(file, _NUMBERS)),
    }
    return json_text({f"{frames.radar}-to-{frames.camera}-extrinsic": entry})


def _recognizes(content: Content) -> bool:
    return bool(_extrinsics(content))


def _extrinsics(content: Content) -> list[Mapping[str, Any]]:
    return [
        entry
        for entry in content.json_mapping.values()
        if isinstance(entry, Mapping) and isinstance(entry.get("param"), Mapping) and "sensor_calib" in entry["param"]
    ]


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the one extrinsic between a radar and a camera.

    Raises:
        InputError: there is none, or more than one, or the matrix is not rigid.
    """
    found = [(entry, direction) for entry in _extrinsics(content) if (direction := _direction(entry)) is not None]
    if len(found) != 1:
        named = ", ".join(" to ".join(_sensors(entry)) for entry in _extrinsics(content)[:6])
        raise InputError(
            f"{source}: contains {named}, {len(found)} of them between a radar and a camera by sensor_name and "
            "target_sensor_name; give the extrinsic of the radar to the camera"
        )
    entry, direction = found[0]
    text = stated_lines(entry.get(STATEMENT_KEY))
    stated = stated_frames(text)
    matrix = rigid_matrix(entry["param"]["sensor_calib"], source=source, place="param.sensor_calib.data")
    sensor, target = _sensors(entry)
    frames = FrameNames(sensor, target) if direction == "camera_from_radar" else FrameNames(target, sensor)
    return ImportedCalibration(
        "pjlab",
        WrittenPose("matrix", matrix[:3, :3], matrix[:3, 3], direction),
        frames=stated or frames,
        check_point=stated_check_point(text),
        assumptions=() if stated else (AXES_ASSUMED,),
    ).checked(source)


def _sensors(entry: Mapping[str, Any]) -> tuple[str, str]:
    return str(entry.get("sensor_name") or ""), str(entry.get("target_sensor_name") or "")


def _direction(entry: Mapping[str, Any]) -> Direction | None:
    """Return which way the matrix goes; None if it is not between a radar and a camera."""
    stated = stated_frames(stated_lines(entry.get(STATEMENT_KEY)))
    sensor, target = _sensors(entry)
    if stated is not None and {sensor, target} == {stated.radar, stated.camera}:
        return "camera_from_radar" if sensor == stated.radar else "radar_from_camera"
    if looks_like_radar(sensor) and looks_like_camera(target):
        return "camera_from_radar"
    return "radar_from_camera" if looks_like_radar(target) and looks_like_camera(sensor) else None


PJLAB = Format(
    name="pjlab",
    title="PJLab SensorsCalibration extrinsic",
    used_in="Calibration tools and arrays",
    also="OpenCalib lidar radar camera",
    numbers=_NUMBERS,
    file_name="radar-to-camera-extrinsic.json",
    camera="none",
    pose_for="raw",
    comment="keys",
    notes=(POSE_ONLY,),
    write=_write,
    reads=Reads(_recognizes, _read),
)
