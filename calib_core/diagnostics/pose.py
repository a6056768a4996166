"""Warnings about the pose as a whole: a second pose, also among the samples of the posterior or of the pairs set aside, and an
implausible camera position."""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix33, Matrix66, Values, Vector3
from calib_core.diagnostics.pairs import listed
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.covariance import pose_covariance
from calib_core.estimation.errors_in_variables import fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution, associate, mixture_cost
from calib_core.geometry import RigidTransform
from calib_core.results import DataWarning

_ALMOST_AS_LIKELY = 6.0  # a difference of twice the log-likelihood
_WORTH_REFINING = 40.0
_OTHER_POSE_SIGMAS = 6.0
_LEAST_PROBABILITY = 0.05
_OTHER_PEAK_SIGMAS = 4.0


def two_poses(fit: SolvedFit) -> list[DataWarning]:
    """Warn if two poses explain the pairs about equally well, or if only the expected distance of the camera decides.

    A plane seen from far away has two poses, and so have returns with a constant companion. The scores of the candidates are
    left out of one comparison: what makes the companion echo more than the reflector does so at every placement.
    """
    for other in fit.alternatives[1:]:
        error = other.camera_from_radar.error_from(fit.refined.camera_from_radar)
        sigmas = float(np.sqrt(error @ fit.uncertainty.pose_information @ error))
        if sigmas <= _OTHER_POSE_SIGMAS:
            continue
        away = (
            f"{np.rad2deg(np.linalg.norm(error[3:])):.1f} deg and {_moved_m(fit, other):.2f} m away ({sigmas:.0f} standard "
            "deviations)"
        )
        if min(other.cost - fit.alternatives[0].cost, _cost_without_scores(fit, other)) < _ALMOST_AS_LIKELY:
            return [_two_poses(fit, other, away)]
        if _cost_without_prior(fit, other) < _ALMOST_AS_LIKELY:
            return [_assumed_distance(fit, other, away)]
    return []


def _two_poses(fit: SolvedFit, other: GncSolution, away: str) -> DataWarning:
    measurements = fit.refined.measurements
    changed = associate(measurements, other.camera_from_radar)[0] != fit.refined.rows
    names = [name for name, differs, inlier in zip(fit.ids, changed, fit.inliers, strict=True) if differs and inlier]
    if not names:
        return DataWarning(
            "two-poses",
            f"another pose, {away}, explains the pairs almost as well",
            "measure the camera position with a tape, or add placements nearer and farther than the present ones",
        )
    return DataWarning(
        "two-poses",
        f"another pose, {away}, explains the pairs almost as well, with other radar positions for {len(names)} of them",
        f"check in the radar view which of the returns is the reflector, for example at {names[0]}: something may always stand "
        "near it; or measure the camera position with a tape",
    )


def _assumed_distance(fit: SolvedFit, other: GncSolution, away: str) -> DataWarning:
    here_m, there_m = (
        float(np.linalg.norm(_camera_centre(one.camera_from_radar))) for one in (fit.alternatives[0], other)
    )
    return DataWarning(
        "camera-far-away",
        f"another pose, {away}, explains the pairs as well; the one with the camera {here_m:.1f} m from the radar, not "
        f"{there_m:.1f} m, was chosen only because about {fit.measurements.prior.sigma_m:g} m is expected",
        "are both sensors on the same rig, or how far apart? Set the nominal distance, or measure the camera position",
    )


def _cost_without_scores(fit: SolvedFit, other: GncSolution) -> float:
    """Return how much less likely another pose is if all candidates of a pair are equally plausible."""
    if fit.measurements.one_to_one:
        return np.inf
    share = -np.log(np.diff(fit.measurements.first))[fit.measurements.owner]
    cost = mixture_cost(replace(fit.refined.measurements, log_score=share), fit.refined.camera_from_radar)
    coarse = mixture_cost(replace(fit.refined.measurements, log_score=share), other.camera_from_radar) - cost
    if not _ALMOST_AS_LIKELY <= coarse < _WORTH_REFINING:
        return coarse
    estimate_scale = fit.options.noise.estimate_scale
    equal = replace(fit.measurements, log_score=share)
    there = fit_errors_in_variables(equal, other, estimate_scale=estimate_scale, coarse=True)
    return mixture_cost(there.measurements, there.camera_from_radar) - cost


def _cost_without_prior(fit: SolvedFit, other: GncSolution) -> float:
    """Return how much less likely another pose is by the pairs alone."""
    prior = fit.measurements.prior
    if prior.measured:
        return np.inf
    by_pairs = [
        one.cost - float(prior.costs(one.camera_from_radar.rotation, one.camera_from_radar.translation_m))
        for one in (other, fit.alternatives[0])
    ]
    return by_pairs[0] - by_pairs[1]


def _moved_m(fit: SolvedFit, other: GncSolution) -> float:
    """Return the distance between the camera centres of the solved pose and another."""
    here, there = _camera_centre(fit.refined.camera_from_radar), _camera_centre(other.camera_from_radar)
    return float(np.linalg.norm(here - there))


