"""Warnings about the pose as a whole: a second pose, and an implausible camera position."""

from dataclasses import replace

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.covariance import pose_covariance
from calib_core.estimation.errors_in_variables import fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution
from calib_core.geometry import RigidTransform
from calib_core.results import DataWarning

__all__ = ["camera_position", "two_poses"]

_ALMOST_AS_LIKELY = 6.0  # a difference of twice the log-likelihood
_OTHER_POSE_RAD = np.deg2rad(5.0)
_OTHER_POSE_SIGMAS = 6.0
_FAR_CAMERA = 3.0
_CONTRADICTION_SIGMAS = 4.0
_SCREENING_SIGMAS = 1.8


def two_poses(fit: SolvedFit) -> list[DataWarning]:
    """Warn if two poses explain the pairs about equally well (a plane seen from far away has two)."""
    best = fit.alternatives[0]
    for other in fit.alternatives[1:]:
        error = other.camera_from_radar.error_from(fit.refined.camera_from_radar)
        apart_rad = float(np.linalg.norm(error[3:]))
        sigmas = float(np.sqrt(error @ fit.uncertainty.information @ error))
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

    A position with a small sigma overrides the pairs and only makes the residuals large, or not even that, so it becomes a
    weak prior here. One step from the solved pose tells whether the fit without it is needed.
    """
    prior, refined = fit.refined.measurements.prior, fit.refined
    residual, jacobian = prior.rows(refined.camera_from_radar)
    weak_jacobian = prior.weakened().rows(refined.camera_from_radar)[1]
    information = fit.uncertainty.information - jacobian.T @ jacobian + weak_jacobian.T @ weak_jacobian
    step = -np.linalg.solve(information, jacobian.T @ residual)
    moved = refined.camera_from_radar.perturbed(step)
    if _away_in_sigmas(fit, moved, np.linalg.inv(information)) < _SCREENING_SIGMAS:
        return []
    start = GncSolution(refined.camera_from_radar, 0.0, float(refined.noise_scale.max()))
    weakened = replace(fit.measurements, prior=prior.weakened())
    alone = fit_errors_in_variables(weakened, start, estimate_scale=fit.options.noise.estimate_scale)
    sigmas = _away_in_sigmas(fit, alone.camera_from_radar, pose_covariance(alone).covariance)
    if sigmas < _CONTRADICTION_SIGMAS:
        return []
    away_m = float(np.linalg.norm(_camera_centre(alone.camera_from_radar) - prior.position_m))
    return [
        DataWarning(
            "camera-position-contradicted",
            f"the pairs alone place the camera {100 * away_m:.0f} cm from the measured position, "
            f"{sigmas:.1f} standard deviations",
            "measure again from the radar's antennas to the lens: forward, left, up; or state a larger uncertainty",
        )
    ]


def _away_in_sigmas(fit: SolvedFit, camera_from_radar: RigidTransform, covariance: Matrix66) -> float:
    """Return the distance of a pose's camera centre from the measured one, in standard deviations of their difference.

    The clicked point may be off the radar's phase centre, which moves the position that the pairs give by as much.
    """
    prior = fit.measurements.prior
    away_m = _camera_centre(camera_from_radar) - prior.position_m
    centre = prior.rows(camera_from_radar)[1] * prior.sigma_m
    tape_m2 = prior.sigma_m**2 + fit.options.reflector.offset_sigma_m**2
    return float(np.sqrt(away_m @ np.linalg.solve(centre @ covariance @ centre.T + tape_m2 * np.eye(3), away_m)))


def _camera_centre(camera_from_radar: RigidTransform) -> np.ndarray:
    return camera_from_radar.inverse().translation_m
