"""The camera: four lens models, projection with analytic Jacobians, and the way back.

Camera frame: x right, y down, z forward. Pixel (0, 0) is the centre of the top-left pixel, as in OpenCV.
"""

from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from calib_core.arrays import Flags, Matrix33, Points2, Points3, Values, frozen_array

__all__ = ["CAMERA_MODELS", "Camera", "CameraModel"]

CameraModel = Literal["pinhole", "plumb_bob", "rational_polynomial", "equidistant"]
CAMERA_MODELS: tuple[CameraModel, ...] = get_args(CameraModel)

_COEFFICIENTS: dict[str, tuple[int, ...]] = {
    "pinhole": (0,),
    "plumb_bob": (4, 5),
    "rational_polynomial": (8,),
    "equidistant": (4,),
}
_NEWTON_STEPS = 60
_NEWTON_TOLERANCE = 1e-13


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A calibrated camera.

    Attributes:
        model: "pinhole" (no distortion), "plumb_bob" (k1 k2 p1 p2 [k3]), "rational_polynomial" (k1 k2 p1 p2 k3 k4 k5 k6)
            or "equidistant" (k1 k2 k3 k4, OpenCV's fisheye).
        width_px: columns of the image.
        height_px: rows of the image.
        matrix_px: (3, 3) K, with focal lengths and principal point [px].
        distortion: (k,) coefficients in the order above.
    """

    model: CameraModel
    width_px: int
    height_px: int
    matrix_px: Matrix33
    distortion: Values = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix_px", frozen_array(self.matrix_px, (3, 3)))
        object.__setattr__(self, "distortion", frozen_array(self.distortion, (None,)))
        if self.model not in _COEFFICIENTS:
            raise ValueError(f"unknown camera model '{self.model}'; known: {', '.join(CAMERA_MODELS)}")
        if len(self.distortion) not in _COEFFICIENTS[self.model]:
            wanted = " or ".join(map(str, _COEFFICIENTS[self.model]))
            raise ValueError(f"{self.model} takes {wanted} distortion coefficients, got {len(self.distortion)}")
        if self.width_px < 1 or self.height_px < 1:
            raise ValueError(f"the image size must be positive, got {self.width_px} x {self.height_px}")
        if not (np.all(np.isfinite(self.matrix_px)) and np.all(np.isfinite(self.distortion))):
            raise ValueError("the camera matrix and the distortion must be finite")
        if self.matrix_px[0, 0] <= 0 or self.matrix_px[1, 1] <= 0:
            raise ValueError("the focal lengths must be positive (a zero camera matrix means: not calibrated)")

    def project(self, points_camera_m: Points3) -> Points2:
        """Project points [m] to pixels [px], through the lens. Points behind a pinhole become NaN.

        Args:
            points_camera_m: (n, 3) in the camera frame.
        """
        return self.project_with_jacobian(points_camera_m)[0]

    def project_with_jacobian(self, points_camera_m: Points3) -> tuple[Points2, np.ndarray]:
        """Project points and differentiate: pixels (n, 2) and d pixel / d point (n, 2, 3) [px/m]."""
        points = np.asarray(points_camera_m, dtype=np.float64)
        if self.model == "equidistant":
            plane, d_plane = _equidistant(points, self.distortion)
        else:
            z = np.where(points[:, 2] > 0, points[:, 2], np.nan)
            ideal = points[:, :2] / z[:, None]
            d_ideal = np.zeros((len(points), 2, 3))
            d_ideal[:, 0, 0] = d_ideal[:, 1, 1] = 1.0 / z
            d_ideal[:, :, 2] = -ideal / z[:, None]
            plane, d_distorted = _brown_conrady(ideal, _padded(self.distortion))
            d_plane = d_distorted @ d_ideal
        linear = self.matrix_px[:2, :2]
        return plane @ linear.T + self.matrix_px[:2, 2], linear @ d_plane

    def rays(self, pixels_px: Points2) -> Points3:
        """Return the unit direction (n, 3) in the camera frame that each pixel sees; NaN where the lens model has none."""
        pixels = np.asarray(pixels_px, dtype=np.float64)
        plane = np.linalg.solve(self.matrix_px[:2, :2], (pixels - self.matrix_px[:2, 2]).T).T
        if self.model == "equidistant":
            return _equidistant_rays(plane, self.distortion)
        ideal = _undistorted(plane, _padded(self.distortion))
        rays = np.concatenate([ideal, np.ones((len(ideal), 1))], axis=1)
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def in_image(self, pixels_px: Points2, *, margin_px: float = 0.0) -> Flags:
        """Tell which pixels lie on the image, whose edge is half a pixel outside the outermost pixel centres."""
        u, v = np.asarray(pixels_px, dtype=np.float64).T
        low, right, bottom = -0.5 - margin_px, self.width_px - 0.5 + margin_px, self.height_px - 0.5 + margin_px
        with np.errstate(invalid="ignore"):
            return (u >= low) & (u <= right) & (v >= low) & (v <= bottom)

    def sees(self, points_camera_m: Points3) -> Flags:
        """Tell which points the lens really images: in front, on the image, and on the near side of the distortion's fold."""
        points = np.asarray(points_camera_m, dtype=np.float64)
        pixels = self.project(points)
        visible = self.in_image(pixels)
        if not visible.any():
            return visible
        back = np.full_like(points, np.nan)
        back[visible] = self.rays(pixels[visible])
        with np.errstate(invalid="ignore"):
            distance = np.linalg.norm(points, axis=1, keepdims=True)
            same = np.linalg.norm(back - points / np.where(distance > 0, distance, 1.0), axis=1) < 1e-6
        return visible & same

    def scaled(self, factor: float) -> "Camera":
        """Return the camera of the same picture resized by a factor, pixel centres kept in place."""
        matrix = self.matrix_px.copy()
        matrix[:2, :2] *= factor
        matrix[:2, 2] = (matrix[:2, 2] + 0.5) * factor - 0.5
        return Camera(
            self.model, round(self.width_px * factor), round(self.height_px * factor), matrix, self.distortion
        )


def _padded(distortion: Values) -> Values:
    padded = np.zeros(8)
    padded[: len(distortion)] = distortion
    return padded


def _brown_conrady(ideal: Points2, k: Values) -> tuple[Points2, np.ndarray]:
    """Distort ideal image-plane points by the rational Brown-Conrady model: points (n, 2) and Jacobian (n, 2, 2)."""
    k1, k2, p1, p2, k3, k4, k5, k6 = k
    x, y = ideal[:, 0], ideal[:, 1]
    r2 = x * x + y * y
    top = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    bottom = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = top / bottom
    d_top = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2)
    d_bottom = k4 + r2 * (2.0 * k5 + 3.0 * k6 * r2)
    d_radial = (d_top - radial * d_bottom) / bottom  # d radial / d r2
    distorted = np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ],
        axis=1,
    )
    jacobian = np.empty((len(ideal), 2, 2))
    jacobian[:, 0, 0] = radial + 2.0 * x * x * d_radial + 2.0 * p1 * y + 6.0 * p2 * x
    jacobian[:, 1, 1] = radial + 2.0 * y * y * d_radial + 6.0 * p1 * y + 2.0 * p2 * x
    jacobian[:, 0, 1] = jacobian[:, 1, 0] = 2.0 * x * y * d_radial + 2.0 * p1 * x + 2.0 * p2 * y
    return distorted, jacobian


