"""Robot cars, cars and carts in the picture: painted blocks on wheels, and the box of cardboard behind a reflector."""

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.rendering.light import lit
from calib_core.synthetic.rendering.reflector import Facet
from calib_core.synthetic.scene.person import Capsule
from calib_core.synthetic.scene.scenes import Scene
from calib_core.synthetic.scene.vehicles import Colour, Part, VehicleState, vehicle_parts

_COLOURS: dict[Colour, tuple[float, float, float]] = {
    "paint": (0.0, 0.0, 0.0),
    "glass": (0.030, 0.040, 0.050),
    "dark": (0.030, 0.030, 0.032),
    "orange": (0.85, 0.25, 0.03),
    "lamp": (0.85, 0.85, 0.80),
    "tail": (0.55, 0.02, 0.02),
}
_PAINTS = ((0.45, 0.03, 0.03), (0.60, 0.61, 0.62), (0.04, 0.10, 0.32), (0.75, 0.74, 0.70), (0.05, 0.22, 0.10))
"""Of the first car, the second and so on."""
_STEPS = 4


def vehicle_facets(state: VehicleState, *, scene: Scene, towards: Vector3, eye_m: Vector3) -> list[Facet]:
    """Build the visible faces of a vehicle, in the order in which they cover one another.

    Args:
        state: the vehicle.
        scene: for its light.
        towards: (3,) direction of the sun.
        eye_m: (3,) the camera.
    """
    facets = []
    for part in vehicle_parts(state):
        if float(part.normal @ (eye_m - part.corners_m.mean(axis=0))) <= 0.0:
            continue
        light = lit(scene, part.normal[None], np.array([max(0.0, float(part.normal @ towards))]))[0]
        paint = _PAINTS[(state.number - 1) % len(_PAINTS)] if part.colour == "paint" else _COLOURS[part.colour]
        facets.append(Facet(_subdivided(part), np.array(paint, dtype=np.float32) * light))
    return facets


def _subdivided(part: Part) -> np.ndarray:
    """Insert points between the corners of an outline, so that lens distortion can bend it."""
    shares = np.arange(_STEPS)[:, None] / _STEPS
    following = np.roll(part.corners_m, -1, axis=0)
    return np.concatenate([a + shares * (b - a) for a, b in zip(part.corners_m, following, strict=True)])


def vehicle_shadow(state: VehicleState) -> tuple[Capsule, ...]:
    """Return capsules that cast about a vehicle's shadow."""
    length, width, height = state.size_m
    radius = min(0.5 * height, 0.28 * width)
    reach = 0.5 * length - radius
    limbs = []
    for side in (-1.0, 0.0, 1.0):
        ends = state.world(np.array([[s * reach, side * (0.5 * width - radius), 0.45 * height] for s in (-1.0, 1.0)]))
        limbs.append(Capsule(ends[0], ends[1], radius, radius, "shoe"))
    return tuple(limbs)


_METAL = (0.55, 0.57, 0.60)
_CARDBOARD = (0.50, 0.36, 0.20)
_PARTS = (((0.35, 0.25, 0.12, 0.22), _METAL), ((0.30, 0.22, 0.22, 0.85), _CARDBOARD))
"""Half length, half width, bottom and top of each part [m], and its colour."""


def cart_facets(echo_m: Vector3, *, scene: Scene, towards: Vector3, eye_m: Vector3) -> list[Facet]:
    """Build the visible faces of a cart around its echo, lower part first.

    Args:
        echo_m: (3,) where the radar sees it, in the world.
        scene: for its light.
        towards: (3,) direction of the sun.
        eye_m: (3,) the camera.
    """
    heading_rad = float(np.arctan2(echo_m[1], echo_m[0]))
    forward = np.array([np.cos(heading_rad), np.sin(heading_rad), 0.0])
    left = np.array([-forward[1], forward[0], 0.0])
    facets: list[Facet] = []
    for (half_length_m, half_width_m, bottom_m, top_m), colour in _PARTS:
        sides = [half_length_m * forward, half_width_m * left, -half_length_m * forward, -half_width_m * left]
        centre = np.array([echo_m[0], echo_m[1], 0.0])
        for one, other in zip(sides, [*sides[1:], sides[0]], strict=True):
            ring = np.array([centre + one - other, centre + one + other, centre + one + other, centre + one - other])
            ring[:, 2] = [bottom_m, bottom_m, top_m, top_m]
            facets += _face(ring, one / np.linalg.norm(one), colour, scene, towards, eye_m)
        top = np.array([centre + a + b for a, b in ((sides[0], sides[1]), (sides[0], sides[3]))])
        top = np.concatenate([top, [centre + sides[2] + sides[3], centre + sides[2] + sides[1]]])
        top[:, 2] = top_m
        facets += _face(top, np.array([0.0, 0.0, 1.0]), colour, scene, towards, eye_m)
    return facets


def _face(
    corners_m: np.ndarray, normal: Vector3, colour: tuple[float, ...], scene: Scene, towards: Vector3, eye_m: Vector3
) -> list[Facet]:
    """Return one face with its light, if the camera sees its outside."""
    if float(normal @ (eye_m - corners_m.mean(axis=0))) <= 0.0:
        return []
    light = lit(scene, normal[None], np.array([max(0.0, float(normal @ towards))]))[0]
    return [Facet(corners_m, np.array(colour, dtype=np.float32) * light)]
