"""Boxes around objects in camera frames, and which radar returns are whose: what Acc is computed from."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.measurements import TimeNs


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle around one object in one frame; pixel (0, 0) is the centre of the top-left pixel.

    Attributes:
        left_px: of its left edge.
        top_px: of its upper edge.
        right_px: of its right edge, not less than left_px.
        bottom_px: of its lower edge, not less than top_px.
        label: the object's class, such as "person"; "" if the source states none.
        score: the detector's confidence, 0 to 1; 1 for a box drawn by a person.
        track: the same for boxes of one object in several frames; "" if the source does not follow objects.
    """

    left_px: float
    top_px: float
    right_px: float
    bottom_px: float
    label: str = ""
    score: float = 1.0
    track: str = ""


@dataclass(frozen=True, slots=True)
class FrameBoxes:
    """The boxes of one annotated frame; none is a statement too: nothing was seen there.

    Attributes:
        image_time: the recorded stamp of the frame.
        boxes: in any order.
    """

    image_time: TimeNs
    boxes: tuple[Box, ...]


@dataclass(frozen=True, slots=True)
class Boxes:
    """The boxes of a recording. A frame that is not listed was not annotated and does not count.

    Attributes:
        frames: in order of time, each stamp once.
        source: where they come from, for messages: a file's name or a topic.
        image_size_px: width and height of the pictures that they were made on; None if the source states none.
        notes: what reading took for granted, as sentences without their final periods.
    """

    frames: tuple[FrameBoxes, ...]
    source: str
    image_size_px: tuple[int, int] | None = None
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.frames)

    def __iter__(self) -> Iterator[FrameBoxes]:
        return iter(self.frames)

    @property
    def times_ns(self) -> TimesNs:
        """The stamps of the annotated frames: (n,), ascending."""
        return np.array([frame.image_time for frame in self.frames], dtype=np.int64)

    @property
    def labels(self) -> tuple[str, ...]:
        """The classes that occur, sorted."""
        return tuple(sorted({box.label for frame in self.frames for box in frame.boxes}))


@dataclass(frozen=True, slots=True)
class LabelledScan:
    """Which object each return of a scan comes from, as only a simulation knows.

    Attributes:
        radar_time: stamp of the scan.
        tracks: of each return in the scan's order: the object, as in Box.track; "" for anything else.
    """

    radar_time: TimeNs
    tracks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ReturnLabels:
    """The true origin of a simulated recording's returns.

    Attributes:
        scans: in order of time.
        source: for messages.
    """

    scans: tuple[LabelledScan, ...]
    source: str
