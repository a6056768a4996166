"""Find boards with markers: ChArUco boards and Kalibr's AprilGrid. A part of the board suffices.

Facts that decide about ids: OpenCV draws the AprilTags of family 36h11 turned by 180 degrees against AprilTag's own pictures,
which Kalibr prints. So the corner that OpenCV calls the first is the lower right one on a Kalibr grid. Grids printed with
OpenCV's pictures exist too; the orientation that makes a plane of the whole grid is taken.
"""

from typing import Any

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Values
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.detection.subpixel import refined_corners

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
    return _refined(grey, board, *best)


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
    turned = _turned(board, numbers, sides)
    if turned is None:
        return None
    return _refined(grey, board, (4 * numbers[:, None] + np.arange(4)).ravel(), turned.reshape(-1, 2))


def _turned(board: Board, numbers: Indices, sides: np.ndarray) -> np.ndarray | None:
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


def _refined(grey: np.ndarray, board: Board, ids: Indices, pixels_px: Points2) -> tuple[Indices, Points2] | None:
    """Refine corners, and leave out those that move away, leave the picture, or do not lie where the others say."""
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
    """Return which corners (n,) lie near the smooth map from the board to the picture that most agree on, and all by it."""
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
