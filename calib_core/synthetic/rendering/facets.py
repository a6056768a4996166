"""Flat polygons of one colour, of which reflectors are made."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3

_STEPS = 6


@dataclass(frozen=True, slots=True, eq=False)
class Facet:
    """A flat polygon with one colour.

    Attributes:
        corners_m: (n, 3) in the world, outline subdivided so that lens distortion can bend it.
        colour: (3,) linear.
    """

    corners_m: Points3
    colour: np.ndarray


def subdivided(corners: np.ndarray) -> np.ndarray:
    """Insert points between the corners of an outline."""
    shares = np.arange(_STEPS)[:, None] / _STEPS
    following = np.roll(corners, -1, axis=0)
    return np.concatenate([a + shares * (b - a) for a, b in zip(corners, following, strict=True)])