def _undistorted(plane: Points2, k: Values) -> Points2:
    """Invert the Brown-Conrady model by Newton's method; NaN where it does not come back to the pixel."""
    ideal = plane.copy()
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON_STEPS):
            distorted, jacobian = _brown_conrady(ideal, k)
            error = distorted - plane
            determinant = jacobian[:, 0, 0] * jacobian[:, 1, 1] - jacobian[:, 0, 1] * jacobian[:, 1, 0]
            step_x = (jacobian[:, 1, 1] * error[:, 0] - jacobian[:, 0, 1] * error[:, 1]) / determinant
            step_y = (jacobian[:, 0, 0] * error[:, 1] - jacobian[:, 1, 0] * error[:, 0]) / determinant
            step = np.stack([step_x, step_y], axis=1)
            length = np.linalg.norm(step, axis=1, keepdims=True)
            ideal = ideal - step * np.minimum(1.0, 0.5 / np.where(length > 0, length, 1.0))
            if np.nanmax(np.abs(step), initial=0.0) < _NEWTON_TOLERANCE:
                break
        distorted, _ = _brown_conrady(ideal, k)
        missed = ~(np.linalg.norm(distorted - plane, axis=1) < 1e-9)
    ideal[missed] = np.nan
    return ideal


def _equidistant_angle(theta: Values, k: Values) -> tuple[Values, Values]:
    """Return the distorted angle theta_d of OpenCV's fisheye model, and its derivative."""
    k1, k2, k3, k4 = k
    t2 = theta * theta
    distorted = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
    slope = 1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)))
    return distorted, slope