def possible_poses(fit: SolvedFit) -> list[DataWarning]:
    """Warn if the samples of the posterior lie about several separate poses."""
    here = fit.refined.camera_from_radar
    for other in fit.beyond.possible:
        error = other.camera_from_radar.error_from(here)
        sigmas = float(np.sqrt(error @ np.linalg.solve(fit.uncertainty.covariance, error)))
        if other.probability >= _LEAST_PROBABILITY and sigmas > _OTHER_PEAK_SIGMAS:
            return [
                DataWarning(
                    "two-poses",
                    f"another pose, {_away(error)}, has a probability of {100 * other.probability:.0f} %: which of the pairs "
                    "are wrong is not clear",
                    "measure the camera position with a tape, or add placements nearer and farther than the present ones",
                )
            ]
    return []


def agreeing_outliers(fit: SolvedFit) -> list[DataWarning]:
    """Name the outliers that agree among themselves on another pose."""
    found = fit.beyond.agreeing
    if found is None:
        return []
    names = [fit.ids[i] for i in found.pairs]
    return [
        DataWarning(
            "agreeing-outliers",
            f"{len(names)} pairs that were set aside agree on another pose, {_away(found.difference)}: {listed(names)}",
            "check which group shows the reflector: an object that always stands near it, such as a cart, or a second "
            "reflector gives such a group; exclude the wrong one",
        )
    ]


def _away(error: Values) -> str:
    """Return in words how far a pose error (6,) is."""
    return f"{np.rad2deg(np.linalg.norm(error[3:])):.1f} deg and {100 * np.linalg.norm(error[:3]):.0f} cm away"


_CONTRADICTION_LEVEL = 0.99
_OTHER_UNIT_SIGMAS = 4.0
_SCREENING_SIGMAS = 1.8
_AGREEING_SIGMAS = 3.0

_UNIT_SLIPS = (
    ("the measured position looks like centimetres", 0.01, 2.0),
    ("the measured position looks like millimetres", 0.001, 2.0),
    ("the measured position looks like feet", 0.3048, 0.0),
    ("the radar's ranges look like feet", 1.0 / 0.3048, 0.0),
)
"""What would remove a contradiction, the factor on the measured position, and the smallest position [m] it is said of."""


def camera_position(fit: SolvedFit) -> list[DataWarning]:
    """Warn if the pairs contradict the measured camera position.

    A position with a small sigma overrides the pairs and only makes the residuals large, or not even that, so it becomes a
    weak prior here. One step from the solved pose tells whether the fit without it is needed.
    """
    if not fit.measurements.prior.measured:
        return []
    prior, refined = fit.refined.measurements.prior, fit.refined
    residual, jacobian = prior.rows(refined.camera_from_radar)
    weak_jacobian = prior.weakened().rows(refined.camera_from_radar)[1]
    information = fit.uncertainty.information.copy()
    information[:6, :6] += weak_jacobian.T @ weak_jacobian - jacobian.T @ jacobian
    covariance = np.linalg.inv(information)[:6, :6]
    moved = refined.camera_from_radar.perturbed(-covariance @ jacobian.T @ residual)
    if _Centre.of(fit, moved, covariance).sigmas_from(prior.position_m) < _SCREENING_SIGMAS:
        return []
    start = GncSolution(refined.camera_from_radar, 0.0, float(refined.noise_scale.max()))
    weakened = replace(fit.measurements, prior=prior.weakened())
    alone = fit_errors_in_variables(weakened, start, estimate_scale=fit.options.noise.estimate_scale)
    centre = _Centre.of(fit, alone.camera_from_radar, pose_covariance(alone).covariance)
    sigmas = centre.sigmas_from(prior.position_m)
    if sigmas < _contradiction_sigmas(alone.degrees_of_freedom):
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


def _contradiction_sigmas(degrees_of_freedom: float) -> float:
    """Return the distance in standard deviations that a right position exceeds in 1 % of the sets: 3 F(3, nu), or chi-square."""
    from scipy.special import chdtri, fdtri

    if degrees_of_freedom <= 0:
        return float(np.sqrt(chdtri(3.0, 1.0 - _CONTRADICTION_LEVEL)))
    return float(np.sqrt(3.0 * fdtri(3.0, degrees_of_freedom, _CONTRADICTION_LEVEL)))


@dataclass(frozen=True, slots=True, eq=False)
class _Centre:
    """The camera centre from the pairs alone, (3,) [m], with the covariance (3, 3) of its distance from the measured one."""

    position_m: Vector3
    covariance_m2: Matrix33

    @classmethod
    def of(cls, fit: SolvedFit, camera_from_radar: RigidTransform, covariance: Matrix66) -> "_Centre":
        """Take it from a pose."""
        prior = fit.measurements.prior
        jacobian = prior.centre_jacobian(camera_from_radar)
        measured_m2 = prior.sigma_m**2 * np.eye(3)
        return cls(_camera_centre(camera_from_radar), jacobian @ covariance @ jacobian.T + measured_m2)

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
            return f"; {text}"
    return ""


def _camera_centre(camera_from_radar: RigidTransform) -> np.ndarray:
    return camera_from_radar.inverse().translation_m
