"""Three sectors that meet in one point: how well any pixel of a picture explains its surroundings in this way."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

_WEDGES = 12
_NARROWEST, _WIDEST = 2, 5
"""Wedges per sector: 60 to 150 deg. Seen from inside, each sheet of a trihedral spans less than 180 deg."""
_FINE = 7
_QUIET_GREY = 2.0
"""Where grey levels vary less than this, there is nothing to find."""


@dataclass(frozen=True, slots=True, eq=False)
class SectorScores:
    """The best division into three sectors at each pixel.

    Attributes:
        score: (h, w) what the weakest of the three boundaries explains, relative to what remains unexplained.
        starts_rad: (h, w, 3) where the sectors begin, from x towards y.
    """

    score: np.ndarray
    starts_rad: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class _Divisions:
    """All ways to divide the wedges into three sectors: (k, 3) first wedges, and the start in radians."""

    first: np.ndarray
    starts_rad: np.ndarray


@lru_cache(maxsize=1)
def _divisions() -> _Divisions:
    widths = range(_NARROWEST, _WIDEST + 1)
    first = np.array(
        [
            (start, start + one, start + one + two)
            for start in range(_WEDGES)
            for one in widths
            for two in widths
            if _WEDGES - one - two in widths and start + one + two < _WEDGES
        ]
    )
    return _Divisions(first, first * (2.0 * np.pi / _WEDGES))


@lru_cache(maxsize=8)
def _wedge_kernels(radius_px: float) -> np.ndarray:
    """Return the share of each pixel of a disc that lies in each wedge: (wedges, n, n)."""
    half = int(np.ceil(radius_px))
    side = 2 * half + 1
    offsets = (np.arange(side * _FINE) + 0.5) / _FINE - 0.5 - half
    x, y = np.meshgrid(offsets, offsets)
    wedge = np.minimum((np.arctan2(y, x) % (2.0 * np.pi) / (2.0 * np.pi / _WEDGES)).astype(int), _WEDGES - 1)
    distance = np.hypot(x, y)
    inside = (distance <= radius_px) & (distance > 0.6)  # the middle pixel belongs to all
    shares = [(wedge == number) & inside for number in range(_WEDGES)]
    return np.array([share.reshape(side, _FINE, side, _FINE).mean(axis=(1, 3)) for share in shares], dtype=np.float32)


def score_sectors(grey: np.ndarray, radius_px: float) -> SectorScores:
    """Score each pixel whose disc lies inside the picture.

    Args:
        grey: (h + 2 n, w + 2 n) float32, with n the radius rounded up.
        radius_px: of the disc.
    """
    import cv2

    kernels = _wedge_kernels(radius_px)
    half = kernels.shape[1] // 2
    grey = grey - grey.mean()

    def summed(picture: np.ndarray, kernel: np.ndarray) -> np.ndarray:
        return cv2.filter2D(picture, cv2.CV_32F, kernel)[half:-half, half:-half]

    areas = kernels.sum(axis=(1, 2))
    sums = np.stack([summed(grey, kernel) for kernel in kernels])
    squares = summed(grey * grey, kernels.sum(axis=0))
    busy = np.nonzero(squares - sums.sum(axis=0) ** 2 / areas.sum() > areas.sum() * _QUIET_GREY**2)
    divisions = _divisions()
    score = np.zeros(squares.shape, dtype=np.float32)
    starts_rad = np.zeros((*squares.shape, 3))
    if len(busy[0]):
        scores = _weakest_boundary(sums[:, busy[0], busy[1]], squares[busy], areas, divisions.first)
        best = scores.argmax(axis=0)
        score[busy] = scores[best, np.arange(len(best))]
        starts_rad[busy] = divisions.starts_rad[best]
    return SectorScores(score, starts_rad)


def _weakest_boundary(sums: np.ndarray, squares: np.ndarray, areas: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return for each division (rows) and pixel (columns) the variance that its weakest boundary explains over the rest."""
    before = np.concatenate([np.zeros((1, sums.shape[1]), np.float32), np.cumsum(sums, axis=0, dtype=np.float32)])
    area_before = np.concatenate([[0.0], np.cumsum(areas)]).astype(np.float32)
    one, two = (before[first[:, k + 1]] - before[first[:, k]] for k in (0, 1))
    area_one, area_two = ((area_before[first[:, k + 1]] - area_before[first[:, k]])[:, None] for k in (0, 1))
    three, area_three = before[-1] - one - two, area_before[-1] - area_one - area_two
    means = (one / area_one, two / area_two, three / area_three)
    rest = squares - one * means[0] - two * means[1] - three * means[2]
    boundary = (means[0] - means[1]) ** 2 * (area_one * area_two / (area_one + area_two))
    for (a, area_a), (b, area_b) in (
        ((means[1], area_two), (means[2], area_three)),
        ((means[2], area_three), (means[0], area_one)),
    ):
        np.minimum(boundary, (a - b) ** 2 * (area_a * area_b / (area_a + area_b)), out=boundary)
    return np.asarray(boundary / (np.maximum(rest, 0.0) + area_before[-1]))
