"""Two halves of the views calibrated separately: how far their lenses are apart, and how far they may be."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Points2, Values, freeze
from calib_core.camera import Camera
from calib_core.geometry import rotation_exp
from calib_core.intrinsics.adjustment import adjust, reduced, shared_covariance
from calib_core.intrinsics.calibrated_lens import CalibratedLens
from calib_core.intrinsics.image_maps import far_point_slopes, found_pixels, grid_covariance, image_grid
from calib_core.intrinsics.linearization import Freedom, LensState, ViewStack, linearize, stack_views
from calib_core.measurements import Unsolvable

_LEAST_VIEWS = 8
_COLUMNS, _ROWS = 16, 10
_TOO_FAR = 2.0  # times what is expected; chance reaches 1.5
_TURN_STEPS = 4


@dataclass(frozen=True, slots=True, eq=False)
class SplitDifference:
    """Two lenses from two halves of the views, compared over the part of the image in which corners were found.

    Attributes:
        split: how the views were divided, such as "near and far views".
        x_px: (c,) columns of the grid.
        y_px: (r,) its rows.
        apart_px: (r, c) distance between the projections of a far point; NaN where one of the lenses sees nothing.
        expected_px: (r, c) root mean square of that distance by the covariances of both.
        ratio: of both, as a root mean square over the cells that corners reach.
    """

    split: str
    x_px: Values
    y_px: Values
    apart_px: np.ndarray
    expected_px: np.ndarray
    ratio: float

    def __post_init__(self) -> None:
        grid = (len(self.y_px), len(self.x_px))
        freeze(self, x_px=(None,), y_px=(None,), apart_px=grid, expected_px=grid)

    @property
    def agrees(self) -> bool:
        """Whether both lenses are as close as their covariances say."""
        return self.ratio <= _TOO_FAR


def split_difference(lens: CalibratedLens, columns: int = _COLUMNS, rows: int = _ROWS) -> SplitDifference | Unsolvable:
    """Calibrate two halves of the views separately, in two ways, and return the comparison that differs more.

    Every other view, and near against far views: the latter sees errors that depend on the distance or on the size of the
    board in the image, which every other view does not.

    Args:
        lens: with its views.
        columns: of the grid.
        rows: of the grid.
    """
    if len(lens.views) < _LEAST_VIEWS:
        return Unsolvable("few-views", {"views": len(lens.views), "needed": _LEAST_VIEWS, "halves": True})
    distances_m = np.array([np.linalg.norm(view.camera_from_board.translation_m) for view in lens.views])
    order = np.argsort(distances_m, kind="stable")
    near = np.zeros(len(order), dtype=bool)
    near[order[: len(order) // 2]] = True
    splits = (("every other view", np.arange(len(order)) % 2 == 0), ("near and far views", near))
    return max((_compare_halves(lens, text, half, columns, rows) for text, half in splits), key=lambda one: one.ratio)


def _compare_halves(lens: CalibratedLens, text: str, half: Flags, columns: int, rows: int) -> SplitDifference:
    """Compare the lenses of some of the views and of the others."""
    size_px = (lens.camera.width_px, lens.camera.height_px)
    views = [view.corners for view in lens.views]
    stack = stack_views(views, lens.board_shape_m, size_px, [view.used for view in lens.views])
    rotations = np.stack([view.camera_from_board.rotation for view in lens.views])
    shifts = np.stack([view.camera_from_board.translation_m for view in lens.views])
    state = LensState(lens.camera, rotations, shifts)
    found_px = found_pixels(lens)
    x_px, y_px, places = image_grid(lens.camera, columns, rows)
    first, first_matrix = _half(state, stack, half)
    second, second_matrix = _half(state, stack, ~half)
    expected = grid_covariance(lens.camera, first_matrix + second_matrix, places, found_px).trace(axis1=1, axis2=2)
    apart = np.square(_projection_differences(first, second, places, found_px)).sum(axis=1)
    reached = _reached(places, found_px, size_px, columns, rows) & np.isfinite(expected) & np.isfinite(apart)
    ratio = float(np.sqrt((apart[reached] / expected[reached]).mean())) if reached.any() else float("nan")
    return SplitDifference(
        text, x_px, y_px, np.sqrt(apart).reshape(rows, columns), np.sqrt(expected).reshape(rows, columns), ratio
    )


def _half(state: LensState, stack: ViewStack, half: Flags) -> tuple[Camera, np.ndarray]:
    """Return the lens of some of the views, with the covariance of its parameters (p, p)."""
    freedom = Freedom.of(state.camera)
    found = adjust(state.of(half), stack.of(half), freedom)
    return found.camera, shared_covariance(reduced(linearize(found, stack.of(half), freedom))).matrix


def _projection_differences(first: Camera, second: Camera, places_px: Points2, found_px: Points2) -> Points2:
    """Return by how much far points project elsewhere (n, 2) [px], after the rotation that fits best where corners were found."""
    rays = first.rays(found_px)
    turn = np.eye(3)
    for _ in range(_TURN_STEPS):
        off = second.project(rays @ turn.T) - found_px
        slopes = far_point_slopes(second, found_px)[1]
        seen = np.isfinite(off).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2))
        angle = np.linalg.lstsq(slopes[seen].reshape(-1, 3), -off[seen].ravel(), rcond=None)[0]
        turn = rotation_exp(angle) @ turn
    return second.project(first.rays(places_px) @ turn.T) - places_px


def _reached(places_px: Points2, found_px: Points2, size_px: tuple[int, int], columns: int, rows: int) -> Flags:
    """Return which places of a grid have a corner within one cell."""
    cell = np.array([size_px[0] / columns, size_px[1] / rows])
    apart = np.abs(places_px[:, None, :] - found_px[None, :, :]) / cell
    return np.asarray((apart.max(axis=2) <= 1.0).any(axis=1))
