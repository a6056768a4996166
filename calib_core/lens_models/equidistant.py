"""The equidistant (Kannala-Brandt) lens model of OpenCV's fisheye module: the radius is a function of the angle from the axis."""

import numpy as np

from calib_core.arrays import Points2, Points3, Values
from calib_core.lens_models.lens_model import LensModel, NameElsewhere, TypicalLens

_NEWTON_STEPS = 60
_NEWTON_TOLERANCE = 1e-13


def _distorted_angle(theta: Values, k: Values) -> tuple[Values, Values]:
    """Return the distorted angle theta_d of OpenCV's fisheye model, and its derivative."""
    k1, k2, k3, k4 = k
    t2 = theta * theta
    distorted = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
    slope = 1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)))
    return distorted, slope


def _project(points: np.ndarray, k: Values) -> tuple[np.ndarray, np.ndarray]:
    """Project points (..., 3, n) by OpenCV's fisheye model: image plane (..., 2, n) and Jacobian (..., 3, 2, n)."""
    x, y, z = points[..., 0, :], points[..., 1, :], points[..., 2, :]
    a = np.hypot(x, y)
    n2 = a * a + z * z
    theta = np.arctan2(a, z)
    distorted, slope = _distorted_angle(theta, k)
    on_axis = a < 1e-12 * np.maximum(np.abs(z), 1e-300)
    safe_a = np.where(on_axis, 1.0, a)
    safe_n2 = np.where(n2 > 0, n2, np.nan)
    scale = np.where(on_axis, 1.0 / np.where(z > 0, z, np.nan), distorted / safe_a)  # plane = scale * (x, y)
    # d scale / d a = (slope * z / n2 - scale) / a ; d scale / d z = -slope / n2
    d_scale_a = np.where(on_axis, 0.0, (slope * z / safe_n2 - scale) / safe_a)
    d_scale_z = -slope / safe_n2
    cos_a, sin_a = np.where(on_axis, 0.0, x / safe_a), np.where(on_axis, 0.0, y / safe_a)
    jacobian = np.empty((*points.shape[:-1], 2, points.shape[-1]))
    for row, component in enumerate((x, y)):
        jacobian[..., 0, row, :] = component * d_scale_a * cos_a
        jacobian[..., 1, row, :] = component * d_scale_a * sin_a
        jacobian[..., row, row, :] += scale
        jacobian[..., 2, row, :] = component * d_scale_z
    return np.stack([scale * x, scale * y], axis=-2), jacobian


def _coefficient_jacobian(points: np.ndarray, _k: Values) -> np.ndarray:
    """Differentiate the image plane with respect to the four coefficients: (..., 4, 2, n)."""
    x, y, z = points[..., 0, :], points[..., 1, :], points[..., 2, :]
    a = np.hypot(x, y)
    theta = np.arctan2(a, z)
    direction = np.stack([x, y], axis=-2) / np.where(a > 0, a, 1.0)[..., None, :]
    powers = np.stack([theta**3, theta**5, theta**7, theta**9], axis=-2)
    return np.asarray(powers[..., :, None, :] * direction[..., None, :, :])


def _unproject(plane: Points2, k: Values) -> Points3:
    """Invert OpenCV's fisheye model by Newton's method on the angle."""
    distorted = np.linalg.norm(plane, axis=1)
    theta = np.minimum(distorted, np.pi / 2)
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON_STEPS):
            value, slope = _distorted_angle(theta, k)
            step = np.clip((value - distorted) / slope, -0.3, 0.3)
            theta = theta - step
            if np.nanmax(np.abs(step), initial=0.0) < _NEWTON_TOLERANCE:
                break
        value, slope = _distorted_angle(theta, k)
        wrong = ~(np.abs(value - distorted) < 1e-9) | ~(slope > 0) | (theta < 0) | (theta > np.pi)
    direction = plane / np.where(distorted > 0, distorted, 1.0)[:, None]
    rays = np.concatenate([np.sin(theta)[:, None] * direction, np.cos(theta)[:, None]], axis=1)
    rays[wrong] = np.nan
    return rays


def _angle(angle_rad: float) -> float:
    """Return the radius before distortion, which is the angle itself."""
    return angle_rad


EQUIDISTANT = LensModel(
    name="equidistant",
    coefficients=("k1", "k2", "k3", "k4"),
    counts=(4,),
    project=_project,
    unproject=_unproject,
    coefficient_jacobian=_coefficient_jacobian,
    is_perspective=False,
    opencv="fisheye.projectPoints",
    typical=TypicalLens((-0.012, 0.006, -0.004, 0.0009), field_of_view_deg=110.0, radius_at=_angle),
    names_elsewhere=(
        NameElsewhere("camera_info", "equidistant", 4),
        NameElsewhere("kalibr", "equidistant", 4),
        NameElsewhere("opencv", "equidistant", 4),
        NameElsewhere("colmap", "OPENCV_FISHEYE", 4),
        NameElsewhere("foxglove", "kannala_brandt", 4),
    ),
    names_in_files=("equidistant", "fisheye", "kannala_brandt"),
    names_in_messages=("equidistant", "fisheye", "kannala_brandt", "kannala_brandt4"),
)
