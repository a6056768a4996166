"""Where the frames come from: a recording, or anything else that has them by number."""

from typing import Protocol

import numpy as np

from calib_core.arrays import TimesNs


class FrameSource(Protocol):
    """Camera frames by number; a `Recording` is one. Only the frames that are asked for are decoded."""

    @property
    def image_times(self) -> TimesNs:
        """Their stamps, ascending [ns]."""
        ...

    def image(self, index: int, /) -> np.ndarray:
        """Return a frame's pixels: uint8 (h, w, 3), blue first. Several threads may call it at once.

        Raises:
            CalibrationError: it cannot be read.
        """
        ...
