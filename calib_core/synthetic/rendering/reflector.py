"""Trihedral corner reflectors in the picture: of triangles, and of squares on a pole.

Three square-cut facets meet at the apex. The apex is the phase centre: every path with three bounces is as long as the
path to the apex and back. It is the point to click, and the reflector's position in truth.json.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, Vector3
from calib_core.synthetic.rendering.surfaces import lit
from calib_core.synthetic.scene.person import Capsule
from calib_core.synthetic.scene.scenes import USUAL_EDGE_M, Scene

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


_BASE_HALF_M = 0.095
_GROUND_STAND_M = 0.35
_ALUMINIUM = np.array([0.80, 0.82, 0.85], dtype=np.float32)
_ORANGE = np.array([0.92, 0.23, 0.02], dtype=np.float32)
_RIM = np.array([0.95, 0.96, 0.97], dtype=np.float32)
_FACET_LEVEL = (0.62, 1.0, 0.36)
"""How bright the lower, the left and the right facet are: polished sheets show sky, sun and ground."""


def apex_edges(facing_rad: float, elevation_rad: float) -> np.ndarray:
    """Return the edges from the apex as unit rows (3, 3): up, lower left, lower right, as seen by a viewer in front."""
    c, s = np.cos(facing_rad), np.sin(facing_rad)
    ce, se = np.cos(elevation_rad), np.sin(elevation_rad)
    axis = np.array([ce * c, ce * s, se])
    up = np.array([-se * c, -se * s, ce])
    right = np.array([-s, c, 0.0])  # of that viewer, who looks against the axis
    turns = np.deg2rad([0.0, 120.0, 240.0])
    around = np.cos(turns)[:, None] * up - np.sin(turns)[:, None] * right
    return axis / np.sqrt(3.0) + np.sqrt(2.0 / 3.0) * around


def reflector_facets(
    apex_m: Vector3,
    facing_rad: float,
    *,
    scene: Scene,
    towards: Vector3,
    eye_m: Vector3,
    ground_stand: bool,
    edge_m: float = USUAL_EDGE_M,
) -> list[Facet]:
    """Build the polygons of reflector and base block, farthest first.

    Args:
        apex_m: (3,) in the world.
        facing_rad: heading it faces.
        scene: for its light.
        towards: (3,) direction of the sun.
        eye_m: (3,) the camera.
        ground_stand: whether it sits on its block (else on a tripod).
        edge_m: length of the three edges that meet at the apex.
    """
    edges = edge_m * apex_edges(facing_rad, np.deg2rad(9.0))
    facets: list[Facet] = []
    if ground_stand:
        facets += _base(apex_m, edges, facing_rad, scene, towards, eye_m)
    up, left, right = edges
    for level, (one, two) in zip(_FACET_LEVEL, ((left, right), (up, left), (right, up)), strict=True):
        facets += _sheet(apex_m, one, two, level, eye_m)
    return facets


def _sheet(apex: Vector3, one: Vector3, two: Vector3, level: float, eye: Vector3) -> list[Facet]:
    """Build a triangular sheet with a gradient from apex to rim and a bright cut edge."""
    inside = np.cross(one, two)
    if float(inside @ (eye - apex)) < 0.0:  # seen from behind: the painted back
        return [Facet(subdivided(apex + np.array([np.zeros(3), one, two])), 0.22 * _ALUMINIUM)]
    facets = []
    for share in np.linspace(1.0, 0.14, 9):  # nested triangles: darker into the corner
        gradient = 0.70 + 0.30 * share
        corners = apex + share * np.array([np.zeros(3), one, two])
        facets.append(Facet(subdivided(corners), level * gradient * _ALUMINIUM))
    rim = apex + np.array([one, two, 0.955 * two, 0.955 * one])
    return [*facets, Facet(subdivided(rim), (0.35 + 0.65 * level) * _RIM)]


def _base(
    apex: Vector3, edges: np.ndarray, facing_rad: float, scene: Scene, towards: Vector3, eye: Vector3
) -> list[Facet]:
    """Build the orange block below, from the ground to the sheets' lowest corner."""
    forward = np.array([np.cos(facing_rad), np.sin(facing_rad), 0.0])
    left = np.array([-forward[1], forward[0], 0.0])
    top = apex[2] + float(edges[:, 2].min()) - 0.004
    bottom = top - 0.125
    centre = apex + 0.055 * forward
    normals = [forward, left, -forward, -left, np.array([0.0, 0.0, 1.0])]
    facets = []
    for normal in normals:
        if abs(normal[2]) > 0.5:
            ring = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
            corners = np.array([centre + _BASE_HALF_M * (a * forward + b * left) for a, b in ring])
            corners[:, 2] = top
        else:
            across = np.cross([0.0, 0.0, 1.0], normal)
            middle = centre + _BASE_HALF_M * normal
            corners = np.array([middle + _BASE_HALF_M * s * across for s in (-1.0, 1.0, 1.0, -1.0)])
            corners[:, 2] = [bottom, bottom, top, top]
        if float(normal @ (eye - corners.mean(axis=0))) <= 0.0:
            continue
        light = lit(scene, normal[None], np.array([max(0.0, float(normal @ towards))]))[0]
        facets.append(Facet(subdivided(corners), _ORANGE * light))
        if abs(normal[2]) < 0.5:  # a white band for visibility
            band = corners.copy()
            band[:, 2] = [bottom + 0.045, bottom + 0.045, bottom + 0.075, bottom + 0.075]
            facets.append(Facet(subdivided(band), np.array([0.85, 0.85, 0.83]) * light))
    return facets


def stand_limbs(apex_m: Vector3, *, at_rest: bool) -> tuple[Capsule, ...]:
    """Build the tripod below a raised reflector; folded while it is carried."""
    hub = apex_m - np.array([0.0, 0.0, 0.11])
    limbs = [Capsule(hub, hub + np.array([0.0, 0.0, 0.05]), 0.022, 0.018, "shoe")]
    for turn in np.deg2rad([30.0, 150.0, 270.0]):
        out = np.array([np.cos(turn), np.sin(turn), 0.0])
        foot = hub + 0.42 * min(1.0, hub[2] / 0.9) * out if at_rest else hub + 0.03 * out
        foot = np.array([foot[0], foot[1], 0.012 if at_rest else hub[2] - 0.6])
        limbs.append(Capsule(hub, foot, 0.014, 0.010, "shoe"))
    return tuple(limbs)


def on_block(height_m: float) -> bool:
    """Return whether a reflector whose apex rests at this height sits on its block (else on a tripod)."""
    return height_m < _GROUND_STAND_M


def shadow_limbs(apex_m: Vector3, facing_rad: float, edge_m: float = USUAL_EDGE_M) -> tuple[Capsule, ...]:
    """Return capsules that cast about the same shadow as sheets and block."""
    edges = edge_m * apex_edges(facing_rad, np.deg2rad(9.0))
    tips = apex_m + edges
    centre = np.array([apex_m[0] + 0.055 * np.cos(facing_rad), apex_m[1] + 0.055 * np.sin(facing_rad), 0.0])
    bottom = centre + np.array([0.0, 0.0, max(0.05, float(tips[:, 2].min()) - 0.09)])
    limbs = [Capsule(apex_m, tip, 0.045, 0.02, "shoe") for tip in tips]
    return (*limbs, Capsule(bottom, bottom + np.array([0.0, 0.0, 0.03]), 0.085, 0.085, "shoe"))


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
