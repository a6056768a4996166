"""Boards in pictures: which corners, where, and how sharp."""

from calib_core.intrinsics.detection.edge_width import blur_px
from calib_core.intrinsics.detection.finding import find_board
from calib_core.intrinsics.detection.other_boards import board_in

__all__ = ["blur_px", "board_in", "find_board"]
