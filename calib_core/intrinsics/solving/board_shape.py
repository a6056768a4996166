"""Whether the board is bent or its squares are longer one way, as far as the views show it."""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Values, frozen_array
from calib_core.intrinsics.solving.adjustment import adjust, reduced
from calib_core.intrinsics.solving.lens_covariance import shared_covariance
from calib_core.intrinsics.solving.linearization import BoardWarp, LensState, ViewStack, linearize
from calib_core.intrinsics.solving.model_choice import LensFit

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
        for name in ("amounts", "sigmas", "lens_change"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (None,)))


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
    found = BoardWarp(tuple(np.array(warps.names)[keep]), warps.directions[keep])
    sigmas = np.sqrt(np.diag(covariance.matrix)[first:])
    return ShapeTest(found, state.amounts, sigmas, state.camera.parameters - flat.camera.parameters)
