"""ASAM OpenLABEL 1.0: coordinate systems with poses in their parents, and streams with intrinsics."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.cameras.camera_format import FoundCamera
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import WrittenPose, looks_like_camera, looks_like_radar
from calib_core.interchange.pose_parts import direction_by_facing, rigid, rigid_rows
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_choice import WantedFrames, choose_frames
from calib_core.interchange.trees.frame_tree import Joint, Place, Sensor, TreePart, joined

_ASSUMPTIONS = (
    "assumed that pose_wrt_parent is the pose in the parent, as the standard words it; some data sets write the inverse",
    "assumed a radar with x forward, y left, z up, and optical camera axes",
)
_UNTYPED = (None, "", "other")  # OpenLABEL's types of streams are camera, lidar, radar, gps_imu and other


def recognizes_openlabel(content: Content) -> bool:
    """Return whether JSON is OpenLABEL with coordinate systems."""
    inner = content.json_mapping.get("openlabel")
    return isinstance(inner, Mapping) and "coordinate_systems" in inner


def read_openlabel(content: Content, source: str) -> TreePart:
    """Read every coordinate system with a parent, and what the streams say of their sensors.

    Raises:
        InputError: a pose is invalid, or the camera faces the radar only if the poses are inverted.
    """
    label = content.mapping["openlabel"]
    systems = {str(name): system for name, system in _mapping(label, "coordinate_systems").items()}
    streams = _mapping(label, "streams")
    joints = tuple(
        joint
        for number, (name, system) in enumerate(systems.items())
        if (joint := _joint(name, system, number, source))
    )
    sensors = (_sensor(name, _mapping(streams, name), source) for name in systems)
    part = TreePart("openlabel", tuple(filter(None, joints)), tuple(sensors), assumptions=_ASSUMPTIONS)
    _refuse_inverted(part, source)
    return part


def _joint(name: str, system: Any, number: int, source: str) -> Joint | None:
    if not isinstance(system, Mapping):
        raise InputError(f"{source}: coordinate_systems.{name}: not an object; correct it")
    parent, pose = str(system.get("parent") or ""), _pose(system.get("pose_wrt_parent"), name, source=source)
    if not parent and "pose_wrt_parent" not in system:
        return None
    written = WrittenPose("matrix", pose.rotation, pose.translation_m, "radar_from_camera")
    return Joint.posed(parent or f"world {number}", name, written, Place(source))


def _sensor(name: str, stream: Mapping[str, Any], source: str) -> Sensor:
    """Return what is known of the sensor at a coordinate system: its kind by the type of its stream, else by its name."""
    kind = stream.get("type")
    if kind in _UNTYPED:
        kind = "radar" if looks_like_radar(name) else "camera" if looks_like_camera(name) else "other"
    if kind == "camera":
        return Sensor(name, "camera", "optical", _camera(stream, source=source))
    return Sensor(name, "radar" if kind == "radar" else "other")


def _refuse_inverted(part: TreePart, source: str) -> None:
    tree = joined([part])
    try:
        chosen = choose_frames(tree, WantedFrames(), source=source)
        rotation = tree.between(chosen.radar, chosen.camera).rotation
    except InputError:
        return  # choosing the frames says what is wrong
    if direction_by_facing(rotation) == "camera_from_radar":
        raise InputError(
            f"{source}: coordinate_systems: {chosen.camera!r} looks away from {chosen.radar!r}, and would not if "
            "pose_wrt_parent were inverted, as some data sets write it; write it as the pose in the parent"
        )


def _mapping(values: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    inner = values.get(key)
    return inner if isinstance(inner, Mapping) else {}


def _pose(value: Any, name: str, *, source: str) -> RigidTransform:
    place = f"coordinate_systems.{name}.pose_wrt_parent"
    if value is None:
        return RigidTransform.identity()
    if not isinstance(value, Mapping):
        value = {"matrix4x4": value}  # as before version 1.0
    if "matrix4x4" in value:
        rows = rigid_rows(value["matrix4x4"], source=source, place=f"{place}.matrix4x4")
        return rigid("matrix", rows[:, :3], rows[:, 3], source=source)
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
