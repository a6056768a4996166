"""ASAM OpenLABEL 1.0: objects by frame, each with bbox [centre u, centre v, width, height], a turned rbbox, or a cuboid.

A cuboid [x, y, z, rotation, sizes along x, y and z] is in a coordinate system of the file, whose poses in one another carry it to
the camera's. Without a rectangle of its own it needs the one camera's pinhole lens, too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from calib_core.boxes.formats.box_format import (
    BoxFile,
    BoxFormat,
    FileBoxes,
    FileFrame,
    cuboid_box,
    cuboid_of,
    numbers,
    rotated_box,
    stated_pose,
    whole_number,
)
from calib_core.errors import InputError, RecordingError
from calib_core.geometry import RigidTransform, rotation_from_euler
from calib_core.measurements import Box, TimeNs
from calib_core.recordings.time.written_times import read_time


def _root(file: BoxFile) -> Mapping[str, Any]:
    return _part(file.mapping, "openlabel") or _part(file.mapping, "vcd")


def _part(parent: Any, key: str) -> Mapping[str, Any]:
    value = parent.get(key) if isinstance(parent, dict) else None
    return value if isinstance(value, dict) else {}


def _recognizes(file: BoxFile) -> bool:
    return bool(_part(_root(file), "frames"))


def _read(file: BoxFile) -> FileBoxes:
    root = _root(file)
    objects = _part(root, "objects")
    cameras: set[str] = set()
    frames = []
    for number, frame in _part(root, "frames").items():
        place = f"{file.source}: frames.{number}"
        boxes: list[Box] = []
        for key, found in _part(frame, "objects").items():
            label, where = str(_part(objects, key).get("type", "")), f"{place}.objects.{key}"
            own = [
                (entry, _box(entry, key, label, f"{where}.{entry.get('name', 'bbox')}"))
                for kind in ("bbox", "rbbox")
                for entry in _entries(found, kind)
            ]
            cameras |= {str(entry["coordinate_system"]) for entry, _ in own if entry.get("coordinate_system")}
            cuboids = _entries(found, "cuboid")
            if cuboids:
                system = cuboids[0].get("coordinate_system") or _part(objects, key).get("coordinate_system")
                camera = _camera(root, [entry.get("coordinate_system") for entry, _ in own])
                boxes += _with_cuboid(root, cuboids[0], system, camera, [box for _, box in own], label, key, where)
            else:
                boxes += [box for _, box in own]
        frames.append(FileFrame(tuple(boxes), _stamp(frame, place), whole_number(number, place), _picture(frame)))
    if len(cameras) > 1:
        raise InputError(
            f"{file.source}: has the boxes of {len(cameras)} cameras ({', '.join(sorted(cameras)[:5])}); export one camera's"
        )
    return FileBoxes(tuple(frames), _size(root, file.source))


def _camera(root: Mapping[str, Any], stated: Sequence[Any]) -> str:
    """Return the name of the camera: that of an object's rectangle, else the one with a pinhole lens; "" if there is no one."""
    named = {str(name) for name in stated if name} or {
        name for name, stream in _part(root, "streams").items() if _lens(stream)
    }
    return next(iter(named)) if len(named) == 1 else ""


def _lens(stream: Any) -> Mapping[str, Any]:
    return _part(_part(stream, "stream_properties"), "intrinsics_pinhole")


def _with_cuboid(
    root: Mapping[str, Any],
    entry: Mapping[str, Any],
    system: Any,
    camera: str,
    own: Sequence[Box],
    label: str,
    key: str,
    place: str,
) -> Sequence[Box]:
    """Return the rectangles of an object with its cuboid, or the one around the cuboid; as they are if nothing says where it is.

    Raises:
        InputError: there is no rectangle, and nothing says where the cuboid is in the picture.
    """
    values = entry.get("val")
    if not isinstance(values, list) or len(values) not in (9, 10):
        raise InputError(f"{place}.cuboid.val: expected 9 or 10 numbers; correct it")
    where = numbers(values, len(values), f"{place}.cuboid.val")
    poses = _root_from(root, str(system), place), _root_from(root, camera, place)
    lens = _lens(_part(root, "streams").get(camera))
    if poses[0] is None or poses[1] is None or not (own or lens):
        if own:
            return own
        raise InputError(
            f"{place}: has a cuboid and no bbox, and the file does not state the poses of the coordinate systems {str(system)!r} "
            "and of one camera with a pinhole lens; export them, or the rectangles of the camera's picture (bbox)"
        )
    turn = where[3:-3]
    rotation = np.array([turn[3], *turn[:3]]) if len(turn) == 4 else rotation_from_euler(*turn)
    camera_from_object = poses[1].inverse() @ poses[0] @ stated_pose(rotation, where[:3], place)
    if own:
        return [replace(box, cuboid=cuboid_of(camera_from_object, where[-3:])) for box in own]
    rows = numbers(lens.get("camera_matrix_3x4"), 12, f"{place}: camera_matrix_3x4")
    size = (
        whole_number(lens.get("width_px"), f"{place}: width_px"),
        whole_number(lens.get("height_px"), f"{place}: height_px"),
    )
    matrix_px = np.array(rows).reshape(3, 4)[:, :3]
    box = cuboid_box(camera_from_object, where[-3:], matrix_px, size, label=label, track=key)
    return [box] if box else []


