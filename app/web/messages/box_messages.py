"""What the page is sent about boxes."""

from dataclasses import dataclass

from app.view.box_rows import BoxInFrame

__all__ = ["FrameBoxes"]


@dataclass(frozen=True, slots=True)
class FrameBoxes:
    """The boxes of the frame that a page shows.

    Attributes:
        index: of the frame.
        boxes: around objects in it.
    """

    index: int
    boxes: tuple[BoxInFrame, ...]
