"""Autoware's sensor kit: each sensor's pose in sensor_kit_base_link, the camera with body axes."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import (
    Format,
    ImportedCalibration,
    Reads,
    WrittenPose,
    looks_like_camera,
    looks_like_radar,
    posed_between,
)
from calib_core.interchange.formats.statement import (
    POSE_ONLY,
    hash_comment,
    stated_check_point,
    stated_frames,
    statement,
)
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, rpy_from_matrix
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import number_text, quoted

_NOTES = (
    "poses are in sensor_kit_base_link; the radar is at the kit's origin unless its pose is given (--parent-from-radar)",
    POSE_ONLY,
)
_KIT = "sensor_kit_base_link"
_POSE_KEYS = ("x", "y", "z", "roll", "pitch", "yaw")


def _write(file: CalibrationFile) -> str:
    """Write sensor_kit_calibration.yaml with the radar at the kit's origin."""
    return _write_in_kit(file, RigidTransform.identity())


def _write_in_kit(file: CalibrationFile, kit_from_radar: RigidTransform) -> str:
    """Write sensor_kit_calibration.yaml with the radar at its pose in the kit."""
    frames = file.frames
    kit_from_link = kit_from_radar @ file.calibration.camera_from_radar.inverse() @ LINK_FROM_OPTICAL.inverse()
    meaning = (
        f"each entry is its pose in {_KIT}; angles in radians about fixed axes, R = Rz(yaw) Ry(pitch) Rx(roll); "
        f"{frames.camera_link} has body axes (x forward, y left, z up)"
    )
    return (
        hash_comment(statement(file, meaning))
        + f"{_KIT}:\n"
        + _autoware_entry(frames.radar, kit_from_radar)
        + _autoware_entry(frames.camera_link, kit_from_link)
    )


def _autoware_entry(name: str, kit_from_sensor: RigidTransform) -> str:
    numbers = (*kit_from_sensor.translation_m, *rpy_from_matrix(kit_from_sensor.rotation))
    rows = "".join(f"    {key}: {number_text(value)}\n" for key, value in zip(_POSE_KEYS, numbers, strict=True))
    return f"  {quoted(name)}:\n{rows}"


def _recognizes(content: Content) -> bool:
    return any(_is_kit(value) for value in content.mapping.values())


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read a kit that contains one radar and one camera.

    Raises:
        InputError: it contains more or fewer sensors, or a number is missing.
    """
    kit_name, kit = next(((str(key), value) for key, value in content.mapping.items() if _is_kit(value)), ("", {}))
    stated = stated_frames(content.text)
    kit = {str(name): entry for name, entry in kit.items() if isinstance(entry, Mapping)}
    radars = [name for name in kit if (stated.radar == name if stated else looks_like_radar(name))]
    cameras = [name for name in kit if name not in radars and (stated or looks_like_camera(name))]
    if len(radars) != 1 or len(cameras) != 1:
        raise InputError(
            f"{source}: {kit_name}: contains {len(radars)} radars and {len(cameras)} cameras by name; keep one of each"
        )
    radar, camera = radars[0], cameras[0]
    kit_from_radar, kit_from_camera = (
        _posed(kit[name], source=source, place=f"{kit_name}.{name}") for name in (radar, camera)
    )
    numbers, both = kit_from_camera, None
    if np.any(kit_from_radar.as_written().as_matrix() != np.eye(4)):
        radar_from_camera = kit_from_radar.as_written().inverse() @ kit_from_camera.as_written()
        numbers = WrittenPose(
            "matrix", radar_from_camera.rotation, radar_from_camera.translation_m, "radar_from_camera"
        )
        both = kit_from_radar, kit_from_camera
    roles = posed_between(radar, camera, stated, numbers)
    return ImportedCalibration(
        "autoware",
        roles.pose,
        frames=roles.frames,
        check_point=stated_check_point(content.text),
        assumptions=roles.assumptions,
        in_third_frame=both,
    ).checked(source)


def _posed(entry: Mapping[str, Any], *, source: str, place: str) -> WrittenPose:
    """Return the pose of a sensor in the kit."""
    numbers = [floats(entry.get(key), source=source, place=f"{place}.{key}", length=1)[0] for key in _POSE_KEYS]
    return WrittenPose("rpy", np.array(numbers[3:]), np.array(numbers[:3]), "radar_from_camera")


def _is_kit(value: Any) -> bool:
    return isinstance(value, Mapping) and any(isinstance(entry, Mapping) and "yaw" in entry for entry in value.values())


AUTOWARE = Format(
    name="autoware",
    title="Autoware sensor kit",
    used_in="Vehicle stacks",
    also="ROS 2 xacro vehicle kit",
    numbers="pose of each sensor in sensor_kit_base_link, roll pitch yaw about fixed axes; camera_link has body axes",
    file_name="sensor_kit_calibration.yaml",
    camera="none",
    comment="#",
    notes=_NOTES,
    write=_write,
    write_in_parent=_write_in_kit,
    reads=Reads(_recognizes, _read),
)
