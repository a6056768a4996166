"""The frames of cameras that intrinsics name, such as Apollo's front_6mm_intrinsics.yaml beside its extrinsics."""

from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Sensor
from calib_core.interchange.trees.tree_part import TreePart


def cameras_named_in(content: Content) -> TreePart | None:
    """Return the camera whose frame a CameraInfo in YAML names; None if it is no such file.

    A CameraInfo is about the optical frame; Apollo's files, too, pose that one.
    """
    info = content.mapping
    header = info.get("header")
    if content.syntax != "yaml" or not ({"K", "D"} <= set(info) or {"k", "d"} <= set(info)):
        return None
    frame = header.get("frame_id") if isinstance(header, dict) else info.get("frame_id")
    if not isinstance(frame, str) or not frame.strip():
        return TreePart("camera_info", ())
    return TreePart("camera_info", (), (Sensor(frame.strip().lstrip("/"), "camera", "optical"),))
