"""Find every pose in a file's values, and every way to read its numbers: matrices, rotations with translations, seven numbers."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from calib_core.arrays import Vector3
from calib_core.geometry import matrix_from_quaternion_wxyz, rotation_exp
from calib_core.interchange.hypotheses.found_poses import (
    FoundPose,
    PoseReading,
    RotationReading,
    Unreadable,
    hints_of,
    part_of,
    unit_in,
    words_of,
)
from calib_core.interchange.hypotheses.plain_values import array_of, number_of
from calib_core.interchange.rotations import matrix_from_rpy, nearest_rotation

_WHOLE = "the file"
_MOST_POSES = 200
_MOST_VALUES = 20_000
_DEEPEST = 40
_LONGEST_NAME = 80
_MOST_TEXTS = 40
_FRAME_KEYS = (  # target, source, and whether that is said of the points or of the sensors
    ("parent", "child", "from"),
    ("parent_frame", "child_frame", "from"),
    ("frame_id", "child_frame_id", "from"),
    ("to", "from", "to"),
    ("target", "source", "to"),
    ("to_frame", "from_frame", "to"),
    ("target_frame", "source_frame", "to"),
)
_NOT_POSES = frozenset(
    {"intrinsic", "intrinsics", "projection", "rectification", "distortion", "coefficients", "covariance"}
    | {"homography", "fundamental", "essential", "information"}
)
_CAMERA_KEY = re.compile(r"[kdphef]\d*|p_rect.*|camera_?matrix", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Found:
    """What was found in a file.

    Attributes:
        poses: in file order.
        unreadable: what has the shape of a pose and is none.
    """

    poses: tuple[FoundPose, ...]
    unreadable: tuple[Unreadable, ...]


@dataclass(slots=True)
class _Search:
    """What has been found so far; each list and mapping is looked at once, however often YAML refers to it."""

    poses: list[FoundPose] = field(default_factory=list)
    unreadable: list[Unreadable] = field(default_factory=list)
    seen: set[int] = field(default_factory=set)

    def add(
        self,
        keys: Sequence[object],
        readings: tuple[PoseReading, ...],
        texts: Sequence[str],
        names: Sequence[object] | None = None,
    ) -> None:
        if readings and len(self.poses) < _MOST_POSES:
            hints = hints_of(keys if names is None else names, texts)
            said = tuple(str(name) for name in (*texts, *keys) if isinstance(name, str))
            self.poses.append(FoundPose(_place(keys), readings, hints, said))

    def refuse(self, keys: Sequence[object], fault: ValueError) -> None:
        if len(self.unreadable) < _MOST_POSES:
            self.unreadable.append(Unreadable(_place(keys), str(fault)))

    def is_new(self, value: Any) -> bool:
        new = id(value) not in self.seen and len(self.seen) < _MOST_VALUES
        self.seen.add(id(value))
        return new


def find_poses(values: Any) -> Found:
    """Return every pose in a file's values.

    Args:
        values: mappings, lists, text, numbers and arrays, as `plain_values` returns them.
    """
    search = _Search()
    if isinstance(values, list) and values and all(isinstance(row, np.ndarray) for row in values):
        _in_rows(values, search)
    else:
        _look(values, (), (), search)
    return Found(tuple(search.poses), tuple(search.unreadable))


def _place(keys: Sequence[object]) -> str:
    text = ""
    for key in keys:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else str(key)
    return "".join(character for character in text[:200] if character.isprintable()) or _WHOLE


def _in_rows(rows: list[np.ndarray], search: _Search) -> None:
    """Look at lines of numbers: one matrix, or a pose in each line, perhaps with a time before it."""
    whole = array_of([row.tolist() for row in rows]) if len(rows) <= 16 else None
    if whole is None and len(rows) <= 16:
        whole = array_of(np.concatenate([np.atleast_1d(row) for row in rows]).tolist())
    if whole is not None and whole.size in (12, 16) and whole.shape not in ((2, 8), (8, 2)):
        _as_numbers(whole, (), (), search)
        return
    for index, row in enumerate(rows):
        keys: tuple[object, ...] = () if len(rows) == 1 else (f"line {index + 1}",)
        if row.shape == (8,):  # a time before it, as in TUM's trajectories, whose quaternions end with w
            search.add(keys, tuple(one for one in seven_number_readings(row[1:]) if one.turned.key == "xyz-xyzw"), ())
        else:
            _as_numbers(row, keys, (), search)


def _look(value: Any, keys: tuple[object, ...], texts: tuple[str, ...], search: _Search) -> None:
    if len(keys) > _DEEPEST or (isinstance(value, list | dict) and not search.is_new(value)):
        return
    of_the_camera = _is_of_the_camera(keys[-1:]) and array_of(value) is not None
    if of_the_camera or _as_numbers(value, keys, texts, search):
        return
    if isinstance(value, Mapping):
        _in_mapping(value, keys, texts, search)
    elif isinstance(value, list | tuple):
        for index, item in enumerate(value[:_MOST_VALUES]):
            if isinstance(item, list | tuple | Mapping):
                _look(item, (*keys, index), texts, search)


def _words_around(keys: Sequence[object], texts: Sequence[str]) -> list[str]:
    return [word for one in (*keys, *texts) for word in words_of(one)]


def _is_of_the_camera(keys: tuple[object, ...]) -> bool:
    """Return whether a key names a matrix that is no pose, such as the camera's."""
    return any(_NOT_POSES & set(words_of(key)) or _CAMERA_KEY.fullmatch(str(key)) for key in keys)


