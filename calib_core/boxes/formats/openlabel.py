"""ASAM OpenLABEL 1.0: objects by frame, each with bbox [centre u, centre v, width, height], a turned rbbox, or a cuboid.

A cuboid [x, y, z, rotation, sizes along x, y and z] is in a coordinate system of the file, whose poses in one another carry it to
the camera's; a transform that a frame states, as of a moving vehicle, holds in that frame. With no rectangle of its own it needs
the one camera's pinhole lens, too.
"""

import itertools
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

_Moved = Mapping[tuple[str, str], Any]


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
    moving = {pair for frame in _part(root, "frames").values() for pair in _moved(frame)}
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
                lenses = {name: one for name, one in _streams(frame).items() if _lens(one)}
                now = {**root, "streams": {**_part(root, "streams"), **lenses}}
                moved = dict.fromkeys(moving) | _moved(frame)
                boxes += _with_cuboid(
                    now, moved, cuboids[0], system, camera, [box for _, box in own], label, key, where
                )
            else:
                boxes += [box for _, box in own]
        frames.append(FileFrame(tuple(boxes), _stamp(frame, place), whole_number(number, place), _image(frame)))
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


def _moved(frame: Any) -> dict[tuple[str, str], Any]:
    """Return the transforms that a frame states, by the systems that they lead from and to."""
    stated = _part(_part(frame, "frame_properties"), "transforms").values()
    return {(str(one.get("src")), str(one.get("dst"))): one for one in stated if isinstance(one, dict)}


def _with_cuboid(
    root: Mapping[str, Any],
    moved: _Moved,
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
        InputError: there is no rectangle, and nothing says where the cuboid is in the image.
    """
    values = entry.get("val")
    if not isinstance(values, list) or len(values) not in (9, 10):
        raise InputError(f"{place}.cuboid.val: expected 9 or 10 numbers; correct it")
    where = numbers(values, len(values), f"{place}.cuboid.val")
    camera_from_source = _pose(root, moved, camera, str(system), place)
    lens = _lens(_part(root, "streams").get(camera))
    if camera_from_source is None or not (own or lens):
        if own:
            return own
        raise InputError(
            f"{place}: has a cuboid and no bbox, and the file does not state the poses in this frame of the coordinate systems "
            f"{str(system)!r} and of one camera with a pinhole lens; export them, or the rectangles of the image (bbox)"
        )
    turn = where[3:-3]
    rotation = np.array([turn[3], *turn[:3]]) if len(turn) == 4 else rotation_from_euler(*turn)
    camera_from_object = camera_from_source @ stated_pose(rotation, where[:3], place)
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


def _pose(root: Mapping[str, Any], moved: _Moved, camera: str, system: str, place: str) -> RigidTransform | None:
    """Return the pose of a coordinate system in the camera's; None if the file does not state it.

    Raises:
        InputError: a frame's transform leads past a parent, so that the poses of systems may be stated twice.
    """
    systems = _part(root, "coordinate_systems")
    for one, other in moved:
        parents = _part(systems, one).get("parent"), _part(systems, other).get("parent")
        if one in systems and other in systems and other != parents[0] and one != parents[1]:
            raise InputError(
                f"{place}: a transform leads from {one} to {other}, of which neither is the other's parent in "
                "coordinate_systems; state the transform from a system to its parent"
            )
    above_camera, above_system = (_ancestors(root, name, place) for name in (camera, system))
    shared = next((name for name in above_camera if name in above_system), None)
    if shared is None:
        return None
    poses = []
    for above in (above_camera, above_system):
        pose = RigidTransform.identity()
        for child, parent in itertools.pairwise(above[: above.index(shared) + 1]):
            parent_from_child = _link(root, moved, child, parent, f"{place}: pose of {child}")
            if parent_from_child is None:
                return None
            pose = parent_from_child @ pose
        poses.append(pose)
    return poses[0].inverse() @ poses[1]


def _ancestors(root: Mapping[str, Any], system: str, place: str) -> list[str]:
    """Return a coordinate system, its parent and so on; none if the file does not have it."""
    systems = _part(root, "coordinate_systems")
    found: list[str] = []
    while system in systems:
        if system in found:
            raise InputError(f"{place}: the coordinate system {system} is its own parent; correct it")
        found.append(system)
        system = str(_part(systems, system).get("parent") or "")
    return found


def _link(root: Mapping[str, Any], moved: _Moved, child: str, parent: str, place: str) -> RigidTransform | None:
    """Return parent_from_child: the frame's, else the one that always holds; None if that is not stated."""
    for pair in ((child, parent), (parent, child)):
        if pair in moved:
            transform = _stated_transform(_part(moved[pair], "transform_src_to_dst"), place)
            return transform if transform is None or pair[0] == child else transform.inverse()
    return _stated_transform(_part(_part(_part(root, "coordinate_systems"), child), "pose_wrt_parent"), place)


def _stated_transform(pose: Mapping[str, Any], place: str) -> RigidTransform | None:
    if "matrix4x4" in pose:
        matrix = np.array(numbers(pose["matrix4x4"], 16, place)).reshape(4, 4)
        return stated_pose(matrix[:3, :3], matrix[:3, 3].tolist(), place)
    if "quaternion" in pose and "translation" in pose:
        x, y, z, w = numbers(pose["quaternion"], 4, place)
        return stated_pose(np.array([w, x, y, z]), numbers(pose["translation"], 3, place), place)
    return None


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
    for stream in _streams(frame).values():
        sync = _part(_part(stream, "stream_properties"), "sync")
        stated.append(sync.get("timestamp"))
    written = next((one for one in stated if isinstance(one, str | int | float) and not isinstance(one, bool)), None)
    if written is None:
        return None
    try:
        return read_time(str(written))
    except RecordingError:  # counted from the file's own beginning: the frames are matched by number
        return None


def _streams(frame: Any) -> Mapping[str, Any]:
    return _part(_part(frame, "frame_properties"), "streams")


def _image(frame: Any) -> str:
    uri = next(
        (stream["uri"] for stream in _streams(frame).values() if isinstance(stream, dict) and "uri" in stream), ""
    )
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
