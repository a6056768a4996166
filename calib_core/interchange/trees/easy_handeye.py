"""Hand-eye calibrations of easy_handeye (ROS 1) and easy_handeye2: the tracking camera's pose in the robot's frame."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.cameras.fields import named_numbers
from calib_core.interchange.format import WrittenPose, looks_like_radar
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Joint, Place, TreePart


def recognizes_easy_handeye(content: Content) -> bool:
    """Return whether a file is such a calibration."""
    given = _parameters(content.mapping)
    return "tracking_base_frame" in given and bool({"transform", "transformation"} & set(content.mapping))


def _parameters(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the parameters, which older versions write at the top level."""
    nested = values.get("parameters")
    return nested if isinstance(nested, Mapping) else values


def read_easy_handeye(content: Content, source: str) -> TreePart:
    """Read the pose of the tracking frame in the robot's base, or in its effector if the camera is on the hand.

    Raises:
        InputError: a frame has no name, neither is a radar by name, or a number is missing.
    """
    given = _parameters(content.mapping)
    kind = str(given.get("calibration_type") or "")
    on_hand = kind == "eye_in_hand" if kind else given.get("eye_on_hand") in (True, "true", "True")
    parent = str(given.get("robot_effector_frame" if on_hand else "robot_base_frame") or "")
    child = str(given.get("tracking_base_frame") or "")
    if not parent or not child:
        raise InputError(f"{source}: parameters: the frame of the robot or of the camera has no name; name both")
    if not looks_like_radar(parent) and not looks_like_radar(child):
        raise InputError(
            f"{source}: is the pose of {child!r} in {parent!r}, and by name neither is a radar; rename the radar's frame, or "
            "give the transform between radar and camera"
        )
    name, translation_m, rotation = _numbers(content.mapping, source=source)
    written = WrittenPose("quaternion_xyzw", np.array(rotation), np.array(translation_m), "radar_from_camera")
    return TreePart(name, (Joint.posed(parent, child, written, Place(source)),))


def _numbers(values: Mapping[str, Any], *, source: str) -> tuple[str, tuple[float, ...], tuple[float, ...]]:
    if "transformation" in values:
        numbers = named_numbers(
            values["transformation"], ("x", "y", "z", "qx", "qy", "qz", "qw"), source=source, place="transformation"
        )
        return "easy_handeye", numbers[:3], numbers[3:]
    block = values["transform"] if isinstance(values["transform"], Mapping) else {}
    return (
        "easy_handeye2",
        named_numbers(block.get("translation"), "xyz", source=source, place="transform.translation"),
        named_numbers(block.get("rotation"), "xyzw", source=source, place="transform.rotation"),
    )
