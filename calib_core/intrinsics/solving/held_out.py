"""How well a lens predicts views that it was not calibrated with."""

import numpy as np

from calib_core.arrays import Indices, Values
from calib_core.intrinsics.solving.adjustment import adjust
from calib_core.intrinsics.solving.linearization import Freedom, LensState, residuals_of, warped
from calib_core.intrinsics.solving.view_stack import ViewStack

_REFIT_STEPS = 4  # from the fit with all views
_POSE_STEPS = 6


def view_folds(views: int, most: int) -> Indices:
    """Return the number of the fold of each view: as equal as possible, neighbours in time together."""
    return np.arange(views) * min(views, most) // views


def held_out_squares(state: LensState, stack: ViewStack, freedom: Freedom, folds: Indices) -> Values:
    """Return the mean squared residual (v,) [px^2] of each view, with the lens of all other folds.

    The lens and the shape of the board come from the other folds; the pose of a left-out view is fitted to its own corners.

    Args:
        state: the fit to all views.
        stack: the views.
        freedom: what the fit may change besides the poses.
        folds: (v,) the number of each view's fold.
    """
    squares = np.full(len(stack), np.nan)
    for fold in range(int(folds.max()) + 1):
        out = folds == fold
        others = adjust(state.of(~out), stack.of(~out), freedom, steps=_REFIT_STEPS)
        left = warped(stack.of(out), freedom.warp, others.amounts)
        start = LensState(others.camera, state.rotations[out], state.translations_m[out])
        with np.errstate(all="ignore"):
            posed = adjust(start, left, Freedom.none(others.camera), steps=_POSE_STEPS)
        squares[out] = left.mean_square(residuals_of(posed, left))
    return squares
