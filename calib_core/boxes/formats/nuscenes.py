"""nuScenes: the tables of one version, such as v1.0-mini, with a cuboid for each object of a keyframe.

A cuboid is in the axes of the map; the vehicle's and the camera's poses of an image carry it there. Images are undistorted.
Tables of the whole set have up to 1 GB: they are read row by row, and only what belongs to recorded images is kept.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from calib_core.boxes.formats.box_format import (
    BoxFile,
    BoxFormat,
    FileBoxes,
    FileFrame,
    cuboid_box,
    numbers,
    stated_pose,
    whole_number,
)
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.measurements import TimeNs
from calib_core.parsing import json_rows, json_value

ANNOTATIONS = "sample_annotation"
_Row = Mapping[str, Any]


def _recognizes(file: BoxFile) -> bool:
    first = file.value[0] if isinstance(file.value, list) and file.value else None
    alone = isinstance(first, dict) and {"sample_token", "instance_token"} <= first.keys()
    return alone or any(PurePosixPath(name).name == f"{ANNOTATIONS}.json" for name in file.members)


def _read(file: BoxFile) -> FileBoxes:
    recorded, seen = set(file.image_names), Counter[bool]()

    def is_shown(row: _Row) -> bool:
        if not (row.get("is_key_frame") and row.get("width")):
            return False
        seen[_stem(row) in recorded] += 1
        return _stem(row) in recorded

    shown = _table(file, "sample_data", is_shown).values()
    if not shown:
        raise InputError(
            f"{file.source}: none of its {seen.total()} images of keyframes is a recorded frame; open the set's own "
            "images, such as samples/CAM_FRONT"
        )
    samples = {str(row.get("sample_token")) for row in shown}
    of_sample: dict[Any, list[_Row]] = {}
    for row in _table(file, ANNOTATIONS, lambda row: str(row.get("sample_token")) in samples).values():
        of_sample.setdefault(row.get("sample_token"), []).append(row)
    poses = {str(row.get("ego_pose_token")) for row in shown}
    tables = {name: _table(file, name, lambda _: True) for name in ("calibrated_sensor", "instance", "category")}
    tables["ego_pose"] = _table(file, "ego_pose", lambda row: row["token"] in poses)
    frames, sizes = [], set()
    for image in shown:
        place = f"{file.source}: sample_data {image.get('token')}"
        size = (whole_number(image["width"], place), whole_number(image.get("height"), place))
        sensor = _row(tables, "calibrated_sensor", image.get("calibrated_sensor_token"), place)
        vehicle = _row(tables, "ego_pose", image.get("ego_pose_token"), place)
        camera_from_map = (_pose(vehicle, place) @ _pose(sensor, place)).inverse()
        lens = sensor.get("camera_intrinsic")
        rows = lens if isinstance(lens, list) and len(lens) == 3 else [[]]
        matrix_px = np.array([numbers(row, 3, f"{place}: camera_intrinsic") for row in rows])
        boxes = []
        for found in of_sample.get(image.get("sample_token"), ()):
            where = f"{file.source}: {ANNOTATIONS} {found.get('token')}"
            width_m, length_m, height_m = numbers(found.get("size"), 3, f"{where}: size")
            instance = _row(tables, "instance", found.get("instance_token"), where)
            label = str(_row(tables, "category", instance.get("category_token"), where).get("name", ""))
            camera_from_object = camera_from_map @ _pose(found, where)
            name = str(found.get("instance_token"))
            boxes.append(
                cuboid_box(camera_from_object, (length_m, width_m, height_m), matrix_px, size, label=label, track=name)
            )
        stamp = TimeNs(1000 * whole_number(image.get("timestamp"), f"{place}: timestamp", most=1e18))
        frames.append(FileFrame(tuple(box for box in boxes if box), stamp=stamp, name=_stem(image)))
        sizes.add(size)
    return FileBoxes(tuple(frames), image_size_px=next(iter(sizes)) if len(sizes) == 1 else None)


def _stem(image: _Row) -> str:
    return PurePosixPath(str(image.get("filename"))).stem


def _table(file: BoxFile, name: str, wanted: Callable[[_Row], bool]) -> dict[str, _Row]:
    """Return the wanted rows of a table by their tokens.

    Raises:
        InputError: it is not there, or is no table.
    """
    found = [member for member in file.members if PurePosixPath(member).name == f"{name}.json"]
    if len(found) != 1:
        raise InputError(
            f"{file.source}: expected one table {name}.json, found {len(found)}; give the folder with all tables of one version"
        )
    return {row["token"]: row for row in _rows(file, found[0]) if wanted(row)}


def _rows(file: BoxFile, member: str) -> Iterator[_Row]:
    place = f"{file.source}/{member}"
    rows = (
        json_rows(file.tables / member, source=place) if file.tables else json_value(file.members[member], source=place)
    )
    for row in rows if file.tables or isinstance(rows, list) else [rows]:
        if not isinstance(row, dict) or not isinstance(row.get("token"), str):
            raise InputError(f"{place}: expected a list of rows with a token each; is it the right file?")
        yield row


def _row(tables: Mapping[str, Mapping[Any, _Row]], name: str, token: Any, place: str) -> _Row:
    row = tables[name].get(token) if isinstance(token, str) else None
    if row is None:
        raise InputError(f"{place}: names a row of {name}.json that is not there; give the tables of one version")
    return row


def _pose(row: _Row, place: str) -> RigidTransform:
    turn = np.array(numbers(row.get("rotation"), 4, f"{place}: rotation"))
    return stated_pose(turn, numbers(row.get("translation"), 3, f"{place}: translation"), place)


NUSCENES = BoxFormat("nuScenes tables", _recognizes, _read)
