"""Paired differences: which of two calibrations is better on the same clicks and frames, and is it more than noise?"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Values
from calib_core.evaluation.box_acc import grouped_error
from calib_core.evaluation.figures import BoxFigures, ResidualFigures

Winner: TypeAlias = Literal["A", "B", "equal", "unknown"]
"""The better one; "equal" if the two are the same there (residuals: to 0.01 px), "unknown" if the difference may be noise."""

_SIGNIFICANT_P = 0.05
_SAME_PX = 0.01  # the digits of a pose in a file move a pixel by less
_LEAST_GROUPS = 3


@dataclass(frozen=True, slots=True)
class PairedDifference:
    """What B has more than A, over groups whose errors are independent of one another.

    Attributes:
        mean: of the differences B - A: [px] of residuals, 0 to 1 of Acc.
        standard_error: of that mean; NaN below two groups.
        low: lower end of the 95 % interval of the mean (Student's t); NaN likewise.
        high: its upper end.
        p_value: probability of a mean this far from 0 if neither were better; NaN likewise.
        groups: number of placements, or of groups of neighboring frames.
        winner: which one is better.
    """

    mean: float
    standard_error: float
    low: float
    high: float
    p_value: float
    groups: int
    winner: Winner


def residual_difference(a: ResidualFigures, b: ResidualFigures, *, lost_px: float) -> PairedDifference:
    """Compare the lengths of residuals, B's minus A's, as the mean over placements of the mean over their clicks.

    Args:
        a: of one calibration.
        b: of another, at the same clicks.
        lost_px: what a residual counts where the reflector would be behind the camera, such as the image's diagonal.
    """
    lengths = [np.where(np.isfinite(one.distances_px), one.distances_px, lost_px) for one in (a, b)]
    groups = a.placements if len(a.placements) else np.arange(len(a.ids))
    differences = np.bincount(groups, weights=lengths[1] - lengths[0]) / np.maximum(np.bincount(groups), 1)
    error = float(differences.std(ddof=1) / np.sqrt(len(differences))) if len(differences) > 1 else float("nan")
    same = bool((np.abs(lengths[1] - lengths[0]) < _SAME_PX).all())
    return _judge_difference(float(differences.mean()), error, len(differences), less_is_better=True, same=same)


def acc_difference(a: BoxFigures, b: BoxFigures) -> PairedDifference | None:
    """Compare Acc, B's minus A's, frame by frame with neighboring frames taken together; None if no frame counts.

    Args:
        a: of one calibration.
        b: of another, from the same returns and boxes.
    """
    both = [(frame, other) for frame, other in zip(a.frames, b.frames, strict=True) if frame.returns]
    if not both:
        return None
    differences: Values = np.array([other.share - one.share for one, other in both])
    error, groups = grouped_error(differences, np.array([one.image_time for one, _ in both], dtype=np.int64))
    return _judge_difference(float(differences.mean()), error, groups, less_is_better=False)


def _judge_difference(
    mean: float, error: float, groups: int, *, less_is_better: bool, same: bool = False
) -> PairedDifference:
    from scipy.special import stdtr, stdtrit

    if same or (mean == 0.0 and not error > 0.0):
        return PairedDifference(0.0, error, 0.0, 0.0, 1.0, groups, "equal")
    if not np.isfinite(error) or groups < _LEAST_GROUPS:
        nan = float("nan")
        return PairedDifference(mean, error, nan, nan, nan, groups, "unknown")
    half = float(stdtrit(groups - 1, 0.975)) * error
    p_value = float(2.0 * stdtr(groups - 1, -abs(mean) / error)) if error > 0 else 0.0
    winner: Winner = "unknown"
    if p_value < _SIGNIFICANT_P:
        winner = "B" if (mean < 0) == less_is_better else "A"
    return PairedDifference(mean, error, mean - half, mean + half, p_value, groups, winner)
