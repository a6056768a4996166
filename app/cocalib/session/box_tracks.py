"""Boxes that a person drew or loaded, as a value: one track per object, with the frames in which its box is known."""

from typing import Annotated, TypeAlias

import msgspec
from msgspec import Meta

from calib_core.measurements import TimeNs

BoxEdges: TypeAlias = tuple[float, float, float, float]
"""Left, top, right and bottom edge of a box [px]; pixel (0, 0) is the centre of the top-left pixel."""


TrackId: TypeAlias = Annotated[str, Meta(min_length=1, max_length=100)]
BoxLabel: TypeAlias = Annotated[str, Meta(max_length=100)]


class BoxKeyframe(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"edges_px": "box_px"}):
    """A frame in which a person said where an object is.

    Attributes:
        image_time: stamp of the frame.
        edges_px: of its box; None: the object is hidden from this frame on.
    """

    image_time: TimeNs
    edges_px: BoxEdges | None


class BoxTrack(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"is_carried": "carried"}):
    """The boxes of one object.

    Attributes:
        id: unique in the session, such as "b3"; it becomes Box.track.
        label: the object's class, such as "person"; "" if a file states none.
        keyframes: sorted by time, at least one, each stamp once.
        is_carried: the box is followed through the frames after each keyframe; boxes from a file are only in the frames
            for which the file states them.
    """

    id: TrackId
    label: BoxLabel
    keyframes: tuple[BoxKeyframe, ...]
    is_carried: bool = True
