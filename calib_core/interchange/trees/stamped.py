"""The joints of stamped transforms in YAML: Apollo's extrinsics, and what `ros2 topic echo /tf_static` prints."""

from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import WrittenPose
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import PlacedValue, placed_yaml
from calib_core.interchange.trees.frame_tree import Joint, JointNumbers, Place, TreePart

_NUMBERS = (("translation", "xyz"), ("rotation", "xyzw"))


def recognizes_stamped(content: Content) -> bool:
    """Return whether each document of a YAML file, or the JSON, is a stamped transform, or a list of them."""
    documents = content.documents or (content.json_mapping,)
    return all(map(_is_stamped, documents))


def _is_stamped(value: Any) -> bool:
    """Return whether a value is a stamped transform or a list of them, and not Foxglove's, which names its parent otherwise."""
    if not isinstance(value, dict):
        return False
    listed = value.get("transforms")
    if isinstance(listed, list):
        return not any(isinstance(one, dict) and "parent_frame_id" in one for one in listed)
    return "child_frame_id" in value and ("header" in value or "transform" in value)


def read_stamped(text: str, source: str) -> TreePart:
    """Read every transform of every document.

    Raises:
        InputError: a frame name or a number is missing.
    """
    joints = []
    for document in placed_yaml(text, source=source):
        listed = document.get("transforms")
        joints += [_joint(one, text, source) for one in ([document] if listed is None else listed.items())]
    return TreePart("apollo", tuple(joints))


def _joint(stamped: PlacedValue, text: str, source: str) -> Joint:
    place = Place(source, stamped.line)
    parent, child = stamped.get("header", "frame_id"), stamped.get("child_frame_id")
    transform = stamped.get("transform")
    if parent is None or child is None or transform is None or not parent.text or not child.text:
        raise InputError(f"{place}: a stamped transform needs header.frame_id, child_frame_id and transform; add them")
    values: list[list[PlacedValue]] = []
    for part, keys in _NUMBERS:
        found = [transform.get(part, key) for key in keys]
        if any(one is None for one in found):
            raise InputError(f"{place}: transform.{part} needs {', '.join(keys)}; add what is missing")
        values.append([one for one in found if one is not None])
    translation, rotation = (
        np.array(floats([one.text for one in part], source=source, place=f"line {place.line}")) for part in values
    )
    return Joint.posed(
        parent.text,
        child.text,
        WrittenPose("quaternion_xyzw", rotation, translation, "radar_from_camera"),
        place,
        numbers=JointNumbers.at("quaternion_xyzw", [one.span_in(text) for part in values for one in part]),
    )
