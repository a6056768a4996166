"""Boxes and labels of a recording, from files."""

from pathlib import Path
from typing import Any

import msgspec

from calib_core.detections import Box, Boxes, FrameBoxes, LabelledScan, ReturnLabels
from calib_core.errors import InputError
from calib_core.measurements import Stamp
from calib_core.recordings import Recording

__all__ = ["find_boxes", "find_labels"]


def find_boxes(file_or_topic: str, recording: Recording) -> Boxes:
    """Read boxes from a file.

    Raises:
        InputError: it cannot be read.
    """
    document = _document(file_or_topic, "cocalib/boxes-1")
    frames = tuple(
        FrameBoxes(
            msgspec.convert(frame["image_time"], Stamp).time,
            tuple(_box(box) for box in frame["boxes"]),
        )
        for frame in document["frames"]
    )
    width, height = document["image_size_px"]
    return Boxes(frames, Path(file_or_topic).name, (width, height))


def find_labels(path: Path) -> ReturnLabels:
    """Read labels from a file.

    Raises:
        InputError: it cannot be read.
    """
    document = _document(str(path), "cocalib/labels-1")
    scans = tuple(
        LabelledScan(msgspec.convert(scan["radar_time"], Stamp).time, tuple(scan["tracks"]))
        for scan in document["scans"]
    )
    return ReturnLabels(scans, path.name)


def _box(document: dict[str, Any]) -> Box:
    left, top, right, bottom = document["box_px"]
    label, score, track = document.get("label", ""), document.get("score", 1.0), document.get("track", "")
    return Box(left, top, right, bottom, label, score, track)


def _document(path: str, schema: str) -> dict[str, Any]:
    try:
        document = msgspec.json.decode(Path(path).read_bytes())
    except (OSError, msgspec.DecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    if not isinstance(document, dict) or document.get("schema") != schema:
        raise InputError(f"{path}: is not {schema}")
    return document
