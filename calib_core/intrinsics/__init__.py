"""Calibrate a camera's lens from images of a board: K, distortion, and how well they are known."""

from calib_core.intrinsics.board import Board, BoardKind, board_of_size
from calib_core.intrinsics.board_images import BoardCorners, BoardImages, LeftOutImage
from calib_core.intrinsics.board_search import search_boards
from calib_core.intrinsics.calibrated_lens import CalibratedLens, LensView, ModelTrial
from calib_core.intrinsics.calibrating import calibrate_lens
from calib_core.intrinsics.coverage import BoardSearch, Coverage, SearchProgress, view_coverage
from calib_core.intrinsics.image_maps import (
    MODEL_ERRORS_UNSEEN,
    ImageGrid,
    ResidualField,
    projection_uncertainty,
    residual_field,
)
from calib_core.intrinsics.split_difference import SplitDifference, split_difference

__all__ = [
    "MODEL_ERRORS_UNSEEN",
    "Board",
    "BoardCorners",
    "BoardImages",
    "BoardKind",
    "BoardSearch",
    "CalibratedLens",
    "Coverage",
    "ImageGrid",
    "LeftOutImage",
    "LensView",
    "ModelTrial",
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
