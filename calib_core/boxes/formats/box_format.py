"""What a format of boxes is: how its files are recognised and read, what they state of a frame, and checks of their numbers."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from xml.etree.ElementTree import Element

from calib_core.errors import InputError
from calib_core.measurements import Box, TimeNs


@dataclass(frozen=True, slots=True)
class FileFrame:
    """One annotated frame as its file names it; at least one of stamp, number and name identifies it.

    Attributes:
        boxes: in our pixels: (0, 0) is the centre of the top-left pixel.
        stamp: that the file states for the frame; None if it states none.
        number: that the file states for the frame; None if it states none.
        name: of the picture, without folder and suffix; "" if the file names none.
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
        image_size_px: width and height of the pictures; None if the file does not state it.
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
        image_size_px: width and height of the recorded pictures, for formats that count in shares of them; None if unknown.
    """

    source: str
    value: Any = None
    root: Element | None = None
    members: Mapping[str, str] = field(default_factory=dict)
    image_size_px: tuple[int, int] | None = None

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


def finite_number(value: Any, place: str) -> float:
    """Return a number of a file.

    Args:
        value: a number, or text with one.
        place: where it is, with the file's name.

    Raises:
        InputError: it is none, or not finite.
    """
    if isinstance(value, int | float | str) and not isinstance(value, bool):
        try:
            number = float(value)
        except (ValueError, OverflowError):
            number = math.nan
        if math.isfinite(number) and abs(number) <= _LARGEST:
            return number
    raise InputError(f"{place}: expected a number, found {str(value)[:40]!r}; correct it")


def whole_number(value: Any, place: str) -> int:
    """Return a whole number of a file, such as that of a frame.

    Raises:
        InputError: it is none.
    """
    number = finite_number(value, place)
    if not number.is_integer():
        raise InputError(f"{place}: expected a whole number, found {str(value)[:40]!r}; correct it")
    return int(number)


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
    cosine, sine = abs(math.cos(angle_rad)), abs(math.sin(angle_rad))
    half_u_px = (width_px * cosine + height_px * sine) / 2
    half_v_px = (width_px * sine + height_px * cosine) / 2
    edges = (u_px - half_u_px, v_px - half_v_px, u_px + half_u_px, v_px + half_v_px)
    return edge_box(edges, place, label=label, score=score, track=track)
