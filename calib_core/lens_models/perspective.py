"""Lenses that distort the ideal image plane z = 1: projection with its Jacobian, and its inverse by Newton's method.

Such a lens model is one function, which maps an ideal point (x, y) = (X / Z, Y / Z) to a distorted one with its Jacobian.
"""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from calib_core.arrays import Points2, Points3, Values

Distort: TypeAlias = Callable[
    [Values, Values, list[float]], tuple[tuple[Values, Values], tuple[Values, Values, Values]]
]
"""Maps ideal x, y and coefficients to distorted x, y and the entries xx, xy = yx and yy of the symmetric Jacobian."""

_NEWTON_STEPS = 60
_NEWTON_TOLERANCE = 1e-13


def project_distorted(points: np.ndarray, k: list[float], distort: Distort) -> tuple[np.ndarray, np.ndarray]:
    """Project points in front of the camera to the image plane; the others become NaN.

    Args:
        points: (..., 3, n) in the camera frame.
        k: the coefficients.
        distort: the lens model.

    Returns:
        The image plane (..., 2, n) and d plane / d point (..., 3, 2, n).
    """
    depth = points[..., 2, :]
    inverse_z = 1.0 / np.where(depth > 0, depth, np.nan)
    x, y = points[..., 0, :] * inverse_z, points[..., 1, :] * inverse_z
    (distorted_x, distorted_y), (xx, xy, yy) = distort(x, y, k)
    plane = np.stack([distorted_x, distorted_y], axis=-2)
    jacobian = np.empty((*points.shape[:-1], 2, points.shape[-1]))
    jacobian[..., 0, 0, :] = xx * inverse_z
    jacobian[..., 0, 1, :] = jacobian[..., 1, 0, :] = xy * inverse_z
    jacobian[..., 1, 1, :] = yy * inverse_z
    along_x, along_y = jacobian[..., 0, :, :], jacobian[..., 1, :, :]
    jacobian[..., 2, :, :] = -(along_x * x[..., None, :] + along_y * y[..., None, :])
    return plane, jacobian


def unproject_distorted(plane: Points2, k: list[float], distort: Distort) -> Points3:
    """Return the unit rays (n, 3) of image-plane points (n, 2); NaN where the lens model has none.

    Args:
        plane: (n, 2).
        k: the coefficients.
        distort: the lens model.
    """
    ideal = _undistorted(plane, k, distort)
    rays = np.concatenate([ideal, np.ones((len(ideal), 1))], axis=1)
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def _undistorted(plane: Points2, k: list[float], distort: Distort) -> Points2:
    """Invert the lens model by Newton's method; NaN where the result does not map back to the image-plane point."""
    wanted_x, wanted_y = plane.T.copy()
    x, y = wanted_x, wanted_y
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON_STEPS):
            (distorted_x, distorted_y), (d_xx, d_xy, d_yy) = distort(x, y, k)
            error_x, error_y = distorted_x - wanted_x, distorted_y - wanted_y
            determinant = d_xx * d_yy - d_xy * d_xy
            step_x = (d_yy * error_x - d_xy * error_y) / determinant
            step_y = (d_xx * error_y - d_xy * error_x) / determinant
            length = np.hypot(step_x, step_y)
            damping = np.minimum(1.0, 0.5 / np.where(length > 0, length, 1.0))
            x, y = x - step_x * damping, y - step_y * damping
            if np.fmax.reduce(length, initial=0.0) < _NEWTON_TOLERANCE:  # NaN does not count
                break
        (distorted_x, distorted_y), _ = distort(x, y, k)
        missed = ~(np.hypot(distorted_x - wanted_x, distorted_y - wanted_y) < 1e-9)
    ideal = np.stack([x, y], axis=1)
    ideal[missed] = np.nan
    return ideal
