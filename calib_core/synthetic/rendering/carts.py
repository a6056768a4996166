"""The cart behind a reflector, in the picture: a box of cardboard on a metal base."""

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.rendering.facets import Facet
from calib_core.synthetic.rendering.light import lit
from calib_core.synthetic.scene.scenes import Scene

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
