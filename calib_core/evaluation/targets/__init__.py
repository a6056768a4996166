"""Moving targets: found in radar returns and followed from scan to scan, without any calibration."""

from calib_core.evaluation.targets.moving_returns import MovingReturns, SensorMotion, TargetOptions
from calib_core.evaluation.targets.target_track import TargetTrack
from calib_core.evaluation.targets.target_tracking import FoundTargets, find_targets, moving_targets

__all__ = [
    "FoundTargets",
    "MovingReturns",
    "SensorMotion",
    "TargetOptions",
    "TargetTrack",
    "find_targets",
    "moving_targets",
]
