"""Find a board in a picture."""

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
