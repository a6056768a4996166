"""Warnings about the pose as a whole: mirrored axes, a second pose, and an implausible camera position."""

from dataclasses import replace

import numpy as np

from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.covariance import pose_covariance
from calib_core.estimation.errors_in_variables import fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution
from calib_core.estimation.mirror_test import MIRRORED_GAIN, NOT_MIRRORED_GAIN
from calib_core.geometry import RigidTransform
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar
from calib_core.results import DataWarning

__all__ = ["assumed_axes", "camera_position", "mirrored_axes", "two_poses"]

_ALMOST_AS_LIKELY = 6.0  # a difference of twice the log-likelihood
_OTHER_POSE_RAD = np.deg2rad(5.0)
_OTHER_POSE_SIGMAS = 6.0
_FAR_CAMERA = 3.0
_CONTRADICTION_SIGMAS = 4.0
_LEAST_CHI2_PER_DEGREE = 1.6
_PLANE_ROUNDS = 6
_NORMAL_QUANTILE_99 = 2.33


def mirrored_axes(fit: SolvedFit) -> list[DataWarning]:
    """Warn if mirrored radar axes are more likely, or about as likely."""
    if fit.mirror_gain > MIRRORED_GAIN:
        return [
            DataWarning(
                "mirrored-axes",
                "pairs and expected camera position agree better with one radar axis mirrored "
                f"(log-likelihood ratio {fit.mirror_gain / 2:.1f}): the radar's axes look left-handed",
                "radar axes must be x forward, y left, z up: flip the sign of y (or of the elevation) at the source; "
                "do not use this pose",
            )
        ]
    if fit.mirror_gain > NOT_MIRRORED_GAIN:
        return [
            DataWarning(
                "handedness-open",
                "a mirrored radar axis would explain the pairs about as well: all placements lie near one plane",
                "measure the camera position with a tape, or add placements at other heights (a tripod)",
            )
        ]
    return []


def assumed_axes(fit: SolvedFit) -> list[DataWarning]:
    """Warn if only the expected camera distance, and not the pairs, rules out mirrored axes."""
    already_warned = fit.mirror_gain > NOT_MIRRORED_GAIN or fit.measurements.flat
    if already_warned or fit.measurements.prior.measured or _heights_decide(fit):
        return []
    return [
        DataWarning(
            "handedness-assumed",
            "the placements lie near one plane, so mirrored radar axes fit equally well: that none is mirrored is inferred "
            f"only from the camera being within about {fit.measurements.prior.sigma_m:g} m of the radar",
            "measure the camera position (0.3 m is enough for this), or add placements at other heights (a tripod)",
        )
    ]


def _heights_decide(fit: SolvedFit) -> bool:
    """Return whether the placements are far enough from any plane that the pairs alone rule out mirrored axes.

    Mirrored axes with a rotated camera are a reflection in some plane, which moves a placement by twice its height h above
    that plane. Twice the log-likelihood therefore falls by about sum (2 h / sigma)^2 with the true heights, by
    4 (chi2 - (n - 3)) with measured ones; the limit includes the 99 % quantile of the noise of that figure.
    """
    measurements, rows = fit.refined.measurements, fit.refined.rows[fit.inliers]
    points = cartesian_from_polar(measurements.polar[rows])
    covariances = covariance_from_sigma_polar(points, measurements.sigma_polar[rows])
    weights, chi2 = np.ones(len(points)), np.inf
    for _ in range(_PLANE_ROUNDS):
        offsets = points - (weights @ points) / weights.sum()
        normal = np.linalg.svd(offsets * np.sqrt(weights)[:, None])[2][2]
        weights = 1.0 / np.einsum("i,nij,j->n", normal, covariances, normal)
        chi2 = min(chi2, float(weights @ (offsets @ normal) ** 2))
    redundancy = max(len(points) - 3, 1)
    return 4.0 * (chi2 - redundancy) > MIRRORED_GAIN + 4.0 * _NORMAL_QUANTILE_99 * np.sqrt(2.0 * redundancy)


def two_poses(fit: SolvedFit) -> list[DataWarning]:
    """Warn if two poses explain the pairs about equally well (a plane seen from far away has two)."""
    best = fit.alternatives[0]
    for other in fit.alternatives[1:]:
        error = other.camera_from_radar.error_from(fit.refined.camera_from_radar)
        apart_rad = float(np.linalg.norm(error[3:]))
        sigmas = float(np.sqrt(error @ fit.uncertainty.pose_information @ error))
        if other.cost - best.cost < _ALMOST_AS_LIKELY and apart_rad > _OTHER_POSE_RAD and sigmas > _OTHER_POSE_SIGMAS:
            return [
                DataWarning(
                    "two-poses",
                    f"another pose, {np.rad2deg(apart_rad):.0f} deg away, explains the pairs almost as well",
                    "measure the camera position with a tape, or add placements nearer and farther than the present ones",
                )
            ]
    return []


def camera_position(fit: SolvedFit) -> list[DataWarning]:
    """Warn if the camera position contradicts the tape measure, or is much farther away than expected."""
    if fit.measurements.prior.measured:
        return _contradicted_position(fit)
    prior = fit.measurements.prior
    away_m = float(np.linalg.norm(_camera_centre(fit.refined.camera_from_radar) - prior.position_m))
    if away_m <= _FAR_CAMERA * prior.sigma_m:
        return []
    return [
        DataWarning(
            "camera-far-away",
            f"the solved camera position is {away_m:.1f} m from the radar; about {prior.sigma_m:g} m was expected",
            "if the sensors really are that far apart, set the nominal distance; otherwise check axes and intrinsics",
        )
    ]


def _contradicted_position(fit: SolvedFit) -> list[DataWarning]:
    """Compare the measured camera position with the one from the pairs alone.

    A position with a small sigma overrides the pairs and only makes the residuals large, so it becomes a weak prior here.
    """
    prior = fit.measurements.prior
    if fit.chi2_per_degree < _LEAST_CHI2_PER_DEGREE:
        return []
    start = GncSolution(fit.refined.camera_from_radar, 0.0, float(fit.refined.noise_scale.max()))
    alone = fit_errors_in_variables(replace(fit.measurements, prior=prior.weakened()), start, estimate_scale=True)
    away_m = _camera_centre(alone.camera_from_radar) - prior.position_m
    centre_jacobian = prior.rows(alone.camera_from_radar)[1] * prior.sigma_m
    difference_covariance = centre_jacobian @ pose_covariance(
        alone
    ).covariance @ centre_jacobian.T + prior.sigma_m**2 * np.eye(3)
    sigmas = float(np.sqrt(away_m @ np.linalg.solve(difference_covariance, away_m)))
    if sigmas < _CONTRADICTION_SIGMAS:
        return []
    return [
        DataWarning(
            "camera-position-contradicted",
            f"the pairs alone place the camera {100 * np.linalg.norm(away_m):.0f} cm from the measured position, "
            f"{sigmas:.1f} standard deviations",
            "measure again from the radar's antennas to the lens: forward, left, up; or state a larger uncertainty",
        )
    ]


def _camera_centre(camera_from_radar: RigidTransform) -> np.ndarray:
    return camera_from_radar.inverse().translation_m
