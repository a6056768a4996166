"""Results: a calibration with its pairs, metrics and warnings, and the verdict on it."""

from calib_core.measurements import DataWarning
from calib_core.results.calibration import (
    Calibration,
    CheckPoint,
    InputFile,
    Metrics,
    NextPlacement,
    PairResult,
    UnconfirmedClicks,
)

__all__ = [
    "Calibration",
    "CheckPoint",
    "DataWarning",
    "InputFile",
    "Metrics",
    "NextPlacement",
    "PairResult",
    "UnconfirmedClicks",
]
