"""Measured camera position: do the pairs contradict it?

The position that the pairs alone give is compared with the measured one. If it is farther away than that of one right set in
thirty-three, the measured position is left out: a camera measured to the housing, or with a wrong sign, would otherwise pull the
pose along and leave its residuals small.
"""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix33, Matrix66, Vector3
from calib_core.estimation.covariance import pose_covariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution, normal_equations
from calib_core.estimation.measurement_model import CameraPrior, PairMeasurements
from calib_core.geometry import RigidTransform

_LEVEL = 0.03  # probability that a right position is farther from that of the pairs
_SCREENING_SIGMAS = 1.8
_OTHER_UNIT_SIGMAS = 4.0
_AGREEING_SIGMAS = 3.0

_UNIT_SLIPS = (
    ("the measured position looks like centimetres", 0.01, 2.0),
    ("the measured position looks like millimetres", 0.001, 2.0),
    ("the measured position looks like feet", 0.3048, 0.0),
    ("the radar's ranges look like feet", 1.0 / 0.3048, 0.0),
)
"""What would remove a contradiction, the factor on the measured position, and the smallest position [m] it is said of."""


@dataclass(frozen=True, slots=True, eq=False)
class ContradictedPosition:
    """A measured camera position that the pairs contradict, and the fit without it.

    Attributes:
        measurements: all pairs with the assumed noise; the position is but a weak prior.
        refined: their fit.
        away_m: of the camera from the measured position, by the pairs alone.
        sigmas: the same in standard deviations.
        other_unit: which unit would remove the contradiction, in words; empty if none would.
    """

    measurements: PairMeasurements
    refined: ErrorsInVariablesFit
    away_m: float
    sigmas: float
    other_unit: str


def contradicted_position(
    measurements: PairMeasurements, refined: ErrorsInVariablesFit, *, estimate_scale: bool
) -> ContradictedPosition | None:
    """Fit the pairs without the measured camera position; None if there is none, or they agree with it.

    One step from the fit tells whether the other fit is needed.

    Args:
        measurements: all pairs with the assumed noise.
        refined: their fit.
        estimate_scale: estimate the noise level.
    """
    prior = measurements.prior
    if not prior.measured or _distance_after_one_step(refined, prior) < _SCREENING_SIGMAS:
        return None
    weakened = replace(measurements, prior=prior.weakened())
    start = GncSolution(refined.camera_from_radar, 0.0, float(refined.noise_scale.max()))
    alone = fit_errors_in_variables(weakened, start, estimate_scale=estimate_scale)
    centre = _Centre.of(alone.camera_from_radar, pose_covariance(alone).covariance, prior)
    sigmas = centre.sigmas_from(prior.position_m)
    if sigmas < _contradiction_sigmas(alone.degrees_of_freedom):
        return None
    away_m = float(np.linalg.norm(centre.position_m - prior.position_m))
    return ContradictedPosition(weakened, alone, away_m, sigmas, _other_unit(centre, prior.position_m))


def _distance_after_one_step(refined: ErrorsInVariablesFit, prior: CameraPrior) -> float:
    """Return the distance of the camera from the measured position, in standard deviations, by one step without it."""
    weak = replace(refined.measurements, prior=prior.weakened())
    hessian, gradient = normal_equations(weak, refined.camera_from_radar, refined.model, refined.weights)
    covariance = np.linalg.inv(hessian)
    moved = refined.camera_from_radar.perturbed((covariance @ gradient)[:6])
    return _Centre.of(moved, covariance[:6, :6], prior).sigmas_from(prior.position_m)


def _contradiction_sigmas(degrees_of_freedom: float) -> float:
    """Return the distance in standard deviations that a right position exceeds in 3 % of the sets: 3 F(3, nu), or chi-square."""
    from scipy.special import chdtri, fdtri

    if degrees_of_freedom <= 0:
        return float(np.sqrt(chdtri(3.0, _LEVEL)))
    return float(np.sqrt(3.0 * fdtri(3.0, degrees_of_freedom, 1.0 - _LEVEL)))


@dataclass(frozen=True, slots=True, eq=False)
class _Centre:
    """The camera centre from the pairs alone, (3,) [m], with the covariance (3, 3) of its distance from the measured one."""

    position_m: Vector3
    covariance_m2: Matrix33

    @classmethod
    def of(cls, camera_from_radar: RigidTransform, covariance: Matrix66, measured: CameraPrior) -> "_Centre":
        """Take it from a pose."""
        jacobian = measured.centre_jacobian(camera_from_radar)
        covariance_m2 = jacobian @ covariance @ jacobian.T + measured.sigma_m**2 * np.eye(3)
        return cls(camera_from_radar.inverse().translation_m, covariance_m2)

    def sigmas_from(self, position_m: Vector3) -> float:
        """Return the distance from a position in standard deviations."""
        away_m = self.position_m - position_m
        return float(np.sqrt(away_m @ np.linalg.solve(self.covariance_m2, away_m)))


def _other_unit(centre: _Centre, measured_m: Vector3) -> str:
    """Return in words which other unit would remove the contradiction; empty if none would."""
    size_m = float(np.linalg.norm(measured_m))
    for text, factor, least_m in _UNIT_SLIPS:
        clear = centre.sigmas_from(np.zeros(3)) > _OTHER_UNIT_SIGMAS or least_m > 0.0
        if clear and size_m > least_m and centre.sigmas_from(factor * measured_m) < _AGREEING_SIGMAS:
            return text
    return ""
