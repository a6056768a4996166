"""The keys of two more of our files: boxes around objects in frames, and the true origin of a simulation's returns."""

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta, Struct

from calib_core.json_forms import Measured
from calib_core.measurements import LabelledScan, TimeNs

BOXES_SCHEMA: Final = "cocalib/boxes-1"
LABELS_SCHEMA: Final = "cocalib/labels-1"

Label = Annotated[str, Meta(max_length=200)]
ImageSide = Annotated[int, Meta(ge=1, le=1_000_000)]


class BoxDocument(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A rectangle around an object: left, top, right, bottom; pixel (0, 0) is the center of the top-left pixel.

    score is a detector's confidence; track is the same for one object in several frames.
    """

    box_px: tuple[Measured, Measured, Measured, Measured]
    label: Label = ""
    score: Annotated[float, Meta(ge=0.0, le=1.0)] = 1.0
    track: Label = ""


class FrameDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """An annotated frame; no boxes say that nothing was seen in it."""

    image_time: TimeNs
    boxes: list[BoxDocument]


class BoxesDocument(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Boxes in recorded frames, identified by the frames' stamps. A frame that is not listed was not annotated."""

    schema: Literal["cocalib/boxes-1"]
    frames: list[FrameDocument]
    image_size_px: tuple[ImageSide, ImageSide] | None = None


class LabelsDocument(Struct, frozen=True, forbid_unknown_fields=True):
    """The true origin of a simulated recording's returns."""

    schema: Literal["cocalib/labels-1"]
    scans: list[LabelledScan]


for _document in (BoxesDocument, LabelsDocument):
    msgspec.json.Decoder(_document)  # for the reason given in documents.py
