"""How far apart two cameras image the same rays, to notice that intrinsics belong to another camera."""

import numpy as np

from calib_core.camera import Camera

_GRID = 9


def largest_difference_px(a: Camera, b: Camera) -> float:
    """Return the largest distance [px] between the pixels of one ray, over the picture of the first camera.

    Infinite if the pictures have different sizes, or the second camera does not image a ray of the first.
    """
    if (a.width_px, a.height_px) != (b.width_px, b.height_px):
        return float("inf")
    columns, rows = np.linspace(0, a.width_px - 1, _GRID), np.linspace(0, a.height_px - 1, _GRID)
    pixels_px = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    rays = a.rays(pixels_px)
    seen = np.isfinite(rays).all(axis=1)
    apart_px = np.linalg.norm(b.project(rays[seen]) - pixels_px[seen], axis=1)
    return float(np.where(np.isfinite(apart_px), apart_px, np.inf).max(initial=0.0))
