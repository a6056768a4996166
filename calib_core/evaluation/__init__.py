"""How good is a calibration on a recording? Residuals at clicks (AED, CDSD), and radar returns in boxes (Acc)."""

from calib_core.evaluation.figures import (
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
from calib_core.evaluation.targets import BoxedReturns, TargetTrack

__all__ = [
    "BoxFigures",
    "BoxedReturns",
    "ClassFigure",
    "Evaluation",
    "FrameFigure",
    "HeldOut",
    "ResidualFigures",
    "Sensitivity",
    "Share",
    "Spread",
    "TargetTrack",
]
