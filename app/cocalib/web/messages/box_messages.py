"""What the page is sent about boxes."""

from dataclasses import dataclass

from cocalib.view.box_rows import BoxedReturn, BoxInFrame


@dataclass(frozen=True, slots=True)
class FrameBoxes:
    """The boxes of the frame that a page shows.

    Attributes:
        index: of the frame.
        boxes: around objects in it.
        returns: of moving targets at its time.
    """

    index: int
    boxes: tuple[BoxInFrame, ...]
    returns: tuple[BoxedReturn, ...]
