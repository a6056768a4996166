"""Warnings about the pose as a whole: a second pose, and an implausible camera position."""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix33, Matrix66, Vector3
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
_AGREEING_SIGMAS = 3.0
_UNIT_SLIPS = (
    ("the measured position looks like centimetres", 0.01, 2.0),
    ("the measured position looks like millimetres", 0.001, 2.0),
    ("the measured position looks like feet", 0.3048, 0.0),
    ("the radar's ranges look like feet", 1.0 / 0.3048, 0.0),
)
"""What would remove a contradiction, the factor on the measured position, and the smallest position [m] it is said of."""


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
    moved = refined.camera_from_radar.perturbed(-np.linalg.solve(information, jacobian.T @ residual))
    if _Centre.of(fit, moved, np.linalg.inv(information)).sigmas_from(prior.position_m) < _SCREENING_SIGMAS:
        return []
    start = GncSolution(refined.camera_from_radar, 0.0, float(refined.noise_scale.max()))
    weakened = replace(fit.measurements, prior=prior.weakened())
    alone = fit_errors_in_variables(weakened, start, estimate_scale=fit.options.noise.estimate_scale)
    centre = _Centre.of(fit, alone.camera_from_radar, pose_covariance(alone).covariance)
    sigmas = centre.sigmas_from(prior.position_m)
    if sigmas < _CONTRADICTION_SIGMAS:
        return []
    away_m = float(np.linalg.norm(centre.position_m - prior.position_m))
    return [
        DataWarning(
            "camera-position-contradicted",
            f"the pairs alone place the camera {100 * away_m:.0f} cm from the measured position, "
            f"{sigmas:.1f} standard deviations{_other_unit(centre, prior.position_m)}",
            "measure again from the radar's antennas to the lens: forward, left, up; or state a larger uncertainty",
        )
    ]


@dataclass(frozen=True, slots=True, eq=False)
class _Centre:
    """The camera centre from the pairs alone, (3,) [m], with the covariance (3, 3) of its distance from the measured one."""

    position_m: Vector3
    covariance_m2: Matrix33

    @classmethod
    def of(cls, fit: SolvedFit, camera_from_radar: RigidTransform, covariance: Matrix66) -> "_Centre":
        """Take it from a pose; the clicked point may be off the radar's phase centre, which moves it by as much."""
        prior = fit.measurements.prior
        jacobian = prior.rows(camera_from_radar)[1] * prior.sigma_m
        measured_m2 = prior.sigma_m**2 + fit.options.reflector.offset_sigma_m**2
        return cls(_camera_centre(camera_from_radar), jacobian @ covariance @ jacobian.T + measured_m2 * np.eye(3))

    def sigmas_from(self, position_m: Vector3) -> float:
        """Return the distance from a position in standard deviations."""
        away_m = self.position_m - position_m
        return float(np.sqrt(away_m @ np.linalg.solve(self.covariance_m2, away_m)))


def _other_unit(centre: _Centre, measured_m: Vector3) -> str:
    """Return in words which other unit would remove the contradiction; empty if none would."""
    size_m = float(np.linalg.norm(measured_m))
    for text, factor, least_m in _UNIT_SLIPS:
        clear = centre.sigmas_from(np.zeros(3)) > _CONTRADICTION_SIGMAS or least_m > 0.0
        if clear and size_m > least_m and centre.sigmas_from(factor * measured_m) < _AGREEING_SIGMAS:
            return f"; {text}"
    return ""


def _camera_centre(camera_from_radar: RigidTransform) -> np.ndarray:
    return camera_from_radar.inverse().translation_m
