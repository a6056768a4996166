"""Boxes around objects, from the files of labelling tools, from topics of a recording, and from a fixed rig's pictures."""

from calib_core.boxes.own_files import boxes_text, labels_text

__all__ = ["boxes_text", "labels_text"]
