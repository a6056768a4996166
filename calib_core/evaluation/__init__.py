"""How good is a calibration on a recording? Residuals at clicks (AED, CDSD), and radar returns in boxes (Acc)."""

from calib_core.evaluation.box_acc import box_figures, judged_by_boxes
from calib_core.evaluation.counted_returns import CountedReturns, counted_returns, renamed_classes
from calib_core.evaluation.evaluation_json import EVALUATION_SCHEMA, evaluation_document, evaluation_json
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
from calib_core.evaluation.moving_returns import TargetOptions
from calib_core.evaluation.paired_difference import PairedDifference, acc_difference, residual_difference
from calib_core.evaluation.residuals import AssociatedPairs, associated_pairs, residual_figures
from calib_core.evaluation.sentences import (
    NOT_ACCURACY,
    acc_sentence,
    evaluation_lines,
    residual_sentence,
    sensitivity_sentences,
)
from calib_core.evaluation.target_tracking import FoundTargets, TargetTrack, find_targets, moving_targets

__all__ = [
    "EVALUATION_SCHEMA",
    "NOT_ACCURACY",
    "AssociatedPairs",
    "BoxFigures",
    "BoxedReturns",
    "ClassFigure",
    "CountedReturns",
    "Evaluation",
    "FoundTargets",
    "FrameFigure",
    "HeldOut",
    "PairedDifference",
    "ResidualFigures",
    "Sensitivity",
    "Share",
    "Spread",
    "TargetOptions",
    "TargetTrack",
    "acc_difference",
    "acc_sentence",
    "associated_pairs",
    "box_figures",
    "counted_returns",
    "evaluation_document",
    "evaluation_json",
    "evaluation_lines",
    "find_targets",
    "judged_by_boxes",
    "moving_targets",
    "renamed_classes",
    "residual_difference",
    "residual_figures",
    "residual_sentence",
    "sensitivity_sentences",
]