def _equidistant(points: Points3, k: Values) -> tuple[Points2, np.ndarray]:
    """Project by OpenCV's fisheye model: image-plane points (n, 2) and Jacobian (n, 2, 3)."""
    x, y, z = points.T
    a = np.hypot(x, y)
    n2 = a * a + z * z
    theta = np.arctan2(a, z)
    distorted, slope = _equidistant_angle(theta, k)
    on_axis = a < 1e-12 * np.maximum(np.abs(z), 1e-300)
    safe_a = np.where(on_axis, 1.0, a)
    safe_n2 = np.where(n2 > 0, n2, np.nan)
    scale = np.where(on_axis, 1.0 / np.where(z > 0, z, np.nan), distorted / safe_a)  # plane = scale * (x, y)
    # d scale / d a = (slope * z / n2 - scale) / a ; d scale / d z = -slope / n2
    d_scale_a = np.where(on_axis, 0.0, (slope * z / safe_n2 - scale) / safe_a)
    d_scale_z = -slope / safe_n2
    cos_a, sin_a = np.where(on_axis, 0.0, x / safe_a), np.where(on_axis, 0.0, y / safe_a)
    jacobian = np.empty((len(points), 2, 3))
    for row, component in enumerate((x, y)):
        jacobian[:, row, 0] = component * d_scale_a * cos_a
        jacobian[:, row, 1] = component * d_scale_a * sin_a
        jacobian[:, row, row] += scale
        jacobian[:, row, 2] = component * d_scale_z
    return np.stack([scale * x, scale * y], axis=1), jacobian


def _equidistant_rays(plane: Points2, k: Values) -> Points3:
    """Invert OpenCV's fisheye model by Newton's method on the angle."""
    distorted = np.linalg.norm(plane, axis=1)
    theta = np.minimum(distorted, np.pi / 2)
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON_STEPS):
            value, slope = _equidistant_angle(theta, k)
            step = np.clip((value - distorted) / slope, -0.3, 0.3)
            theta = theta - step
            if np.nanmax(np.abs(step), initial=0.0) < _NEWTON_TOLERANCE:
                break
        value, slope = _equidistant_angle(theta, k)
        wrong = ~(np.abs(value - distorted) < 1e-9) | ~(slope > 0) | (theta < 0) | (theta > np.pi)
    direction = plane / np.where(distorted > 0, distorted, 1.0)[:, None]
    rays = np.concatenate([np.sin(theta)[:, None] * direction, np.cos(theta)[:, None]], axis=1)
    rays[wrong] = np.nan
    return rays