def _as_numbers(value: Any, keys: tuple[object, ...], texts: tuple[str, ...], search: _Search) -> bool:
    """Take a value as a pose if it has the shape of one; return whether it is numbers at all."""
    numbers = array_of(value)
    if numbers is None:
        return False
    if numbers.ndim == 3 or (numbers.ndim == 2 and numbers.shape[1] in (7, 12, 16)):
        for index, one in enumerate(numbers):
            _as_numbers(one, (*keys, index), texts, search)
        return True
    try:
        words = _words_around(keys, texts)
        readings = seven_number_readings(numbers, words) if numbers.shape == (7,) else matrix_readings(numbers)
        search.add(keys, readings, texts)
    except ValueError as error:
        search.refuse(keys, error)
    return True


def _in_mapping(value: Mapping[Any, Any], keys: tuple[object, ...], texts: tuple[str, ...], search: _Search) -> None:
    """Look for a rotation and a translation next to each other, then into each value."""
    own = (text for text in value.values() if isinstance(text, str) and len(text) < _LONGEST_NAME)
    texts = (*_frames_named(value), *own, *texts)[:_MOST_TEXTS]
    taken = _pairs_in(value, keys, texts, search)
    for key, inner in value.items():
        if key not in taken:
            _look(inner, (*keys, key), texts, search)


def _frames_named(value: Mapping[Any, Any]) -> Iterator[str]:
    """Yield which frames a mapping names, as words about the direction: a child's pose carries its points into the parent."""
    named = {
        str(key).lower(): text for key, text in value.items() if isinstance(text, str) and len(text) < _LONGEST_NAME
    }
    for target, source, word in _FRAME_KEYS:
        if target in named and source in named:
            yield f"{named[target]} from {named[source]}" if word == "from" else f"{named[source]} to {named[target]}"


@dataclass(frozen=True, slots=True, eq=False)
class _Half:
    """A rotation or a translation in a mapping.

    Attributes:
        keys: its own, or those of its components if they stand beside other values.
        rest: the other words of its key.
        readings: of a rotation; empty for a translation.
        vector: of a translation; None for a rotation.
        names: of its components, which may state units.
    """

    keys: tuple[object, ...]
    rest: tuple[str, ...] = ()
    readings: tuple[RotationReading, ...] = ()
    vector: np.ndarray | None = None
    names: tuple[object, ...] = ()


