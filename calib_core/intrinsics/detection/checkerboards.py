"""Find a checkerboard: quickly in a smaller picture, then to a fraction of a pixel in the full one.

OpenCV's older detector is ten times as fast as its newer one and nearly as robust; the newer one is asked where the older one
finds nothing: in a small picture always, in a larger one only if a quick look shows squares, for most frames show no board.
Both number the corners row by row, but may begin at any end; a grid that is mirrored by its numbers is turned over, so that a
board seen from its front always has a right-handed frame.
"""

from collections.abc import Iterator

import numpy as np

from calib_core.arrays import Points2
from calib_core.intrinsics.detection.subpixel import refined_corners

_QUICK_WIDTH_PX = 960
_ROBUST_WIDTHS_PX = (640, 320)  # the smaller one also finds blurred boards, which are to be named
_CROSSING_SHARE = 0.75  # of the contrast inside; at a board's border it is half
_LEAST_SPACING_PX = 4.0
_MOST_BENT = 0.35  # second difference of neighbouring corners over their distance
_MOST_MOVED = 0.3  # by the refinement, over the distance to the next corner


def find_checkerboard(grey: np.ndarray, columns: int, rows: int) -> Points2 | None:
    """Find all inner corners of a checkerboard: (rows * columns, 2) [px], row by row; None if one of them is hidden.

    Args:
        grey: uint8 (h, w).
        columns: inner corners in a row.
        rows: number of rows.
    """
    for found in _roughly(grey, columns, rows):
        corners = _refined(grey, _right_handed(found.reshape(rows, columns, 2)))
        if corners is not None:
            return corners
    return None


def _refined(grey: np.ndarray, rough: np.ndarray) -> Points2 | None:
    """Refine a grid (rows, columns, 2) to (rows * columns, 2); None if it is not that of a whole board."""
    if not is_regular(rough) or _goes_on(grey, rough):
        return None
    corners = refined_corners(grey, rough.reshape(-1, 2), _spacing(rough))
    moved = np.linalg.norm(corners - rough.reshape(-1, 2), axis=1)
    if (moved > _MOST_MOVED * _spacing(rough)).any() or not is_regular(corners.reshape(rough.shape)):
        return None
    return corners


def _roughly(grey: np.ndarray, columns: int, rows: int) -> Iterator[Points2]:
    """Yield the corners to a pixel or so, in any order that is row by row, as one detector after the other finds them.

    The quick one mixes up the corners of blurred boards; so the next is asked if a grid turns out not to be one.
    """
    import cv2

    usual = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    quick, factor = _resized(grey, _QUICK_WIDTH_PX)
    promising = cv2.checkChessboard(quick, (columns, rows))
    if promising:
        found, corners = cv2.findChessboardCorners(quick, (columns, rows), flags=usual)
        if found:
            yield _at_full_size(corners, factor)
    for width_px in _ROBUST_WIDTHS_PX if promising else _ROBUST_WIDTHS_PX[-1:]:
        small, factor = _resized(grey, width_px)
        grid = _whole_board(small, columns, rows)
        if grid is not None:
            yield _at_full_size(grid, factor)
    if grey.shape[1] > _QUICK_WIDTH_PX and cv2.checkChessboard(grey, (columns, rows)):
        found, corners = cv2.findChessboardCorners(grey, (columns, rows), flags=usual)
        if found:
            yield _at_full_size(corners, 1.0)


def _whole_board(grey: np.ndarray, columns: int, rows: int) -> np.ndarray | None:
    """Find a board by OpenCV's newer detector, which also finds a board in a larger one and then says how large that is."""
    import cv2

    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_LARGER
    found, corners, meta = cv2.findChessboardCornersSBWithMeta(grey, (columns, rows), flags)
    if not found or meta is None or sorted(meta.shape[:2]) != sorted((columns, rows)):
        return None
    grid = corners.reshape(*meta.shape[:2], 2)
    return grid if grid.shape[:2] == (rows, columns) else grid.swapaxes(0, 1)


