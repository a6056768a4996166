"""Adjustment with weights that forgive corners and views that do not fit."""

import numpy as np

from calib_core.intrinsics.solving.adjustment import adjust
from calib_core.intrinsics.solving.linearization import Freedom, LensState, residuals_of
from calib_core.intrinsics.solving.view_stack import ViewStack

_ROUNDS = 12
_STEPS = 2
_REACH = 4.0  # in standard deviations: a corner that far away has a quarter of its weight
_FLOOR_PX = 0.01
_MEDIAN_DISTANCE = 1.1774  # of a point scattered with a standard deviation of 1 along both axes
_SETTLED = 0.02


def typical_sigma(residuals_px: np.ndarray, stack: ViewStack) -> float:
    """Return the standard deviation [px] per axis of the corners that fit, from the median distance."""
    distances = np.sqrt(np.square(residuals_px).sum(axis=1))[stack.weights > 0]
    distances = np.where(np.isnan(distances), np.inf, distances)  # not imaged is far off
    return max(float(np.median(distances)) / _MEDIAN_DISTANCE, _FLOOR_PX) if len(distances) else _FLOOR_PX


def adjust_robustly(state: LensState, stack: ViewStack, freedom: Freedom) -> LensState:
    """Adjust with the loss of Geman and McClure, whose scale follows the median residual down.

    Args:
        state: the start.
        stack: the corners; those with weight 0 stay out.
        freedom: what may change besides the poses.
    """
    sigma = np.inf
    for _ in range(_ROUNDS):
        residuals = residuals_of(state, stack, freedom.warp)
        before, sigma = sigma, typical_sigma(residuals, stack)
        far = np.square(residuals).sum(axis=1) / (_REACH * sigma) ** 2
        weights = np.where(np.isfinite(far), 1.0 / np.square(1.0 + far), 0.0)
        state = adjust(state, stack.weighted(np.where(stack.weights > 0, weights, 0.0)), freedom, steps=_STEPS)
        if abs(before - sigma) <= _SETTLED * sigma:
            break
    return state
