"""A board as it really is: bent, and with squares that are not equal."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, Vector3, frozen_array
from calib_core.intrinsics import Board
from calib_core.synthetic.boards.board_film import BoardShape
from calib_core.synthetic.boards.board_pattern import BoardPattern, pattern_of


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
