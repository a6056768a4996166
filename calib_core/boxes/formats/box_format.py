"""What a format of boxes is: how its files are recognised and read, what they state of a frame, and checks of their numbers."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from calib_core.arrays import Matrix33
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, matrix_from_quaternion_wxyz
from calib_core.measurements import Box, Cuboid, TimeNs
from calib_core.recordings.box_topics import upright


@dataclass(frozen=True, slots=True)
class FileFrame:
    """One annotated frame as its file names it; at least one of stamp, number and name identifies it.

    Attributes:
        boxes: in our pixels: (0, 0) is the centre of the top-left pixel.
        stamp: that the file states for the frame; None if it states none.
        number: that the file states for the frame; None if it states none.
        name: of the image, without folder and suffix; "" if the file names none.
    """

    boxes: tuple[Box, ...]
    stamp: TimeNs | None = None
    number: int | None = None
    name: str = ""


@dataclass(frozen=True, slots=True)
class FileBoxes:
    """The content of a file of boxes.

    Attributes:
        frames: in the file's order; none may be annotated twice.
        image_size_px: width and height of the images; None if the file does not state it.
        first_number: of the first frame of the sequence, if the format defines it; None if files differ.
        frame_count: how many frames the annotated sequence has; None if the file does not state it.
        notes: what reading took for granted, as sentences without their final periods.
    """

    frames: tuple[FileFrame, ...]
    image_size_px: tuple[int, int] | None = None
    first_number: int | None = None
    frame_count: int | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class BoxFile:
    """A file of boxes, or a folder or zip archive of files, its syntax parsed once.

    Attributes:
        source: its name, for messages.
        value: of JSON; None for anything else.
        root: of XML; None for anything else.
        members: the text files of a folder or archive, or a single text file, by their path with forward slashes.
        tables: the folder whose members are left to be read row by row, their texts here empty; None if these are whole.
        image_size_px: width and height of the recorded images, for formats that count in shares of them; None if unknown.
        image_names: of the recorded frames' files without suffix, for sets of several cameras; none if they are not files.
    """

    source: str
    value: Any = None
    root: Element | None = None
    members: Mapping[str, str] = field(default_factory=dict)
    tables: Path | None = None
    image_size_px: tuple[int, int] | None = None
    image_names: Sequence[str] = ()

    @property
    def mapping(self) -> Mapping[str, Any]:
        """The value if it is a JSON object, otherwise an empty mapping."""
        return self.value if isinstance(self.value, dict) else {}


@dataclass(frozen=True, slots=True)
class BoxFormat:
    """A format of boxes that is read.

    Attributes:
        name: for messages, as its tool spells it.
        recognizes: whether a file is of this format, by its content; never raises.
        read: the frames and boxes of a recognised file; raises InputError with the place of what is wrong.
    """

    name: str
    recognizes: Callable[[BoxFile], bool]
    read: Callable[[BoxFile], FileBoxes]


HALF_PX = 0.5
"""Where (0, 0) is the corner of the top-left pixel, its centre is (0.5, 0.5), which is our (0, 0)."""
_LARGEST = 1e9


def finite_number(value: Any, place: str, *, most: float = _LARGEST) -> float:
    """Return a number of a file.

    Args:
        value: a number, or text with one.
        place: where it is, with the file's name.
        most: its largest size.

    Raises:
        InputError: it is none, or not finite.
    """
    if isinstance(value, int | float | str) and not isinstance(value, bool):
        try:
            number = float(value)
        except (ValueError, OverflowError):
            number = math.nan
        if math.isfinite(number) and abs(number) <= most:
            return number
    raise InputError(f"{place}: expected a number, found {str(value)[:40]!r}; correct it")


def numbers(values: Any, count: int, place: str) -> list[float]:
    """Return a list of a file with this many numbers.

    Raises:
        InputError: it is none.
    """
    if not isinstance(values, list) or len(values) != count:
        raise InputError(f"{place}: expected a list of {count} numbers; correct it")
    return [finite_number(value, place) for value in values]


def whole_number(value: Any, place: str, *, most: float = _LARGEST) -> int:
    """Return a whole number of a file, such as that of a frame.

    Raises:
        InputError: it is none.
    """
    number = finite_number(value, place, most=most)
    if not number.is_integer():
        raise InputError(f"{place}: expected a whole number, found {str(value)[:40]!r}; correct it")
    return value if isinstance(value, int) else int(number)


def score_of(value: Any) -> float:
    """Return a confidence between 0 and 1; 1 for what is no such number."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        return 1.0
    return number if 0.0 <= number <= 1.0 else 1.0


