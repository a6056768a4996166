"""The Brown-Conrady lens models: `pinhole`, `plumb_bob` and `rational_polynomial`, which share one formula.

Lenses that distort the ideal image plane z = 1: projection with its Jacobian, and its inverse by Newton's method.

Such a lens model is one function, which maps an ideal point (x, y) = (X / Z, Y / Z) to a distorted one with its Jacobian.
"""

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np

from calib_core.arrays import Points2, Points3, Values
from calib_core.lens_models.lens_model import LensModel, NameElsewhere, TypicalLens

_COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")


def _project(points: np.ndarray, distortion: Values) -> tuple[np.ndarray, np.ndarray]:
    return project_distorted(points, _padded(distortion), _distort)


def _unproject(plane: Points2, distortion: Values) -> Points3:
    return unproject_distorted(plane, _padded(distortion), _distort)


def _coefficient_jacobian(points: np.ndarray, distortion: Values) -> np.ndarray:
    """Differentiate the image plane with respect to the eight coefficients: (..., 8, 2, n)."""
    k1, k2, _, _, k3, k4, k5, k6 = _padded(distortion)
    with np.errstate(all="ignore"):
        inverse_z = np.where(points[..., 2, :] > 0, 1.0 / points[..., 2, :], np.nan)
    x, y = points[..., 0, :] * inverse_z, points[..., 1, :] * inverse_z
    r2, xy2 = x * x + y * y, 2.0 * x * y
    bottom = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / bottom
    slopes = np.empty((*points.shape[:-2], 8, 2, points.shape[-1]))
    for row, component in enumerate((x, y)):
        for power, (above, below) in enumerate(((0, 5), (1, 6), (4, 7)), start=1):
            slopes[..., above, row, :] = component * r2**power / bottom
            slopes[..., below, row, :] = -radial * slopes[..., above, row, :]
    slopes[..., 2, 0, :] = slopes[..., 3, 1, :] = xy2
    slopes[..., 2, 1, :] = r2 + 2.0 * y * y
    slopes[..., 3, 0, :] = r2 + 2.0 * x * x
    return slopes


def _coefficient_jacobian_without(points: np.ndarray, _distortion: Values) -> np.ndarray:
    return np.empty((*points.shape[:-2], 0, 2, points.shape[-1]))


def _coefficient_jacobian_of_five(points: np.ndarray, distortion: Values) -> np.ndarray:
    return _coefficient_jacobian(points, distortion)[..., :5, :, :]


def _padded(distortion: Values) -> list[float]:
    return [*distortion.tolist(), *[0.0] * (8 - len(distortion))]


def _distort(x: Values, y: Values, k: list[float]) -> tuple[tuple[Values, Values], tuple[Values, Values, Values]]:
    """Distort ideal image-plane points by the rational Brown-Conrady model.

    Returns:
        The distorted x and y, and the entries xx, xy = yx and yy of the Jacobian, which is symmetric.
    """
    k1, k2, p1, p2, k3, k4, k5, k6 = k
    x2, y2, xy = x * x, y * y, x * y
    r2 = x2 + y2
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    d_radial = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2)  # d radial / d r2
    if k4 or k5 or k6:
        bottom = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
        radial = radial / bottom
        d_radial = (d_radial - radial * (k4 + r2 * (2.0 * k5 + 3.0 * k6 * r2))) / bottom
    distorted_x = x * radial + 2.0 * p1 * xy + p2 * (r2 + 2.0 * x2)
    distorted_y = y * radial + p1 * (r2 + 2.0 * y2) + 2.0 * p2 * xy
    d_xx = radial + 2.0 * x2 * d_radial + 2.0 * p1 * y + 6.0 * p2 * x
    d_yy = radial + 2.0 * y2 * d_radial + 6.0 * p1 * y + 2.0 * p2 * x
    d_xy = 2.0 * xy * d_radial + 2.0 * p1 * x + 2.0 * p2 * y
    return (distorted_x, distorted_y), (d_xx, d_xy, d_yy)


_brown_conrady = partial(LensModel, project=_project, unproject=_unproject, is_perspective=True, opencv="projectPoints")

PINHOLE = _brown_conrady(
    name="pinhole",
    coefficients=(),
    counts=(0,),
    coefficient_jacobian=_coefficient_jacobian_without,
    typical=TypicalLens(),
    names_elsewhere=(
        NameElsewhere("camera_info", "plumb_bob", 5),
        NameElsewhere("kalibr", "none", 0),
        NameElsewhere("opencv", "plumb_bob", 5),
        NameElsewhere("colmap", "PINHOLE", 0),
        NameElsewhere("foxglove", "plumb_bob", 5),
    ),
    names_in_files=("none", "pinhole"),
)

PLUMB_BOB = _brown_conrady(
    name="plumb_bob",
    coefficients=_COEFFICIENTS[:5],
    counts=(4, 5),
    coefficient_jacobian=_coefficient_jacobian_of_five,
    typical=TypicalLens((-0.17, 0.032, 0.0006, -0.0004, 0.0)),
    names_elsewhere=(
        NameElsewhere("camera_info", "plumb_bob", 5),
        NameElsewhere("kalibr", "radtan", 4),
        NameElsewhere("opencv", "plumb_bob"),
        NameElsewhere("colmap", "OPENCV", 4),
        NameElsewhere("colmap", "FULL_OPENCV", 8),
        NameElsewhere("foxglove", "plumb_bob", 5),
    ),
    names_in_files=("plumb_bob", "radtan", "brown_conrady"),
    names_in_messages=("plumb_bob", "radtan", "brown_conrady", ""),
)

RATIONAL_POLYNOMIAL = _brown_conrady(
    name="rational_polynomial",
    coefficients=_COEFFICIENTS,
    counts=(8,),
    coefficient_jacobian=_coefficient_jacobian,
    typical=TypicalLens((0.62, 0.21, 0.0005, -0.0003, 0.012, 0.79, 0.33, 0.045)),
    names_elsewhere=(
        NameElsewhere("camera_info", "rational_polynomial", 8),
        NameElsewhere("kalibr", "radtan", 4),
        NameElsewhere("opencv", "rational_polynomial", 8),
        NameElsewhere("colmap", "FULL_OPENCV", 8),
        NameElsewhere("foxglove", "rational_polynomial", 8),
    ),
    names_in_files=("rational_polynomial",),
    names_in_messages=("rational_polynomial",),
)


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
