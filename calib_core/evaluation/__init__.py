"""How good is a calibration on a recording? Residuals at clicks (AED, CDSD), and radar returns in boxes (Acc)."""

from calib_core.evaluation.box_acc import box_figures, judged_by_boxes
from calib_core.evaluation.counted_returns import CountedReturns, counted_returns, renamed_classes
from calib_core.evaluation.figures import (
    BoxedReturns,
    BoxFigures,
    ClassFigure,
    Evaluation,
    FrameFigure,
    HeldOut,
    ResidualFigures,
    Sensitivity,
    Share,
    Spread,
)
from calib_core.evaluation.residuals import AssociatedPairs, associated_pairs, residual_figures
from calib_core.evaluation.targets import FoundTargets, TargetOptions, TargetTrack, find_targets, moving_targets

__all__ = [
    "AssociatedPairs",
    "BoxFigures",
    "BoxedReturns",
    "ClassFigure",
    "CountedReturns",
    "Evaluation",
    "FoundTargets",
    "FrameFigure",
    "HeldOut",
    "ResidualFigures",
    "Sensitivity",
    "Share",
    "Spread",
    "TargetOptions",
    "TargetTrack",
    "associated_pairs",
    "box_figures",
    "counted_returns",
    "find_targets",
    "judged_by_boxes",
    "moving_targets",
    "renamed_classes",
    "residual_figures",
]
