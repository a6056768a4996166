"""The camera: four lens models, projection with analytic Jacobians, and the way back.

Camera frame: x right, y down, z forward. Pixel (0, 0) is the centre of the top-left pixel, as in OpenCV.
"""

from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from calib_core.arrays import Flags, Matrix33, Points2, Points3, Values, frozen_array
from calib_core.geometry import RigidTransform, rotation_jacobian

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

    @property
    def is_distorted(self) -> bool:
        """Whether its matrix alone does not tell where a point is seen: a coefficient is not zero, or the lens is equidistant."""
        return self.model == "equidistant" or bool(self.distortion.any())

    def project(self, points_camera_m: Points3) -> Points2:
        """Project points [m] to pixels [px], through the lens. Points behind a pinhole become NaN.

        Args:
            points_camera_m: (n, 3) in the camera frame.
        """
        return self.project_with_jacobian(points_camera_m)[0]

    def project_with_jacobian(self, points_camera_m: Points3) -> tuple[Points2, np.ndarray]:
        """Project points and differentiate: pixels (n, 2) and d pixel / d point (n, 2, 3) [px/m]."""
        pixels, d_point = self.project_planes(np.ascontiguousarray(np.asarray(points_camera_m, dtype=np.float64).T))
        return np.ascontiguousarray(pixels.T), np.ascontiguousarray(d_point.T)

    def project_planes(self, points_camera_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Project and differentiate points given as planes, one row per coordinate: NumPy is quick along long rows.

        Args:
            points_camera_m: (..., 3, n), the leading axes those of any batch.

        Returns:
            Pixels (..., 2, n) and d pixel / d point (..., 3, 2, n): first the coordinate, then the pixel's row.
        """
        if self.model == "equidistant":
            plane, d_plane = _equidistant(points_camera_m, self.distortion)
        else:
            plane, d_plane = _through_lens(points_camera_m, _padded(self.distortion))
        linear = self.matrix_px[:2, :2]
        return linear @ plane + self.matrix_px[:2, 2:], linear @ d_plane

    def rays(self, pixels_px: Points2) -> Points3:
        """Return the unit direction (n, 3) in the camera frame that each pixel sees; NaN where the lens model has none."""
        pixels = np.asarray(pixels_px, dtype=np.float64)
        plane = np.linalg.solve(self.matrix_px[:2, :2], (pixels - self.matrix_px[:2, 2]).T).T
        if self.model == "equidistant":
            return _equidistant_rays(plane, self.distortion)
        ideal = _undistorted(plane, _padded(self.distortion))
        rays = np.concatenate([ideal, np.ones((len(ideal), 1))], axis=1)
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def pose_jacobian(self, camera_from_radar: RigidTransform, points_radar_m: Points3) -> np.ndarray:
        """Return d pixel / d (dt, dtheta) at radar points (n, 3), seen through the lens: (n, 2, 6) [px/m, px/rad]."""
        turned_m = np.asarray(points_radar_m, dtype=np.float64) @ camera_from_radar.rotation.T
        planes = np.empty((6, 2, len(turned_m)))
        planes[:3] = self.project_with_jacobian(turned_m + camera_from_radar.translation_m)[1].T
        rotation_jacobian(turned_m.T, planes[:3], out=planes[3:])
        return np.asarray(planes.T)

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


def _padded(distortion: Values) -> list[float]:
    return [*distortion.tolist(), *[0.0] * (8 - len(distortion))]


def _through_lens(points: np.ndarray, k: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Project points (..., 3, n) in front of the camera to the image plane (..., 2, n), with the Jacobian (..., 3, 2, n)."""
    depth = points[..., 2, :]
    inverse_z = 1.0 / np.where(depth > 0, depth, np.nan)
    x, y = points[..., 0, :] * inverse_z, points[..., 1, :] * inverse_z
    (distorted_x, distorted_y), (xx, xy, yy) = _brown_conrady(x, y, k)
    plane = np.stack([distorted_x, distorted_y], axis=-2)
    jacobian = np.empty((*points.shape[:-1], 2, points.shape[-1]))
    jacobian[..., 0, 0, :] = xx * inverse_z
    jacobian[..., 0, 1, :] = jacobian[..., 1, 0, :] = xy * inverse_z
    jacobian[..., 1, 1, :] = yy * inverse_z
    along_x, along_y = jacobian[..., 0, :, :], jacobian[..., 1, :, :]
    jacobian[..., 2, :, :] = -(along_x * x[..., None, :] + along_y * y[..., None, :])
    return plane, jacobian


def _brown_conrady(x: Values, y: Values, k: list[float]) -> tuple[tuple[Values, Values], tuple[Values, Values, Values]]:
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


def _undistorted(plane: Points2, k: list[float]) -> Points2:
    """Invert the Brown-Conrady model by Newton's method; NaN where it does not come back to the pixel."""
    wanted_x, wanted_y = plane.T.copy()
    x, y = wanted_x, wanted_y
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON_STEPS):
            (distorted_x, distorted_y), (d_xx, d_xy, d_yy) = _brown_conrady(x, y, k)
            error_x, error_y = distorted_x - wanted_x, distorted_y - wanted_y
            determinant = d_xx * d_yy - d_xy * d_xy
            step_x = (d_yy * error_x - d_xy * error_y) / determinant
            step_y = (d_xx * error_y - d_xy * error_x) / determinant
            length = np.hypot(step_x, step_y)
            held = np.minimum(1.0, 0.5 / np.where(length > 0, length, 1.0))
            x, y = x - step_x * held, y - step_y * held
            if np.fmax.reduce(length, initial=0.0) < _NEWTON_TOLERANCE:  # NaN does not count
                break
        (distorted_x, distorted_y), _ = _brown_conrady(x, y, k)
        missed = ~(np.hypot(distorted_x - wanted_x, distorted_y - wanted_y) < 1e-9)
    ideal = np.stack([x, y], axis=1)
    ideal[missed] = np.nan
    return ideal


def _equidistant_angle(theta: Values, k: Values) -> tuple[Values, Values]:
    """Return the distorted angle theta_d of OpenCV's fisheye model, and its derivative."""
    k1, k2, k3, k4 = k
    t2 = theta * theta
    distorted = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
    slope = 1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)))
    return distorted, slope


def _equidistant(points: np.ndarray, k: Values) -> tuple[np.ndarray, np.ndarray]:
    """Project points (..., 3, n) by OpenCV's fisheye model: image plane (..., 2, n) and Jacobian (..., 3, 2, n)."""
    x, y, z = points[..., 0, :], points[..., 1, :], points[..., 2, :]
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
    jacobian = np.empty((*points.shape[:-1], 2, points.shape[-1]))
    for row, component in enumerate((x, y)):
        jacobian[..., 0, row, :] = component * d_scale_a * cos_a
        jacobian[..., 1, row, :] = component * d_scale_a * sin_a
        jacobian[..., row, row, :] += scale
        jacobian[..., 2, row, :] = component * d_scale_z
    return np.stack([scale * x, scale * y], axis=-2), jacobian


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
