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

__all__ = [
    "BoxFigures",
    "ClassFigure",
    "Evaluation",
    "FrameFigure",
    "HeldOut",
    "ResidualFigures",
    "Sensitivity",
    "Share",
    "Spread",
]
