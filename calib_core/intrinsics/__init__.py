"""Calibrate a camera's lens from pictures of a board: K, distortion, and how well they are known."""

from calib_core.intrinsics.board import Board, BoardKind, board_of_size
from calib_core.intrinsics.board_pictures import BoardCorners, BoardPictures, LeftOutPicture
from calib_core.intrinsics.board_search import search_boards
from calib_core.intrinsics.calibrated_lens import CalibratedLens, LensView, ModelTrial
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.coverage import BoardSearch, Coverage, SearchProgress, view_coverage
from calib_core.intrinsics.picture_maps import (
    MODEL_ERRORS_UNSEEN,
    PictureGrid,
    ResidualField,
    projection_uncertainty,
    residual_field,
)
from calib_core.intrinsics.split_difference import SplitDifference, split_difference

__all__ = [
    "MODEL_ERRORS_UNSEEN",
    "Board",
    "BoardCorners",
    "BoardKind",
    "BoardPictures",
    "BoardSearch",
    "CalibratedLens",
    "Coverage",
    "LeftOutPicture",
    "LensView",
    "ModelTrial",
    "PictureGrid",
    "ResidualField",
    "SearchProgress",
    "SplitDifference",
    "board_of_size",
    "calibrate_lens",
    "projection_uncertainty",
    "residual_field",
    "search_boards",
    "split_difference",
    "view_coverage",
]
