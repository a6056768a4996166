"""Pictures of calibration boards, and corners without pictures, with known truth."""

from calib_core.synthetic.boards.board_picture import draw_board, render_board
from calib_core.synthetic.boards.board_poses import Waving, waved_poses
from calib_core.synthetic.boards.moving_board import BoardFilm, MovingBoard, true_corners
from calib_core.synthetic.boards.printed_board import BoardShape, PrintedBoard, printed_board
from calib_core.synthetic.boards.simulated_views import CornerErrors, simulated_views

__all__ = [
    "BoardFilm",
    "BoardShape",
    "CornerErrors",
    "MovingBoard",
    "PrintedBoard",
    "Waving",
    "draw_board",
    "printed_board",
    "render_board",
    "simulated_views",
    "true_corners",
    "waved_poses",
]
