"""Measured camera position: how far do the pairs believe it?

The pairs are fitted without the position first. Its distance a from the camera of that fit, with covariance C, tells how far
it may be off: with V0 the variance that it has where the pairs say nothing, its expected error is e = V0 (V0 + C)^-1 a, so
that its variance is V1 = (nu sigma^2 + |e|^2) / (nu - 2). A position that was measured to another point, with a wrong sign or
in another unit is off by much more, with the variance W. So it is right with the probability

    q = (1 - p) t(a; C + V0) / ((1 - p) t(a; C + V0) + p t(a; C + W)),                                   (4)

t being the density of a distance whose scale the pairs estimated, and p the share of such slips.

The answer is the mean of the pose with it, with q, and the pose without it. That is the pose of a position with the variance
V1 / q + C (1 - q) / q, and the covariance grows by q (1 - q) times the square of the difference of the two poses, which is
C (C + V1)^-1 a. So a camera measured to the housing, or with a wrong sign, does not pull the pose along, and a click that is
moved a little moves the pose a little. A weight that depended on the pose it shapes would have two answers.
"""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix33, Matrix66, Values, Vector3
from calib_core.estimation.covariance import pose_covariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution
from calib_core.estimation.measurement_model import CameraPrior, PairMeasurements
from calib_core.estimation.plausibility import UNITS_M
from calib_core.estimation.pose_posterior import LARGEST_EXPONENT
from calib_core.geometry import RigidTransform, camera_position_jacobian
from calib_core.measurements import MIN_PAIRS
from calib_core.radar import cartesian_from_polar

_SLIP_PROBABILITY = 0.02  # p: of positions measured to another point of the housing, with a wrong sign, in another unit
_SLIP_SIGMA_M, _SLIP_SIGMAS = 0.3, 3.0
"""Per axis: the size of housings and mounts; and more than the tape is off anyway."""
_LEAST_PROBABILITY = 0.01  # probability q below which a position has no weight; its variance V1 / q is 100 V1 there
_OTHER_UNIT_SIGMAS, _AGREEING_SIGMAS = 4.0, 3.0
"""By which a camera is not at the radar, and within which it is at another reading: exceeded by chance in 0.1 % and 3 %
(chi-square with three degrees of freedom)."""

_UNIT_SLIPS = (
    *(("position", unit, factor) for unit, factor in UNITS_M.items()),
    ("ranges", "feet", 1.0 / UNITS_M["feet"]),
)
"""What may have another unit, which one, and the factor on the measured position that this makes."""


@dataclass(frozen=True, slots=True, eq=False)
class WeighedPosition:
    """A measured camera position as the pairs leave it.

    Attributes:
        prior: with the standard deviation that it has in the fit; not a measured one where it has no weight.
        doubt: (6,) of the pose, (dt, dtheta): its outer product is the covariance of not knowing whether the position is right.
        probability: q that it is right; the share of it in the pose.
        chance: the share of right positions that are as far away or farther.
        away_m: of the camera from the measured position, by the pairs alone.
        sigmas: the same in standard deviations.
        misread: what would not contradict it if it were read in another way, "position" or "ranges"; empty if neither.
        unit: which unit that is, or "level" for a position along the ground instead of the radar's axes; empty if none.
    """

    prior: CameraPrior
    doubt: Values
    probability: float
    chance: float
    away_m: float
    sigmas: float
    misread: str
    unit: str


def weighed_position(
    measurements: PairMeasurements, start: GncSolution, *, estimate_scale: bool
) -> tuple[WeighedPosition, ErrorsInVariablesFit]:
    """Fit the pairs without the measured camera position, weigh it by that, and fit them with it.

    Args:
        measurements: all pairs with the assumed noise, and the position as it was measured.
        start: of the fit.
        estimate_scale: estimate the noise level.
    """
    prior = measurements.prior
    weakened = replace(measurements, prior=prior.weakened())
    alone = fit_errors_in_variables(weakened, start, estimate_scale=estimate_scale, coarse=True)
    centre = _Centre.of(alone.camera_from_radar, pose_covariance(alone).covariance)
    freedom = alone.degrees_of_freedom or np.inf
    away_m = prior.position_m - centre.position_m
    variance_m2 = prior.expected_variance_m2(np.zeros(3))
    slip_m2 = variance_m2 + max(_SLIP_SIGMA_M, _SLIP_SIGMAS * prior.sigma_m) ** 2
    right, slip = (_log_density(centre, away_m, v, freedom) for v in (variance_m2, slip_m2))
    odds = np.log(1.0 / _SLIP_PROBABILITY - 1.0) + right - slip
    probability = float(1.0 / (1.0 + np.exp(min(-odds, LARGEST_EXPONENT))))
    sigmas = centre.sigmas_from(prior.position_m, variance_m2**0.5)
    chance = _chance(sigmas, freedom)
    variance_m2 = prior.expected_variance_m2(variance_m2 * centre.solved(away_m, variance_m2))
    difference = centre.mixed @ centre.solved(away_m, variance_m2)
    weighed = weakened.prior
    if probability > _LEAST_PROBABILITY:
        unbelieved_m2 = (1.0 - probability) * float(np.trace(centre.covariance_m2)) / 3.0
        weighed = prior.weighed_with(float(np.sqrt((variance_m2 + unbelieved_m2) / probability)))
    position = WeighedPosition(
        weighed,
        np.sqrt(probability * (1.0 - probability)) * difference,
        probability,
        chance,
        float(np.linalg.norm(away_m)),
        sigmas,
        *_misreading(centre, prior, _level(alone)),
    )
    near = GncSolution(alone.camera_from_radar, 0.0, 1.0)
    scale = alone.noise_scale.tolist()
    again = replace(measurements, prior=weighed, errors=alone.measurements.errors)
    return position, fit_errors_in_variables(again, near, estimate_scale=estimate_scale, noise_scale=scale)


