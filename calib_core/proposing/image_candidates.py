"""Image candidates: places in the image that changed for one dwell, at the size that the reflector has there."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector2, freeze

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
