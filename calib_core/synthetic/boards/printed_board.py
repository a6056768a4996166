"""A board as it really is: the printed cells of ink and paper; bent, and with squares that are not equal."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, Values, Vector3, frozen_array
from calib_core.intrinsics import Board


@dataclass(frozen=True, slots=True)
class BoardShape:
    """How a board differs from the ideal one; the same in every picture.

    Attributes:
        bend_m: how far its middle stands behind its sides, and behind its upper and lower edge: a quadratic bend [m].
        scale: size of the squares along x and y over the stated one.
        unequal_m: standard deviation of where each line between squares is printed [m].
        seed: of these lines.
    """

    bend_m: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    unequal_m: float = 0.0
    seed: int = 0


_MARGIN_SQUARES = 0.6
"""Width of the white margin around the squares."""
_TAG_BORDER_BITS = 2
"""Kalibr's; the width of a tag's black border."""


@dataclass(frozen=True, slots=True, eq=False)
class BoardPattern:
    """What is printed on a board, in the board's frame.

    Attributes:
        x_m: (k,) lines between cells, ascending; the first and the last are the board's edges.
        y_m: (l,) the same along y.
        paper: (l - 1, k - 1) 1 where a cell is white.
    """

    x_m: Values
    y_m: Values
    paper: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "x_m", frozen_array(self.x_m, (None,)))
        object.__setattr__(self, "y_m", frozen_array(self.y_m, (None,)))
        shape = (len(self.y_m) - 1, len(self.x_m) - 1)
        object.__setattr__(self, "paper", frozen_array(self.paper, shape, dtype=np.float32))

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height with the margin [m]."""
        return float(np.ptp(self.x_m)), float(np.ptp(self.y_m))


def pattern_of(board: Board) -> BoardPattern:
    """Return what is printed on a board."""
    match board.kind:
        case "checkerboard":
            return _checkerboard(board)
        case "charuco":
            return _charuco(board)
        case _:
            return _aprilgrid(board)


def _checkerboard(board: Board) -> BoardPattern:
    x_m, y_m = (board.square_m * np.arange(-1, count + 1) for count in (board.columns, board.rows))
    odd = np.add.outer(np.arange(board.rows + 1), np.arange(board.columns + 1)) % 2
    return _with_margin(x_m, y_m, odd, _MARGIN_SQUARES * board.square_m)


def _charuco(board: Board) -> BoardPattern:
    """Lay out a ChArUco board as OpenCV does: the upper left square is black, markers are in the white ones."""
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    bits = dictionary.markerSize + 2
    inset = 0.5 * (board.square_m - board.marker_m)
    steps = np.concatenate([[0.0], inset + board.marker_m * np.arange(bits + 1) / bits])
    x_m, y_m = (
        np.append((board.square_m * np.arange(-1, count - 1)[:, None] + steps).ravel(), board.square_m * (count - 1))
        for count in (board.columns, board.rows)
    )
    paper = np.zeros((len(y_m) - 1, len(x_m) - 1))
    number = 0
    for row in range(board.rows):
        for column in range(board.columns):
            if (row + column) % 2 == 0:
                continue
            square = paper[row * len(steps) : (row + 1) * len(steps), column * len(steps) : (column + 1) * len(steps)]
            square[:] = 1.0
            square[1:-1, 1:-1] = dictionary.generateImageMarker(number, bits, borderBits=1) > 0
            number += 1
    return _with_margin(x_m, y_m, paper, _MARGIN_SQUARES * board.square_m)


def _aprilgrid(board: Board) -> BoardPattern:
    """Lay out a grid of AprilTags as Kalibr prints it: tag 0 below left, black squares at the corners of all tags."""
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    bits = dictionary.markerSize + 2 * _TAG_BORDER_BITS
    first_m = board.corners_m[:, :2].min(axis=0)
    steps = board.square_m * np.arange(bits + 1) / bits
    pitch_m = board.square_m + board.marker_m
    x_m, y_m = (
        np.concatenate([[-board.marker_m], (pitch_m * np.arange(count)[:, None] + steps).ravel(), [pitch_m * count]])
        for count in (board.columns, board.rows)
    )
    paper = np.ones((len(y_m) - 1, len(x_m) - 1))
    paper[:: bits + 1, :: bits + 1] = 0.0
    for tag in range(board.columns * board.rows):
        row, column = board.rows - 1 - tag // board.columns, tag % board.columns
        cells = (
            slice(row * (bits + 1) + 1, (row + 1) * (bits + 1)),
            slice(column * (bits + 1) + 1, (column + 1) * (bits + 1)),
        )
        upside_down = dictionary.generateImageMarker(tag, bits, borderBits=_TAG_BORDER_BITS) > 0
        paper[cells] = upside_down[::-1, ::-1]  # OpenCV's tags are AprilTag's, turned by half a turn
    return _with_margin(first_m[0] + x_m, first_m[1] + y_m, paper, 0.3 * board.square_m)


def _with_margin(x_m: Values, y_m: Values, paper: np.ndarray, margin_m: float) -> BoardPattern:
    around = [np.concatenate([[lines[0] - margin_m], lines, [lines[-1] + margin_m]]) for lines in (x_m, y_m)]
    return BoardPattern(around[0], around[1], np.pad(paper, 1, constant_values=1.0))


@dataclass(frozen=True, slots=True, eq=False)
class PrintedBoard:
    """A board as it really is, in its own frame.

    Attributes:
        pattern: what is printed on it, with its lines where they are.
        corners_m: (n, 3) the true corners by id.
        middle_m: (3,) the middle of its ideal corners, about which it turns.
        bends: (2,) z = bends[0] (x - middle x)^2 + bends[1] (y - middle y)^2 - a constant [1/m].
        sag_m: that constant: the middle is behind the edges by it.
    """

    pattern: BoardPattern
    corners_m: Points3
    middle_m: Vector3
    bends: tuple[float, float]
    sag_m: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners_m", frozen_array(self.corners_m, (None, 3)))
        object.__setattr__(self, "middle_m", frozen_array(self.middle_m, (3,)))

    def height_m(self, x_m: np.ndarray, y_m: np.ndarray) -> np.ndarray:
        """Return z of the surface at x, y [m]."""
        x, y = x_m - self.middle_m[0], y_m - self.middle_m[1]
        return np.asarray(self.sag_m - self.bends[0] * x * x - self.bends[1] * y * y)


def printed_board(board: Board, shape: BoardShape) -> PrintedBoard:
    """Return a board with its faults."""
    ideal = pattern_of(board)
    corners = board.corners_m
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    half = 0.5 * np.ptp(corners[:, :2], axis=0)
    rng = np.random.default_rng([shape.seed, 77])
    lines = []
    for axis, ideal_m in enumerate((ideal.x_m, ideal.y_m)):
        scaled = middle[axis] + shape.scale[axis] * (ideal_m - middle[axis])
        lines.append(scaled + shape.unequal_m * rng.standard_normal(len(ideal_m)))
    bends = (float(shape.bend_m[0] / half[0] ** 2), float(shape.bend_m[1] / half[1] ** 2))
    made = PrintedBoard(
        BoardPattern(lines[0], lines[1], ideal.paper), np.zeros((0, 3)), middle, bends, float(sum(shape.bend_m))
    )
    x, y = np.interp(corners[:, 0], ideal.x_m, lines[0]), np.interp(corners[:, 1], ideal.y_m, lines[1])
    true = np.stack([x, y, made.height_m(x, y)], axis=1)
    return PrintedBoard(made.pattern, true, middle, bends, made.sag_m)
