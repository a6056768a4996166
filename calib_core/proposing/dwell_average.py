"""A click averaged over its dwell: the apex that each of a few frames shows where the click means it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector2, frozen_array
from calib_core.errors import CalibrationError
from calib_core.proposing.dwell_views import DwellView
from calib_core.proposing.still_pictures import FrameSource
from calib_core.vision.apex import Apex, find_apex

_REACH, _LEAST_REACH_PX = 0.1, 4.0
"""How far from a click an apex is still what was clicked: in widths of the reflector, and at least."""
_HALF, _LEAST_HALF_PX = 0.75, 8
"""Half the side of the patch around a click that is compared between frames, in widths of the reflector, and at least."""
_SHAKE_PX = 3.0
"""How far the picture may move between two frames of a dwell; farther off it is another one."""
_LEAST_ALIKE = 0.6
"""Correlation from which on two frames show the same around a click: nobody stands before it, and nothing was moved."""
_LEAST_SHARE = 0.5
"""Of the frames that show the same, so many have to show the apex."""
_APART, _APART_PX = 4.0, 0.25
"""An apex that lies farther from the median of all is left out: in median absolute deviations, and at least."""


@dataclass(frozen=True, slots=True, eq=False)
class DwellAverage:
    """A click as it holds for its whole dwell.

    Attributes:
        pixel_px: (2,) mean of the apexes of its frames.
        sigma_px: standard deviation per axis.
        frames: how many entered.
    """

    pixel_px: Vector2
    sigma_px: float
    frames: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "pixel_px", frozen_array(self.pixel_px, (2,)))


def averaged_over_dwell(view: DwellView, frames: FrameSource, clicked: int, pixel_px: Vector2) -> DwellAverage | None:
    """Average a click over the clear frames of its dwell that show the same as the one that was clicked.

    Args:
        view: of the dwell.
        frames: of the camera.
        clicked: number of the frame that was clicked.
        pixel_px: (2,) clicked there; it limits the search and does not pull the answer.

    Returns:
        None if the frames show no apex there: then the click is all that is known.

    Raises:
        CalibrationError: the clicked frame cannot be read.
    """
    pixel_px = np.asarray(pixel_px, dtype=np.float64)
    own = frames.image(clicked)
    reach_px = max(_LEAST_REACH_PX, _REACH * view.width_px)
    shown = [(own, np.zeros(2)), *_alike(own, view, frames, clicked, pixel_px)]
    answers = [find_apex(one, pixel_px + shift, reach_px=reach_px, size_px=view.width_px) for one, shift in shown]
    apexes = [one for one in answers if isinstance(one, Apex)]
    if not apexes or len(apexes) < _LEAST_SHARE * len(answers):
        return None
    return _mean(apexes)


def _alike(
    own: np.ndarray, view: DwellView, frames: FrameSource, clicked: int, pixel_px: Vector2
) -> Iterator[tuple[np.ndarray, Vector2]]:
    """Yield the other frames that show the same around a pixel, and by how much it moved there."""
    import cv2

    half = max(_LEAST_HALF_PX, int(np.ceil(_HALF * view.width_px)))
    wider = half + int(np.ceil(_SHAKE_PX)) + 1
    centre = (float(pixel_px[0]), float(pixel_px[1]))
    patch = cv2.getRectSubPix(own, (2 * half + 1, 2 * half + 1), centre)
    for number in view.clear.tolist():
        if number == clicked:
            continue
        try:
            picture = frames.image(number)
        except CalibrationError:
            continue
        around = cv2.getRectSubPix(picture, (2 * wider + 1, 2 * wider + 1), centre)
        scores = cv2.matchTemplate(around, patch, cv2.TM_CCOEFF_NORMED)
        row, column = (int(v) for v in np.unravel_index(int(np.argmax(scores)), scores.shape))
        shift = np.array([column, row], dtype=np.float64) - (wider - half)
        if scores[row, column] >= _LEAST_ALIKE and float(np.hypot(*shift)) <= _SHAKE_PX:
            yield picture, shift


def _mean(apexes: list[Apex]) -> DwellAverage:
    """Average without what lies apart; what all frames have in common is not averaged away."""
    pixels_px = np.stack([one.pixel_px for one in apexes])
    off_px = np.hypot(*(pixels_px - np.median(pixels_px, axis=0)).T)
    kept = off_px <= max(_APART_PX, _APART * float(np.median(off_px)))
    sigma_px = float(np.median([one.sigma_px for one, good in zip(apexes, kept, strict=True) if good]))
    count = int(kept.sum())
    scatter_px2 = float(pixels_px[kept].var(axis=0, ddof=1).mean()) / count if count > 1 else 0.0
    return DwellAverage(pixels_px[kept].mean(axis=0), float(np.hypot(sigma_px, np.sqrt(scatter_px2))), count)
