"""Find a board in an image; say how sharp it is, or which checkerboard it is if it is another one.

Checkerboards are found quickly in a smaller image, then to a fraction of a pixel in the full one. OpenCV's older detector is
ten times as fast as its newer one and nearly as robust; the newer one is asked where the older one finds nothing: in a small
image always, in a larger one only if a quick look shows squares, for most frames show no board. Both number the corners row
by row, but may begin at any end; a grid that is mirrored by its numbers is turned over, so that a board seen from its front
always has a right-handed frame.

Boards with markers are ChArUco boards and Kalibr's AprilGrid; a part of the board suffices. Facts that decide about ids: OpenCV
draws the AprilTags of family 36h11 turned by 180 degrees against AprilTag's own images, which Kalibr prints. So the corner
that OpenCV calls the first is the lower right one on a Kalibr grid. Grids printed with OpenCV's images exist too; the
orientation that makes a plane of the whole grid is taken.

Corners to a fraction of a pixel: the window around each follows the distance to its neighbors. Where four squares meet, the
brightness has a saddle point. A first estimate is where the gradients point along the lines through it (OpenCV's cornerSubPix);
then the saddle point of a quadratic that is fitted to the smoothed image, which uses all of the light around the corner
instead of the edges alone.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Values
from calib_core.intrinsics.board import Board


def find_board(image: np.ndarray, board: Board) -> tuple[Indices, Points2] | None:
    """Find a board: ids (n,) of its corners in the image, ascending, and their pixels (n, 2); None if it is not there.

    A checkerboard must be seen as a whole; of the others a part suffices.

    Args:
        image: uint8 (h, w, 3), blue first, or (h, w).
        board: which board.
    """
    import cv2

    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    if board.kind == "checkerboard":
        corners = find_checkerboard(grey, board.columns, board.rows)
        return None if corners is None else (np.arange(len(corners)), corners)
    return find_charuco(grey, board) if board.kind == "charuco" else find_aprilgrid(grey, board)


_WIDTH_PX = 640
_SEEDS = ((3, 3), (4, 3), (5, 4))


def board_in(image: np.ndarray, board: Board) -> tuple[int, int] | None:
    """Return the inner corners of another checkerboard in an image: along its longer and its shorter side; None without one.

    Args:
        image: uint8 (h, w, 3), blue first, or (h, w).
        board: the one that was looked for and is not there.
    """
    import cv2

    if board.kind != "checkerboard":
        return None
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    factor = min(1.0, _WIDTH_PX / grey.shape[1])
    small = cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    sizes = []
    for seed in _SEEDS:
        flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_NORMALIZE_IMAGE
        found, _, meta = cv2.findChessboardCornersSBWithMeta(small, seed, flags)
        if found and meta is not None:
            sizes.append((max(meta.shape[:2]), min(meta.shape[:2])))
    largest = max(sizes, key=lambda size: size[0] * size[1], default=None)
    looked_for = max(board.columns, board.rows), min(board.columns, board.rows)
    return None if largest == looked_for else largest


_ALONG = np.linspace(-0.2, 0.2, 5)  # where along an edge it is crossed, over its length, from its middle
_SAMPLES = 41
_ENDS = 5
_WIDEST_SHARE, _WIDEST_PX = 0.4, 16.0
_BETWEEN = (0.1587, 0.8413)  # one standard deviation to either side of an edge blurred by a Gaussian
_LEAST_CONTRAST = 20.0
_LEAST_EDGES = 4
_SMALL_STEP = 1e-3  # over the length of an edge


def blur_px(image: np.ndarray, corner_ids: Indices, pixels_px: Points2, board: Board) -> float:
    """Return the width of the edges between black and white, as the standard deviation of a Gaussian [px].

    Motion blurs the edges across it; of the two directions of the board the wider one counts. NaN where nothing can be measured.

    Args:
        image: uint8 (h, w, 3), blue first, or (h, w).
        corner_ids: (n,) corners of the board in it.
        pixels_px: (n, 2) where they are.
        board: which board.
    """
    edges = board.edges
    place = np.full(len(board.corners_m), -1)
    place[corner_ids] = np.arange(len(corner_ids))
    rows = place[edges]
    seen = (rows >= 0).all(axis=1)
    half = len(edges) // 2 if board.kind == "aprilgrid" else _along_rows(board)
    across = np.arange(len(edges)) >= half
    steps = _steps_across(board, corner_ids, pixels_px)
    if steps is None:
        return float("nan")
    widths: list[float] = []
    for direction in (~across, across):
        chosen = seen & direction
        found = _widths(image, pixels_px[rows[chosen]], steps[chosen], _free_share(board))
        if len(found) >= _LEAST_EDGES:
            widths.append(float(np.median(found)))
    return max(widths, default=float("nan"))


def _steps_across(board: Board, corner_ids: Indices, pixels_px: Points2) -> np.ndarray | None:
    """Return how far a step in the board's plane, across each edge and as long as it, is in the image: (k, 2) [px]."""
    import cv2

    plane_m = board.corners_m[:, :2]
    homography, _ = cv2.findHomography(plane_m[corner_ids], pixels_px)
    if homography is None:
        return None
    ends_m = plane_m[board.edges]
    along_m, middle_m = ends_m[:, 1] - ends_m[:, 0], ends_m.mean(axis=1)
    across_m = _SMALL_STEP * np.stack([-along_m[:, 1], along_m[:, 0]], axis=1)
    before, after = (
        cv2.perspectiveTransform((middle_m + way * across_m)[:, None], homography)[:, 0] for way in (-1, 1)
    )
    return np.asarray((after - before) / (2.0 * _SMALL_STEP))


