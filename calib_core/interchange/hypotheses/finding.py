"""Find every pose in a file's values: matrices, rotations with translations beside them, seven numbers."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from calib_core.interchange.hypotheses.found_poses import FoundPose, PoseReading, RotationReading, Unreadable
from calib_core.interchange.hypotheses.key_words import hints_of, part_of, words_of
from calib_core.interchange.hypotheses.number_readings import (
    matrix_readings,
    named_rotation_readings,
    named_vector,
    rotation_readings,
    seven_number_readings,
    vector_of,
)
from calib_core.interchange.hypotheses.plain_values import array_of

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
            self.poses.append(FoundPose(_place(keys), readings, hints_of(keys if names is None else names, texts)))

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
        _as_numbers(row[1:] if row.shape == (8,) else row, keys, (), search)


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
    texts = (*_between(value), *own, *texts)[:_MOST_TEXTS]
    taken = _pairs_in(value, keys, texts, search)
    for key, inner in value.items():
        if key not in taken:
            _look(inner, (*keys, key), texts, search)


def _between(value: Mapping[Any, Any]) -> Iterator[str]:
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
        fitting = [one for one in translations if one.rest == half.rest] or translations
        if len(fitting) != 1 or fitting[0].vector is None:
            fault = (
                "a rotation, and no translation beside it" if not fitting else "a rotation, and several translations"
            )
            search.refuse((*keys, *half.keys[:1]), ValueError(fault))
            continue
        beside, vector = fitting[0], fitting[0].vector
        place = (*keys, *half.keys[:1]) if len(rotations) > 1 else keys
        readings = tuple(PoseReading(one, vector) for one in half.readings)
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
