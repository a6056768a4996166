"""The uncertainty in the image as a map: how far from the drawn place a point may really appear, over all of the image."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values, freeze
from calib_core.estimation.covariance import PoseCovariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit
from calib_core.geometry import RigidTransform, larger_eigenvalues
from calib_core.results import Calibration
from calib_core.results.calibration import CHI2_95_2, CHI2_95_6
from calib_core.results.verdict import degrees_of_freedom

MAP_DISTANCES_M = (5.0, 20.0, 60.0)
"""The distances from the camera that are shown; those at which two calibrations are compared as well."""

_SAME_PX = 1e-3
"""A ray that does not project to its own pixel lies where the lens folds back."""


@dataclass(frozen=True, slots=True, eq=False)
class UncertaintyMap:
    """Where a point at one distance may appear, for a grid of places in the image.

    Attributes:
        distance_m: of the point from the camera.
        columns_px: (c,) of the grid, ascending, from the left edge of the image to the right.
        rows_px: (r,) of the grid, ascending.
        semi_major_px: (r, c) semi-major axis of the ellipse that contains the point with 95 % probability; NaN where the lens
            has no ray, or the method no noise model.
    """

    distance_m: float
    columns_px: Values
    rows_px: Values
    semi_major_px: np.ndarray

    def __post_init__(self) -> None:
        freeze(self, columns_px=(None,), rows_px=(None,))
        shape = (len(self.rows_px), len(self.columns_px))
        freeze(self, semi_major_px=shape)


# 48 steps across an image, 40 px of 1920: a pose's error changes slowly over an image (a choice)
def uncertainty_map(calibration: Calibration, distance_m: float, *, columns: int = 49) -> UncertaintyMap:
    """Map the 95 % uncertainty of a reprojection over the image, for points at one distance from the camera.

    Each pixel of the grid is carried along its ray to the distance, and the covariance of the pose from there into the image.
    It covers the pose; for a radar without elevation, what the pairs determine of it. The noise of a single radar position is
    not included.

    Args:
        calibration: of any method; without a covariance the map is NaN.
        distance_m: from the camera's center, along the ray.
        columns: of the grid; rows follow from the shape of the image.
    """
    camera = calibration.camera
    rows = max(2, round((columns - 1) * camera.height_px / camera.width_px) + 1)
    columns_px = np.linspace(-0.5, camera.width_px - 0.5, columns)
    rows_px = np.linspace(-0.5, camera.height_px - 0.5, rows)
    grid_px = np.stack(np.meshgrid(columns_px, rows_px), axis=-1).reshape(-1, 2)
    points_camera_m = camera.rays(grid_px) * distance_m
    semi_major_px = np.full(len(grid_px), np.nan)
    seen = np.asarray(np.isfinite(points_camera_m).all(axis=1))
    seen[seen] = np.linalg.norm(camera.project(points_camera_m[seen]) - grid_px[seen], axis=1) < _SAME_PX
    radar_from_camera: RigidTransform = calibration.camera_from_radar.inverse()
    covariances_px2 = calibration.pixel_covariance(radar_from_camera @ points_camera_m[seen])
    quantile = pixel_quantile(calibration.covariance_quantile)
    semi_major_px[seen] = np.sqrt(quantile * larger_eigenvalues(covariances_px2))
    return UncertaintyMap(distance_m, columns_px, rows_px, semi_major_px.reshape(rows, columns))


def pixel_quantile(covariance_quantile: float) -> float:
    """Return the factor on a pixel covariance (2, 2) that gives its 95 % ellipse, from that of the pose's (6, 6).

    The pose's is the 95 % quantile of 6 F(6, nu): chi-square with 6 degrees of freedom if the noise is known, larger if few pairs
    had to show it. The pixel has 2 dimensions, so the quantile is that of 2 F(2, nu) with the same nu, at least 5.99.

    Args:
        covariance_quantile: of `Calibration`.
    """
    if not covariance_quantile > CHI2_95_6:
        return CHI2_95_2
    from scipy.special import fdtri

    # degrees of freedom of noise that is as good as known
    freedom = degrees_of_freedom(covariance_quantile, least=1.0, most=1e7)
    return max(CHI2_95_2, 2.0 * float(fdtri(2.0, freedom, 0.95)))  # the probability of the ellipse


def picture_sigma_px(refined: ErrorsInVariablesFit, uncertainty: PoseCovariance) -> float:
    """Return the standard deviation per axis [px] of a reprojection, root mean square over the inlier placements.

    Pose and radar errors are uncertain together, and mostly cancel in the image: a radar without elevation may be tilted by
    degrees, but where its returns appear is known to pixels. The noise of a single radar position is not included.
    """
    inliers = refined.inliers
    jacobian = refined.model.jacobian[inliers].copy()
    for k, error in enumerate(refined.measurements.errors.estimated):
        if error.axis is not None:  # the reflector's offset moves the click, not the reprojection
            jacobian[:, :, 6 + k] = 0.0
    jacobian_px = np.linalg.solve(refined.model.whitening[inliers], jacobian)
    variances = (jacobian_px @ np.linalg.inv(uncertainty.information)) * jacobian_px
    return float(np.sqrt(variances.sum(axis=(1, 2)).mean() / 2.0)) * uncertainty.growth
