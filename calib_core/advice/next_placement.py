"""Next placement: where a further pair would reduce the pose's uncertainty most, and when to stop."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, Values
from calib_core.geometry import RigidTransform
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar
from calib_core.results import Calibration, NextPlacement

__all__ = ["PlacementLimits", "next_placement"]

_ENOUGH_GAIN = 1.04  # a placement that gains less is not worth the effort
_MARGIN_SHARE = 0.04  # of the image, kept free at its edges


@dataclass(frozen=True, slots=True)
class PlacementLimits:
    """Where the reflector can be put, on the plane of the existing placements."""

    min_range_m: float = 2.0
    """Nearest place [m]."""
    max_range_m: float = 15.0
    """Farthest place [m]."""
    max_azimuth_deg: float = 40.0
    """Largest bearing to either side [deg]; beyond it a radar's angles get worse."""
    separation_m: float = 0.5
    """Smallest distance to a place that has been used [m]."""


def next_placement(calibration: Calibration, *, limits: PlacementLimits | None = None) -> NextPlacement | None:
    """Find the place whose pair would reduce the uncertainty most (A-optimal design); None if no place is free.

    Args:
        calibration: of the default method, with its covariance.
        limits: where the reflector can go.
    """
    used = np.array([pair.point_radar_m for pair in calibration.pairs if pair.inlier]).reshape(-1, 3)
    if not len(used) or not np.isfinite(calibration.covariance).all():
        return None
    limits = limits or PlacementLimits()
    places = _free_places(calibration, used, limits)
    if not len(places):
        return None
    distance_m = float(np.median(np.linalg.norm(used, axis=1)))
    now = _spread(calibration.covariance[None], distance_m)[0]
    then = _spread(_covariances_after(calibration, places), distance_m)
    best = int(np.argmin(then))
    gain = float(np.sqrt(now / then[best]))
    pixel = calibration.reproject(places[best : best + 1])[0]
    return NextPlacement(places[best], pixel, gain, may_stop=gain < _ENOUGH_GAIN)


def _free_places(calibration: Calibration, used: Points3, limits: PlacementLimits) -> Points3:
    """Return the points of a polar grid on the plane of the used places that both sensors see and that are not used yet."""
    range_m = np.geomspace(limits.min_range_m, limits.max_range_m, 10)
    azimuth_rad = np.deg2rad(np.linspace(-limits.max_azimuth_deg, limits.max_azimuth_deg, 21))
    grid = np.stack(np.meshgrid(range_m, azimuth_rad, indexing="ij"), axis=-1).reshape(-1, 2)
    flat = cartesian_from_polar(np.column_stack([grid, np.zeros(len(grid))]))
    flat[:, 2] = _heights(flat[:, :2], used)
    camera_from_radar, camera = calibration.camera_from_radar, calibration.camera
    margin_px = -_MARGIN_SHARE * min(camera.width_px, camera.height_px)
    points_camera = camera_from_radar @ flat
    seen = camera.sees(points_camera) & camera.in_image(camera.project(points_camera), margin_px=margin_px)
    apart = np.linalg.norm(flat[:, None] - used[None], axis=2).min(axis=1) >= limits.separation_m
    return flat[seen & apart]


def _heights(places: np.ndarray, used: Points3) -> Values:
    """Return z on the plane z = a x + b y + c through the used places, with regularized slopes."""
    design = np.column_stack([used[:, :2], np.ones(len(used))])
    regularized = np.vstack([design, np.diag([1.0, 1.0, 0.0])])
    plane = np.linalg.lstsq(regularized, np.concatenate([used[:, 2], np.zeros(3)]), rcond=None)[0]
    return np.asarray(np.column_stack([places, np.ones(len(places))]) @ plane)


def _covariances_after(calibration: Calibration, places: Points3) -> np.ndarray:
    """Return the covariance (n, 6, 6) after one more pair at each place: (P^-1 + J^T S^-1 J)^-1."""
    jacobian = calibration.camera.pose_jacobian(calibration.camera_from_radar, places)
    noise = _pixel_noise(calibration, places)
    added = np.swapaxes(jacobian, 1, 2) @ np.linalg.solve(noise, jacobian)
    return np.linalg.inv(np.linalg.inv(calibration.covariance) + added)


def _pixel_noise(calibration: Calibration, places: Points3) -> np.ndarray:
    """Return S = C + J V J^T (n, 2, 2) of a pair at each place, with the estimated noise."""
    noise, scale = calibration.options.noise, np.array(calibration.noise_scale)
    sigma = np.array([noise.sigma_range_m, np.deg2rad(noise.sigma_azimuth_deg), np.deg2rad(noise.sigma_elevation_deg)])
    covariance = covariance_from_sigma_polar(places, np.tile(sigma * scale[1:], (len(places), 1)))
    pose: RigidTransform = calibration.camera_from_radar
    d_point = calibration.camera.project_with_jacobian(pose @ places)[1] @ pose.rotation
    return np.asarray(d_point @ covariance @ np.swapaxes(d_point, 1, 2) + (noise.sigma_px * scale[0]) ** 2 * np.eye(2))


def _spread(covariances: np.ndarray, distance_m: float) -> Values:
    """Reduce covariances (n, 6, 6) to (n,) [rad^2]: rotation variance, plus position variance at the typical distance."""
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    return np.asarray(variances[:, 3:].sum(axis=1) + variances[:, :3].sum(axis=1) / distance_m**2)
