"""YOLO: a folder with one text file per image; class, centre and size as shares of the image, perhaps score and track."""

import re
from collections.abc import Mapping
from pathlib import PurePosixPath

from calib_core.boxes.formats.box_format import (
    BoxFile,
    BoxFormat,
    FileBoxes,
    FileFrame,
    edge_box,
    finite_number,
    score_of,
)
from calib_core.errors import InputError
from calib_core.measurements import Box
from calib_core.parsing import yaml_documents

_LISTS = frozenset({"classes.txt", "labels.txt", "predefined_classes.txt", "train.txt", "val.txt", "test.txt"})
_NAMES = ("classes.txt", "predefined_classes.txt", "labels.txt")
_LINE = re.compile(r"\s*\d+(\s+[-+.\deE]+){4,}\s*")
_WHOLE = re.compile(r"\d+")
_POLYGON_COLUMNS = 8


def _recognizes(file: BoxFile) -> bool:
    lines = [text.lstrip().split("\n", 1)[0] for _, text in _frames_of(file) if text.strip()]
    return bool(lines) and all(_LINE.fullmatch(line) for line in lines)


def _frames_of(file: BoxFile) -> list[tuple[str, str]]:
    """Return the name and text of each image's file."""
    return [
        (name, text)
        for name, text in file.members.items()
        if name.lower().endswith(".txt") and PurePosixPath(name).name.lower() not in _LISTS
    ]


def _read(file: BoxFile) -> FileBoxes:
    if file.image_size_px is None:
        raise InputError(
            f"{file.source}: counts in shares of an image whose size is unknown; give the camera's recording"
        )
    labels = _labels(file.members, file.source)
    frames = []
    for name, text in _frames_of(file):
        rows = [(at, line.split()) for at, line in enumerate(text.splitlines(), 1) if line.strip()]
        place = f"{file.source}/{name}"
        boxes = tuple(_box(row, labels, file.image_size_px, f"{place}: line {at}") for at, row in rows)
        frames.append(FileFrame(boxes, name=PurePosixPath(name).stem))
    notes = (
        ()
        if labels
        else ("the folder has no list of classes (data.yaml or classes.txt); their numbers are used as labels",)
    )
    return FileBoxes(tuple(frames), notes=notes)


def _labels(members: Mapping[str, str], source: str) -> dict[str, str]:
    """Return the names of the classes by number, of data.yaml or of a list with one name per line; empty without either."""
    for name, text in members.items():
        if name.lower().endswith((".yaml", ".yml")):
            for document in yaml_documents(text, source=f"{source}/{name}"):
                names = document.get("names") if isinstance(document, dict) else None
                if isinstance(names, list):
                    return {str(number): str(label) for number, label in enumerate(names)}
                if isinstance(names, dict):
                    return {str(number): str(label) for number, label in names.items()}
    for name, text in members.items():
        if PurePosixPath(name).name.lower() in _NAMES or name.lower().endswith(".names"):
            return {str(number): label.strip() for number, label in enumerate(text.strip().split("\n"))}
    return {}


def _box(row: list[str], labels: Mapping[str, str], size_px: tuple[int, int], place: str) -> Box:
    """Read a line: class, centre u and v, width, height, then score, track or both; or class and a polygon's corners."""
    if len(row) < 5:
        raise InputError(f"{place}: expected class, centre and size (5 numbers or more), found {len(row)}; correct it")
    shares = [finite_number(text, place) for text in row[1:]]
    if len(row) > _POLYGON_COLUMNS or (len(row) == 7 and not _WHOLE.fullmatch(row[6])):
        if len(shares) % 2:
            raise InputError(f"{place}: a polygon with a corner of one coordinate; correct it")
        across, down = shares[::2], shares[1::2]
        sides = (min(across), min(down), max(across), max(down))
        rest: list[str] = []
    else:
        u, v, width, height = shares[:4]
        sides = (u - width / 2, v - height / 2, u + width / 2, v + height / 2)
        rest = row[5:]
    tracked = bool(rest) and _WHOLE.fullmatch(rest[-1]) is not None and (len(rest) == 2 or rest[-1] not in ("0", "1"))
    scored = len(rest) == 2 or (len(rest) == 1 and not tracked)
    scale = (*size_px, *size_px)
    return edge_box(
        [side * pixels for side, pixels in zip(sides, scale, strict=True)],
        place,
        label=labels.get(row[0].lstrip("0") or "0", row[0]),
        score=score_of(rest[0]) if scored else 1.0,
        track=rest[-1] if tracked else "",
    )


YOLO = BoxFormat("YOLO (one text file per image)", _recognizes, _read)