def _pairs_in(
    value: Mapping[Any, Any], keys: tuple[object, ...], texts: tuple[str, ...], search: _Search
) -> set[object]:
    """Take each rotation with the translation that belongs to it; return the keys that were taken."""
    halves = list(_halves(value, keys, texts, search))
    rotations = [half for half in halves if half.readings]
    translations = [half for half in halves if half.vector is not None]
    taken: set[object] = set()
    for half in rotations:
        fitting = [translation for translation in translations if translation.rest == half.rest] or translations
        if len(fitting) != 1 or fitting[0].vector is None:
            fault = (
                "a rotation, and no translation beside it" if not fitting else "a rotation, and several translations"
            )
            search.refuse((*keys, *half.keys[:1]), ValueError(fault))
            continue
        beside, vector = fitting[0], fitting[0].vector
        place = (*keys, *half.keys[:1]) if len(rotations) > 1 else keys
        readings = tuple(PoseReading(reading, vector) for reading in half.readings)
        names = (*keys, *half.keys, *beside.keys, *beside.names)
        search.add(place, readings, texts, names)
        taken |= {*half.keys, *beside.keys}
    return taken


def _halves(
    value: Mapping[Any, Any], keys: tuple[object, ...], texts: tuple[str, ...], search: _Search
) -> Iterator[_Half]:
    """Yield each rotation and each translation in a mapping, by name and as components beside other values."""
    words = _words_around(keys, texts)
    for key, inner in value.items():
        part, rest = part_of(key)
        names = tuple(inner) if isinstance(inner, Mapping) else ()
        try:
            if part == "rotation":
                yield _Half((key,), rest, readings=rotation_readings(inner, key, words))
            if part == "translation":
                yield _Half((key,), rest, vector=vector_of(inner), names=names)
        except ValueError as error:
            search.refuse((*keys, key), error)
    try:
        yield _Half((), readings=named_rotation_readings(value, words))
        yield _Half((), vector=named_vector(value), names=tuple(value))
    except ValueError as error:
        search.refuse(keys, error)


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
    readings: list[PoseReading] = []
    fault = ""
    for key, words, rotation, translation in _ways_to_read_twelve(_finite(numbers)):
        try:
            turned = RotationReading(nearest_rotation(rotation, tolerance=_ROUNDING), key, words, _BY_ROWS[key])
        except ValueError as error:
            fault = fault or str(error)
            continue
        readings.append(PoseReading(turned, translation))
    if not readings:
        raise ValueError(_with_scale(fault, numbers))
    if len(readings) == 1:
        turned = readings[0].turned
        return (PoseReading(RotationReading(turned.rotation, words=turned.words), readings[0].translation),)
    return tuple(readings)


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
        what = "it looks like a projection K [R | t], with the camera matrix multiplied into it"
        return f"{fault}: {what}; give R and t alone: inverse(K) times it"
    return f"{fault}: is it scaled, or rounded to too few digits?"


def named_rotation_readings(values: Mapping[Any, Any], words: Sequence[str] = ()) -> tuple[RotationReading, ...]:
    """Return each way to read qx, qy, qz, qw or roll, pitch, yaw among other values; empty if they are not there.

    Args:
        values: by name.
        words: in the names and texts around them.

    Raises:
        ValueError: the quaternion does not have length 1, or a number is not finite.
    """
    if (quaternion := _components_by_name(values, ("qw", "qx", "qy", "qz"))) is not None:
        return (RotationReading(_from_quaternion(quaternion)),)
    angles = _components_by_name(values, *_ANGLE_NAMES[:2])
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
    if (quaternion := _components_by_name(named, ("w", "x", "y", "z"), ("qw", "qx", "qy", "qz"))) is not None:
        return (RotationReading(_from_quaternion(quaternion)),)
    if (angles := _components_by_name(named, *_ANGLE_NAMES)) is not None:
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


def _components_by_name(values: Mapping[Any, Any], *orders: tuple[str, ...]) -> np.ndarray | None:
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
    return _components_by_name(values, ("tx", "ty", "tz"), ("x", "y", "z"))


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
        for reading in readings:
            key, both = f"{reading.key}-xyz", f"{reading.words}, then x y z"
            if position_first:
                key, both = f"xyz-{reading.key}", f"x y z, then {reading.words}"
            turned = RotationReading(reading.rotation, key, both, reading.weight * (0.8 if position_first else 0.2))
            found.append(PoseReading(turned, _finite(translation)))
    return tuple(found)
