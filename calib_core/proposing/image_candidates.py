"""Image candidates: places that changed for one dwell, at the size that the reflector has there, moved to the apex in them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Vector2, freeze
from calib_core.errors import CalibrationError
from calib_core.proposing.apex import Apex, find_apex
from calib_core.proposing.still_images import FrameSource, in_light_of, stack_median

_MOST = 12
_APART = 0.8
"""Widths of the reflector between two blobs at least, in columns or in rows."""
_BLOB_SIGMA = 0.3
"""Standard deviation of a blob's centre as an apex, in widths of the reflector."""


@dataclass(frozen=True, slots=True, eq=False)
class ImageCandidate:
    """A place in the image where the reflector may stand.

    Attributes:
        pixel_px: (2,) column and row of its apex, or of its centre, in the full image.
        sigma_px: standard deviation of that pixel per axis.
        strength: how much the place differs from the same place in other dwells, in standard deviations of these.
        likeness: correlation with the reflector that a person confirmed, -1 to 1; NaN before anything is confirmed.
        has_apex: three sheets that meet in one point were found there.
    """

    pixel_px: Vector2
    sigma_px: float
    strength: float
    likeness: float = float("nan")
    has_apex: bool = False

    def __post_init__(self) -> None:
        freeze(self, pixel_px=(2,))


def blobs(response: np.ndarray, width_px: float, *, most: int = _MOST) -> tuple[ImageCandidate, ...]:
    """Return the places of the strongest change at one size, the strongest first.

    Args:
        response: (h, w) float32, in standard deviations; above 0 where something of that size changed.
        width_px: of the reflector in that image.
        most: how many.
    """
    left = response.copy()
    reach = max(3, round(_APART * width_px))
    candidates: list[ImageCandidate] = []
    for _ in range(most):
        row, column = (int(v) for v in np.unravel_index(int(np.argmax(left)), left.shape))
        strength = float(left[row, column])
        if strength <= 0.0:
            break
        pixel_px = np.array([column, row], dtype=np.float64)
        candidates.append(ImageCandidate(pixel_px, _BLOB_SIGMA * width_px, strength))
        left[max(0, row - reach) : row + reach + 1, max(0, column - reach) : column + reach + 1] = -np.inf
    return tuple(candidates)


_REACHES = (0.45, 0.25)
"""How far from where it is expected an apex is searched, in widths of the reflector: the nearer where two corners rival."""
_SEARCHED, _LEAST_SHARE = 5, 0.3
"""An apex is searched in so many candidates at most, and only where so much changed, relative to the strongest."""
_LEAST_REACH_PX = 4.0
_APEX_GAIN = 2.0
"""How much stronger a place with an apex counts: parts of a person seldom show three sheets that meet."""
_ABOVE_BLOB, _BELOW_SIGMA = 0.2, 0.22
"""How far above a blob's centre the apex lies on average, and its standard deviation per axis, in widths of the reflector."""
_KEPT = 8


def full_image(numbers: Indices, frames: FrameSource) -> np.ndarray | None:
    """Return the median of a few frames of a dwell at full resolution: (h, w, 3) uint8; None if none can be read.

    Args:
        numbers: of the frames.
        frames: of the camera.
    """
    images: list[np.ndarray] = []
    for number in numbers.tolist():
        try:
            images.append(frames.image(number))
        except CalibrationError:
            continue
    if not images:
        return None
    middle = images[len(images) // 2]
    return stack_median([in_light_of(middle, image) for image in images])


def with_apexes(candidates: Sequence[ImageCandidate], image: np.ndarray, width_px: float) -> tuple[ImageCandidate, ...]:
    """Move each candidate to the apex near it, if one is seen; two that share an apex become one. Those with an apex gain.

    Args:
        candidates: in pixels of the full image, the strongest first.
        image: (h, w, 3) uint8, full.
        width_px: of the reflector there.
    """
    found: list[ImageCandidate] = []
    least = _LEAST_SHARE * max((one.strength for one in candidates), default=0.0)
    for index, candidate in enumerate(candidates):
        tried = index < _SEARCHED and candidate.strength >= least
        moved = _at_apex(candidate, image, width_px, tried=tried)
        if all(float(np.hypot(*(moved.pixel_px - other.pixel_px))) > 0.3 * width_px for other in found):
            found.append(moved)
    found.sort(key=lambda one: -one.strength)
    return tuple(found[:_KEPT])


def _at_apex(candidate: ImageCandidate, image: np.ndarray, width_px: float, *, tried: bool) -> ImageCandidate:
    centre_px = candidate.pixel_px - np.array([0.0, _ABOVE_BLOB * width_px])
    for reach in _REACHES if tried else ():
        reach_px = max(_LEAST_REACH_PX, reach * width_px)
        apex = find_apex(image, centre_px, reach_px=reach_px, size_px=width_px)
        if isinstance(apex, Apex):
            gained = _APEX_GAIN * candidate.strength
            return replace(candidate, pixel_px=apex.pixel_px, sigma_px=apex.sigma_px, strength=gained, has_apex=True)
        if not apex.several:
            break
    return replace(candidate, pixel_px=centre_px, sigma_px=_BELOW_SIGMA * width_px)
