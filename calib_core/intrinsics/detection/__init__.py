"""Boards in pictures: which corners, where, and how sharp."""

from calib_core.intrinsics.detection.finding import blur_px, board_in, find_board

__all__ = ["blur_px", "board_in", "find_board"]
