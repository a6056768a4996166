"""Where images of a board come from, and what is found in one."""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np
from msgspec import Meta, Struct

from calib_core.arrays import Indices, Points2, freeze
from calib_core.json_forms import Name
from calib_core.measurements import TimeNs


class BoardImages(Protocol):
    """Images in which a board may be: frames of a recording or a video, or a folder of images."""

    def __len__(self) -> int:
        """Return how many there are."""
        ...

    def name(self, index: int, /) -> str:
        """Return what messages call an image: "left01.jpg", "frame 12 (3.42 s)"."""
        ...

    def time_ns(self, index: int, /) -> TimeNs | None:
        """Return when it was taken; None if nothing says."""
        ...

    def image(self, index: int, /) -> np.ndarray:
        """Return its pixels: uint8 (h, w, 3), blue first. Several threads may call it at once.

        Raises:
            CalibrationError: it cannot be read.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class BoardCorners:
    """The corners of a board in an image.

    Attributes:
        index: the image's number in its source.
        name: what messages call the image.
        time_ns: when it was taken; None if nothing says.
        size_px: width and height of the image.
        corner_ids: (n,) which corners of the board were found, ascending.
        pixels_px: (n, 2) where.
        blur_px: width of the edges between squares, as the standard deviation of a Gaussian [px]; NaN if not measured.
    """

    index: int
    name: str
    time_ns: TimeNs | None
    size_px: tuple[int, int]
    corner_ids: Indices
    pixels_px: Points2
    blur_px: float = float("nan")

    def __post_init__(self) -> None:
        count = len(self.corner_ids)
        freeze(self, np.int64, corner_ids=(count,))
        freeze(self, pixels_px=(count, 2))


class LeftOutImage(Struct, frozen=True, forbid_unknown_fields=True):
    """An image that is not used, and why.

    Attributes:
        index: its number in its source.
        name: what messages call it.
        reason: why, as a clause: "blurred: edges are 4.1 px wide, those of the others 1.2 px".
        spare: it is a good view that others make unnecessary.
    """

    index: Annotated[int, Meta(ge=0, le=1_000_000_000)]
    name: Name
    reason: Annotated[str, Meta(max_length=10_000)]
    spare: bool = False
