"""Least squares over lens, shape of the board and all poses (Levenberg-Marquardt, poses eliminated by the Schur complement).

`adjust_robustly` weighs down corners and views that do not fit.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values
from calib_core.intrinsics.solving.linearization import (
    Freedom,
    LensState,
    Linearized,
    ViewStack,
    linearize,
    residuals_of,
)

_STEPS = 60
_FIRST_DAMPING = 1e-4
_LEAST_DAMPING = 1e-12
_MOST_DAMPING = 1e8
_SETTLED = 1e-10  # of the cost, relative: steps that gain less do not change what is stated


@dataclass(frozen=True, slots=True, eq=False)
class Reduced:
    """The normal equations of lens and warp, after each view's pose has been eliminated.

    Attributes:
        information: (v, q, q) what each view says about the q free numbers.
        gradients: (v, q) of half the cost with respect to them.
        prior: (q, q) what is known without the views.
        noise_px2: the variance of a corner along either axis, if all were independent.
    """

    information: np.ndarray
    gradients: np.ndarray
    prior: np.ndarray
    noise_px2: float


def weighted_cost(residuals_px: np.ndarray, stack: ViewStack) -> float:
    """Return half the weighted sum of squares [px^2]; infinite if a corner with a weight cannot be projected."""
    squares = np.where(stack.weights > 0, np.square(residuals_px).sum(axis=1) * stack.weights, 0.0)
    total = 0.5 * float(squares.sum())
    return total if np.isfinite(total) else float("inf")


def reduced(at: Linearized) -> Reduced:
    """Eliminate the poses: what remains of the slopes is orthogonal to each view's own."""
    poses_t = np.swapaxes(at.poses, 1, 2)
    within = np.linalg.solve(at.poses @ poses_t, at.poses @ np.swapaxes(at.shared, 1, 2))
    slopes = at.shared - np.swapaxes(within, 1, 2) @ at.poses
    within = np.linalg.solve(at.poses @ poses_t, at.poses @ at.residuals[:, :, None])
    left = at.residuals - (poses_t @ within)[:, :, 0]
    rows = int((at.poses != 0.0).any(axis=1).sum())
    free = rows - 6 * len(left) - slopes.shape[1]
    return Reduced(
        slopes @ np.swapaxes(slopes, 1, 2),
        (slopes @ left[:, :, None])[:, :, 0],
        at.prior,
        float(np.square(left).sum()) / max(free, 1),
    )


def adjust(state: LensState, stack: ViewStack, freedom: Freedom, *, steps: int = _STEPS) -> LensState:
    """Return the state that minimises the weighted squares, from a start nearby.

    Args:
        state: the start.
        stack: the corners with their weights.
        freedom: what may change besides the poses.
        steps: at most so many.
    """
    if len(state.amounts) != len(freedom.warp):
        state = LensState(state.camera, state.rotations, state.translations_m, np.zeros(len(freedom.warp)))
    cost = _cost(state, stack, freedom)
    damping = _FIRST_DAMPING
    for _ in range(steps):
        at = linearize(state, stack, freedom)
        before = cost
        while damping <= _MOST_DAMPING:
            trial = _stepped(state, at, freedom, damping)
            trial_cost = float("inf") if trial is None else _cost(trial, stack, freedom)
            if trial is not None and trial_cost <= cost:
                state, cost = trial, trial_cost
                damping = max(damping / 10.0, _LEAST_DAMPING)
                break
            damping *= 10.0
        if before - cost <= _SETTLED * before or damping > _MOST_DAMPING:
            break
    return state


def _cost(state: LensState, stack: ViewStack, freedom: Freedom) -> float:
    return weighted_cost(residuals_of(state, stack, freedom.warp), stack) + freedom.pull_cost(state.camera)


def _stepped(state: LensState, at: Linearized, freedom: Freedom, damping: float) -> LensState | None:
    """Return the state after one damped Gauss-Newton step; None if there is no such lens."""
    poses_t = np.swapaxes(at.poses, 1, 2)
    own = at.poses @ poses_t
    scale = np.einsum("vii->vi", own)[:, :, None]
    own = own + np.where(scale > 0.0, damping * scale, 1.0) * np.eye(6)  # a view without weights stays where it is
    mixed = at.shared @ poses_t
    gradient_own = (at.poses @ at.residuals[:, :, None])[:, :, 0]
    solved = np.linalg.solve(own, np.concatenate([np.swapaxes(mixed, 1, 2), gradient_own[:, :, None]], axis=2))
    step = _shared_step(at, mixed, solved, damping)
    poses = -solved[:, :, -1] - (solved[:, :, :-1] @ step)
    lens_count = freedom.lens.shape[1]
    try:
        values = state.camera.parameters + freedom.lens @ step[:lens_count]
        camera = state.camera.with_parameters(values) if lens_count else state.camera
        return state.moved(camera, poses, state.amounts + step[lens_count:])
    except ValueError:  # a focal length that is not positive, or numbers that are not finite
        return None


def _shared_step(at: Linearized, mixed: np.ndarray, solved: np.ndarray, damping: float) -> Values:
    """Solve the reduced normal equations for the step of lens and warp (q,)."""
    count = at.shared.shape[1]
    if count == 0:
        return np.zeros(0)
    full = (at.shared @ np.swapaxes(at.shared, 1, 2)).sum(axis=0) + at.prior
    right = (at.shared @ at.residuals[:, :, None])[:, :, 0].sum(axis=0) + at.prior_gradient
    scale = np.sqrt(np.maximum(np.diag(full), 1e-300))
    system = (full - (mixed @ solved[:, :, :-1]).sum(axis=0)) / np.outer(scale, scale)
    right = (right - (mixed @ solved[:, :, -1:])[:, :, 0].sum(axis=0)) / scale
    system += damping * np.eye(count) + 1e-15 * np.eye(count)
    return np.asarray(-np.linalg.solve(system, right) / scale)


_ROUNDS = 12
_ROBUST_STEPS = 2
_REACH = 4.0  # in standard deviations: a corner that far away has a quarter of its weight
_FLOOR_PX = 0.01
_MEDIAN_DISTANCE = 1.1774  # of a point scattered with a standard deviation of 1 along both axes
_ROBUST_SETTLED = 0.02


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
        state = adjust(state, stack.weighted(np.where(stack.weights > 0, weights, 0.0)), freedom, steps=_ROBUST_STEPS)
        if abs(before - sigma) <= _ROBUST_SETTLED * sigma:
            break
    return state
