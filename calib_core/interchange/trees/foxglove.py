"""The joints of Foxglove's FrameTransforms in JSON: each the pose of a child frame in its parent, and a camera's lens."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.cameras.fields import find_cameras, named_numbers
from calib_core.interchange.format import WrittenPose
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Joint, Place, Sensor, TreePart


def recognizes_foxglove(content: Content) -> bool:
    """Return whether JSON is a FrameTransforms message, alone or under its name."""
    return bool(_transform_list(content))


def read_foxglove(content: Content, source: str) -> TreePart:
    """Read every transform, and which frame is the camera's if a CameraCalibration is with them: it has optical axes.

    Raises:
        InputError: a frame name or a number is missing.
    """
    joints = tuple(_joint(one, index, source) for index, one in enumerate(_transform_list(content)))
    camera = content.json_mapping.get("CameraCalibration")
    frame = str(camera.get("frame_id") or "") if isinstance(camera, Mapping) else ""
    lens = find_cameras(content.json_mapping, source=source)[0] if camera is not None else None
    return TreePart("foxglove", joints, (Sensor(frame, "camera", "optical", lens),) if frame else ())


def _transform_list(content: Content) -> list[Mapping[str, Any]]:
    messages = content.json_mapping
    named, alone = messages.get("FrameTransforms", messages), messages.get("FrameTransform", messages)
    listed = named.get("transforms") if isinstance(named, Mapping) else None
    listed = listed if isinstance(listed, list) and listed else [alone]
    return [one for one in listed if isinstance(one, Mapping) and "parent_frame_id" in one]


def _joint(transform: Mapping[str, Any], index: int, source: str) -> Joint:
    place = f"transforms[{index}]"
    parent, child = (str(transform.get(key) or "") for key in ("parent_frame_id", "child_frame_id"))
    if not parent or not child:
        raise InputError(f"{source}: {place}: parent_frame_id or child_frame_id is missing; name both frames")
    translation, rotation = (
        np.array(named_numbers(transform.get(part), keys, source=source, place=f"{place}.{part}"))
        for part, keys in (("translation", "xyz"), ("rotation", "xyzw"))
    )
    written = WrittenPose("quaternion_xyzw", rotation, translation, "radar_from_camera")
    return Joint.posed(parent, child, written, Place(source))
