"""What `tf_echo` (ROS 1) and `tf2_echo` (ROS 2) print: the pose of the second frame in the first."""

import re
from dataclasses import dataclass

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import WrittenPose
from calib_core.interchange.pose_parts import direction_by_facing, rigid
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Joint, Place, TreePart

_LIST = r"\[([^\]]*)\]"
_TRANSLATION = re.compile(rf"Translation:\s*{_LIST}")
_QUATERNION = re.compile(rf"in Quaternion(?: \(xyzw\))?\s*{_LIST}")
_DEGREES = re.compile(rf"in RPY \(degree\)\s*{_LIST}")
_NAMES = (re.compile(r"tf2?_echo\s+(\S+)\s+(\S+)"), re.compile(r"Waiting for transform\s+(\S+)\s*->\s*([^\s:]+)"))
_PRINTED = "printed with three decimals: the translation is good to 0.5 mm"
_ROUNDED_M, _ROUNDED_DEG = 0.002, 0.3
_STEEP_DEG = 89.0
_LENGTH = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class _Printed:
    """One pose as printed: the more exact way to write its rotation, and both checked against each other."""

    pose: WrittenPose
    transform: RigidTransform


def recognizes_tf_echo(content: Content) -> bool:
    """Return whether a text is such an output."""
    return content.syntax == "lines" and bool(_TRANSLATION.search(content.text) and _QUATERNION.search(content.text))


def read_tf_echo(content: Content, source: str) -> TreePart:
    """Read the pose, and the frame names if the command or its waiting line is in the text.

    Raises:
        InputError: the transform changes, contradicts itself, or does not tell which way it goes.
    """
    text = content.text
    named = next((match for pattern in _NAMES if (match := pattern.search(text))), None)
    printed = _all_printed(text, source=source)
    first = printed[0]
    for other in printed[1:]:
        _refuse_moving(first.transform, other.transform, source=source)
    if named is not None:
        return TreePart("tf-echo", (Joint.posed(named[1], named[2], first.pose, Place(source)),), notes=(_PRINTED,))
    direction = direction_by_facing(first.transform.rotation)
    if direction is None:
        raise InputError(
            f"{source}: the printed text names no frames; put the command above it (tf2_echo RADAR_FRAME CAMERA_FRAME)"
        )
    usual = FrameNames()
    ends = (usual.radar, usual.camera) if direction == "radar_from_camera" else (usual.camera, usual.radar)
    assumption = (
        f"the text names no frames; assumed tf2_echo {' '.join(ends)}: its optical axis then looks where the radar does"
    )
    joint = Joint.posed(ends[0], ends[1], first.pose, Place(source))
    return TreePart("tf-echo", (joint,), notes=(_PRINTED,), assumptions=(assumption,))


def _all_printed(text: str, *, source: str) -> list[_Printed]:
    starts = [match.start() for match in _TRANSLATION.finditer(text)]
    return [_one(text[start:end], source=source) for start, end in zip(starts, [*starts[1:], len(text)], strict=True)]


def _one(text: str, *, source: str) -> _Printed:
    translation, quaternion, degrees = (pattern.search(text) for pattern in (_TRANSLATION, _QUATERNION, _DEGREES))
    if translation is None or quaternion is None:
        raise InputError(f"{source}: a translation without its quaternion; copy the whole output")
    position_m = _numbers(translation[1], 3, "Translation", source=source)
    xyzw = _numbers(quaternion[1], 4, "Rotation: in Quaternion", source=source)
    if abs(float(np.linalg.norm(xyzw)) - 1.0) > _LENGTH:
        raise InputError(
            f"{source}: the quaternion's length is {np.linalg.norm(xyzw):.4g}: too few decimals; print more with -p 9"
        )
    by_quaternion = rigid("quaternion_xyzw", xyzw, position_m, source=source)
    as_written = WrittenPose("quaternion_xyzw", np.array(xyzw), np.array(position_m), "radar_from_camera")
    if degrees is None:
        return _Printed(as_written, by_quaternion)
    rpy_deg = _numbers(degrees[1], 3, "Rotation: in RPY (degree)", source=source)
    by_angles = rigid("rpy", np.deg2rad(rpy_deg).tolist(), position_m, source=source)
    if _apart_deg(by_quaternion, by_angles) > _ROUNDED_DEG:
        raise InputError(f"{source}: the quaternion and the angles in degrees disagree; copy the output again")
    if abs(rpy_deg[1]) > _STEEP_DEG:
        return _Printed(as_written, by_quaternion)
    return _Printed(WrittenPose("rpy", np.deg2rad(rpy_deg), np.array(position_m), "radar_from_camera"), by_angles)


def _numbers(text: str, count: int, place: str, *, source: str) -> tuple[float, ...]:
    return floats(text.replace(",", " ").split(), source=source, place=place, length=count)


def _refuse_moving(first: RigidTransform, other: RigidTransform, *, source: str) -> None:
    moved_m = np.abs(first.translation_m - other.translation_m).max()
    if moved_m > _ROUNDED_M or _apart_deg(first, other) > _ROUNDED_DEG:
        raise InputError(f"{source}: the transform changes from one print to the next; give that of two fixed frames")


def _apart_deg(a: RigidTransform, b: RigidTransform) -> float:
    cosine = (np.trace(a.rotation.T @ b.rotation) - 1.0) / 2.0
    return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
