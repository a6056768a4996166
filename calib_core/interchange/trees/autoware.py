"""The joints of Autoware's calibration files: frames by parent and child, with x, y, z, roll, pitch and yaw."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import WrittenPose
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import PlacedValue, placed_yaml
from calib_core.interchange.trees.frame_tree import Joint, JointNumbers, Place, TreePart

POSE_KEYS = ("x", "y", "z", "roll", "pitch", "yaw")


def recognizes_autoware(content: Content) -> bool:
    """Return whether a YAML file poses frames in a parent by roll, pitch and yaw."""
    return content.syntax == "yaml" and any(_is_parent(value) for value in content.mapping.values())


def _is_parent(value: Any) -> bool:
    return isinstance(value, Mapping) and any(isinstance(entry, Mapping) and "yaw" in entry for entry in value.values())


def read_autoware(text: str, source: str) -> TreePart:
    """Read every frame of every parent.

    Raises:
        InputError: a number is missing, or is none.
    """
    joints = []
    for document in placed_yaml(text, source=source):
        for parent, children in document.entries():
            joints += [
                _joint(parent, child, entry, text, source)
                for child, entry in children.entries()
                if entry.get("yaw") is not None
            ]
    return TreePart("autoware", tuple(joints))


def _joint(parent: str, child: str, entry: PlacedValue, text: str, source: str) -> Joint:
    place = Place(source, entry.line)
    found = [entry.get(key) for key in POSE_KEYS]
    missing = [key for key, value in zip(POSE_KEYS, found, strict=True) if value is None]
    if missing:
        raise InputError(f"{place}: {parent}.{child}: {', '.join(missing)} is missing; add it")
    values = [value for value in found if value is not None]
    numbers = np.array(floats([value.text for value in values], source=source, place=f"{parent}.{child}"))
    return Joint.posed(
        parent,
        child,
        WrittenPose("rpy", numbers[3:], numbers[:3], "radar_from_camera"),
        place,
        numbers=JointNumbers.at("rpy", [value.span_in(text) for value in values]),
    )