def _along_rows(board: Board) -> int:
    columns, rows = (board.columns, board.rows) if board.kind == "checkerboard" else (board.columns - 1, board.rows - 1)
    return rows * (columns - 1)


def _free_share(board: Board) -> float:
    """Return how far from an edge the board is plain, over the length of the edge."""
    if board.kind == "checkerboard":
        return _WIDEST_SHARE
    if board.kind == "charuco":
        return min(_WIDEST_SHARE, 0.45 * (1.0 - board.marker_m / board.square_m))
    return min(0.18, 0.45 * board.marker_m / board.square_m)


def _widths(image: np.ndarray, ends: np.ndarray, steps: np.ndarray, share: float) -> np.ndarray:
    """Return the widths of edges whose contrast suffices: (<= k,) [px].

    Args:
        image: that they are in.
        ends: (k, 2, 2) their ends.
        steps: (k, 2) across them in the board's plane, which a tilt shortens.
        share: of these steps that is plain on either side.
    """
    import cv2

    if not len(ends):
        return np.zeros(0)
    along = ends[:, 1] - ends[:, 0]
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
    away_px = np.abs((steps * normal).sum(axis=1))  # between the edge and its parallel one step farther
    share_of_step = np.minimum(share, _WIDEST_PX / np.maximum(away_px, 1e-9))
    reach = share_of_step * away_px
    across = np.linspace(-1.0, 1.0, _SAMPLES)
    middle = 0.5 * (ends[:, 0] + ends[:, 1])
    at = (
        middle[:, None, None]
        + (_ALONG[None, :, None] * along[:, None, :])[:, :, None]
        + (share_of_step[:, None] * across)[:, None, :, None] * steps[:, None, None]
    ).astype(np.float32)
    flat = at.reshape(len(ends), -1, 2)
    values = cv2.remap(image, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    if values.ndim == 3:
        values = values.mean(axis=2)
    profiles = values.reshape(len(ends), len(_ALONG), _SAMPLES).astype(np.float64).mean(axis=1)
    low, high = profiles[:, :_ENDS].mean(axis=1), profiles[:, -_ENDS:].mean(axis=1)
    clear = np.abs(high - low) >= _LEAST_CONTRAST
    rising = (profiles[clear] - low[clear, None]) / (high - low)[clear, None]
    step = 2.0 * reach[clear] / (_SAMPLES - 1)
    crossings = [_crossing(rising, level) for level in _BETWEEN]
    return np.asarray(0.5 * np.maximum(crossings[1] - crossings[0], 0.0) * step)


def _crossing(rising: np.ndarray, level: float) -> np.ndarray:
    """Return where profiles (k, s) that rise from 0 to 1 last are below a level, in samples."""
    below = rising < level
    last = rising.shape[1] - 1 - np.argmax(below[:, ::-1], axis=1)
    last = np.minimum(last, rising.shape[1] - 2)
    rows = np.arange(len(rising))
    before, after = rising[rows, last], rising[rows, last + 1]
    rise = np.where(np.abs(after - before) > 1e-9, after - before, 1.0)
    return np.asarray(last + np.clip((level - before) / rise, 0.0, 1.0))


_QUICK_WIDTH_PX = 960
_ROBUST_WIDTHS_PX = (640, 320)  # the smaller one also finds blurred boards, which are to be named
_CROSSING_SHARE = 0.75  # of the contrast inside; at a board's border it is half
_LEAST_SPACING_PX = 4.0
_MOST_BENT = 0.35  # second difference of neighboring corners over their distance
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
    typical = float(np.median(_inner_crossing(grey, grid)))
    for lines in (grid, grid[::-1], grid.swapaxes(0, 1), grid.swapaxes(0, 1)[::-1]):
        beyond = 3.0 * (lines[0] - lines[1]) + lines[2] if len(lines) > 2 else 2.0 * lines[0] - lines[1]
        crossing = _inner_crossing(grey, np.stack([beyond, lines[0]]))[0]
        known = crossing[np.isfinite(crossing)]
        if 2 * len(known) > len(crossing) and float(np.median(known)) > _CROSSING_SHARE * typical:
            return True
    return False


def _inner_crossing(grey: np.ndarray, grid: np.ndarray) -> np.ndarray:
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
    """Return the distance of each corner to its nearest neighbor in the grid (rows, columns, 2): (rows * columns,) [px]."""
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


_WINDOW_SHARE = 0.22  # half the window over the distance to the nearest neighbor
_SMALLEST_PX, _LARGEST_PX = 2, 9
_STEPS, _ENOUGH_PX = 40, 1e-3
_SMOOTHING_PX = 1.2
_SADDLE_SHARE, _SMALLEST_SADDLE_PX, _LARGEST_SADDLE_PX = 0.3, 3.0, 6.0
_SADDLE_SAMPLES = 13
_NEIGHBOURS_FOR_SQUARES, _NEIGHBOURS_FOR_SLOPE = 16, 6
_SADDLE_ROUNDS, _LARGEST_STEP_PX = 4, 1.0


def refined_corners(grey: np.ndarray, corners_px: Points2, spacing_px: Values) -> Points2:
    """Move each corner (n, 2) to where four squares meet.

    A window that reaches the next corner is pulled toward it; a small one collects little light, and much noise.

    Args:
        grey: uint8 (h, w).
        corners_px: roughly.
        spacing_px: (n,) distance to the nearest other corner.
    """
    import cv2

    half = np.clip(np.floor(_WINDOW_SHARE * np.asarray(spacing_px)), _SMALLEST_PX, _LARGEST_PX).astype(int)
    refined = np.array(corners_px, dtype=np.float64)
    until = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, _STEPS, _ENOUGH_PX)
    for size in np.unique(half).tolist():
        chosen = half == size
        start = np.ascontiguousarray(refined[chosen], dtype=np.float32).reshape(-1, 1, 2)
        refined[chosen] = cv2.cornerSubPix(grey, start, (size, size), (-1, -1), until).reshape(-1, 2)
    return _saddle_points(grey, refined, np.asarray(spacing_px))


