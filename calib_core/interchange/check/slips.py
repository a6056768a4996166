"""What explains a mismatch: rounding, or a slip between a right calibration and a wrong file, with the edit that undoes it."""

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from decimal import Decimal
from itertools import combinations
from typing import Literal

import numpy as np

from calib_core.arrays import Vector3
from calib_core.geometry import (
    RigidTransform,
    matrix_from_quaternion_wxyz,
    quaternion_wxyz_from_matrix,
    rotation_angle_rad,
)
from calib_core.interchange.format import Direction, Form, WrittenPose
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, matrix_from_rpy, rpy_from_matrix

_ROUNDED = 1.001


@dataclass(frozen=True, slots=True)
class Slip:
    """One slip.

    Attributes:
        code: one word for programs.
        message: what is wrong, as a clause.
        hint: what to do about it.
        undo: returns the pose as it should have been written, in each possible way; empty if the slip is impossible.
    """

    code: str
    message: str
    hint: str
    undo: Callable[[WrittenPose], tuple[WrittenPose, ...]]


@dataclass(frozen=True, slots=True, eq=False)
class UndoneSlips:
    """One or two slips and the pose with them undone.

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
    """Reorder the four numbers, also if they have since been converted to a matrix or to angles."""
    if pose.form in ("quaternion_xyzw", "quaternion_wxyz"):
        other: Form = "quaternion_wxyz" if pose.form == "quaternion_xyzw" else "quaternion_xyzw"
        return (dataclasses.replace(pose, form=other),)
    wxyz = quaternion_wxyz_from_matrix(pose.rotation_matrix())
    return tuple(_as_matrix(pose, matrix_from_quaternion_wxyz(np.roll(wxyz, shift))) for shift in (1, -1))


def _degrees(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    return (dataclasses.replace(pose, rotation=np.radians(pose.rotation)),) if pose.form == "rpy" else ()


def _radians(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    """Convert small angles to degrees, as if radians were converted twice or given instead of degrees."""
    angles = pose.rotation if pose.form == "rpy" else rpy_from_matrix(pose.rotation_matrix())
    small = np.abs(angles).max() <= np.radians(np.pi) * _ROUNDED
    return (dataclasses.replace(pose, form="rpy", rotation=np.degrees(angles)),) if small else ()


def _reverse_angles(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    """Reverse the three angles, also if they have since been converted to a matrix or to a quaternion."""
    angles = pose.rotation if pose.form == "rpy" else rpy_from_matrix(pose.rotation_matrix())
    return (dataclasses.replace(pose, form="rpy", rotation=angles[::-1]),)


def _turning_axes(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    """Take the angles about turning axes where they were taken about fixed axes, and the other way round.

    About turning axes x, y, z in this order the rotation is Rx Ry Rz, the inverse of the fixed-axis one of the negated angles.
    """
    rotation = pose.rotation_matrix()
    fixed = pose.rotation if pose.form == "rpy" else rpy_from_matrix(rotation)
    turning = -rpy_from_matrix(rotation.T)
    return _as_matrix(pose, matrix_from_rpy(-fixed).T), _as_matrix(pose, matrix_from_rpy(turning))


def _swap_axes(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    return (dataclasses.replace(pose, axes="link" if pose.axes == "optical" else "optical"),)


def _opengl_axes(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    """Turn a camera with x right, y up, z backward into one with x right, y down, z forward."""
    rotation, optical = pose.rotation_matrix(), dataclasses.replace(pose, axes="optical")
    if pose.direction == "radar_from_camera":
        return (_as_matrix(optical, rotation @ _HALF_TURN_ABOUT_X),)
    turned_m = _HALF_TURN_ABOUT_X @ pose.translation_m
    return (dataclasses.replace(_as_matrix(optical, _HALF_TURN_ABOUT_X @ rotation), translation_m=turned_m),)


def _other_radar_axes(turn: np.ndarray) -> Callable[[WrittenPose], tuple[WrittenPose, ...]]:
    """Return what undoes other axes of the radar, given the rotation (3, 3) from x forward, y left, z up to them."""

    def undo(pose: WrittenPose) -> tuple[WrittenPose, ...]:
        rotation = pose.rotation_matrix()
        if pose.direction == "camera_from_radar":
            return (_as_matrix(pose, rotation @ turn),)
        right_m = turn.T @ pose.translation_m
        return (dataclasses.replace(_as_matrix(pose, turn.T @ rotation), translation_m=right_m),)

    return undo


def _divided_by(factor: float) -> Callable[[WrittenPose], tuple[WrittenPose, ...]]:
    def undo(pose: WrittenPose) -> tuple[WrittenPose, ...]:
        return (dataclasses.replace(pose, translation_m=pose.translation_m / factor),)

    return undo


def _position(pose: WrittenPose) -> tuple[WrittenPose, ...]:
    rotation = pose.rotation_matrix()
    return (dataclasses.replace(_as_matrix(pose, rotation), translation_m=-rotation @ pose.translation_m),)


_HALF_TURN_ABOUT_X = np.diag([1.0, -1.0, -1.0])
_RIGHT_FORWARD_UP = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])

SLIPS: tuple[Slip, ...] = (
    Slip(
        "swapped-direction",
        "the direction is swapped: the numbers are those of the inverse transform",
        "write the inverse, or swap parent and child",
        _swap_direction,
    ),
    Slip(
        "transposed-rotation",
        "the rotation is transposed (or the quaternion conjugated), but the translation is unchanged",
        "transpose the rotation",
        _transpose,
    ),
    Slip(
        "quaternion-order",
        "the quaternion order is wrong: w is first where the format expects it last, or vice versa",
        "reorder the four numbers",
        _reorder_quaternion,
    ),
    Slip(
        "degrees-for-radians",
        "the angles are in degrees, but the format expects radians",
        "convert the angles",
        _degrees,
    ),
    Slip(
        "radians-for-degrees",
        "the angles are in radians where the format expects degrees, or were converted to radians twice",
        "convert the angles",
        _radians,
    ),
    Slip(
        "angle-order",
        "the angles are in the order yaw, pitch, roll where the format expects roll, pitch, yaw (or vice versa)",
        "reverse the three angles",
        _reverse_angles,
    ),
    Slip(
        "optical-for-link",
        "the camera has the wrong axes: optical (z forward) instead of body (x forward), or vice versa",
        "use the pose of the named frame; camera_link and its optical frame differ by a fixed rotation",
        _swap_axes,
    ),
    Slip("millimetres", "the translation is in millimeters", "divide the translation by 1000", _divided_by(1000.0)),
    Slip("centimetres", "the translation is in centimeters", "divide the translation by 100", _divided_by(100.0)),
    Slip(
        "position-for-translation",
        "the translation is the position c of the target frame's origin in the source frame, not t = -R c",
        "write t = -R c",
        _position,
    ),
    Slip(
        "translation-sign",
        "the sign of the translation is reversed",
        "negate the translation",
        _divided_by(-1.0),
    ),
    Slip(
        "opengl-axes",
        "the camera has OpenGL's axes (x right, y up, z backward) instead of x right, y down, z forward",
        "turn the camera frame by 180 deg about x: negate its y and z",
        _opengl_axes,
    ),
    Slip(
        "radar-y-right",
        "the radar has y right and z down instead of y left and z up",
        "turn the radar frame by 180 deg about x: negate its y and z",
        _other_radar_axes(_HALF_TURN_ABOUT_X),
    ),
    Slip(
        "radar-x-right",
        "the radar has x right, y forward, z up instead of x forward, y left, z up",
        "turn the radar frame by 90 deg about z",
        _other_radar_axes(_RIGHT_FORWARD_UP),
    ),
    Slip(
        "turning-axes",
        "the angles are about turning axes where the format expects fixed axes, or vice versa",
        "convert the angles: Rz(yaw) Ry(pitch) Rx(roll) is expected",
        _turning_axes,
    ),
)


def undone_slips(pose: WrittenPose) -> Iterator[UndoneSlips]:
    """Yield the pose with each single slip undone, then with each two."""
    for slip in SLIPS:
        for undone in slip.undo(pose):
            yield UndoneSlips((slip,), undone)
    for first, second in combinations(SLIPS, 2):
        for once in first.undo(pose):
            for undone in second.undo(once):
                yield UndoneSlips((first, second), undone)


@dataclass(frozen=True, slots=True)
class CheckResult:
    """One result of a check.

    Attributes:
        level: "good" (verified), "warning" (look at it) or "error" (the file is wrong).
        code: one word for programs.
        message: what was found, with figures.
        hint: what to do about it; empty if nothing needs to be done.
        question: which of `QUESTIONS` it answers; the same whatever the answer.
    """

    level: Literal["good", "warning", "error"]
    code: str
    message: str
    hint: str = ""
    question: str = ""


QUESTIONS = ("consistent", "check-point", "of", "against", "pairs", "own-pairs", "recording", "plausible", "solved")
"""Is the file consistent, does it reproduce its check point, is it the file of --of, does it agree with --against, with --pairs
and with its own pairs, does it hold on the recording, is its pose plausible, was it trusted when it was solved."""


def answering(question: str, results: Iterable[CheckResult]) -> list[CheckResult]:
    """Return results as answers to a question."""
    return [replace(result, question=question) for result in results]


def explain(
    pose: WrittenPose, miss: Callable[[RigidTransform], float], limit: float, *, most: int = 2
) -> UndoneSlips | None:
    """Find the fewest slips that, undone, bring the miss within the limit; among equally few, the best.

    Args:
        pose: as written.
        miss: how far a pose is from the right one, in any unit.
        limit: in the same unit.
        most: how many slips may have happened at once, 1 or 2.
    """
    best: tuple[int, float, UndoneSlips] | None = None
    for undone in undone_slips(pose):
        if len(undone.slips) > most or (best is not None and len(undone.slips) > best[0]):
            break
        try:
            missed = miss(undone.pose.camera_from_radar())
        except ValueError:
            continue
        rank = (len(undone.slips), missed)
        if missed <= limit and (best is None or rank < best[:2]):
            best = (*rank, undone)
    return best[2] if best else None


def explained(undone: UndoneSlips, mismatch: str) -> CheckResult:
    """Return an error result that names the slips.

    Args:
        undone: the slips.
        mismatch: what does not fit, with figures; it starts the message.
    """
    slips = undone.slips
    return CheckResult(
        "error",
        "+".join(slip.code for slip in slips),
        f"{mismatch}: " + ", and ".join(slip.message for slip in slips),
        ", and ".join(slip.hint for slip in slips),
    )


_FULL_DIGITS = 15
_FLOAT_32 = 1e-6
_HARMLESS_RAD, _HARMLESS_M = 2e-4, 1e-3
_LARGEST = 0.02  # meters and radians: numbers such as 1 and 0.5 are usually not rounded


@dataclass(frozen=True, slots=True)
class Rounding:
    """What rounding can have done to a pose.

    Attributes:
        digits: of its numbers; 15 and more are all that a number has.
        angle_rad: the largest rotation that rounding can have added.
        distance_m: the largest shift of the translation as written.
    """

    digits: int
    angle_rad: float
    distance_m: float

    @property
    def is_harmless(self) -> bool:
        """Whether it moves the pose by less than any calibration knows it: about 0.01 degrees and a millimeter."""
        return self.angle_rad <= _HARMLESS_RAD and self.distance_m <= _HARMLESS_M

    def at(self, point_radar_m: Vector3, camera_from_radar: RigidTransform) -> float:
        """Return how far rounding can have moved a radar point (3,) in the camera frame [m]."""
        arm_m = float(np.linalg.norm(point_radar_m) + np.linalg.norm(camera_from_radar.translation_m))
        return self.distance_m + self.angle_rad * arm_m

    @property
    def text(self) -> str:
        """What was done to the numbers."""
        return f"the numbers are rounded to {self.digits} digits"


def rounding_of(pose: WrittenPose) -> Rounding:
    """Find out from the numbers of a pose how they were rounded; angles may have been written in degrees."""
    digits, tolerance = _last_digits(pose.rotation)
    if pose.form == "rpy":
        in_degrees, tolerance_deg = _last_digits(np.degrees(pose.rotation))
        if in_degrees < digits:
            digits, tolerance = in_degrees, np.radians(tolerance_deg)
    half_angles = 2.0 if pose.form.startswith("quaternion") else 1.0
    angle_rad = float(tolerance.sum()) if pose.form == "rpy" else half_angles * float(np.linalg.norm(tolerance))
    shift_digits, shift_m = _last_digits(pose.translation_m)
    found = (digits, shift_digits)
    return Rounding(
        max(found) if max(found) < _FULL_DIGITS else min(found),
        min(angle_rad, _LARGEST) + _FLOAT_32,
        min(float(np.linalg.norm(shift_m)), _LARGEST) + _FLOAT_32,
    )


def within_rounding(pose: WrittenPose, camera_from_radar: RigidTransform, rounding: Rounding) -> bool:
    """Return whether a pose, as written, is the given one up to rounding.

    Raises:
        ValueError: its rotation is not a rotation.
    """
    written, wanted = pose.as_written(), as_in_file(pose, camera_from_radar)
    angle_rad = rotation_angle_rad(written.rotation @ wanted.rotation.T)
    far_m = _FLOAT_32 * float(np.linalg.norm(wanted.translation_m))
    distance_m = float(np.linalg.norm(written.translation_m - wanted.translation_m))
    return angle_rad <= rounding.angle_rad and distance_m <= rounding.distance_m + far_m


def as_in_file(pose: WrittenPose, camera_from_radar: RigidTransform) -> RigidTransform:
    """Return the transform that the file would hold for another pose: in its direction, with its camera axes."""
    meant = LINK_FROM_OPTICAL @ camera_from_radar if pose.axes == "link" else camera_from_radar
    return meant if pose.direction == "camera_from_radar" else meant.inverse()


def _last_digits(values: np.ndarray) -> tuple[int, np.ndarray]:
    """Return the most significant digits of any value, and for each value half a unit of its last digit.

    Trailing zeros are not visible in a number, so that the digit is that of the value with the most digits.
    """
    flat = np.abs(np.asarray(values, dtype=np.float64)).ravel()
    parts = [_digits_and_decimals(value) for value in flat.tolist() if value]
    digits = max((digits for digits, _ in parts), default=1)
    decimals = max((decimals for _, decimals in parts), default=0)
    if digits >= _FULL_DIGITS:
        return digits, np.zeros(len(flat))
    exponents = np.floor(np.log10(np.where(flat > 0, flat, 1.0)))
    by_digits = np.where(flat > 0, 0.5 * 10.0 ** (exponents + 1 - digits), 0.0)
    return digits, np.maximum(by_digits, 0.5 * 10.0**-decimals)


def _digits_and_decimals(value: float) -> tuple[int, int]:
    number = Decimal(repr(value)).normalize().as_tuple()
    return len(number.digits), max(0, -int(number.exponent))
