"""The camera: a lens model followed by a camera matrix; projection with analytic Jacobians, and its inverse.

Camera frame: x right, y down, z forward. Pixel (0, 0) is the centre of the top-left pixel, as in OpenCV.
"""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from calib_core.arrays import Flags, Matrix33, Points2, Points3, Values, freeze
from calib_core.geometry import RigidTransform, rotation_jacobian
from calib_core.lens_models.lens_model import LensModel
from calib_core.lens_models.registry import LENS_MODELS

CAMERA_MODELS: tuple[str, ...] = tuple(LENS_MODELS)
if TYPE_CHECKING:
    CameraModel: TypeAlias = str
else:  # the command line, our files and their schemas accept what is registered
    CameraModel = Literal[CAMERA_MODELS]


_MATRIX_NAMES = ("fx_px", "fy_px", "cx_px", "cy_px")
_MATRIX_PLACES = ([0, 1, 0, 1], [0, 1, 2, 2])


@dataclass(frozen=True, slots=True, eq=False)
class CameraCovariance:
    """How well the intrinsics are known.

    Attributes:
        order: (p,) names of parameters, out of `Camera.parameter_names`; one that is not among them is taken to be exact.
        matrix: (p, p) their covariance, in the units of their names; coefficients have none.
    """

    order: tuple[str, ...]
    matrix: np.ndarray

    def __post_init__(self) -> None:
        count = len(self.order)
        object.__setattr__(self, "order", tuple(self.order))
        freeze(self, matrix=(count, count))
        if len(set(self.order)) != count:
            raise ValueError("the covariance of the intrinsics names a parameter twice")
        spread = np.sqrt(np.maximum(np.diag(self.matrix), 0.0))
        scale = np.outer(spread, spread)
        scale[scale == 0.0] = 1.0
        if (
            not np.all(np.isfinite(self.matrix))
            or np.abs((self.matrix - self.matrix.T) / scale).max(initial=0.0) > 1e-6
        ):
            raise ValueError("the covariance of the intrinsics must be finite and symmetric")
        if (
            np.linalg.eigvalsh(self.matrix / scale).min(initial=0.0) < -1e-9
            or np.diag(self.matrix).min(initial=0.0) < 0
        ):
            raise ValueError("the covariance of the intrinsics must not be negative in any direction")

    def sigma(self, name: str) -> float:
        """Return the standard deviation of a parameter; 0 for one that is exact."""
        return float(self.matrix.diagonal()[self.order.index(name)] ** 0.5) if name in self.order else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A calibrated camera.

    Attributes:
        model: the name of its lens model, one of `lens_models.registry.LENS_MODELS`: "pinhole" (no distortion), "plumb_bob"
            (k1 k2 p1 p2 [k3]), "rational_polynomial" (k1 k2 p1 p2 k3 k4 k5 k6), "equidistant" (k1 k2 k3 k4, OpenCV's fisheye).
        width_px: columns of the image.
        height_px: rows of the image.
        matrix_px: (3, 3) K, with focal lengths and principal point [px].
        distortion: (k,) coefficients in the lens model's order.
        covariance: how well all this is known; None if nobody said.
        is_part: whether the image is a part of the sensor's, whose middle then says nothing of the principal point.
    """

    model: CameraModel
    width_px: int
    height_px: int
    matrix_px: Matrix33
    distortion: Values = field(default_factory=lambda: np.zeros(0))
    covariance: CameraCovariance | None = None
    is_part: bool = False

    def __post_init__(self) -> None:
        freeze(self, matrix_px=(3, 3), distortion=(None,))
        if self.model not in LENS_MODELS:
            raise ValueError(f"unknown camera model '{self.model}'; known: {', '.join(LENS_MODELS)}")
        if len(self.distortion) not in self.lens.counts:
            wanted = " or ".join(map(str, self.lens.counts))
            raise ValueError(f"{self.model} takes {wanted} distortion coefficients, got {len(self.distortion)}")
        if self.width_px < 1 or self.height_px < 1:
            raise ValueError(f"the image size must be positive, got {self.width_px} x {self.height_px}")
        if not (np.all(np.isfinite(self.matrix_px)) and np.all(np.isfinite(self.distortion))):
            raise ValueError("the camera matrix and the distortion must be finite")
        if self.matrix_px[0, 0] <= 0 or self.matrix_px[1, 1] <= 0:
            raise ValueError("the focal lengths must be positive (a zero camera matrix means not calibrated)")
        strange = set(self.covariance.order if self.covariance else ()) - set(self.parameter_names)
        if strange:
            known = ", ".join(self.parameter_names)
            named = ", ".join(sorted(strange))
            raise ValueError(f"the covariance names {named}, which {self.model} does not have; it has {known}")

    @property
    def lens(self) -> LensModel:
        """The lens model."""
        return LENS_MODELS[self.model]

    @property
    def is_distorted(self) -> bool:
        """Whether the matrix alone does not give the projection: a coefficient is not zero, or the lens is a fisheye."""
        return not self.lens.is_perspective or bool(self.distortion.any())

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """The intrinsics by name: focal lengths and principal point [px], then the coefficients."""
        return (*_MATRIX_NAMES, *self.lens.coefficients[: len(self.distortion)])

    @property
    def parameters(self) -> Values:
        """The values of `parameter_names`: (4 + k,)."""
        return np.concatenate([self.matrix_px[_MATRIX_PLACES], self.distortion])

    def with_parameters(self, values: Values, covariance: CameraCovariance | None = None) -> "Camera":
        """Return the camera with other values of `parameter_names` (4 + k,); skew stays."""
        matrix = self.matrix_px.copy()
        matrix[_MATRIX_PLACES] = values[:4]
        return replace(self, matrix_px=matrix, distortion=np.asarray(values[4:]), covariance=covariance)

    def parameter_planes(self, points_camera_m: np.ndarray) -> np.ndarray:
        """Return d pixel / d parameter (..., 4 + k, 2, n) of points (..., 3, n), in the order of `parameter_names`."""
        plane, _ = self.lens.project(points_camera_m, self.distortion)
        count = len(self.distortion)
        slopes = np.zeros((*points_camera_m.shape[:-2], 4 + count, 2, points_camera_m.shape[-1]))
        slopes[..., 0, 0, :], slopes[..., 1, 1, :] = plane[..., 0, :], plane[..., 1, :]
        slopes[..., 2, 0, :] = slopes[..., 3, 1, :] = 1.0
        bends = self.lens.coefficient_jacobian(points_camera_m, self.distortion)[..., :count, :, :]
        slopes[..., 4:, :, :] = self.matrix_px[:2, :2] @ bends
        return slopes

    def project(self, points_camera_m: Points3) -> Points2:
        """Project points [m] to pixels [px], through the lens. Points behind a pinhole become NaN.

        Args:
            points_camera_m: (n, 3) in the camera frame.
        """
        return self.project_with_jacobian(points_camera_m)[0]

    def project_with_jacobian(self, points_camera_m: Points3) -> tuple[Points2, np.ndarray]:
        """Project points to pixels (n, 2), with the derivative d pixel / d point (n, 2, 3) [px/m]."""
        pixels, d_point = self.project_planes(np.ascontiguousarray(np.asarray(points_camera_m, dtype=np.float64).T))
        return np.ascontiguousarray(pixels.T), np.ascontiguousarray(d_point.T)

    def project_planes(self, points_camera_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Project points stored one row per coordinate, with derivatives; NumPy is fast along long rows.

        Args:
            points_camera_m: (..., 3, n); the leading axes are batch axes.

        Returns:
            Pixels (..., 2, n) and d pixel / d point (..., 3, 2, n), indexed by coordinate, then row of the pixel.
        """
        plane, d_plane = LENS_MODELS[self.model].project(points_camera_m, self.distortion)
        linear = self.matrix_px[:2, :2]
        return linear @ plane + self.matrix_px[:2, 2:], linear @ d_plane

    def rays(self, pixels_px: Points2) -> Points3:
        """Return the unit direction (n, 3) in the camera frame that each pixel sees; NaN where the lens model has none."""
        pixels = np.asarray(pixels_px, dtype=np.float64)
        plane = np.linalg.solve(self.matrix_px[:2, :2], (pixels - self.matrix_px[:2, 2]).T).T
        return self.lens.unproject(plane, self.distortion)

    def pose_jacobian(self, camera_from_radar: RigidTransform, points_radar_m: Points3) -> np.ndarray:
        """Return d pixel / d (dt, dtheta) at radar points (n, 3), seen through the lens: (n, 2, 6) [px/m, px/rad]."""
        turned_m = np.asarray(points_radar_m, dtype=np.float64) @ camera_from_radar.rotation.T
        planes = np.empty((6, 2, len(turned_m)))
        planes[:3] = self.project_with_jacobian(turned_m + camera_from_radar.translation_m)[1].T
        rotation_jacobian(turned_m.T, planes[:3], out=planes[3:])
        return np.asarray(planes.T)

    def in_image(self, pixels_px: Points2, *, margin_px: float = 0.0) -> Flags:
        """Return which pixels are in the image, whose edge is half a pixel outside the outermost pixel centres."""
        u, v = np.asarray(pixels_px, dtype=np.float64).T
        low, right, bottom = -0.5 - margin_px, self.width_px - 0.5 + margin_px, self.height_px - 0.5 + margin_px
        with np.errstate(invalid="ignore"):
            return (u >= low) & (u <= right) & (v >= low) & (v <= bottom)

    def sees(self, points_camera_m: Points3) -> Flags:
        """Return which points the lens images: in front of it, in the image, and before the distortion folds back."""
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
        """Return the camera for the image resized by a factor, with pixel centres kept in place."""
        matrix = self.matrix_px.copy()
        matrix[:2, :2] *= factor
        matrix[:2, 2] = (matrix[:2, 2] + 0.5) * factor - 0.5
        size_px = round(self.width_px * factor), round(self.height_px * factor)
        return Camera(
            self.model,
            *size_px,
            matrix,
            self.distortion,
            self._rescaled_covariance(np.array([factor, factor])),
            self.is_part,
        )

    def windowed(self, offset_px: tuple[int, int], size_px: tuple[int, int], binning: tuple[int, int]) -> "Camera":
        """Return the camera for a part of the image whose pixels are binned (REP 104): the full sensor's column u becomes
        (u - offset + 1/2) / binning - 1/2, which keeps pixel centres at integers.

        Args:
            offset_px: left column and upper row of the part.
            size_px: its width and height before binning.
            binning: pixels along a row and along a column that become one.
        """
        by = np.array(binning, dtype=np.float64)
        matrix = self.matrix_px.copy()
        matrix[:2, :2] /= by[:, None]
        matrix[:2, 2] = (self.matrix_px[:2, 2] - offset_px + 0.5) / by - 0.5
        width, height = int(size_px[0] // by[0]), int(size_px[1] // by[1])
        covariance = self._rescaled_covariance(1.0 / by)
        is_part = self.is_part or tuple(size_px) != (self.width_px, self.height_px)
        return Camera(self.model, width, height, matrix, self.distortion, covariance, is_part)

    def _rescaled_covariance(self, factors: Values) -> CameraCovariance | None:
        """Return the covariance for an image whose columns and rows are so many times as many (2,)."""
        if self.covariance is None:
            return None
        by_name = dict(zip(_MATRIX_NAMES, np.tile(factors, 2).tolist(), strict=True))
        gain = np.array([by_name.get(name, 1.0) for name in self.covariance.order])
        return CameraCovariance(self.covariance.order, self.covariance.matrix * np.outer(gain, gain))
