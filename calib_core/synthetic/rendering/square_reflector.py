"""Another reflector in the picture: three square sheets with one edge down, on a pole.

The apex is where the sheets meet, as in the one of triangles, and its echo is the same.
"""

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.rendering.facets import Facet, subdivided
from calib_core.synthetic.scene.person import Capsule

_STEEL = np.array([0.46, 0.48, 0.50], dtype=np.float32)
_PAINT = np.array([0.10, 0.16, 0.30], dtype=np.float32)
_SHEET_LEVEL = (0.30, 0.95, 0.60)
"""How bright the upper, the left and the right sheet are."""
_LEAN_RAD = np.deg2rad(14.0)
_NESTED = 5
_POLE_M, _FOOT_M = 0.016, 0.06
_CARRIED_M = 0.35


def square_edges(facing_rad: float, edge_m: float) -> np.ndarray:
    """Return the edges from the apex (3, 3): down, upper left, upper right, as seen by a viewer in front."""
    c, s, ce, se = np.cos(facing_rad), np.sin(facing_rad), np.cos(_LEAN_RAD), np.sin(_LEAN_RAD)
    axis = np.array([ce * c, ce * s, se])
    up = np.array([-se * c, -se * s, ce])
    right = np.array([-s, c, 0.0])
    turns = np.deg2rad([180.0, 60.0, -60.0])
    around = np.cos(turns)[:, None] * up - np.sin(turns)[:, None] * right
    return np.asarray(edge_m * (axis / np.sqrt(3.0) + np.sqrt(2.0 / 3.0) * around))


def square_facets(apex_m: Vector3, facing_rad: float, *, eye_m: Vector3, edge_m: float) -> list[Facet]:
    """Build the three sheets.

    Args:
        apex_m: (3,) in the world.
        facing_rad: heading it faces.
        eye_m: (3,) the camera.
        edge_m: length of the edges that meet at the apex, and of the squares.
    """
    down, left, right = square_edges(facing_rad, edge_m)
    facets: list[Facet] = []
    for level, (one, two) in zip(_SHEET_LEVEL, ((left, right), (down, left), (right, down)), strict=True):
        square = np.array([np.zeros(3), one, one + two, two])
        seen_inside = (
            float(np.cross(one, two) @ (eye_m - apex_m)) * float(np.cross(one, two) @ (left + right + down)) > 0.0
        )
        if not seen_inside:
            facets.append(Facet(subdivided(apex_m + square), _PAINT))
            continue
        for share in np.linspace(1.0, 0.2, _NESTED):
            colour = level * (0.8 + 0.2 * share) * _STEEL
            facets.append(Facet(subdivided(apex_m + share * square), colour.astype(np.float32)))
    return facets


def pole_limbs(apex_m: Vector3, facing_rad: float, edge_m: float, *, at_rest: bool) -> tuple[Capsule, ...]:
    """Build the pole below the lowest corner, with its foot while it stands."""
    top = apex_m + square_edges(facing_rad, edge_m)[0]
    bottom = top * [1.0, 1.0, 0.0] if at_rest else top - [0.0, 0.0, _CARRIED_M]
    pole = Capsule(top, bottom, _POLE_M, _POLE_M, "stripe")
    if not at_rest:
        return (pole,)
    return (pole, Capsule(bottom, bottom + np.array([0.0, 0.0, 0.01]), _FOOT_M, 0.03, "trousers"))