def _saddle_points(grey: np.ndarray, corners_px: Points2, spacing_px: Values) -> Points2:
    """Step to the saddle point of the brightness around each corner; one that is none, or far off, stays where it was."""
    import cv2

    left, top = np.maximum(np.floor(corners_px.min(axis=0)).astype(int) - _MARGIN_PX, 0)
    right, bottom = np.ceil(corners_px.max(axis=0)).astype(int) + _MARGIN_PX
    part = np.ascontiguousarray(grey[top:bottom, left:right], dtype=np.float32)
    smooth = cv2.GaussianBlur(part, (0, 0), _SMOOTHING_PX)
    reach = np.clip(_SADDLE_SHARE * spacing_px, _SMALLEST_SADDLE_PX, _LARGEST_SADDLE_PX)
    origin = np.array([left, top], dtype=np.float64)
    first = corners_px - origin
    at, good = first.copy(), np.ones(len(first), dtype=bool)
    for _ in range(_SADDLE_ROUNDS):
        patch = (at[:, None] + reach[:, None, None] * _OFFSETS).astype(np.float32)
        values = cv2.remap(smooth, patch[..., 0], patch[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        even = values.astype(np.float64) / _light(at, patch, values)
        _, slope_x, slope_y, xx, xy, yy = (even @ _FIT.T).T
        determinant = 4.0 * xx * yy - xy * xy
        good &= determinant < 0.0
        step = np.stack([xy * slope_y - 2.0 * yy * slope_x, xy * slope_x - 2.0 * xx * slope_y], axis=1)
        step *= (reach / np.where(good, determinant, 1.0))[:, None]
        at[good] += np.clip(step[good], -_LARGEST_STEP_PX, _LARGEST_STEP_PX)
    good &= np.linalg.norm(at - first, axis=1) <= _LARGEST_STEP_PX
    return np.where(good[:, None], at + origin, corners_px)


def _light(corners_px: Points2, patches_px: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the brightness of the light over patches (n, m, 2), as a share of that at their corners: (n, m).

    Half of every patch is black and half is white, so its mean follows the light; a light that falls off to one side would
    otherwise move all corners to the other.
    """
    middle, size = corners_px.mean(axis=0), max(float(np.ptp(corners_px, axis=0).max()), 1.0)
    degree = 2 if len(corners_px) >= _NEIGHBOURS_FOR_SQUARES else 1 if len(corners_px) >= _NEIGHBOURS_FOR_SLOPE else 0

    def terms(pixels_px: np.ndarray) -> np.ndarray:
        x, y = (pixels_px[..., 0] - middle[0]) / size, (pixels_px[..., 1] - middle[1]) / size
        return np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=-1)

    means = np.log(np.maximum((values * _WEIGHTS).sum(axis=1), 1.0))
    at_corners = terms(corners_px)
    smooth, *_ = np.linalg.lstsq(at_corners, means, rcond=None)
    return np.asarray(np.exp(terms(patches_px) @ smooth - (at_corners @ smooth)[:, None]))


def _offsets() -> np.ndarray:
    """Return the places at which a patch is sampled, over its reach: (m, 2)."""
    line = np.linspace(-1.0, 1.0, _SADDLE_SAMPLES)
    return np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)


def _middle_weights(offsets: np.ndarray) -> np.ndarray:
    """Return weights (m,) of a patch's samples, larger in the middle; their sum is 1."""
    weights = np.exp(-2.0 * (offsets**2).sum(axis=1))
    return np.asarray(weights / weights.sum())


def _quadratic_fit(offsets: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return what makes the coefficients of 1, x, y, x^2, x y, y^2 of m values: (6, m)."""
    x, y = offsets.T
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    weighted = terms * weights[:, None]
    return np.asarray(np.linalg.solve(terms.T @ weighted, weighted.T))


_OFFSETS = _offsets()
_WEIGHTS = _middle_weights(_OFFSETS)
_FIT = _quadratic_fit(_OFFSETS, _WEIGHTS)
_MARGIN_PX = 16


_LEAST_CORNERS = 6
_LEAST_TAGS = 2
_KALIBR_BORDER_BITS = 2
_TURNS = (2, 0, 1, 3)
_BORDER_PX = 2.0
_MARGINS = 4.0  # margins between a corner and the marker beside it that count as the distance to the next corner
_CORNERS_FOR_CUBIC, _CORNERS_FOR_SQUARES = 24, 14
_ABSOLUTE_ROUNDS, _LEAST_ABSOLUTE_PX = 20, 0.02
_ROUNDS, _LEAST_OFF_PX, _OFF_FACTOR = 5, 0.5, 6.0
_OFF_PLANE = 0.25  # over the side of a tag; a lens may bend the grid by some of it


def charuco_board(board: Board, *, legacy: bool = False) -> Any:
    """Return OpenCV's ChArUco board."""
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    made = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_m, board.marker_m, dictionary)
    made.setLegacyPattern(legacy)
    return made


def find_charuco(grey: np.ndarray, board: Board) -> tuple[Indices, Points2] | None:
    """Find the corners of a ChArUco board, printed as OpenCV draws it now or as it did before version 4.6.

    Args:
        grey: uint8 (h, w).
        board: which board.
    """
    import cv2

    best: tuple[Indices, Points2] | None = None
    for legacy in (False, True) if board.rows % 2 == 0 else (False,):
        detector = cv2.aruco.CharucoDetector(charuco_board(board, legacy=legacy))
        corners, ids, _, marker_ids = detector.detectBoard(grey)
        if ids is not None and (best is None or len(ids) > len(best[0])):
            best = ids.ravel().astype(np.int64), corners.reshape(-1, 2).astype(np.float64)
        if marker_ids is None:
            break
    if best is None or len(best[0]) < _LEAST_CORNERS:
        return None
    return _refined_marked(grey, board, *best)


def find_aprilgrid(grey: np.ndarray, board: Board) -> tuple[Indices, Points2] | None:
    """Find the corners of the tags of a grid.

    Args:
        grey: uint8 (h, w).
        board: which board.
    """
    import cv2

    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = _KALIBR_BORDER_BITS
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    parameters.relativeCornerRefinmentWinSize = 0.1
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    tags, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(grey)
    if ids is None:
        return None
    numbers, sides = ids.ravel().astype(np.int64), np.array(tags, dtype=np.float64).reshape(-1, 4, 2)
    once = np.array([np.count_nonzero(numbers == number) == 1 for number in numbers])
    known = once & (numbers < board.columns * board.rows)
    numbers, sides = numbers[known], sides[known]
    if len(numbers) < _LEAST_TAGS:
        return None
    turned = _number_tag_corners(board, numbers, sides)
    if turned is None:
        return None
    return _refined_marked(grey, board, (4 * numbers[:, None] + np.arange(4)).ravel(), turned.reshape(-1, 2))


def _number_tag_corners(board: Board, numbers: Indices, sides: np.ndarray) -> np.ndarray | None:
    """Number the corners of each tag (n, 4, 2) as the board does: the turn whose grid is most nearly a plane; None if none is."""
    import cv2

    ours = board.corners_m[(4 * numbers[:, None] + np.arange(4)).ravel(), :2]
    found = []
    for turn in _TURNS:
        turned = np.roll(sides, -turn, axis=1)
        homography, _ = cv2.findHomography(ours, turned.reshape(-1, 2))
        if homography is not None:
            expected = cv2.perspectiveTransform(ours[:, None], homography)[:, 0]
            apart = float(np.sqrt(np.square(expected - turned.reshape(-1, 2)).sum(axis=1).mean()))
            found.append((apart, turn))
    side_px = float(np.median(np.linalg.norm(sides[:, 0] - sides[:, 1], axis=1)))
    apart, turn = min(found, default=(np.inf, 0))
    return np.roll(sides, -turn, axis=1) if apart < _OFF_PLANE * side_px else None


def _refined_marked(grey: np.ndarray, board: Board, ids: Indices, pixels_px: Points2) -> tuple[Indices, Points2] | None:
    """Refine corners, and leave out those that move away, leave the image, or do not lie where the others say."""
    order = np.argsort(ids)
    ids, pixels_px = ids[order], pixels_px[order]
    height, width = grey.shape
    inside = ((pixels_px > _BORDER_PX) & (pixels_px < np.array([width, height]) - 1.0 - _BORDER_PX)).all(axis=1)
    ids, pixels_px = ids[inside], pixels_px[inside]
    if len(ids) < _LEAST_CORNERS:
        return None
    spacing = _plain_spacing(board, ids, pixels_px)
    corners = refined_corners(grey, pixels_px, spacing)
    kept = np.linalg.norm(corners - pixels_px, axis=1) < np.maximum(2.0, 0.2 * spacing)
    ids, corners = ids[kept], corners[kept]
    spacing = spacing[kept]
    kept, expected = _where_others_say(board.corners_m[ids, :2], corners)
    if not kept.all() and kept.any():
        # A tag's outline runs into the squares between the tags, and its corners start too far off to be pulled back.
        corners[~kept] = refined_corners(grey, expected[~kept], spacing[~kept])
        kept, _ = _where_others_say(board.corners_m[ids, :2], corners)
    return (ids[kept], corners[kept]) if np.count_nonzero(kept) >= _LEAST_CORNERS else None


def _plain_spacing(board: Board, ids: Indices, pixels_px: Points2) -> Values:
    """Return the distance (n,) [px] over which nothing but the edges through a corner is printed, as if to the next corner."""
    apart_px = np.linalg.norm(pixels_px[:, None] - pixels_px[None], axis=2)
    np.fill_diagonal(apart_px, np.inf)
    nearest_px = apart_px.min(axis=1)
    if board.kind == "aprilgrid":
        return np.asarray(nearest_px)
    margin = 0.5 * (1.0 - board.marker_m / board.square_m)
    return np.asarray(nearest_px * min(1.0, _MARGINS * margin))


def _where_others_say(plane_m: Points2, corners_px: Points2) -> tuple[Flags, Points2]:
    """Return which corners (n,) lie near the smooth map from the board to the image that most agree on, and all by it."""
    middle, size = plane_m.mean(axis=0), np.ptp(plane_m, axis=0).max()
    x, y = ((plane_m - middle) / max(size, 1e-9)).T
    degree = 3 if len(x) >= _CORNERS_FOR_CUBIC else 1 if len(x) < _CORNERS_FOR_SQUARES else 2
    terms = np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)
    kept = _agreeing(terms, corners_px)
    for _ in range(_ROUNDS):
        map_px, *_ = np.linalg.lstsq(terms[kept], corners_px[kept], rcond=None)
        off_px = np.linalg.norm(terms @ map_px - corners_px, axis=1)
        limit = max(_LEAST_OFF_PX, _OFF_FACTOR * float(np.median(off_px[kept])))
        again = off_px <= limit
        if (again == kept).all() or np.count_nonzero(again) <= terms.shape[1]:
            break
        kept = again
    return np.asarray(kept), np.asarray(terms @ map_px)


def _agreeing(terms: np.ndarray, corners_px: Points2) -> Flags:
    """Return which corners (n,) lie near the map of the least sum of distances, which a third of wrong ones hardly moves."""
    weights = np.ones(len(terms))
    for _ in range(_ABSOLUTE_ROUNDS):
        root = np.sqrt(weights)[:, None]
        map_px, *_ = np.linalg.lstsq(root * terms, root * corners_px, rcond=None)
        off_px = np.linalg.norm(terms @ map_px - corners_px, axis=1)
        weights = 1.0 / np.maximum(off_px, _LEAST_ABSOLUTE_PX)
    near = off_px <= max(_LEAST_OFF_PX, _OFF_FACTOR * float(np.median(off_px)))
    return np.asarray(near if np.count_nonzero(near) > terms.shape[1] else np.ones(len(terms), dtype=bool))
