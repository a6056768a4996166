"""Our own files: boxes (cocalib/boxes-1) and the true origin of a simulation's returns (cocalib/labels-1)."""

import json
from typing import Any

from calib_core.detections import Box, Boxes, ReturnLabels
from calib_core.measurements import TimeNs, time_parts

__all__ = ["boxes_text", "labels_text"]


def boxes_text(boxes: Boxes) -> str:
    """Return boxes as JSON (schema cocalib/boxes-1)."""
    document: dict[str, Any] = {"schema": "cocalib/boxes-1"}
    if boxes.image_size_px is not None:
        document["image_size_px"] = list(boxes.image_size_px)
    document["frames"] = [
        {"image_time": _time(frame.image_time), "boxes": [_box(box) for box in frame.boxes]} for frame in boxes
    ]
    return _text(document)


def labels_text(labels: ReturnLabels) -> str:
    """Return the origin of returns as JSON (schema cocalib/labels-1)."""
    scans = [{"radar_time": _time(scan.radar_time), "tracks": list(scan.tracks)} for scan in labels.scans]
    return _text({"schema": "cocalib/labels-1", "scans": scans})


def _box(box: Box) -> dict[str, Any]:
    entry: dict[str, Any] = {"label": box.label, "box_px": [box.left_px, box.top_px, box.right_px, box.bottom_px]}
    if box.score != 1.0:
        entry["score"] = box.score
    if box.track:
        entry["track"] = box.track
    return entry


def _time(time: TimeNs) -> dict[str, int]:
    sec, nanosec = time_parts(time)
    return {"sec": sec, "nanosec": nanosec}


def _text(document: dict[str, Any]) -> str:
    return json.dumps(document, indent=1, allow_nan=False) + "\n"
