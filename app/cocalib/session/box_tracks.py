"""Boxes that a person drew or loaded, as a value: one track per object, with the frames in which its box is known."""

from dataclasses import dataclass
from typing import TypeAlias

from calib_core.measurements import TimeNs

BoxEdges: TypeAlias = tuple[float, float, float, float]
"""Left, top, right and bottom edge of a box [px]; pixel (0, 0) is the centre of the top-left pixel."""


@dataclass(frozen=True, slots=True, order=True)
class BoxKeyframe:
    """A frame in which a person said where an object is.

    Attributes:
        image_time: stamp of the frame.
        edges_px: of its box; None: the object is hidden from this frame on.
    """

    image_time: TimeNs
    edges_px: BoxEdges | None


@dataclass(frozen=True, slots=True)
class BoxTrack:
    """The boxes of one object.

    Attributes:
        id: unique in the session, such as "b3"; it becomes Box.track.
        label: the object's class, such as "person"; "" if a file states none.
        keyframes: sorted by time, at least one, each stamp once.
        is_carried: the box is followed through the frames after each keyframe; boxes from a file are only in the frames
            for which the file states them.
    """

    id: str
    label: str
    keyframes: tuple[BoxKeyframe, ...]
    is_carried: bool = True
