"""Pose change: did the camera turn or move between two calibrations of the same sensors, and what change would have been noticed?

Two sets of pairs are fitted together, linearized about their own fits. The unknowns are a pose for each set and one value for
each error that both sets share, so that it cancels as far as the placements allow; the change is the difference of the poses.

Not shared are what a person's clicks and the reflector get wrong, unless it is the same person, the height of the placements and
the tilt of a radar without elevation, and smooth angle errors. A camera position that both sets state to the last digit was
measured once: it says where the camera is, and nothing of a change.
"""

from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Matrix66, Values, frozen_array
from calib_core.association.placement_groups import placement_groups
from calib_core.estimation.covariance import pose_covariance, symmetric_inverse, widening_rows
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.geometry import RigidTransform, squared_distance
from calib_core.measurements import MIN_PAIRS
from calib_core.options import ReflectorOptions
from calib_core.results import Calibration
from calib_core.results.radar_axes import mounting_moves
from calib_core.results.systematic_errors import SystematicError

AXES = ("roll", "pitch", "yaw", "forward", "left", "up")
"""Along the axes of the radar: turns of the camera about its own centre, then moves of it."""

POWER = 0.95
"""Share of the changes of a noticeable size that are noticed."""

_SAME_FIT = 1.0  # squared distance of a pose from that of its own pairs, in standard deviations
_MOST_FREEDOM = 1e6  # degrees of freedom for a known noise: F of infinitely many is NaN in SciPy
_HALVINGS, _MOST_NONCENTRAL = 60, 1e4
"""Number of steps, which reach the rounding of float64, and the end of the search: the square of 100 standard deviations."""
_OF_CLICKS = ("click_right_px", "click_down_px")
_OWNERS: Mapping[str, "Owner"] = {
    "azimuth_scale": "radar",
    "elevation_scale": "radar",
    "range_bias_m": "radar",
    "range_scale": "radar",
    "elevation_lean": "radar",
    "squared_height_m2": "session",
    "reflector_right_m": "person",
    "reflector_down_m": "person",
    "reflector_forward_m": "person",
}
"""Of every error that is not the lens's."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseChange:
    """How far a second pose is from a first one.

    Attributes:
        first: the first camera_from_radar.
        error: (6,) (dt, dtheta) of the second from the first [m, rad].
        covariance: (6, 6) of this error if nothing changed.
        freedom: degrees of freedom of the noise level in the covariance.
    """

    first: RigidTransform
    error: Values
    covariance: Matrix66
    freedom: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "error", frozen_array(self.error, (6,)))
        object.__setattr__(self, "covariance", frozen_array(self.covariance, (6, 6)))

    @property
    def squared(self) -> float:
        """Squared Mahalanobis distance of the error; NaN if the covariance is unknown or singular."""
        return squared_distance(self.error, self.covariance)

    @property
    def p_value(self) -> float:
        """Probability of an error this large if nothing changed."""
        from scipy.special import fdtrc

        return float(fdtrc(6.0, self.freedom, self.squared / 6.0))

    @property
    def sigmas(self) -> float:
        """The same as the number of standard deviations that one normal variable exceeds as rarely."""
        return sigmas_of(self.p_value, self.squared)

    def limit(self, level: float) -> float:
        """Return the squared distance that is exceeded with this probability if nothing changed."""
        from scipy.special import fdtri

        return float(6.0 * fdtri(6.0, self.freedom, 1.0 - level))

    def noticeable(self, level: float) -> Values:
        """Return the size (6,) along each of AXES [deg, then cm] that a test at this level notices in 95 % of cases."""
        moves = _unit_moves(self.first)
        information = np.einsum("ia,ij,ja->a", moves, np.linalg.inv(self.covariance), moves)
        sizes = np.sqrt(_noncentral(self.limit(level), self.freedom) / information)
        return np.concatenate([np.degrees(sizes[:3]), 100.0 * sizes[3:]])  # [cm/m]


def sigmas_of(p_value: float, squared: float) -> float:
    """Return how many standard deviations one normal variable exceeds as rarely as a test its limit.

    Args:
        p_value: of the test.
        squared: of 6 degrees of freedom; it decides where p is 0 in floating point.
    """
    from scipy.special import ndtri, ndtri_exp

    if p_value > 0.0:
        return max(0.0, -float(ndtri(p_value / 2.0)))
    half = squared / 2.0
    return -float(ndtri_exp(np.log1p(half + half**2 / 2.0) - half - np.log(2.0)))


def level_of(sigmas: float) -> float:
    """Return how rarely one normal variable exceeds so many standard deviations."""
    from scipy.special import ndtr

    return 2.0 * float(ndtr(-sigmas))


def _unit_moves(pose: RigidTransform) -> np.ndarray:
    """Return the errors (6, 6) of a pose, one column per axis, that a turn of 1 rad or a move of 1 m makes, in first order."""
    moves = np.zeros((6, 6))
    moves[3:, :3] = pose.rotation
    moves[:3, :3] = np.cross(pose.rotation.T, pose.translation_m).T
    moves[:3, 3:] = -pose.rotation
    return moves


def _noncentral(limit: float, freedom: float) -> float:
    """Return the squared distance of a change with which the test exceeds its limit in 95 % of cases."""
    from scipy.special import ncfdtr

    low, high = 0.0, _MOST_NONCENTRAL
    for _ in range(_HALVINGS):  # importing scipy.optimize would take a third of a second
        middle = 0.5 * (low + high)
        low, high = (middle, high) if ncfdtr(6.0, freedom, middle, limit / 6.0) > 1.0 - POWER else (low, middle)
    return high


def pose_change(first: Calibration, second: Calibration, *, same_lens: bool, same_person: bool) -> PoseChange | str:
    """Fit the pairs of two calibrations of one radar and camera together; if they cannot be, return why.

    Args:
        first: with its pairs.
        second: with other pairs.
        same_lens: both were solved with the same intrinsics.
        same_person: the same person clicked the same reflector in both.
    """
    if _share_pairs(first, second):
        return "the two have pairs in common"
    sets = []
    for calibration in (first, second):
        fit = _refitted(calibration)
        if isinstance(fit, str):
            return fit
        sets.append(_Equations.of(fit, calibration))
    known: dict[Owner, bool] = {"radar": True, "lens": same_lens, "person": same_person}
    return _joined(sets[0], sets[1], {owner for owner, same in known.items() if same})


def _share_pairs(first: Calibration, second: Calibration) -> bool:
    marks = [{(*pair.pixel_px.tolist(), *pair.point_radar_m.tolist()) for pair in one.pairs} for one in (first, second)]
    return not marks[0].isdisjoint(marks[1])


def _refitted(calibration: Calibration) -> ErrorsInVariablesFit | str:
    """Fit the pairs of a calibration again from its pose; say what is wrong if they have none or another one."""
    kept = [pair.measured for pair in calibration.pairs if pair.measured is not None and not pair.excluded]
    options = calibration.options
    if len(kept) < MIN_PAIRS or not options.models_noise:
        return "one of the two keeps no pairs to solve again"
    groups = placement_groups(kept, options)
    camera, estimate_scale = calibration.given_camera or calibration.camera, options.noise.estimate_scale
    fit = fit_errors_in_variables(
        pair_measurements([group.pair for group in groups], camera, options),
        GncSolution(calibration.camera_from_radar, 0.0, 1.0),
        estimate_scale=estimate_scale,
        noise_scale=calibration.noise_scale if estimate_scale else None,
    )
    off = calibration.camera_from_radar.error_from(fit.camera_from_radar)
    if not squared_distance(off, calibration.covariance) <= _SAME_FIT:
        return "one of the two does not have the pose of its own pairs"
    return fit


Owner: TypeAlias = Literal["radar", "lens", "person", "session"]
"""Whose error it is: it is the same in two sets if this is."""


@dataclass(frozen=True, slots=True, eq=False)
class _Unknown:
    """An error with the standard deviation of its prior, and the column of the rows that it belongs to."""

    name: str
    owner: Owner
    sigma: float
    column: int


@dataclass(frozen=True, slots=True, eq=False)
class _Equations:
    """One set of pairs, linear in its pose (dt, dtheta) about its own fit and in the values of its errors.

    Attributes:
        fit: about which it is linear.
        rows: (m, 6 + e) whitened derivatives.
        residual: (m,) whitened, at the pose of the fit without any error.
        unknowns: the errors.
        lost: (6 + e, 6 + e) information that uncertain weights take away.
        wider: (6, 6) what of this pose's covariance no other set shares and no row shows.
    """

    fit: ErrorsInVariablesFit
    rows: np.ndarray
    residual: Values
    unknowns: tuple[_Unknown, ...]
    lost: np.ndarray
    wider: Matrix66

    @classmethod
    def of(cls, fit: ErrorsInVariablesFit, calibration: Calibration) -> "_Equations":
        errors, weights, radar = fit.measurements.errors, fit.weights, calibration.options.radar
        jacobian = np.concatenate([fit.model.jacobian, widening_rows(fit)], axis=2)
        gradients = (np.swapaxes(jacobian, 1, 2) @ fit.model.residual[:, :, None])[:, :, 0]
        values = np.concatenate([np.zeros(6), errors.values, np.zeros(len(errors.widening))])
        root = np.sqrt(weights)[:, None]
        stated, wider = pose_covariance(fit, radar), np.zeros((6, 6))
        if stated.shows_smooth:  # otherwise the array's smooth errors are as likely the same in both sets
            wider = stated.covariance - pose_covariance(fit, radar, smooth=False).covariance
        if fit.measurements.flat:
            moves = mounting_moves(fit.camera_from_radar, fit.placements_z_m, radar)
            wider = wider + moves @ moves.T
        return cls(
            fit,
            (jacobian * root[:, :, None]).reshape(-1, jacobian.shape[2]),
            ((fit.model.residual + jacobian @ values) * root).reshape(-1),
            tuple(_unknowns((*errors.estimated, *errors.widening), calibration.options.reflector)),
            (gradients * (weights * (1.0 - weights))[:, None]).T @ gradients,
            wider,
        )


def _unknowns(errors: Sequence[SystematicError], reflector: ReflectorOptions) -> Iterator[_Unknown]:
    """Yield the errors by owner; what clicks and principal point are off by together belongs to two."""
    for column, error in enumerate(errors, start=6):
        if error.name in _OF_CLICKS:
            person_px = min(reflector.click_offset_sigma_px, error.sigma)
            yield _Unknown(f"own_{error.name}", "person", person_px, column)
            yield _Unknown(error.name, "lens", float(np.sqrt(error.sigma**2 - person_px**2)), column)
        else:
            yield _Unknown(error.name, _OWNERS.get(error.name, "lens"), error.sigma, column)


def _joined(first: _Equations, second: _Equations, shared: Set[Owner]) -> PoseChange:
    places: dict[tuple[str, int], int] = {}
    spreads, sigmas = [], []
    for which, one in enumerate((first, second)):
        spread = np.zeros((one.rows.shape[1], 12 + len(first.unknowns) + len(second.unknowns)))
        spread[:6, 6 * which : 6 * which + 6] = np.eye(6)
        for unknown in one.unknowns:
            if unknown.sigma > 0.0:
                key = (unknown.name, -1 if unknown.owner in shared else which)
                if key not in places:
                    places[key] = 12 + len(places)  # after two poses: the number of their unknowns
                    sigmas.append(unknown.sigma)
                spread[unknown.column, places[key]] = 1.0
        spreads.append(spread)
    size = 12 + len(places)  # number of unknowns of two poses, and others
    prior = np.zeros((size, size))
    prior[12:, 12:] = np.diag(np.array(sigmas) ** -2.0)
    rows = [one.rows @ spread[:, :size] for one, spread in zip((first, second), spreads, strict=True)]
    noise = [row.T @ row for row in rows]
    gradient = rows[0].T @ first.residual + rows[1].T @ second.residual
    for of_position, missed in _position_rows(first.fit, second.fit):
        prior[:12, :12] += of_position.T @ of_position
        gradient[:12] += of_position.T @ missed
    information = noise[0] + noise[1] + prior
    inverse = symmetric_inverse(information)
    lost = sum(
        spread[:, :size].T @ one.lost @ spread[:, :size] for one, spread in zip((first, second), spreads, strict=True)
    )
    to_change = np.hstack([-np.eye(6), np.eye(6), np.zeros((6, len(places)))]) @ inverse
    covariance = to_change @ (information + lost) @ to_change.T + first.wider + second.wider
    step = inverse @ gradient
    before = first.fit.camera_from_radar.perturbed(step[:6])
    after = second.fit.camera_from_radar.perturbed(step[6:12])
    spent = [
        (float(np.trace(np.linalg.solve(covariance, to_change @ part @ to_change.T))) / 6.0) ** 2 / freedom
        for part, freedom in zip(noise, (first.fit.degrees_of_freedom, second.fit.degrees_of_freedom), strict=True)
        if freedom > 0.0
    ]
    freedom = min(1.0 / sum(spent), _MOST_FREEDOM) if spent else _MOST_FREEDOM  # Satterthwaite
    return PoseChange(before, after.error_from(before), covariance, freedom)


def _position_rows(first: ErrorsInVariablesFit, second: ErrorsInVariablesFit) -> list[tuple[np.ndarray, Values]]:
    """Return rows (3, 12) of what is known of the camera's position: of each, or of their mean if it was known once."""
    priors = [fit.measurements.prior for fit in (first, second)]
    (one, by_one), (other, by_other) = (fit.measurements.prior.rows(fit.camera_from_radar) for fit in (first, second))
    nothing = np.zeros((3, 6))
    if all(prior.measured for prior in priors) and (priors[0].position_m != priors[1].position_m).any():
        return [(np.hstack([by_one, nothing]), one), (np.hstack([nothing, by_other]), other)]
    return [(np.hstack([by_one, by_other]) / 2.0, (one + other) / 2.0)]