def edge_box(
    edges: Sequence[Any], place: str, *, label: str, score: float = 1.0, track: str = "", shift_px: float = HALF_PX
) -> Box:
    """Make a box of its left, top, right and bottom edges.

    Args:
        edges: four numbers, or texts with one [px].
        place: where they are, with the file's name.
        label: the class.
        score: the confidence.
        track: the object.
        shift_px: what to take off the coordinates to have pixel (0, 0) at the centre of the top-left pixel.

    Raises:
        InputError: they are no numbers, or in the wrong order.
    """
    if len(edges) != 4:
        raise InputError(f"{place}: expected the four numbers of a box, found {len(edges)}; correct it")
    left_px, top_px, right_px, bottom_px = (finite_number(edge, place) - shift_px for edge in edges)
    if left_px > right_px or top_px > bottom_px:
        raise InputError(f"{place}: the right or lower edge of a box is before the left or upper one; correct it")
    return Box(left_px, top_px, right_px, bottom_px, label, score, track)


def rotated_box(
    centre: Sequence[float],
    size: Sequence[float],
    angle_rad: float,
    place: str,
    *,
    label: str,
    score: float,
    track: str,
) -> Box:
    """Make the upright box around a rectangle that is turned about its centre.

    Args:
        centre: u and v, from the corner of the top-left pixel [px].
        size: width and height [px].
        angle_rad: of the turn.
        place: where it is, with the file's name.
        label: the class.
        score: the confidence.
        track: the object.

    Raises:
        InputError: the size is negative, or a number is not finite.
    """
    u_px, v_px, width_px, height_px = (finite_number(value, place) for value in (*centre, *size))
    if width_px < 0 or height_px < 0:
        raise InputError(f"{place}: a box has a negative width or height; correct it")
    edges = upright((u_px, v_px, width_px, height_px), angle_rad)
    return edge_box(edges, place, label=label, score=score, track=track)


_NEAREST_M = 0.1  # that a corner may be ahead of the camera


def stated_pose(turn: np.ndarray, translation_m: Sequence[float], place: str) -> RigidTransform:
    """Return a pose of a file.

    Args:
        turn: a quaternion (w, x, y, z), or a rotation matrix (3, 3).
        translation_m: x, y, z.
        place: where it is, with the file's name.

    Raises:
        InputError: it is no rotation.
    """
    try:
        rotation = matrix_from_quaternion_wxyz(turn) if turn.ndim == 1 else turn
        return RigidTransform(rotation, np.array(translation_m))
    except ValueError as error:
        raise InputError(f"{place}: {error}; correct it") from None


def cuboid_of(camera_from_object: RigidTransform, size_m: Sequence[float]) -> Cuboid:
    """Return a cuboid as an evaluation takes it.

    Args:
        camera_from_object: of its middle; its x is along its length.
        size_m: length, width and height.
    """
    ahead = camera_from_object.rotation[:, 0]
    right_m, down_m, ahead_m = camera_from_object.translation_m.tolist()
    return Cuboid((right_m, down_m, ahead_m), size_m[0], size_m[1], math.atan2(-ahead[0], ahead[2]))


def cuboid_box(
    camera_from_object: RigidTransform,
    size_m: Sequence[float],
    matrix_px: Matrix33,
    image_size_px: tuple[int, int],
    *,
    label: str,
    track: str,
) -> Box | None:
    """Make the box around a cuboid in an undistorted image; None if it is not in it, or reaches behind the camera.

    Args:
        camera_from_object: of its middle; its x is along its length.
        size_m: length, width and height.
        matrix_px: K.
        image_size_px: width and height.
        label: the class.
        track: the object.
    """
    corners = camera_from_object @ (0.5 * np.array(size_m) * list(itertools.product((-1.0, 1.0), repeat=3)))
    if corners[:, 2].min() <= _NEAREST_M:
        return None
    pixels = (corners @ matrix_px.T)[:, :2] / corners[:, 2:]
    low, high = (
        np.maximum(pixels.min(axis=0), -HALF_PX),
        np.minimum(pixels.max(axis=0), np.array(image_size_px) - HALF_PX),
    )
    if not (low < high).all():
        return None
    cuboid = cuboid_of(camera_from_object, size_m)
    return Box(float(low[0]), float(low[1]), float(high[0]), float(high[1]), label, track=track, cuboid=cuboid)
