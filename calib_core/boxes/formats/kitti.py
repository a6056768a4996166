"""KITTI: label_02/NNNN.txt of the tracking benchmark, or a folder label_2 with one file per image.

Its boxes are pixel indices counted from 0, so they are ours without a shift. Regions marked DontCare are left out. A cuboid is
height, width, length, the middle of its floor in the camera's axes, and the turn about y that takes the camera's x to its length.
"""

import math
from dataclasses import replace
from pathlib import PurePosixPath

from calib_core.boxes.formats.box_format import (
    BoxFile,
    BoxFormat,
    FileBoxes,
    FileFrame,
    edge_box,
    finite_number,
    score_of,
    whole_number,
)
from calib_core.errors import InputError
from calib_core.measurements import Box, Cuboid

_OBJECT_COLUMNS = (15, 16)  # the last, of results, is the score
_TRACK_COLUMNS = (17, 18)
_IGNORED = "DontCare"
_UNKNOWN_M = -999.0
"""KITTI writes -1000 where an object has no cuboid."""


def _rows(text: str) -> list[list[str]]:
    return [line.split() for line in text.splitlines() if line.strip()]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _is_object(row: list[str]) -> bool:
    return len(row) in _OBJECT_COLUMNS and not _is_number(row[0]) and all(map(_is_number, row[1:]))


def _is_track(row: list[str]) -> bool:
    return len(row) in _TRACK_COLUMNS and not _is_number(row[2]) and all(map(_is_number, (*row[:2], *row[3:])))


def _first_rows(file: BoxFile) -> list[list[str]]:
    return [_rows(text.lstrip().split("\n", 1)[0])[0] for text in _texts(file).values() if text.strip()]


def _texts(file: BoxFile) -> dict[str, str]:
    return {name: text for name, text in file.members.items() if name.lower().endswith(".txt")}


def _recognizes_objects(file: BoxFile) -> bool:
    rows = _first_rows(file)
    return bool(rows) and all(map(_is_object, rows))


def _recognizes_tracks(file: BoxFile) -> bool:
    rows = _first_rows(file)
    return bool(rows) and all(map(_is_track, rows))


def _read_objects(file: BoxFile) -> FileBoxes:
    frames = []
    for name, text in _texts(file).items():
        boxes = []
        for at, row in enumerate(_rows(text), 1):
            place = f"{file.source}/{name}: line {at}"
            if not _is_object(row):
                raise InputError(f"{place}: expected KITTI's 15 columns of an object; correct it")
            if row[0] != _IGNORED:
                boxes.append(_box(row[0], row[4:15], row[15:], place))
        frames.append(FileFrame(tuple(boxes), name=PurePosixPath(name).stem))
    return FileBoxes(tuple(frames))


def _read_tracks(file: BoxFile) -> FileBoxes:
    texts = _texts(file)
    if len(texts) > 1:
        first = next(iter(texts))
        raise InputError(
            f"{file.source}: has the labels of {len(texts)} sequences; give the file of one, such as {first}"
        )
    boxes: dict[int, list[Box]] = {}
    for at, row in enumerate(_rows(next(iter(texts.values()))), 1):
        place = f"{file.source}: line {at}"
        if not _is_track(row):
            raise InputError(f"{place}: expected KITTI's 17 columns of a tracked object; correct it")
        found = boxes.setdefault(whole_number(row[0], place), [])
        if row[2] != _IGNORED:
            found.append(_box(row[2], row[6:17], row[17:], place, track=str(whole_number(row[1], place))))
    lowest, highest = min(boxes), max(boxes)
    if highest - lowest > 1_000_000:
        raise InputError(
            f"{file.source}: has frames numbered {lowest} to {highest}; no sequence is that long, correct it"
        )
    frames = (FileFrame(tuple(boxes.get(number, ())), number=number) for number in range(lowest, highest + 1))
    note = "KITTI lists no frame without objects; those between the first and the last listed count as seen and empty"
    return FileBoxes(tuple(frames), first_number=0, notes=(note,) if len(boxes) <= highest - lowest else ())


def _box(label: str, columns: list[str], score: list[str], place: str, track: str = "") -> Box:
    """Make a box of the columns from its left edge to its heading."""
    for value in score:
        finite_number(value, place)
    height_m, width_m, length_m, x_m, y_m, z_m, turn_rad = (finite_number(value, place) for value in columns[4:11])
    cuboid = Cuboid((x_m, y_m - 0.5 * height_m, z_m), length_m, width_m, 0.5 * math.pi - turn_rad)
    has_one = min(height_m, width_m, length_m) > 0.0 and z_m > _UNKNOWN_M
    confidence = score_of(score[0]) if score else 1.0
    box = edge_box(columns[:4], place, label=label, score=confidence, track=track, shift_px=0.0)
    return replace(box, cuboid=cuboid if has_one else None)


KITTI_OBJECTS = BoxFormat("KITTI label_2", _recognizes_objects, _read_objects)
KITTI_TRACKS = BoxFormat("KITTI label_02", _recognizes_tracks, _read_tracks)
