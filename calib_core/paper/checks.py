"""Warnings about a pose of Algorithm 1, which refines on all pairs, the wrong ones included.

The algorithm has no noise model and gives no warnings itself. Its residuals are compared with the noise that the default
method assumes; the pose stays as printed.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Points2, Points3
from calib_core.camera import Camera
from calib_core.estimation.measurement_model import Linearization, linearize
from calib_core.estimation.plausibility import implausible_input
from calib_core.geometry import CM_PER_M, RigidTransform, camera_position_jacobian
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions, PaperOptions
from calib_core.radar import polar_from_cartesian, sigma_polar_of
from calib_core.results import DataWarning
from calib_core.results.calibration import CHI2_999_2

_CONTRADICTED = (
    4.0  # chi2 per degree of freedom: at most 1.8 in 181 right poses, at least 39 in 101 wrong ones (docs/paper)
)
_FAR_CAMERA = 3.0  # expected distances
_TRUSTED_ROTATION_RAD = np.deg2rad(1.0)  # an error of a method that states no uncertainty is not expected to be larger
_TRUSTED_POSITION_M = 0.25
_SURE_SIGMAS = 2.9  # exceeded in 1 of 300 poses


def about_placements(
    clicks: Iterable[ReflectorClick], chosen: Sequence[bool], options: PaperOptions
) -> tuple[DataWarning, ...]:
    """Say where the placement ranges come from; without them, that the average takes in all returns, whatever was chosen."""
    if options.region_m and chosen:
        facts = {"chosen": sum(chosen), "by_score": len(chosen) - sum(chosen), "region_m": options.region_m}
        return (DataWarning("placement-ranges", facts),)
    count = sum(click.chosen is not None and click.counts for click in clicks)
    return (DataWarning("choices-unused", {"clicks": count}),) if count else ()


def judged_by_noise(
    ids: Sequence[str],
    points_radar_m: Points3,
    pixels_px: Points2,
    camera: Camera,
    camera_from_radar: RigidTransform,
    inliers: Flags,
    options: CalibrationOptions,
) -> tuple[Flags, tuple[DataWarning, ...]]:
    """Return which pairs agree with a pose of Algorithm 1 under the assumed noise (n,), and the warnings about it.

    Args:
        ids: of the n pairs that took part.
        points_radar_m: (n, 3) their radar positions.
        pixels_px: (n, 2) their clicks.
        camera: intrinsics.
        camera_from_radar: the pose.
        inliers: (n,) RANSAC's.
        options: the assumed noise, RANSAC's threshold and the expected distance of the camera.
    """
    hidden = np.isnan(camera.project(camera_from_radar @ points_radar_m)).any(axis=1)
    fit = _modelled(points_radar_m[~hidden], pixels_px[~hidden], camera, camera_from_radar, options)
    agreeing = ~hidden
    agreeing[~hidden] = fit.model.squared <= CHI2_999_2
    warnings = (
        *implausible_input(ids, points_radar_m, pixels_px, camera, options),
        *_contradicted(fit, agreeing, inliers, options),
        *_behind(ids, hidden),
        *_spread(fit, camera_from_radar),
        *_far_camera(camera_from_radar, options),
    )
    return agreeing, warnings


@dataclass(frozen=True, slots=True, eq=False)
class _Modelled:
    """The pose under the noise that the default method assumes.

    Attributes:
        model: residuals and Jacobians, whitened by that noise.
        degrees_of_freedom: of the residuals.
        excess: the mean squared whitened residual per degree of freedom; 1 if the noise is as assumed.
    """

    model: Linearization
    degrees_of_freedom: int
    excess: float


def _modelled(
    points_radar_m: Points3,
    pixels_px: Points2,
    camera: Camera,
    camera_from_radar: RigidTransform,
    options: CalibrationOptions,
) -> _Modelled:
    noise, degrees = options.noise, 2 * len(points_radar_m) - 6
    sigma_polar = sigma_polar_of(noise)
    model = linearize(
        camera_from_radar,
        camera,
        pixels_px=pixels_px,
        sigma_px=np.full(len(pixels_px), noise.sigma_px),
        polar=polar_from_cartesian(points_radar_m),
        sigma_polar=np.tile(sigma_polar, (len(points_radar_m), 1)),
    )
    return _Modelled(model, degrees, float(model.squared.sum()) / max(degrees, 1))


def _contradicted(fit: _Modelled, agreeing: Flags, inliers: Flags, options: CalibrationOptions) -> list[DataWarning]:
    if fit.degrees_of_freedom < 1 or fit.excess <= _CONTRADICTED:
        return []
    facts = {
        "chi2_per_degree": fit.excess,
        "agreeing": int(agreeing.sum()),
        "inliers": int(inliers.sum()),
        "pairs": len(agreeing),
        "threshold_px": options.paper.ransac_threshold_px,
    }
    return [DataWarning("algorithm-1-contradicted", facts)]


def _behind(ids: Sequence[str], hidden: Flags) -> list[DataWarning]:
    if not hidden.any():
        return []
    return [DataWarning("behind-camera", {"ids": np.asarray(ids)[hidden].tolist(), "pairs": len(ids)})]


def _spread(fit: _Modelled, camera_from_radar: RigidTransform) -> list[DataWarning]:
    """Warn if the pairs' noise may move the pose farther than somebody who is told no uncertainty expects.

    Algorithm 1 weights all pixels equally, so noise of covariance S in the pixels, as large as its residuals, gives the pose
    the covariance (J^T J)^-1 J^T S J (J^T J)^-1.
    """
    if fit.degrees_of_freedom < 1:
        return []
    unwhitened = np.linalg.pinv(fit.model.whitening)
    jacobian = unwhitened @ fit.model.pose_jacobian
    inverse = np.linalg.pinv(np.einsum("nij,nik->jk", jacobian, jacobian))
    carried = np.swapaxes(jacobian, 1, 2) @ unwhitened
    covariance = fit.excess * inverse @ np.einsum("nij,nkj->ik", carried, carried) @ inverse
    centre = camera_position_jacobian(camera_from_radar)
    rotation_rad = float(np.sqrt(np.trace(covariance[3:, 3:])))
    position_m = float(np.sqrt(np.trace(centre @ covariance @ centre.T)))
    if _SURE_SIGMAS * rotation_rad <= _TRUSTED_ROTATION_RAD and _SURE_SIGMAS * position_m <= _TRUSTED_POSITION_M:
        return []
    return [
        DataWarning(
            "weak-geometry",
            {"rotation_deg": float(np.rad2deg(rotation_rad)), "position_cm": CM_PER_M * position_m, "paper": True},
        )
    ]


def _far_camera(camera_from_radar: RigidTransform, options: CalibrationOptions) -> list[DataWarning]:
    measured = options.solving.camera_position
    expected_m = np.zeros(3) if measured is None else np.array(measured.position_m)
    reach_m = options.solving.nominal_camera_distance_m if measured is None else 10.0 * measured.sigma_m
    away_m = float(np.linalg.norm(camera_from_radar.inverse().translation_m - expected_m))
    if away_m <= _FAR_CAMERA * reach_m:
        return []
    return [DataWarning("camera-far-away", {"solved_m": away_m, "expected_m": reach_m})]