def _root_from(root: Mapping[str, Any], system: str, place: str) -> RigidTransform | None:
    """Return the pose of a coordinate system in the outermost one; None if the file does not state it."""
    systems = _part(root, "coordinate_systems")
    pose, seen = RigidTransform.identity(), set[str]()
    while system not in seen:
        if system not in systems:
            return None
        seen.add(system)
        own = _part(systems, system)
        stated, parent = _part(own, "pose_wrt_parent"), own.get("parent")
        if not parent:
            return pose
        where = f"{place}: pose of {system}"
        if "matrix4x4" in stated:
            matrix = np.array(numbers(stated["matrix4x4"], 16, where)).reshape(4, 4)
            pose = stated_pose(matrix[:3, :3], matrix[:3, 3].tolist(), where) @ pose
        elif "quaternion" in stated and "translation" in stated:
            x, y, z, w = numbers(stated["quaternion"], 4, where)
            pose = stated_pose(np.array([w, x, y, z]), numbers(stated["translation"], 3, where), where) @ pose
        else:
            return None
        system = str(parent)
    raise InputError(f"{place}: the coordinate system {system} is its own parent; correct it")


def _entries(found: Any, kind: str) -> list[Mapping[str, Any]]:
    """Return what an object has of one kind in a frame."""
    listed = _part(found, "object_data").get(kind)
    return [entry for entry in listed if isinstance(entry, dict)] if isinstance(listed, list) else []


def _box(entry: Mapping[str, Any], key: str, label: str, place: str) -> Box:
    values = entry.get("val")
    if not isinstance(values, list) or len(values) not in (4, 5):
        raise InputError(f"{place}.val: expected [centre u, centre v, width, height]; correct it")
    stated = numbers(values, len(values), f"{place}.val")
    angle_rad = stated[4] if len(stated) == 5 else 0.0
    return rotated_box(stated[:2], stated[2:4], angle_rad, f"{place}.val", label=label, score=1.0, track=key)


def _stamp(frame: Any, place: str) -> TimeNs | None:
    """Return the stamp of a frame: its own, else the one stream's."""
    properties = _part(frame, "frame_properties")
    stated = [properties.get("timestamp")]
    for stream in _part(properties, "streams").values():
        sync = _part(_part(stream, "stream_properties"), "sync")
        stated.append(sync.get("timestamp"))
    written = next((one for one in stated if isinstance(one, str | int | float) and not isinstance(one, bool)), None)
    if written is None:
        return None
    try:
        return read_time(str(written))
    except RecordingError:  # counted from the file's own beginning: the frames are matched by number
        return None


def _picture(frame: Any) -> str:
    streams = _part(_part(frame, "frame_properties"), "streams").values()
    uri = next((stream["uri"] for stream in streams if isinstance(stream, dict) and "uri" in stream), "")
    return PurePosixPath(str(uri)).stem if uri else ""


def _size(root: Mapping[str, Any], source: str) -> tuple[int, int] | None:
    sizes = set()
    for stream in _part(root, "streams").values():
        lens = _lens(stream)
        if "width_px" in lens and "height_px" in lens:
            width, height = (whole_number(lens[key], f"{source}: {key}") for key in ("width_px", "height_px"))
            sizes.add((width, height))
    return next(iter(sizes)) if len(sizes) == 1 else None


OPENLABEL = BoxFormat("OpenLABEL", _recognizes, _read)
