"""Light and exposure: the sun, the sky, and the conversion of linear light to grey levels."""

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.scene.scenes import Scene

SUN = np.array([1.34, 1.24, 1.06], dtype=np.float32)
SKY = np.array([0.25, 0.295, 0.365], dtype=np.float32)
_LAMPS = np.array([0.62, 0.61, 0.58], dtype=np.float32)
_BOUNCE = np.array([0.52, 0.51, 0.49], dtype=np.float32)


def sun_direction(scene: Scene) -> Vector3:
    """Return the direction towards the light: (3,) in the world."""
    azimuth, elevation = np.deg2rad(scene.sun_azimuth_deg), np.deg2rad(scene.sun_elevation_deg)
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])


def lit(scene: Scene, normals: np.ndarray, direct: np.ndarray) -> np.ndarray:
    """Return the light (n, 3) that falls on surfaces.

    Args:
        scene: its light; under a ceiling, lamps and reflections from the walls.
        normals: (n, 3) unit vectors in the world.
        direct: (n,) share of the sun that reaches them, cosine included.
    """
    indoors = scene.ceiling_m > 0.0
    ambient, source = (_BOUNCE, _LAMPS) if indoors else (SKY, SUN)
    up = 0.72 + 0.28 * normals[:, 2]
    return ambient * up[:, None] + source * direct[:, None]


def display(linear: np.ndarray) -> np.ndarray:
    """Convert linear light to grey levels 0 to 255 (float), with a soft shoulder at the bright end."""
    x = np.maximum(linear, 0.0) * np.float32(0.92)
    x = np.where(x > 0.6, 0.6 + 0.4 * np.tanh((x - 0.6) / 0.4), x)
    return np.float32(255.0) * np.power(x, np.float32(1.0 / 2.2))
