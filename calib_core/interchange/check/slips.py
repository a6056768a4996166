"""The slips by which a right calibration becomes a wrong file, each as the edit that undoes it."""

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from calib_core.geometry import matrix_from_quaternion_wxyz, quaternion_wxyz_from_matrix
from calib_core.interchange.imported import Direction, Form, WrittenPose

__all__ = ["SLIPS", "Slip", "SuspectedSlips", "suspected_slips"]

_ROUNDED = 1.001


@dataclass(frozen=True, slots=True)
class Slip:
    """One slip.

    Attributes:
        code: one word for programs.
        message: what is wrong, to stand after "it fits once ... is undone".
        hint: what to do about it.
        undo: returns the pose as it should have been written, or nothing where the slip is impossible.
    """

    code: str
    message: str
    hint: str
    undo: Callable[[WrittenPose], tuple[WrittenPose, ...]]


@dataclass(frozen=True, slots=True, eq=False)
class SuspectedSlips:
    """One or two slips that may have happened together.

    Attributes:
        slips: the slips.
        pose: the pose with them undone.
    """

    slips: tuple[Slip, ...]
    pose: WrittenPose


def _as_matrix(pose: WrittenPose, rotation: np.ndarray) -> WrittenPose:
    return dataclasses.replace(pose, form="matrix", rotation=rotation)


def _swap_direction(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    other: Direction = "radar_from_camera" if pose.direction == "camera_from_radar" else "camera_from_radar"
    return (dataclasses.replace(pose, direction=other),)


def _transpose(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    return (_as_matrix(pose, pose.rotation_matrix().T),)


def _reorder_quaternion(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    """Take the four numbers in the other order, also where somebody made a matrix or angles of them."""
    if pose.form in ("quaternion_xyzw", "quaternion_wxyz"):
        other: Form = "quaternion_wxyz" if pose.form == "quaternion_xyzw" else "quaternion_xyzw"
        return (dataclasses.replace(pose, form=other),)
    wxyz = quaternion_wxyz_from_matrix(pose.rotation_matrix())
    return tuple(_as_matrix(pose, matrix_from_quaternion_wxyz(np.roll(wxyz, shift))) for shift in (1, -1))


def _degrees(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    return (dataclasses.replace(pose, rotation=np.radians(pose.rotation)),) if pose.form == "rpy" else ()


def _radians(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    """Take small angles for radians that were converted once too often, or that stand where degrees are wanted."""
    small = pose.form == "rpy" and np.abs(pose.rotation).max() <= np.radians(np.pi) * _ROUNDED
    return (dataclasses.replace(pose, rotation=np.degrees(pose.rotation)),) if small else ()


def _reverse_angles(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    return (dataclasses.replace(pose, rotation=pose.rotation[::-1]),) if pose.form == "rpy" else ()


def _swap_axes(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    return (dataclasses.replace(pose, axes="link" if pose.axes == "optical" else "optical"),)


def _millimetres(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    return (dataclasses.replace(pose, translation_m=pose.translation_m / 1000.0),)


def _position(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    rotation = pose.rotation_matrix()
    return (dataclasses.replace(_as_matrix(pose, rotation), translation_m=-rotation @ pose.translation_m),)


SLIPS: tuple[Slip, ...] = (
    Slip(
        "swapped-direction",
        "the direction is swapped: the numbers are those of the inverse transform",
        "write the inverse, or exchange parent and child",
        _swap_direction,
    ),
    Slip(
        "transposed-rotation",
        "the rotation is transposed (or the quaternion conjugated) while the translation is not",
        "transpose the rotation",
        _transpose,
    ),
    Slip(
        "quaternion-order",
        "the quaternion's order is wrong: w stands first where the format wants it last, or the other way round",
        "reorder the four numbers",
        _reorder_quaternion,
    ),
    Slip("degrees-for-radians", "the angles are in degrees, the format wants radians", "convert the angles", _degrees),
    Slip(
        "radians-for-degrees",
        "the angles are in radians where the format wants degrees, or were turned into radians twice",
        "convert the angles",
        _radians,
    ),
    Slip(
        "angle-order",
        "the angles stand in the order yaw, pitch, roll where the format wants roll, pitch, yaw (or the other way round)",
        "reverse the three angles",
        _reverse_angles,
    ),
    Slip(
        "optical-for-link",
        "the camera's axes are exchanged: optical (z forward) for body (x forward), or the other way round",
        "use the pose of the frame that is named; camera_link and its optical frame differ by a fixed rotation",
        _swap_axes,
    ),
    Slip("millimetres", "the translation is in millimetres", "divide the translation by 1000", _millimetres),
    Slip(
        "position-for-translation",
        "the translation is the position of the source's origin the wrong way round: t = -R c was left out",
        "write t = -R c, c being the position",
        _position,
    ),
)


def suspected_slips(pose: WrittenPose) -> Iterator[SuspectedSlips]:
    """Yield every single slip undone, then every two."""
    for slip in SLIPS:
        for undone in slip.undo(pose):
            yield SuspectedSlips((slip,), undone)
    for first, second in combinations(SLIPS, 2):
        for once in first.undo(pose):
            for undone in second.undo(once):
                yield SuspectedSlips((first, second), undone)
