"""What views of a board cover: the image, tilts and distances; and which view is missing, in words."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from calib_core.arrays import Counts, Vector3, freeze
from calib_core.errors import word_list
from calib_core.intrinsics.board import Board
from calib_core.intrinsics.board_images import BoardCorners, LeftOutImage

_CELLS = (6, 8)
_FINE = (36, 48)
_ROUGH_FOCAL_LENGTH = 0.9  # over the width of the image; tilts need no better one
_SQUARE_ON_DEG = 12.0
_NEAR, _FAR = 0.20, 0.07  # share of the image that the board fills
_VIEWS_WANTED = 12
_PER_TILT, _PER_DISTANCE = 2, 2
_SHARE_WANTED = 0.6
_TILTS = {
    "left": "turn the board by 30 to 45 deg so that it faces the left",
    "right": "turn the board by 30 to 45 deg so that it faces the right",
    "up": "tip the board by 30 to 45 deg so that it faces up",
    "down": "tip the board by 30 to 45 deg so that it faces down",
}
_PLACES = (
    ("upper left corner", "upper side", "upper right corner"),
    ("left side", "middle", "right side"),
    ("lower left corner", "lower side", "lower right corner"),
)


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """What views of a board cover.

    Attributes:
        counts: (rows, columns) corners in each cell of the image.
        share: of the image that was covered by the board, 0 to 1.
        tilts: number of views by where the board faces: "left", "right", "up", "down", or "square on".
        distances: number of views by how much of the image the board fills: "near", "middle", "far".
        missing: sentences that say which view is missing and how to film it; none if nothing is.
    """

    counts: Counts
    share: float
    tilts: Mapping[str, int]
    distances: Mapping[str, int]
    missing: tuple[str, ...]

    def __post_init__(self) -> None:
        freeze(self, np.int64, counts=(None, None))


def view_coverage(views: Sequence[BoardCorners], board: Board, size_px: tuple[int, int]) -> Coverage:
    """Return what views cover.

    Args:
        views: of the board.
        board: that they show.
        size_px: width and height of the images.
    """
    counts, covered = np.zeros(_CELLS, dtype=np.int64), np.zeros(_FINE, dtype=bool)
    tilts, distances = dict.fromkeys((*_TILTS, "square on"), 0), dict.fromkeys(("near", "middle", "far"), 0)
    for view in views:
        one = _view_share(view, board, size_px)
        np.add.at(counts, one.cells, 1)
        covered |= one.covered
        distances[one.distance] += 1
        for tilt in one.tilts:
            tilts[tilt] += 1
    share = float(covered.mean())
    missing = tuple(_missing(len(views), covered, share, tilts, distances))
    return Coverage(counts, share, tilts, distances, missing)


@dataclass(frozen=True, slots=True, eq=False)
class _ViewShare:
    """What one view covers: cells (row, column) of its corners, fine cells, its distance and tilts."""

    cells: tuple[np.ndarray, np.ndarray]
    covered: np.ndarray
    distance: str
    tilts: tuple[str, ...]


@lru_cache(maxsize=1024)  # a search asks for the coverage of all its views after each image
def _view_share(view: BoardCorners, board: Board, size_px: tuple[int, int]) -> _ViewShare:
    shares = (view.pixels_px + 0.5) / np.array(size_px)
    column, row = np.clip((shares * (_CELLS[1], _CELLS[0])).astype(int), 0, (_CELLS[1] - 1, _CELLS[0] - 1)).T
    covered = np.zeros(_FINE, dtype=np.uint8)
    share = _cover(shares, covered)
    distance = "near" if share > _NEAR else "far" if share < _FAR else "middle"
    return _ViewShare((row, column), covered.astype(bool), distance, _tilts(view, board))


def _cover(shares: np.ndarray, covered: np.ndarray) -> float:
    """Mark the hull of corners (n, 2) as covered; return its share of the image."""
    import cv2

    hull = cv2.convexHull((shares * (_FINE[1], _FINE[0])).astype(np.float32))
    cv2.fillConvexPoly(covered, np.floor(hull).astype(np.int32), 1)
    return float(cv2.contourArea(hull)) / covered.size


def _tilts(view: BoardCorners, board: Board) -> tuple[str, ...]:
    """Return where the board faces: one or two directions, or "square on"."""
    into = _normal(view, board)
    if into is None:
        return ()
    across, down = np.degrees(np.arcsin(np.clip(into[:2], -1.0, 1.0)))
    if np.hypot(across, down) < _SQUARE_ON_DEG:
        return ("square on",)
    sideways, upright = ("left" if across > 0 else "right"), ("up" if down > 0 else "down")
    half = _SQUARE_ON_DEG / 2.0 + 0.4 * max(abs(across), abs(down))
    return tuple(name for name, angle in ((sideways, across), (upright, down)) if abs(angle) >= half)


def _normal(view: BoardCorners, board: Board) -> Vector3 | None:
    """Return the board's normal, away from the camera, about the line of sight: (3,) right, down, along it; None if unclear."""
    import cv2

    width, height = view.size_px
    focal_px = _ROUGH_FOCAL_LENGTH * width
    plane = (view.pixels_px - np.array([(width - 1) / 2.0, (height - 1) / 2.0])) / focal_px
    homography, _ = cv2.findHomography(board.corners_m[view.corner_ids][:, :2], plane)
    if homography is None:
        return None
    middle = board.corners_m[:, :2].mean(axis=0)
    sight = homography @ np.array([*middle, 1.0])
    homography = homography * np.sign(sight[2])
    first, second = homography[:, 0], homography[:, 1]
    normal = np.cross(first / np.linalg.norm(first), second / np.linalg.norm(second))
    length = float(np.linalg.norm(normal))
    if length < 1e-6:
        return None
    normal, sight = normal / length, sight / np.linalg.norm(sight) * np.sign(sight[2])
    right = np.cross(np.array([0.0, 1.0, 0.0]), sight)
    right /= np.linalg.norm(right)
    return np.array([normal @ right, normal @ np.cross(sight, right), normal @ sight])


