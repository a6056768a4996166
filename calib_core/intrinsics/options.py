"""Options of calibrating a lens."""

from dataclasses import dataclass
from typing import Literal

from calib_core.options import option


@dataclass(frozen=True, slots=True)
class IntrinsicsOptions:
    """How a lens is calibrated."""

    model: Literal["auto", "pinhole", "plumb_bob", "rational_polynomial", "equidistant"] = option(
        "auto", "Lens model; auto takes the simplest that predicts views it has not seen as well as any."
    )
    board_shape: Literal["auto", "flat"] = option(
        "auto", "Shape of the board; auto estimates bending and unequal sides of the squares where the views show them."
    )
    robust: bool = option(True, "Leave out views and corners that contradict the others.")
    square_pixels: bool = option(False, "Estimate one focal length for rows and columns.")
