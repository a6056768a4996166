"""Boxes around objects, from the files of labelling tools, from topics of a recording, and from a fixed rig's images."""

from calib_core.boxes.formats.own import boxes_text, labels_text, read_labels
from calib_core.boxes.moving import MOVING, changed_boxes
from calib_core.boxes.reading import boxes_from_bytes, holds_boxes, read_boxes

__all__ = [
    "MOVING",
    "boxes_from_bytes",
    "boxes_text",
    "changed_boxes",
    "holds_boxes",
    "labels_text",
    "read_boxes",
    "read_labels",
]