def _missing(
    count: int, covered: np.ndarray, share: float, tilts: Mapping[str, int], distances: Mapping[str, int]
) -> list[str]:
    sentences = []
    if count < _VIEWS_WANTED:
        sentences.append(f"{count} views of the board, 15 to 30 are better: film it from more directions")
    empty = [_PLACES[row][column] for row in range(3) for column in range(3) if not _third(covered, row, column).any()]
    if empty:
        sentences.append(f"nothing in the {word_list(empty)} of the image: hold the board there, tilted")
    elif share < _SHARE_WANTED:
        sentences.append(
            f"the board was in {100.0 * share:.0f} % of the image: hold it nearer to the borders and corners"
        )
    for name, how in _TILTS.items():
        if tilts[name] < _PER_TILT:
            number = "no view" if not tilts[name] else "only one view"
            sentences.append(f"{number} in which the board faces {name}: {how}")
    if distances["near"] < _PER_DISTANCE:
        sentences.append("no near views: let the board fill a third of the image or more")
    if not distances["far"] and not distances["middle"]:
        sentences.append("no views from farther away: step back until the board fills a tenth of the image")
    return sentences


def _third(covered: np.ndarray, row: int, column: int) -> np.ndarray:
    height, width = covered.shape[0] // 3, covered.shape[1] // 3
    return covered[row * height : (row + 1) * height, column * width : (column + 1) * width]


@dataclass(frozen=True, slots=True)
class SearchProgress:
    """How far a search is.

    Attributes:
        searched: images so far.
        total: images to search, as far as known; it grows where the board is found in a long recording.
        views: in which the board was found so far, in order of their numbers.
        left_out: those not used so far.
        coverage: of these views; None before the first.
        indices: numbers of the images that were searched, ascending.
    """

    searched: int
    total: int
    views: tuple[BoardCorners, ...] = ()
    left_out: tuple[LeftOutImage, ...] = ()
    coverage: Coverage | None = None
    indices: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class BoardSearch:
    """What a search found.

    Attributes:
        board: what was looked for.
        size_px: width and height of the images.
        views: those to calibrate with, in order of their numbers.
        left_out: the others in which the board is, or was expected, with the reason.
        searched: how many images were looked at.
        complete: whether all were; False after a canceled search.
    """

    board: Board
    size_px: tuple[int, int]
    views: tuple[BoardCorners, ...]
    left_out: tuple[LeftOutImage, ...]
    searched: int
    complete: bool = True

    @property
    def coverage(self) -> Coverage:
        """What of the image, and which tilts and distances, the views cover."""
        return view_coverage(self.views, self.board, self.size_px)
