"""Whether the board is bent or its squares are longer one way, as far as the views show it; and whether views are
skewed along their rows, as a board that moves under a rolling shutter is.
"""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Values, freeze
from calib_core.intrinsics.adjustment import adjust, reduced, shared_covariance
from calib_core.intrinsics.linearization import BoardWarp, Freedom, LensState, ViewStack, linearize, warped
from calib_core.intrinsics.model_choice import LensFit

_CHANCE = 1e-4
_BENDS = 3  # the first warps are of one kind, heights; the last is of lengths


@dataclass(frozen=True, slots=True, eq=False)
class ShapeTest:
    """The warps of a board, tried all at once.

    Attributes:
        found: those that the views show; none if the board is as stated.
        amounts: (4,) of all that were tried.
        sigmas: (4,) of the same.
        lens_change: (p,) how much all of them together change the parameters of the camera.
    """

    found: BoardWarp
    amounts: Values
    sigmas: Values
    lens_change: Values

    def __post_init__(self) -> None:
        freeze(self, amounts=(None,), sigmas=(None,), lens_change=(None,))


def try_shapes(fit: LensFit, stack: ViewStack, warps: BoardWarp) -> ShapeTest:
    """Estimate all warps together with the lens, and keep those that chance explains in less than one case of 10 000.

    Args:
        fit: to a board as stated.
        stack: the views.
        warps: those of `possible_warps`.
    """
    flat = fit.state
    freedom = replace(fit.freedom, warp=warps)
    state = adjust(LensState(flat.camera, flat.rotations, flat.translations_m), stack, freedom)
    covariance = shared_covariance(reduced(linearize(state, stack, freedom)))
    first = fit.freedom.lens.shape[1]
    unlikely = covariance.chances(state.amounts, first) < _CHANCE
    keep = np.full(len(warps), bool(unlikely[:_BENDS].any()))
    keep[_BENDS:] = unlikely[_BENDS:]
    warp = BoardWarp(tuple(np.array(warps.names)[keep]), warps.directions[keep])
    sigmas = np.sqrt(np.diag(covariance.matrix)[first:])
    return ShapeTest(warp, state.amounts, sigmas, state.camera.parameters - flat.camera.parameters)


_LEAST_SHARE = 0.2
_LEAST_RATIO = 1.4  # correlated noise reaches 1.3; a wrong lens model may exceed it too


@dataclass(frozen=True, slots=True, eq=False)
class RowSkew:
    """How views are skewed.

    Attributes:
        skews_px: (v,) how far the image's last row is displaced against the first, as far as a pose does not explain it.
        share: of the squared residuals that skews explain.
        other_share: that an equally free smooth pattern explains, which motion does not make.
    """

    skews_px: Values
    share: float
    other_share: float

    def __post_init__(self) -> None:
        freeze(self, skews_px=(None,))

    @property
    def shows(self) -> bool:
        """Whether the views are skewed more than other smooth errors bend them."""
        return self.share > _LEAST_SHARE and self.share > _LEAST_RATIO * self.other_share


def row_skew(fit: LensFit, stack: ViewStack) -> RowSkew:
    """Fit to each view's residuals a displacement that grows from row to row, besides its pose.

    Args:
        fit: of the lens.
        stack: the views.
    """
    flat = warped(stack, fit.freedom.warp, fit.state.amounts)
    state = LensState(fit.state.camera, fit.state.rotations, fit.state.translations_m)
    at = linearize(state, flat, Freedom.none(state.camera))
    across, down = (stack.pixels_px[:, axis] / stack.size_px[axis] - 0.5 for axis in (0, 1))
    middle = [_centred(values, stack.weights) for values in (across, down)]
    skews, share = _explained(at.residuals, at.poses, down, stack.weights)
    _, other = _explained(at.residuals, at.poses, middle[0] * middle[1], stack.weights)
    return RowSkew(np.linalg.norm(skews, axis=1), share, other)


def _centred(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return values (v, m) without their mean over each view's corners."""
    return np.asarray(values - (values * weights).sum(axis=1, keepdims=True) / weights.sum(axis=1, keepdims=True))


def _explained(
    residuals: np.ndarray, poses: np.ndarray, pattern: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, float]:
    """Fit a pattern (v, m) to both axes of each view's residuals, besides its pose: amounts (v, 2), and the share explained."""
    root = np.sqrt(weights)
    zero = np.zeros_like(pattern)
    both = np.stack(
        [np.concatenate([pattern * root, zero], axis=1), np.concatenate([zero, pattern * root], axis=1)], axis=1
    )
    poses_t = np.swapaxes(poses, 1, 2)
    own = poses @ poses_t
    both = both - np.swapaxes(np.linalg.solve(own, poses @ np.swapaxes(both, 1, 2)), 1, 2) @ poses
    left = residuals - (poses_t @ np.linalg.solve(own, poses @ residuals[:, :, None]))[:, :, 0]
    right = (both @ left[:, :, None])[:, :, 0]
    amounts = np.linalg.solve(both @ np.swapaxes(both, 1, 2), right[:, :, None])[:, :, 0]
    return amounts, float((amounts * right).sum() / max(float(np.square(left).sum()), 1e-300))
