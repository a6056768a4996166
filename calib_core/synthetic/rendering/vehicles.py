"""Robot cars and cars in the picture: painted blocks on wheels."""

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.rendering.facets import Facet
from calib_core.synthetic.rendering.light import lit
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