def _at_full_size(corners: np.ndarray, factor: float) -> Points2:
    return np.asarray((corners.reshape(-1, 2).astype(np.float64) + 0.5) / factor - 0.5)


def _resized(grey: np.ndarray, width_px: int) -> tuple[np.ndarray, float]:
    import cv2

    if grey.shape[1] <= width_px:
        return grey, 1.0
    factor = width_px / grey.shape[1]
    return cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA), factor


def _right_handed(grid: np.ndarray) -> np.ndarray:
    """Number the corners of a grid (rows, columns, 2) such that rows point right where columns point down."""
    along, down = grid[:, -1] - grid[:, 0], grid[-1] - grid[0]
    mean_along, mean_down = along.mean(axis=0), down.mean(axis=0)
    if mean_along[0] * mean_down[1] - mean_along[1] * mean_down[0] < 0.0:
        grid = grid[:, ::-1]
    return np.ascontiguousarray(grid)


def is_regular(grid: np.ndarray) -> bool:
    """Return whether the corners (rows, columns, 2) can be those of a board: evenly spaced along every row and column."""
    if not np.isfinite(grid).all():
        return False
    for lines in (grid, grid.swapaxes(0, 1)):
        steps = np.diff(lines, axis=1)
        lengths = np.linalg.norm(steps, axis=2)
        if lengths.min() < _LEAST_SPACING_PX:
            return False
        if steps.shape[1] > 1:
            bent = np.linalg.norm(np.diff(steps, axis=1), axis=2)
            if (bent > _MOST_BENT * np.minimum(lengths[:, 1:], lengths[:, :-1])).any():
                return False
    return True


def _goes_on(grey: np.ndarray, grid: np.ndarray) -> bool:
    """Return whether the pattern goes on beyond a grid (rows, columns, 2): it is a part of a larger board.

    Where four squares meet, opposite ones have the same brightness; at the border of a board one of the four is its margin.
    """
    typical = float(np.median(_crossing(grey, grid)))
    for lines in (grid, grid[::-1], grid.swapaxes(0, 1), grid.swapaxes(0, 1)[::-1]):
        beyond = 3.0 * (lines[0] - lines[1]) + lines[2] if len(lines) > 2 else 2.0 * lines[0] - lines[1]
        crossing = _crossing(grey, np.stack([beyond, lines[0]]))[0]
        known = crossing[np.isfinite(crossing)]
        if 2 * len(known) > len(crossing) and float(np.median(known)) > _CROSSING_SHARE * typical:
            return True
    return False


def _crossing(grey: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Return how much the squares that meet at each point (rows, columns, 2) are like a checkerboard; NaN outside."""
    import cv2

    along, down = np.gradient(grid, axis=1), np.gradient(grid, axis=0)
    corners = np.stack([grid + 0.3 * (a * along + b * down) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))])
    flat = corners.reshape(-1, 1, 2).astype(np.float32)
    values = (
        cv2.remap(grey, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR).astype(np.float64).reshape(corners.shape[:-1])
    )
    height, width = grey.shape
    inside = ((corners >= 0) & (corners <= (width - 1, height - 1))).all(axis=(0, -1))
    return np.where(inside, np.abs(values[0] + values[2] - values[1] - values[3]), np.nan)


def _spacing(grid: np.ndarray) -> np.ndarray:
    """Return the distance of each corner to its nearest neighbour in the grid (rows, columns, 2): (rows * columns,) [px]."""
    rows, columns, _ = grid.shape
    nearest = np.full((rows, columns), np.inf)
    along, down = np.linalg.norm(np.diff(grid, axis=1), axis=2), np.linalg.norm(np.diff(grid, axis=0), axis=2)
    for cut, lengths in (
        (np.s_[:, 1:], along),
        (np.s_[:, :-1], along),
        (np.s_[1:], down),
        (np.s_[:-1], down),
    ):
        nearest[cut] = np.minimum(nearest[cut], lengths)
    return nearest.ravel()