@dataclass(frozen=True, slots=True, eq=False)
class _Centre:
    """The camera centre from the pairs alone, (3,) [m], its covariance (3, 3), and (6, 3) that of the pose with it."""

    position_m: Vector3
    covariance_m2: Matrix33
    mixed: np.ndarray

    @classmethod
    def of(cls, camera_from_radar: RigidTransform, covariance: Matrix66) -> "_Centre":
        """Take it from a pose."""
        jacobian = camera_position_jacobian(camera_from_radar)
        mixed = covariance @ jacobian.T
        return cls(camera_from_radar.inverse().translation_m, jacobian @ mixed, mixed)

    def solved(self, away_m: Vector3, variance_m2: float) -> Vector3:
        """Return (C + V)^-1 away (3,), with V the variance per axis of the position that it is away from."""
        return np.asarray(np.linalg.solve(self.covariance_m2 + variance_m2 * np.eye(3), away_m))

    def sigmas_from(self, position_m: Vector3, sigma_m: float) -> float:
        """Return the distance from a position that was measured with a standard deviation, in standard deviations."""
        away_m = self.position_m - position_m
        return float(np.sqrt(away_m @ self.solved(away_m, sigma_m**2)))


def _log_density(centre: _Centre, away_m: Vector3, variance_m2: float, freedom: float) -> float:
    """Return the log-density of a distance (3,) with the variance C + V, up to a constant: Student's t, or normal."""
    squared = float(away_m @ centre.solved(away_m, variance_m2))
    spread = centre.covariance_m2 + variance_m2 * np.eye(3)
    tail = squared if np.isinf(freedom) else (freedom + 3.0) * np.log1p(squared / freedom)
    return -0.5 * (float(np.linalg.slogdet(spread)[1]) + float(tail))


def _chance(sigmas: float, freedom: float) -> float:
    """Return the probability that a right position is as far away, in standard deviations: chi-square, or F(3, nu)."""
    from scipy.special import chdtrc, fdtrc

    return float(chdtrc(3.0, sigmas**2) if np.isinf(freedom) else fdtrc(3.0, freedom, sigmas**2 / 3.0))


def _misreading(centre: _Centre, prior: CameraPrior, to_radar: Matrix33) -> tuple[str, str]:
    """Return what would not contradict the pairs if it were read in another way, and in which.

    Divided by a hundred, any position is at the radar: only a camera that the pairs place away from it tells.

    Args:
        centre: of the camera, by the pairs alone.
        prior: the position as it was measured.
        to_radar: rotation to the radar's axes from those along the ground.
    """
    if centre.sigmas_from(np.zeros(3), prior.sigma_m) <= _OTHER_UNIT_SIGMAS:
        return "", ""
    slips = {(misread, unit): factor * prior.position_m for misread, unit, factor in _UNIT_SLIPS}
    slips["position", "level"] = to_radar @ prior.position_m
    nearest = min(slips, key=lambda slip: centre.sigmas_from(slips[slip], prior.sigma_m))
    return nearest if centre.sigmas_from(slips[nearest], prior.sigma_m) < _AGREEING_SIGMAS else ("", "")


def _level(fit: ErrorsInVariablesFit) -> Matrix33:
    """Return the rotation from axes along the plane of the placements, forward as the radar looks, to the radar's."""
    points = cartesian_from_polar(fit.polar[:, fit.inliers].T)
    if len(points) < MIN_PAIRS:
        return np.eye(3)
    up = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][2]
    up = up * (1.0 if up[2] >= 0.0 else -1.0)
    left = np.cross(up, (1.0, 0.0, 0.0))
    # length of a unit vector's part, a choice: only placements across the radar's x axis have a shorter one
    left = left / max(float(np.linalg.norm(left)), 1e-9)
    return np.column_stack([np.cross(left, up), left, up])
