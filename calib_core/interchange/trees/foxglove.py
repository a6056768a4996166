"""The joints of Foxglove's FrameTransforms in JSON: each the pose of a child frame in its parent."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import WrittenPose
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Joint, Place, Sensor, TreePart

_NUMBERS = (("translation", "xyz"), ("rotation", "xyzw"))


def recognizes_foxglove(content: Content) -> bool:
    """Return whether JSON is a FrameTransforms message, alone or under its name."""
    return bool(_listed(content))


def has_several_transforms(content: Content) -> bool:
    """Return whether it contains more than the one transform that the format's own reader reads."""
    return len(_listed(content)) > 1


def read_foxglove(content: Content, source: str) -> TreePart:
    """Read every transform, and which frame is the camera's if a CameraCalibration is with them.

    Raises:
        InputError: a frame name or a number is missing.
    """
    joints = tuple(_joint(one, f"transforms[{index}]", source) for index, one in enumerate(_listed(content)))
    camera = content.json_mapping.get("CameraCalibration")
    frame = str(camera.get("frame_id") or "") if isinstance(camera, Mapping) else ""
    return TreePart("foxglove", joints, (Sensor(frame, "camera", "optical"),) if frame else ())


def _listed(content: Content) -> list[Mapping[str, Any]]:
    messages = content.json_mapping
    named = messages.get("FrameTransforms")
    transforms = (named if isinstance(named, Mapping) else messages).get("transforms")
    listed = transforms if isinstance(transforms, list) else [messages.get("FrameTransform", messages)]
    return [one for one in listed if isinstance(one, Mapping) and "parent_frame_id" in one]


def _joint(transform: Mapping[str, Any], place: str, source: str) -> Joint:
    parent, child = (str(transform.get(key) or "") for key in ("parent_frame_id", "child_frame_id"))
    if not parent or not child:
        raise InputError(f"{source}: {place}: parent_frame_id or child_frame_id is missing; name both frames")
    values = []
    for part, keys in _NUMBERS:
        block = transform.get(part)
        if not isinstance(block, Mapping):
            raise InputError(f"{source}: {place}.{part}: missing; add it")
        numbers = (floats(block.get(key), source=source, place=f"{place}.{part}.{key}", length=1)[0] for key in keys)
        values.append(np.array(list(numbers)))
    written = WrittenPose("quaternion_xyzw", values[1], values[0], "radar_from_camera")
    return Joint.posed(parent, child, written, Place(source))
