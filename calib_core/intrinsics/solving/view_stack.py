"""The corners of all views as arrays with one row per view, so that a step of the adjustment is a few products."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Points3, frozen_array
from calib_core.intrinsics.board_pictures import BoardCorners


@dataclass(frozen=True, slots=True, eq=False)
class ViewStack:
    """Corners of v views; a view with fewer than m corners ends with places that have no weight.

    Attributes:
        board_m: (v, 3, m) the corners on the board as stated.
        pixels_px: (v, 2, m) where they were found.
        corner_ids: (v, m) which corners of the board.
        weights: (v, m) of each corner; 0 for none.
        size_px: width and height of the pictures.
    """

    board_m: np.ndarray
    pixels_px: np.ndarray
    corner_ids: np.ndarray
    weights: np.ndarray
    size_px: tuple[int, int]

    def __post_init__(self) -> None:
        object.__setattr__(self, "board_m", frozen_array(self.board_m, (None, 3, None)))
        object.__setattr__(self, "pixels_px", frozen_array(self.pixels_px, (None, 2, None)))
        object.__setattr__(self, "corner_ids", frozen_array(self.corner_ids, (None, None), dtype=np.int64))
        object.__setattr__(self, "weights", frozen_array(self.weights, (None, None)))

    def __len__(self) -> int:
        return len(self.weights)

    @property
    def corner_counts(self) -> np.ndarray:
        """Corners with a weight in each view: (v,)."""
        return np.asarray((self.weights > 0).sum(axis=1))

    def of(self, views: np.ndarray) -> "ViewStack":
        """Return some of the views, given by numbers or flags (v,)."""
        return ViewStack(
            self.board_m[views], self.pixels_px[views], self.corner_ids[views], self.weights[views], self.size_px
        )

    def weighted(self, weights: np.ndarray) -> "ViewStack":
        """Return the views with other weights (v, m)."""
        return replace(self, weights=weights)

    def mean_square(self, residuals_px: np.ndarray) -> np.ndarray:
        """Return the mean squared distance (v,) [px^2] of the corners that have a weight; residuals are (v, 2, m)."""
        counted = self.weights > 0
        squares = np.where(counted, np.square(residuals_px).sum(axis=1), 0.0).sum(axis=1)
        return np.asarray(squares / np.maximum(counted.sum(axis=1), 1))

    def mirrored(self) -> "ViewStack":
        """Return the views as they would be in pictures whose left and right are exchanged."""
        pixels = self.pixels_px.copy()
        pixels[:, 0] = self.size_px[0] - 1 - pixels[:, 0]
        return replace(self, pixels_px=pixels)


def stack_views(
    views: Sequence[BoardCorners], board_m: Points3, size_px: tuple[int, int], used: Sequence[Flags] | None = None
) -> ViewStack:
    """Stack views.

    Args:
        views: of the board.
        board_m: (n, 3) its corners, by id.
        size_px: width and height of the pictures.
        used: for each view (n,) which corners have a weight; all if None.
    """
    most = max(len(view.corner_ids) for view in views)
    ids = np.zeros((len(views), most), dtype=np.int64)
    pixels, weights = np.zeros((len(views), 2, most)), np.zeros((len(views), most))
    for row, view in enumerate(views):
        count = len(view.corner_ids)
        ids[row, :count] = view.corner_ids
        ids[row, count:] = view.corner_ids[0]  # a place without weight repeats a corner, so that it projects too
        pixels[row, :, :count], pixels[row, :, count:] = view.pixels_px.T, view.pixels_px[0][:, None]
        weights[row, :count] = 1.0 if used is None else used[row]
    return ViewStack(np.moveaxis(board_m[ids], 2, 1), pixels, ids, weights, size_px)
