"""The joints of Foxglove's FrameTransforms in JSON: each the pose of a child frame in its parent."""

from collections.abc import Mapping
from typing import Any

from calib_core.interchange.formats.foxglove import listed_transforms, posed_frames
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Joint, Place, Sensor, TreePart


def recognizes_foxglove(content: Content) -> bool:
    """Return whether JSON is a FrameTransforms message, alone or under its name."""
    return bool(_transform_list(content))


def has_several_transforms(content: Content) -> bool:
    """Return whether it contains more than the one transform that the format's own reader reads."""
    return len(_transform_list(content)) > 1


def read_foxglove(content: Content, source: str) -> TreePart:
    """Read every transform, and which frame is the camera's if a CameraCalibration is with them.

    Raises:
        InputError: a frame name or a number is missing.
    """
    joints = []
    for index, one in enumerate(_transform_list(content)):
        parent, child, written = posed_frames(one, source=source, place=f"transforms[{index}]")
        joints.append(Joint.posed(parent, child, written, Place(source)))
    camera = content.json_mapping.get("CameraCalibration")
    frame = str(camera.get("frame_id") or "") if isinstance(camera, Mapping) else ""
    return TreePart("foxglove", tuple(joints), (Sensor(frame, "camera", "optical"),) if frame else ())


def _transform_list(content: Content) -> list[Mapping[str, Any]]:
    messages = content.json_mapping
    alone = messages.get("FrameTransform", messages)
    is_one = isinstance(alone, Mapping) and "parent_frame_id" in alone
    return listed_transforms(messages) or ([alone] if is_one else [])
