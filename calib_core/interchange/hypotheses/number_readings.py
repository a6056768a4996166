"""Each way to read numbers as a pose or a rotation: rows or columns, the quaternion's order, the angles' unit and order."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from calib_core.arrays import Vector3
from calib_core.geometry import matrix_from_quaternion_wxyz, rotation_exp
from calib_core.interchange.hypotheses.found_poses import PoseReading, RotationReading
from calib_core.interchange.hypotheses.key_words import unit_in, words_of
from calib_core.interchange.hypotheses.plain_values import array_of, number_of
from calib_core.interchange.rotations import matrix_from_rpy, nearest_rotation

_ROUNDING = 2e-3
_FULL_TURN_RAD = 2 * math.pi
_LARGEST = 1e9
_BY_ROWS = {"": 1.0, "rows": 0.8, "columns": 0.2}
_ANGLE_NAMES = (("roll", "pitch", "yaw"), ("rx", "ry", "rz"), ("x", "y", "z"))
_VECTOR_WORDS = frozenset({"rvec", "rvecs", "rotvec", "rodrigues", "axis", "vec", "vector"})
_ANGLE_WORDS = frozenset({"rpy", "ypr", "euler", "angles", "roll"})


def _finite(numbers: np.ndarray) -> np.ndarray:
    """Return the numbers.

    Raises:
        ValueError: one is not finite, or too large for a pose.
    """
    if not (np.abs(numbers) <= _LARGEST).all():
        raise ValueError("a number is not finite, or too large for a pose")
    return numbers


def matrix_readings(numbers: np.ndarray) -> tuple[PoseReading, ...]:
    """Return each way to read 12 or 16 numbers as a rotation and a translation; empty if they have another shape.

    Args:
        numbers: (4, 4), (3, 4), (4, 3) or flat.

    Raises:
        ValueError: they have the shape of a pose and are none: mirrored, scaled, a row is missing.
    """
    if numbers.shape not in ((4, 4), (16,), (3, 4), (12,), (4, 3)):
        return ()
    if numbers.size == 16:
        return (_homogeneous(_finite(numbers).reshape(4, 4)),)
    found: list[PoseReading] = []
    fault = ""
    for key, words, rotation, translation in _ways_to_read_twelve(_finite(numbers)):
        try:
            turned = RotationReading(nearest_rotation(rotation, tolerance=_ROUNDING), key, words, _BY_ROWS[key])
        except ValueError as error:
            fault = fault or str(error)
            continue
        found.append(PoseReading(turned, translation))
    if not found:
        raise ValueError(_with_scale(fault, numbers))
    if len(found) == 1:
        turned = found[0].turned
        return (PoseReading(RotationReading(turned.rotation, words=turned.words), found[0].translation),)
    return tuple(found)


def _homogeneous(matrix: np.ndarray) -> PoseReading:
    """Return the pose in a 4x4 matrix, whose last row, or if it is transposed last column, is 0 0 0 1.

    Raises:
        ValueError: neither is, or the rest is no rotation.
    """
    transposed = not _is_last(matrix[3]) and _is_last(matrix[:, 3])
    if transposed:
        matrix = matrix.T
    if not _is_last(matrix[3]):
        shown = " ".join(f"{number:.4g}" for number in matrix[3])
        raise ValueError(f"the last row of the 4x4 matrix is {shown} instead of 0 0 0 1")
    try:
        rotation = nearest_rotation(matrix[:3, :3], tolerance=_ROUNDING)
    except ValueError as error:
        raise ValueError(_with_scale(str(error), matrix)) from None
    words = "a 4x4 matrix written by columns (transposed)" if transposed else ""
    return PoseReading(RotationReading(rotation, words=words), matrix[:3, 3])


def _is_last(row: np.ndarray) -> bool:
    return bool(np.abs(row - [0.0, 0.0, 0.0, 1.0]).max() <= 1e-9)


def _ways_to_read_twelve(numbers: np.ndarray) -> list[tuple[str, str, np.ndarray, np.ndarray]]:
    if numbers.shape == (3, 4):
        return [("", "", numbers[:, :3], numbers[:, 3])]
    if numbers.shape == (4, 3):
        return [
            ("rows", "three rows of R, then t", numbers[:3], numbers[3]),
            ("columns", "a 3x4 matrix written by columns", numbers[:3].T, numbers[3]),
        ]
    rows = numbers.reshape(3, 4)
    first, last = numbers[:9].reshape(3, 3), numbers[9:]
    return [
        ("", "", rows[:, :3], rows[:, 3]),
        ("rows", "nine numbers of R by rows, then t", first, last),
        ("columns", "a 3x4 matrix written by columns", first.T, last),
    ]


def _with_scale(fault: str, matrix: np.ndarray) -> str:
    """Add to a fault that a matrix is no rotation what it may be instead."""
    largest = float(np.abs(matrix).max())
    if "orthonormal" not in fault:
        return fault
    if largest > 50:
        return f"{fault}: it looks like a projection, with the camera matrix multiplied into it; give R and t alone"
    return f"{fault}: is it scaled, or rounded to too few digits?"


def named_rotation_readings(values: Mapping[Any, Any], words: Sequence[str] = ()) -> tuple[RotationReading, ...]:
    """Return each way to read qx, qy, qz, qw or roll, pitch, yaw among other values; empty if they are not there.

    Args:
        values: by name.
        words: in the names and texts around them.

    Raises:
        ValueError: the quaternion does not have length 1, or a number is not finite.
    """
    if (quaternion := _named(values, ("qw", "qx", "qy", "qz"))) is not None:
        return (RotationReading(_from_quaternion(quaternion)),)
    angles = _named(values, *_ANGLE_NAMES[:2])
    return () if angles is None else _angle_readings(angles, _angle_unit((*values, *words)), listed=False)


def _angle_unit(names: Sequence[object]) -> str:
    units = (unit_in(f"angle_{name}") for name in (word for one in names for word in words_of(one)[-1:]))
    return next((unit for unit in units if unit in ("deg", "rad")), "")


def rotation_readings(value: Any, key: object, words: Sequence[str] = ()) -> tuple[RotationReading, ...]:
    """Return each way to read a value as a rotation; empty if it has the shape of none.

    Args:
        value: a matrix, a quaternion, a rotation vector or three angles; components may be named.
        key: its own name.
        words: in the names and texts around it.

    Raises:
        ValueError: it has the shape of a rotation and is none: mirrored, a quaternion of another length, not finite.
    """
    named = value if isinstance(value, Mapping) else {}
    if (quaternion := _named(named, ("w", "x", "y", "z"), ("qw", "qx", "qy", "qz"))) is not None:
        return (RotationReading(_from_quaternion(quaternion)),)
    if (angles := _named(named, *_ANGLE_NAMES)) is not None:
        return _angle_readings(angles, _angle_unit((*named, key, *words)), listed=False)
    numbers = array_of(value)
    if numbers is None:
        return ()
    if numbers.shape in ((3, 3), (9,)):
        return (RotationReading(nearest_rotation(_finite(numbers).reshape(3, 3), tolerance=_ROUNDING)),)
    if numbers.shape == (4,):
        return _quaternion_readings(numbers, {*words_of(key), *words})
    unit = _angle_unit((key, *words))
    return _three_number_readings(_finite(numbers), set(words_of(key)), unit) if numbers.shape == (3,) else ()


def _named(values: Mapping[Any, Any], *orders: tuple[str, ...]) -> np.ndarray | None:
    """Return components by name, whatever the case and the unit after it; None if one is missing."""
    by_name: dict[str, Any] = {}
    for key, value in values.items():
        words = words_of(key)
        by_name["".join(words[:-1] if unit_in(key) else words)] = value
    for names in orders:
        numbers = [number_of(by_name.get(name)) for name in names]
        if all(number is not None for number in numbers):
            return _finite(np.array(numbers, dtype=np.float64))
    return None


def vector_of(value: Any) -> Vector3 | None:
    """Return the three numbers of a translation, which may be named x, y, z; None if there are not three.

    Raises:
        ValueError: one is not finite.
    """
    if isinstance(value, Mapping) and "data" not in value:
        return named_vector(value)
    numbers = array_of(value)
    return _finite(numbers) if numbers is not None and numbers.shape == (3,) else None


def named_vector(values: Mapping[Any, Any]) -> Vector3 | None:
    """Return x, y and z among other values, or tx, ty and tz; None if they are not there.

    Raises:
        ValueError: one is not finite.
    """
    return _named(values, ("tx", "ty", "tz"), ("x", "y", "z"))


def _from_quaternion(wxyz: np.ndarray) -> np.ndarray:
    length = math.hypot(*_finite(wxyz))
    if not abs(length - 1.0) <= _ROUNDING:
        raise ValueError(f"the quaternion has length {length:.4g}, not 1")
    return matrix_from_quaternion_wxyz(wxyz)


def _quaternion_readings(numbers: np.ndarray, words: set[str]) -> tuple[RotationReading, ...]:
    last_first = np.roll(_finite(numbers), 1)
    w_first = 0.95 if {"wxyz", "qvec"} & words else 0.05 if "xyzw" in words else 0.45
    return (
        RotationReading(_from_quaternion(last_first), "xyzw", "quaternion x y z w", 1.0 - w_first),
        RotationReading(_from_quaternion(numbers), "wxyz", "quaternion w x y z", w_first),
    )


def _three_number_readings(numbers: np.ndarray, words: set[str], unit: str) -> tuple[RotationReading, ...]:
    """Return three numbers read as a rotation vector, as angles, or as both if the words of the key do not say which."""
    vector: tuple[RotationReading, ...] = ()
    if unit != "deg" and np.abs(numbers).max() <= _FULL_TURN_RAD:
        vector = (RotationReading(rotation_exp(numbers), "rvec", "rotation vector [rad]"),)
    if words & _VECTOR_WORDS:
        if not vector:
            raise ValueError("the rotation vector is longer than a full turn: is it in degrees?")
        return vector
    angles = _angle_readings(numbers[::-1] if "ypr" in words else numbers, unit, listed="ypr" not in words)
    if words & _ANGLE_WORDS:
        return angles
    if not vector:
        return angles
    return tuple(RotationReading(one.rotation, one.key, one.words, one.weight / 2) for one in (*vector, *angles))


def _angle_readings(rpy: np.ndarray, unit: str, *, listed: bool) -> tuple[RotationReading, ...]:
    """Return three angles in each unit and order in which they are usual.

    Args:
        rpy: (3,) roll, pitch, yaw.
        unit: "rad", "deg" or "" if no name says.
        listed: whether they are a list, so that they may be in another order.
    """
    units = {"rad": 1.0} if unit == "rad" else {"deg": 1.0} if unit == "deg" else {"rad": 0.6, "deg": 0.4}
    if not unit and np.abs(rpy).max() > _FULL_TURN_RAD:
        units = {"deg": 1.0}
    orders = {"rpy": 0.6, "ypr": 0.25, "moving": 0.15} if listed else {"rpy": 0.85, "moving": 0.15}
    named = {
        "rpy": "roll, pitch, yaw about fixed axes",
        "ypr": "yaw, pitch, roll",
        "moving": "roll, pitch, yaw about the axes as they move",
    }
    found = []
    for one, weight in units.items():
        angles = np.radians(rpy) if one == "deg" else rpy
        for order, share in orders.items():
            matrix = matrix_from_rpy(angles[::-1] if order == "ypr" else angles)
            if order == "moving":  # Rx Ry Rz: the transpose of the fixed-axis rotation by the opposite angles
                matrix = matrix_from_rpy(-angles).T
            key = f"{order}-{one}"
            found.append(RotationReading(matrix, key, f"{named[order]} [{one}]", weight * share))
    return tuple(found)


def seven_number_readings(numbers: np.ndarray, words: Sequence[str] = ()) -> tuple[PoseReading, ...]:
    """Return each way to read seven numbers as a position and a quaternion; empty if four of them at no end have length 1."""
    found = []
    for position_first in (True, False):
        translation, quaternion = (numbers[:3], numbers[3:]) if position_first else (numbers[4:], numbers[:4])
        try:
            readings = _quaternion_readings(quaternion, set(words))
        except ValueError:
            continue
        for one in readings:
            key, both = f"{one.key}-xyz", f"{one.words}, then x y z"
            if position_first:
                key, both = f"xyz-{one.key}", f"x y z, then {one.words}"
            turned = RotationReading(one.rotation, key, both, one.weight * (0.8 if position_first else 0.2))
            found.append(PoseReading(turned, _finite(translation)))
    return tuple(found)
