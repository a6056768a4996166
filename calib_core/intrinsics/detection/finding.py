"""Find a board in a picture; say how sharp it is, or which checkerboard it is if it is another one."""

import numpy as np

from calib_core.arrays import Indices, Points2
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.detection.checkerboards import find_checkerboard
from calib_core.intrinsics.detection.marker_boards import find_aprilgrid, find_charuco


def find_board(picture: np.ndarray, board: Board) -> tuple[Indices, Points2] | None:
    """Find a board: ids (n,) of its corners in the picture, ascending, and their pixels (n, 2); None if it is not there.

    A checkerboard must be seen as a whole; of the others a part suffices.

    Args:
        picture: uint8 (h, w, 3), blue first, or (h, w).
        board: which board.
    """
    import cv2

    grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    if board.kind == "checkerboard":
        corners = find_checkerboard(grey, board.columns, board.rows)
        return None if corners is None else (np.arange(len(corners)), corners)
    return find_charuco(grey, board) if board.kind == "charuco" else find_aprilgrid(grey, board)


_WIDTH_PX = 640
_SEEDS = ((3, 3), (4, 3), (5, 4))


def board_in(picture: np.ndarray, board: Board) -> tuple[int, int] | None:
    """Return the inner corners of another checkerboard in a picture: along its longer and its shorter side; None without one.

    Args:
        picture: uint8 (h, w, 3), blue first, or (h, w).
        board: the one that was looked for and is not there.
    """
    import cv2

    if board.kind != "checkerboard":
        return None
    grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
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


def blur_px(picture: np.ndarray, corner_ids: Indices, pixels_px: Points2, board: Board) -> float:
    """Return the width of the edges between black and white, as the standard deviation of a Gaussian [px].

    Motion blurs the edges across it; of the two directions of the board the wider one counts. NaN where nothing can be measured.

    Args:
        picture: uint8 (h, w, 3), blue first, or (h, w).
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
        found = _widths(picture, pixels_px[rows[chosen]], steps[chosen], _free_share(board))
        if len(found) >= _LEAST_EDGES:
            widths.append(float(np.median(found)))
    return max(widths, default=float("nan"))


def _steps_across(board: Board, corner_ids: Indices, pixels_px: Points2) -> np.ndarray | None:
    """Return how far a step in the board's plane, across each edge and as long as it, is in the picture: (k, 2) [px]."""
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


def _widths(picture: np.ndarray, ends: np.ndarray, steps: np.ndarray, share: float) -> np.ndarray:
    """Return the widths of edges whose contrast suffices: (<= k,) [px].

    Args:
        picture: that they are in.
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
    values = cv2.remap(picture, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
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
