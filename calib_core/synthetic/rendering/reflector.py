"""The trihedral corner reflector in the image, and faces of other things.

Three square-cut facets meet at the apex. The apex is the phase centre: every path with three bounces is as long as the
path to the apex and back. It is the point to click, and the reflector's position in truth.json.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, Vector3
from calib_core.synthetic.rendering.surfaces import lit
from calib_core.synthetic.scene.person import Capsule
from calib_core.synthetic.scene.scenes import Scene

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


def subdivided(corners: np.ndarray, steps: int = _STEPS) -> np.ndarray:
    """Insert points between the corners of an outline."""
    shares = np.arange(steps)[:, None] / steps
    following = np.roll(corners, -1, axis=0)
    return np.concatenate([a + shares * (b - a) for a, b in zip(corners, following, strict=True)])


def lit_facet(
    corners_m: Points3, normal: Vector3, colour: np.ndarray, scene: Scene, eye_m: Vector3, *, steps: int = 1
) -> list[Facet]:
    """Return a painted face with its light, if the camera sees its outside.

    Args:
        corners_m: (n, 3) in the world.
        normal: (3,) outward.
        colour: (3,) linear.
        scene: for its light.
        eye_m: (3,) the camera.
        steps: into which each edge is divided.
    """
    if float(normal @ (eye_m - corners_m.mean(axis=0))) <= 0.0:
        return []
    light = lit(scene, normal[None], np.array([max(0.0, float(normal @ scene.towards_sun))]))[0]
    return [Facet(subdivided(corners_m, steps), colour * light)]


_BASE_HALF_M = 0.095
_ALUMINIUM = np.array([0.80, 0.82, 0.85], dtype=np.float32)
_ORANGE = np.array([0.92, 0.23, 0.02], dtype=np.float32)
_WHITE = np.array([0.85, 0.85, 0.83])
_RIM = np.array([0.95, 0.96, 0.97], dtype=np.float32)
_FACET_LEVEL = (0.62, 1.0, 0.36)
"""How bright the lower, the left and the right facet are: polished sheets show sky, sun and ground."""
_LEAN_RAD = np.deg2rad(9.0)


def apex_edges(facing_rad: float, elevation_rad: float = _LEAN_RAD) -> np.ndarray:
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
    apex_m: Vector3, facing_rad: float, *, scene: Scene, eye_m: Vector3, grounded: bool, edge_m: float
) -> list[Facet]:
    """Build the polygons of reflector and base block, farthest first.

    Args:
        apex_m: (3,) in the world.
        facing_rad: heading it faces.
        scene: for its light.
        eye_m: (3,) the camera.
        grounded: whether it sits on its block (else on a tripod).
        edge_m: length of the three edges that meet at the apex.
    """
    edges = edge_m * apex_edges(facing_rad)
    facets = _base(apex_m, edges, facing_rad, scene, eye_m) if grounded else []
    up, left, right = edges
    for level, (one, two) in zip(_FACET_LEVEL, ((left, right), (up, left), (right, up)), strict=True):
        facets += _sheet(apex_m, one, two, level, eye_m)
    return facets


def _sheet(apex: Vector3, vector3: Vector3, two: Vector3, level: float, eye: Vector3) -> list[Facet]:
    """Build a triangular sheet with a gradient from apex to rim and a bright cut edge."""
    triangle = np.array([np.zeros(3), vector3, two])
    if float(np.cross(vector3, two) @ (eye - apex)) < 0.0:  # seen from behind: the painted back
        return [Facet(subdivided(apex + triangle), 0.22 * _ALUMINIUM)]
    facets = []
    for share in np.linspace(1.0, 0.14, 9):  # nested triangles: darker into the corner
        gradient = 0.70 + 0.30 * share
        facets.append(Facet(subdivided(apex + share * triangle), level * gradient * _ALUMINIUM))
    rim = apex + np.array([vector3, two, 0.955 * two, 0.955 * vector3])
    return [*facets, Facet(subdivided(rim), (0.35 + 0.65 * level) * _RIM)]


def _base(apex: Vector3, edges: np.ndarray, facing_rad: float, scene: Scene, eye: Vector3) -> list[Facet]:
    """Build the orange block below, from the ground to the sheets' lowest corner, with a white band for visibility."""
    forward = np.array([np.cos(facing_rad), np.sin(facing_rad), 0.0])
    left, up = np.array([-forward[1], forward[0], 0.0]), np.array([0.0, 0.0, 1.0])
    top = apex[2] + float(edges[:, 2].min()) - 0.004
    bottom = top - 0.125
    centre = apex + 0.055 * forward
    facets = []
    for normal in (forward, left, -forward, -left):
        across = np.cross(up, normal)
        middle = centre + _BASE_HALF_M * normal
        corners = np.array([middle + _BASE_HALF_M * s * across for s in (-1.0, 1.0, 1.0, -1.0)])
        for low, high, colour in ((bottom, top, _ORANGE), (bottom + 0.045, bottom + 0.075, _WHITE)):
            ring = corners.copy()
            ring[:, 2] = [low, low, high, high]
            facets += lit_facet(ring, normal, colour, scene, eye, steps=_STEPS)
    lid = np.array([centre + _BASE_HALF_M * (a * forward + b * left) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))])
    lid[:, 2] = top
    return [*facets, *lit_facet(lid, up, _ORANGE, scene, eye, steps=_STEPS)]


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


def shadow_limbs(apex_m: Vector3, facing_rad: float, edge_m: float) -> tuple[Capsule, ...]:
    """Return capsules that cast about the same shadow as sheets and block."""
    tips = apex_m + edge_m * apex_edges(facing_rad)
    centre = np.array([apex_m[0] + 0.055 * np.cos(facing_rad), apex_m[1] + 0.055 * np.sin(facing_rad), 0.0])
    bottom = centre + np.array([0.0, 0.0, max(0.05, float(tips[:, 2].min()) - 0.09)])
    limbs = [Capsule(apex_m, tip, 0.045, 0.02, "shoe") for tip in tips]
    return (*limbs, Capsule(bottom, bottom + np.array([0.0, 0.0, 0.03]), 0.085, 0.085, "shoe"))
