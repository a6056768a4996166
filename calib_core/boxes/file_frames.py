"""What a file of boxes states about its frames, before they are matched to recorded frames."""

from dataclasses import dataclass

from calib_core.detections import Box
from calib_core.measurements import TimeNs


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
