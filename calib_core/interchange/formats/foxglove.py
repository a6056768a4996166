"""Foxglove's FrameTransforms and CameraCalibration messages as JSON."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.cameras.fields import find_cameras, floats
from calib_core.interchange.format import ImportedCalibration, Reads, WrittenPose, posed_between
from calib_core.interchange.formats.pose_parts import Ends, choose_transform
from calib_core.interchange.syntax.content import Content


def _recognizes(content: Content) -> bool:
    messages = content.json_mapping
    return "FrameTransform" in messages or bool(listed_transforms(messages)) or "parent_frame_id" in messages


def listed_transforms(messages: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the transforms of a FrameTransforms message, alone or under its name; none if it is another message."""
    named = messages.get("FrameTransforms")
    transforms = (named if isinstance(named, Mapping) else messages).get("transforms")
    listed = transforms if isinstance(transforms, list) else []
    return [one for one in listed if isinstance(one, Mapping) and "parent_frame_id" in one]


def posed_frames(transform: Any, *, source: str, place: str) -> tuple[str, str, WrittenPose]:
    """Return parent and child of a FrameTransform, and the pose.

    Raises:
        InputError: a frame name or a number is missing.
    """
    message = transform if isinstance(transform, Mapping) else {}
    parent, child = (str(message.get(key) or "") for key in ("parent_frame_id", "child_frame_id"))
    if not parent or not child:
        raise InputError(f"{source}: {place}: parent_frame_id or child_frame_id is missing; name both frames")
    values = []
    for part, keys in (("translation", "xyz"), ("rotation", "xyzw")):
        block = message.get(part)
        if not isinstance(block, Mapping):
            raise InputError(f"{source}: {place}.{part}: missing; add it")
        values.append(
            [floats(block.get(key), source=source, place=f"{place}.{part}.{key}", length=1)[0] for key in keys]
        )
    return parent, child, WrittenPose("quaternion_xyzw", np.array(values[1]), np.array(values[0]), "radar_from_camera")


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read a FrameTransform, or the one of FrameTransforms between a radar and a camera; a CameraCalibration may be with it.

    Raises:
        InputError: a frame name or a number is missing, or there are several transforms.
    """
    messages = content.json_mapping
    message, listed = messages.get("FrameTransform", messages), listed_transforms(messages)
    if listed:
        ends = [Ends(str(one.get("parent_frame_id") or ""), str(one.get("child_frame_id") or "")) for one in listed]
        message = listed[choose_transform(ends, None, source=source)]
    parent, child, written = posed_frames(message, source=source, place="FrameTransform")
    roles = posed_between(parent, child, _frames_of(messages, parent, child), written)
    cameras = find_cameras(messages, source=source) if "CameraCalibration" in messages else ()
    return ImportedCalibration(
        "foxglove",
        roles.pose,
        camera=cameras[0].camera(image_size_px=None, source=source) if cameras else None,
        frames=roles.frames,
        assumptions=roles.assumptions,
    ).checked(source)


def _frames_of(messages: Mapping[str, Any], parent: str, child: str) -> FrameNames | None:
    """Return which of the two frames is the camera's: the frame of a CameraCalibration, which has optical axes by definition."""
    camera = messages.get("CameraCalibration")
    frame = str(camera.get("frame_id") or "") if isinstance(camera, Mapping) else ""
    return FrameNames(parent if frame == child else child, frame) if frame in (parent, child) else None


FOXGLOVE = Reads(_recognizes, _read)
