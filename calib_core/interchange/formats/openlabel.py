"""ASAM OpenLABEL 1.0: coordinate systems with poses in their parents, and streams with intrinsics."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.cameras.camera_format import FoundCamera, with_camera
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import (
    ImportedCalibration,
    Reads,
    WrittenPose,
    looks_like_camera,
    looks_like_radar,
)
from calib_core.interchange.formats.pose_parts import direction_by_facing, rigid, rigid_matrix
from calib_core.interchange.syntax.content import Content

_ASSUMPTIONS = (
    "assumed that pose_wrt_parent is the pose in the parent, as the standard words it; some data sets write the inverse",
    "assumed a radar with x forward, y left, z up, and optical camera axes",
)
_UNTYPED = (None, "", "other")  # OpenLABEL's types of streams are camera, lidar, radar, gps_imu and other


def _recognizes(content: Content) -> bool:
    inner = content.json_mapping.get("openlabel")
    return isinstance(inner, Mapping) and "coordinate_systems" in inner


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the one radar and the one camera among the coordinate systems, through their common parent.

    Raises:
        InputError: there are more or fewer, they have no common parent, or a pose is invalid.
    """
    label = content.mapping["openlabel"]
    systems = {str(name): system for name, system in _mapping(label, "coordinate_systems").items()}
    streams = _mapping(label, "streams")
    radar, camera = (_one(systems, streams, role, source=source) for role in ("radar", "camera"))
    radar_parent, parent_from_radar = _rooted(radar, systems, source=source)
    camera_parent, parent_from_camera = _rooted(camera, systems, source=source)
    if radar_parent != camera_parent:
        raise InputError(f"{source}: {radar!r} and {camera!r} have no common parent; give both in one frame")
    radar_from_camera = parent_from_radar.inverse() @ parent_from_camera
    if direction_by_facing(radar_from_camera.rotation) == "camera_from_radar":
        raise InputError(
            f"{source}: coordinate_systems: {camera!r} looks away from {radar!r}, and would not if pose_wrt_parent were "
            "inverted, as some data sets write it; write it as the pose in the parent"
        )
    calibration = ImportedCalibration(
        "openlabel",
        WrittenPose("matrix", radar_from_camera.rotation, radar_from_camera.translation_m, "radar_from_camera"),
        frames=FrameNames(radar, camera),
        assumptions=_ASSUMPTIONS,
    ).checked(source)
    return with_camera(calibration, _camera(_mapping(streams, camera), source=source), source=source)


def _mapping(values: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    inner = values.get(key)
    return inner if isinstance(inner, Mapping) else {}


def _one(systems: Mapping[str, Any], streams: Mapping[str, Any], role: str, *, source: str) -> str:
    """Return the one coordinate system of a radar or camera, by the type of its stream, else by name."""
    by_name = looks_like_radar if role == "radar" else looks_like_camera
    typed = {name: _mapping(streams, name).get("type") for name in systems}
    fitting = [name for name in systems if typed[name] == role or (typed[name] in _UNTYPED and by_name(name))]
    if len(fitting) != 1:
        named = f" ({', '.join(fitting)})" if fitting else ""
        raise InputError(
            f"{source}: coordinate_systems: {len(fitting)} {role}s by stream type or name{named} among {', '.join(systems)}; "
            "keep one radar and one camera"
        )
    return fitting[0]


def _rooted(name: str, systems: Mapping[str, Any], *, source: str) -> tuple[str, RigidTransform]:
    """Return the topmost parent of a coordinate system, and its pose there."""
    parent_from_sensor, seen = RigidTransform.identity(), {name}
    while name in systems:
        system = systems[name]
        if not isinstance(system, Mapping):
            raise InputError(f"{source}: coordinate_systems.{name}: not an object; correct it")
        parent_from_sensor = _pose(system.get("pose_wrt_parent"), name, source=source) @ parent_from_sensor
        parent = str(system.get("parent") or "")
        if not parent:
            break
        if parent in seen:
            raise InputError(f"{source}: coordinate_systems.{name}: its parents form a circle; correct parent")
        seen.add(parent)
        name = parent
    return name, parent_from_sensor


def _pose(value: Any, name: str, *, source: str) -> RigidTransform:
    place = f"coordinate_systems.{name}.pose_wrt_parent"
    if value is None:
        return RigidTransform.identity()
    if not isinstance(value, Mapping):
        value = {"matrix4x4": value}  # as before version 1.0
    if "matrix4x4" in value:
        matrix = rigid_matrix(value["matrix4x4"], source=source, place=f"{place}.matrix4x4")
        return rigid("matrix", matrix[:3, :3], matrix[:3, 3], source=source)
    if "quaternion" in value:
        quaternion = floats(value["quaternion"], source=source, place=f"{place}.quaternion", length=4)
        translation_m = floats(value.get("translation"), source=source, place=f"{place}.translation", length=3)
        return rigid("quaternion_xyzw", quaternion, translation_m, source=source)
    raise InputError(f"{source}: {place}: neither matrix4x4 nor quaternion and translation; write it as one of these")


def _camera(stream: Mapping[str, Any], *, source: str) -> FoundCamera | None:
    block = _mapping(_mapping(stream, "stream_properties"), "intrinsics_pinhole")
    key = next((key for key in ("camera_matrix_3x4", "camera_matrix") if key in block), None)
    if key is None:
        return None
    numbers = floats(block[key], source=source, place=key)
    if len(numbers) not in (9, 12):
        raise InputError(f"{source}: {key}: expected 12 numbers, found {len(numbers)}; correct it")
    matrix = np.reshape(numbers, (3, -1))
    if matrix[:, 3:].any() or np.abs(matrix[2, :3] - [0, 0, 1]).max() > 0:
        raise InputError(f"{source}: {key}: is a projection with a pose in it, not a camera matrix; give K and zeros")
    distortion = next((block[key] for key in ("distortion_coeffs_1xN", "distortion_coeffs") if block.get(key)), ())
    size = [block.get("width_px"), block.get("height_px")]
    width, height = floats(size, source=source, place="width_px, height_px") if all(size) else (0.0, 0.0)
    return FoundCamera(
        name=key,
        model="",
        matrix_px=tuple(matrix[:, :3].ravel().tolist()),
        distortion=floats(distortion, source=source, place="distortion_coeffs"),
        size_px=(int(width), int(height)) if all(size) else None,
    )


OPENLABEL = Reads(_recognizes, _read)
