"""Where a lens model's distortion folds back, so that two directions share a pixel."""

import numpy as np

from calib_core.arrays import Flags, Points2
from calib_core.camera import Camera
from calib_core.intrinsics.solving.view_stack import ViewStack

_PLACES = 24


def picture_places(size_px: tuple[int, int], columns: int = _PLACES, rows: int = _PLACES) -> Points2:
    """Return places all over a picture, its edges included: (rows * columns, 2) [px]."""
    x, y = np.meshgrid(np.linspace(0, size_px[0] - 1, columns), np.linspace(0, size_px[1] - 1, rows))
    return np.stack([x.ravel(), y.ravel()], axis=1)


def folds_back(camera: Camera, pixels_px: Points2) -> Flags:
    """Return at which pixels (n, 2) the lens has no ray, or one along which the picture runs backwards."""
    rays = camera.rays(pixels_px)
    wrong = ~np.isfinite(rays).all(axis=1)
    with np.errstate(all="ignore"):
        slopes = camera.project_with_jacobian(np.where(wrong[:, None], [0.0, 0.0, 1.0], rays))[1]
        turned = np.linalg.det(np.concatenate([slopes, rays[:, None, :]], axis=1))
    return np.asarray(wrong | ~(turned > 0))


def folds_where_seen(camera: Camera, stack: ViewStack) -> str:
    """Say if the distortion folds back within the circle about the principal point that the corners reach; "" if not."""
    found = np.moveaxis(stack.pixels_px, 1, 2)[stack.weights > 0]
    middle = camera.matrix_px[:2, 2]
    places = picture_places(stack.size_px)
    reach = np.linalg.norm(found - middle, axis=1).max()
    inside = places[np.linalg.norm(places - middle, axis=1) <= reach]
    if not len(inside):
        return "its principal point is outside the picture"
    if folds_back(camera, inside).any():
        return "its distortion folds back where corners were found"
    return ""
