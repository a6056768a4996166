"""Warnings about a pose of Algorithm 1, which refines on all pairs, the wrong ones included.

The algorithm has no noise model and gives no warnings itself. Its residuals are compared with the noise that the default
method assumes; the pose stays as printed.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Flags, Points2, Points3
from calib_core.camera import Camera
from calib_core.estimation.linearization import linearize
from calib_core.geometry import RigidTransform
from calib_core.options import CalibrationOptions
from calib_core.plausibility import implausible_input
from calib_core.radar import polar_from_cartesian
from calib_core.results import DataWarning

__all__ = ["warnings_as_printed"]

_MOST_DISAGREEING = 0.35
_NOISE_EXCESS = 2.5  # of the mean squared residual
_FAR_CAMERA = 3.0  # expected distances


def warnings_as_printed(
    ids: Sequence[str],
    points_radar_m: Points3,
    pixels_px: Points2,
    camera: Camera,
    camera_from_radar: RigidTransform,
    agreeing: Flags,
    options: CalibrationOptions,
) -> tuple[DataWarning, ...]:
    """Return the warnings about a pose of Algorithm 1.

    Args:
        ids: of the n pairs that took part.
        points_radar_m: (n, 3) their radar positions.
        pixels_px: (n, 2) their clicks.
        camera: intrinsics.
        camera_from_radar: the pose.
        agreeing: (n,) RANSAC's inliers.
        options: the assumed noise, RANSAC's threshold and the expected distance of the camera.
    """
    hidden = np.isnan(camera.project(camera_from_radar @ points_radar_m)).any(axis=1)
    return (
        *implausible_input(ids, points_radar_m, pixels_px, camera, options),
        *_disagreeing(ids, agreeing, options),
        *_behind(ids, hidden),
        *_excess(points_radar_m[~hidden], pixels_px[~hidden], camera, camera_from_radar, options),
        *_far_camera(camera_from_radar, options),
    )


def _disagreeing(ids: Sequence[str], agreeing: Flags, options: CalibrationOptions) -> list[DataWarning]:
    if np.mean(~agreeing) <= _MOST_DISAGREEING:
        return []
    return [
        DataWarning(
            "many-outliers",
            f"only {int(agreeing.sum())} of {len(ids)} pairs agree within {options.paper.ransac_threshold_px:g} px, but "
            "Algorithm 1 fits the pose to all of them",
            "use the default method, which leaves wrong pairs out; or exclude the pairs with the largest residuals",
        )
    ]


def _behind(ids: Sequence[str], hidden: Flags) -> list[DataWarning]:
    if not hidden.any():
        return []
    return [
        DataWarning(
            "behind-camera",
            f"with this pose the camera cannot see {int(hidden.sum())} of {len(ids)} radar positions "
            f"({', '.join(np.asarray(ids)[hidden][:6])}); the metrics exclude them",
            "do not use this pose; use the default method",
        )
    ]


def _excess(
    points_radar_m: Points3,
    pixels_px: Points2,
    camera: Camera,
    camera_from_radar: RigidTransform,
    options: CalibrationOptions,
) -> list[DataWarning]:
    degrees = 2 * len(points_radar_m) - 6
    if degrees < 1:
        return []
    noise = options.noise
    sigma_polar = [noise.sigma_range_m, *np.deg2rad([noise.sigma_azimuth_deg, noise.sigma_elevation_deg])]
    model = linearize(
        camera_from_radar,
        camera,
        pixels_px=pixels_px,
        sigma_px=np.full(len(pixels_px), noise.sigma_px),
        polar=polar_from_cartesian(points_radar_m),
        sigma_polar=np.tile(sigma_polar, (len(points_radar_m), 1)),
    )
    excess = float(model.squared.sum()) / degrees
    if excess < max(_NOISE_EXCESS, 1.0 + 4.0 * np.sqrt(2.0 / degrees)):
        return []
    return [
        DataWarning(
            "residuals-too-large",
            f"residuals are {np.sqrt(excess):.1f} times what the assumed noise explains "
            f"(chi2 / degrees of freedom {excess:.1f})",
            "some radar positions or clicks are wrong: use the default method, and check the pairs it names",
        )
    ]


def _far_camera(camera_from_radar: RigidTransform, options: CalibrationOptions) -> list[DataWarning]:
    measured = options.solving.camera_position
    expected_m = np.zeros(3) if measured is None else np.array(measured.position_m)
    reach_m = options.solving.nominal_camera_distance_m if measured is None else 10.0 * measured.sigma_m
    away_m = float(np.linalg.norm(camera_from_radar.inverse().translation_m - expected_m))
    if away_m <= _FAR_CAMERA * reach_m:
        return []
    return [
        DataWarning(
            "camera-far-away",
            f"the solved camera position is {away_m:.1f} m from the expected one (± {reach_m:.1g} m)",
            "if the sensors really are that far apart, set the nominal distance; otherwise do not use this pose",
        )
    ]
