"""What is behind the board: a cluttered room, so that a detector has something to mistake for a board."""

import numpy as np

from calib_core.camera import Camera

_OCTAVES_PX = ((160, 28.0), (40, 14.0), (9, 6.0))
_THINGS = 14


def room_behind(rng: np.random.Generator, camera: Camera) -> np.ndarray:
    """Draw grey levels (h, w), float32: clouds of three sizes, and things with straight edges."""
    import cv2

    width, height = camera.width_px, camera.height_px
    levels = np.full((height, width), 110.0, dtype=np.float32)
    for size, strength in _OCTAVES_PX:
        small = rng.standard_normal((height // size + 3, width // size + 3), dtype=np.float32)
        levels += np.float32(strength) * cv2.resize(small, (width, height), interpolation=cv2.INTER_CUBIC)
    for _ in range(_THINGS):
        u, v = rng.uniform([0.0, 0.0], [width, height]).tolist()
        long, wide = (rng.uniform(0.02, 0.22, 2) * width).tolist()
        corners = cv2.boxPoints(((u, v), (long, wide), float(rng.uniform(0.0, 180.0))))
        cv2.fillConvexPoly(levels, np.round(corners).astype(np.int32), (float(rng.uniform(30.0, 210.0)),))
    return np.clip(levels, 5.0, 245.0)
