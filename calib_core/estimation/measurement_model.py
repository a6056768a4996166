"""Measurement model: the measured pairs, the errors they share, and the camera prior, as arrays; and the model linearized.

A pair is a pixel z with covariance C = sigma_px^2 I, and a measured polar position m = (range, azimuth, elevation) with
covariance V = diag(sigma_polar^2). With pi the projection and p(mu) the Cartesian position of polar mu, the model is

    z = pi(R p(mu) + t) + noise(C),    m = mu + noise(V).                                                  (1)

Linearized at a true position mu, with J = d pi / d mu and e = z - pi(R p(mu) + t) - J (m - mu), the unknown positions
drop out (the Schur complement of the joint problem):

    e ~ N(0, S),    S = C + J V J^T.                                                                       (2)

The whitened linear model about a pose (`Linearization`) is shared by every solver stage.

Click density: where the pixels of outliers are to be expected. Most outliers have a good click and a radar position of
something else, so their pixels are spread as those of all clicks are. In an aisle, where all clicks are close together, an even
density would take agreement by chance as evidence.

Unmeasured elevation: a radar without elevation reports one elevation, or one height, for whatever it sees. A pitch or a roll of
the radar against the plane of the placements is then exactly a rotation, and the height of that plane above or below the radar
a shift along its up axis, but for the range along the plane, sqrt(r^2 - h^2). So each elevation is taken as reported, with a
small noise of its own, h^2 is estimated with the pose (`systematic_errors`), and pitch, roll and height are added to the
covariance afterwards (`radar_axes.mounting_moves`): the pose is the one that maps reported positions to pixels, its covariance
that of the radar's housing.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Indices, Points2, Points3, Values, Vector3, frozen_array
from calib_core.association.exclusive_returns import shared_returns
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, camera_position_jacobian, rotation_jacobian
from calib_core.measurements import Pair
from calib_core.options import CalibrationOptions
from calib_core.radar import polar_from_cartesian, position_planes
from calib_core.results.systematic_errors import (
    NO_ERRORS,
    Sensitivity,
    SystematicError,
    SystematicErrors,
    systematic_errors,
)

LEAST_SCORE = 1e-6
"""Least probability of a candidate, so that its logarithm is finite. A choice: it counts as 28 in -2 log-likelihood."""

OWN_SIGMA_RAD = np.deg2rad(0.5)
"""Standard deviation of each placement's elevation above or below the common plane: uneven ground."""


@dataclass(frozen=True, slots=True, eq=False)
class MeasurementPlanes:
    """The measurements of n pairs as planes: one row per coordinate, for fast NumPy operations.

    Attributes:
        pixels_px: (2, n) clicks.
        sigma_px: (n,) or a single number.
        polar: (3, n) range [m], azimuth, elevation [rad], the radar's estimated errors taken out.
        sigma_polar: (3, n).
        errors: systematic errors; the estimated ones are unknowns beside the pose.
    """

    pixels_px: np.ndarray
    sigma_px: Values
    polar: np.ndarray
    sigma_polar: np.ndarray
    errors: SystematicErrors = NO_ERRORS

    def linearize(
        self, camera: Camera, rotations: np.ndarray, translations_m: np.ndarray, at_polar: np.ndarray | None = None
    ) -> "Linearization":
        """Linearize and whiten the projection about one pose or many.

        Args:
            camera: the intrinsics.
            rotations: (..., 3, 3) of camera_from_radar, the leading axes those of any batch.
            translations_m: (..., 3).
            at_polar: (3, n) the true positions mu to linearize at; None takes the measured ones.
        """
        true_polar = self.polar if at_polar is None else at_polar
        turned_m, d_polar = _turned(rotations, true_polar)
        seen_m = turned_m + (translations_m + self.errors.offset_m)[..., None]
        projected_px, d_point = camera.project_planes(seen_m)
        # residual, d pixel / d (dt, dtheta), d pixel / d errors, d pixel / d polar, stacked
        rows = np.empty((*rotations.shape[:-2], 10 + len(self.errors), *self.pixels_px.shape))
        np.subtract(self.pixels_px, projected_px, out=rows[..., 0, :, :])
        rows[..., 1:4, :, :] = d_point
        rotation_jacobian(turned_m, d_point, out=rows[..., 4:7, :, :])
        to_polar = rows[..., -3:, :, :]
        np.einsum("...irn,...ikn->...krn", d_point, d_polar, out=to_polar)
        if self.errors.estimated:
            at = _sensitivity(camera, true_polar, projected_px, d_point, to_polar)
            at = _with_lens(at, camera, seen_m, self.errors.estimated)
            for k, error in enumerate(self.errors.estimated):
                rows[..., 7 + k, :, :] = error.column(at)
        if at_polar is not None:
            rows[..., 0, :, :] -= (to_polar * (self.polar - at_polar)[:, None, :]).sum(axis=-3)
        return _whitened(rows, self.sigma_px, self.sigma_polar)

    def columns(
        self,
        camera: Camera,
        pose: RigidTransform,
        errors: Sequence[SystematicError],
        at_polar: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return d pixel / d error (k, 2, n), not whitened, of errors that are no unknowns of the fit."""
        true_polar = self.polar if at_polar is None else at_polar
        turned_m, d_polar = _turned(pose.rotation, true_polar)
        seen_m = turned_m + (pose.translation_m + self.errors.offset_m)[:, None]
        projected_px, d_point = camera.project_planes(seen_m)
        to_polar = np.einsum("irn,ikn->krn", d_point, d_polar)
        at = _sensitivity(camera, true_polar, projected_px, d_point, to_polar)
        at = _with_lens(at, camera, seen_m, errors)
        return np.array([error.column(at) for error in errors]).reshape(len(errors), *self.pixels_px.shape)


@dataclass(frozen=True, slots=True, eq=False)
class Linearization:
    """Equation (2) at one pose or many, whitened by W with W S W^T = I, so that plain least squares is maximum likelihood.

    The properties without "planes" in their name require a single pose.

    Attributes:
        planes: (..., 10 + k, 2, n) W e; W d pixel / d (dt, dtheta), 6 of them; the same for k systematic errors;
            W d pixel / d polar, 3.
        whitening_planes: (..., 3, n) the entries 00, 10 and 11 of W, which is triangular.
        log_determinant: (..., n) of S.
    """

    planes: np.ndarray
    whitening_planes: np.ndarray
    log_determinant: np.ndarray

    @property
    def residual(self) -> Points2:
        """W e: (n, 2)."""
        return np.asarray(self.planes[0].T)

    @property
    def unknown_planes(self) -> np.ndarray:
        """W d pixel / d unknown: (..., 6 + k, 2, n), the pose and the systematic errors."""
        return np.asarray(self.planes[..., 1:-3, :, :])

    @property
    def polar_planes(self) -> np.ndarray:
        """W d pixel / d polar: (..., 3, 2, n)."""
        return np.asarray(self.planes[..., -3:, :, :])

    @property
    def pose_jacobian(self) -> np.ndarray:
        """W d pixel / d (dt, dtheta): (n, 2, 6)."""
        return np.asarray(self.planes[1:7].T)

    @property
    def jacobian(self) -> np.ndarray:
        """W d pixel / d unknown: (n, 2, 6 + k), the pose and the systematic errors."""
        return np.asarray(self.unknown_planes.T)

    @property
    def point_jacobian(self) -> np.ndarray:
        """W d pixel / d polar: (n, 2, 3)."""
        return np.asarray(self.polar_planes.T)

    @property
    def whitening(self) -> np.ndarray:
        """W: (n, 2, 2); zeros where the camera does not see the position."""
        whitening = np.zeros((self.whitening_planes.shape[-1], 2, 2))
        whitening[:, 0, 0], whitening[:, 1, 0], whitening[:, 1, 1] = self.whitening_planes
        return whitening

    @property
    def squared(self) -> np.ndarray:
        """Squared Mahalanobis distance of each residual: (..., n)."""
        return np.asarray(self.planes[..., 0, 0, :] ** 2 + self.planes[..., 0, 1, :] ** 2)

    def rows(self, rows: Indices) -> "Linearization":
        """Take rows (..., n) of the last axis, separately for each pose."""
        return Linearization(
            np.take_along_axis(self.planes, rows[..., None, None, :], axis=-1),
            np.take_along_axis(self.whitening_planes, rows[..., None, :], axis=-1),
            np.take_along_axis(self.log_determinant, rows, axis=-1),
        )


_FREEDOM = 4.0  # degrees of freedom of a measured position: of ten tapes, one is off by more than twice its sigma


@dataclass(frozen=True, slots=True, eq=False)
class CameraPrior:
    """What is known of the camera centre before any pair: the farther the camera, the less the prior weighs.

    A measured position is Student's t with nu degrees of freedom: of ten tapes, one is off by more than twice its sigma. Where
    the pairs say nothing, the expected variance of one that is d away is (nu sigma^2 + d^2) / (nu - 2) per axis.

    Attributes:
        position_m: (3,) in the radar frame.
        sigma_m: per axis.
        measured: whether it was measured with a tape; otherwise it only selects between poses.
        height_sigma_m: what is added to the variance of its up coordinate, for a radar that does not measure elevation.
        weighed: whether the pairs alone have told how far it may be off; it is then normal, so that the estimate has one peak.
    """

    position_m: Vector3
    sigma_m: float
    measured: bool
    height_sigma_m: float = 0.0
    weighed: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_m", frozen_array(self.position_m, (3,)))

    def rows(self, camera_from_radar: RigidTransform) -> tuple[Vector3, np.ndarray]:
        """Return the whitened residual (3,) and its Jacobian (3, 6) for (dt, dtheta)."""
        away_m = self.position_m + camera_from_radar.rotation.T @ camera_from_radar.translation_m
        sigma_m = np.sqrt(self._variance_m2(away_m))
        return away_m / sigma_m, camera_position_jacobian(camera_from_radar) / sigma_m[:, None]

    @property
    def _near_m2(self) -> float:
        """The variance per axis of a camera at the prior's position."""
        return self.sigma_m**2 * (_FREEDOM / (_FREEDOM - 2.0) if self.measured and not self.weighed else 1.0)

    @property
    def tail(self) -> float:
        """The share of the squared error of a measured position that is expected in its variance."""
        return 1.0 / (_FREEDOM - 2.0) if self.measured else 0.0

    @property
    def _loosening(self) -> float:
        """The share of a camera's squared distance that is added to the variance."""
        return 0.0 if self.weighed else self.tail or 1.0

    def expected_variance_m2(self, error_m: Vector3) -> float:
        """Return the variance per axis of a measured position that the pairs expect to be off by an error (3,)."""
        return float(self._near_m2 + self.tail * (error_m @ error_m))

    def weighed_with(self, sigma_m: float) -> "CameraPrior":
        """Return the same measured position with the standard deviation that the pairs leave it."""
        return replace(self, sigma_m=sigma_m, weighed=True)

    def _variance_m2(self, away_m: np.ndarray) -> np.ndarray:
        """Return the variance per radar axis (..., 3), for a camera (..., 3) away from the prior's position."""
        variance = self._near_m2 + self._loosening * (away_m**2).sum(axis=-1, keepdims=True) * np.ones(3)
        variance[..., 2] += self.height_sigma_m**2
        return variance

    def information(self, rotations: np.ndarray, translations_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return J^T J (..., 6, 6) and J^T residual (..., 6) of `rows` at poses (..., 3, 3) and (..., 3).

        In camera axes the residual is -(R c0 + t), its Jacobian (I, [t]x) and its precision R diag(1 / sigma^2) R^T.
        """
        missed = -(rotations @ self.position_m + translations_m)
        x, y, z = translations_m[..., 0], translations_m[..., 1], translations_m[..., 2]
        jacobian = np.zeros((*translations_m.shape, 6))
        jacobian[..., 0, 0] = jacobian[..., 1, 1] = jacobian[..., 2, 2] = 1.0
        jacobian[..., 0, 4], jacobian[..., 0, 5], jacobian[..., 1, 5] = -z, y, -x
        jacobian[..., 1, 3], jacobian[..., 2, 3], jacobian[..., 2, 4] = z, -y, x
        weighted = np.swapaxes(jacobian, -1, -2) @ self._precision(rotations, missed)
        return weighted @ jacobian, (weighted @ missed[..., None])[..., 0]

    def _precision(self, rotations: np.ndarray, missed_m: np.ndarray) -> np.ndarray:
        """Return the precision (..., 3, 3) in camera axes, for a camera missed by (..., 3)."""
        if not self.height_sigma_m:  # the same along all axes, so the rotation cancels
            farther = self._loosening * (missed_m**2).sum(axis=-1)[..., None, None]
            return np.asarray(np.eye(3) / (self._near_m2 + farther))
        to_radar = np.swapaxes(rotations, -1, -2)
        variance = self._variance_m2((to_radar @ missed_m[..., None])[..., 0])
        return np.asarray((rotations / variance[..., None, :]) @ to_radar)

    def weakened(self) -> "CameraPrior":
        """Return the same position as a weak prior, with a sigma of at least 1 m."""
        return replace(self, sigma_m=max(self.sigma_m, 1.0), measured=False, weighed=False)

    def squared(self, rotations: np.ndarray, translations_m: np.ndarray) -> Values:
        """Return the squared distance of the camera of each pose (s,) from the position, in standard deviations."""
        away_m = (np.swapaxes(rotations, -1, -2) @ translations_m[..., None])[..., 0] + self.position_m
        variance_m2 = self._near_m2 + np.array([0.0, 0.0, self.height_sigma_m**2])
        return np.asarray((away_m**2 / variance_m2).sum(axis=-1))

    def costs(self, rotations: np.ndarray, translations_m: np.ndarray) -> Values:
        """Return twice the negative log-probability of each pose (s,), up to a constant."""
        squared = self.squared(rotations, translations_m)
        return np.asarray(np.log1p(self.tail * squared) / self.tail) if self.measured and not self.weighed else squared


@dataclass(frozen=True, slots=True, eq=False)
class PairMeasurements:
    """All pairs as columns; pair i owns the candidate rows first[i] to first[i + 1].

    Attributes:
        camera: the intrinsics.
        pixels_px: (n, 2) clicks.
        sigma_px: (n,) their standard deviation per axis.
        rays: (n, 3) unit directions of the clicks in the camera frame; NaN where the lens model has none.
        first: (n + 1,).
        reported: (m, 3) range [m], azimuth, elevation [rad] of the candidates as the radar reports them.
        sigma_polar: (m, 3) their standard deviations.
        log_score: (m,) logarithm of each candidate's plausibility before any pose.
        prior: of the camera centre.
        log_outlier: (n,) logarithm of the density of each click if its pair is an outlier [1/px^2].
        returns: (m,) equal labels are one return that several pairs of one moment have in common; -1 is a pair's own.
        errors: that all pairs share, with their present values.
        flat: whether the radar does not measure elevation.
    """

    camera: Camera
    pixels_px: Points2
    sigma_px: Values
    rays: Points3
    first: Indices
    reported: Points3
    sigma_polar: Points3
    log_score: Values
    prior: CameraPrior
    log_outlier: Values
    returns: Indices
    errors: SystematicErrors = NO_ERRORS
    flat: bool = False

    def __len__(self) -> int:
        return len(self.pixels_px)

    @property
    def polar(self) -> Points3:
        """The candidates' positions with the radar's estimated errors taken out: (m, 3)."""
        return np.asarray(self.errors.radar.corrected_polar(self.reported.T).T)

    @property
    def owner(self) -> Indices:
        """The pair that owns each candidate row: (m,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.first))

    @property
    def one_to_one(self) -> bool:
        """Whether every pair has a single candidate, so that there is nothing to associate."""
        return len(self.reported) == len(self)

    def some(self, pairs: Indices) -> "PairMeasurements":
        """Keep the pairs of the given indices, with their candidates."""
        rows = pairs if self.one_to_one else np.concatenate([np.arange(*self.first[i : i + 2]) for i in pairs])
        return replace(
            self,
            pixels_px=self.pixels_px[pairs],
            sigma_px=self.sigma_px[pairs],
            rays=self.rays[pairs],
            log_outlier=self.log_outlier[pairs],
            first=np.concatenate([[0], np.cumsum(np.diff(self.first)[pairs])]),
            reported=self.reported[rows],
            sigma_polar=self.sigma_polar[rows],
            log_score=self.log_score[rows],
            returns=self.returns[rows],
        )

    def measured(self, rows: Indices) -> MeasurementPlanes:
        """Take one candidate row per pair (n,), as planes."""
        polar = self.errors.radar.corrected_polar(self.reported[rows].T)
        return MeasurementPlanes(self.pixels_px.T, self.sigma_px, polar, self.sigma_polar[rows].T, self.errors)

    def candidates_apart(self) -> "PairMeasurements":
        """Make every candidate a pair of its own, with its pair's click."""
        owner = self.owner
        return replace(
            self,
            pixels_px=self.pixels_px[owner],
            sigma_px=self.sigma_px[owner],
            rays=self.rays[owner],
            log_outlier=self.log_outlier[owner],
            first=np.arange(len(owner) + 1),
            returns=np.full(len(owner), -1),
        )

    def mirrored(self) -> "PairMeasurements":
        """Return the pairs with the radar's y axis mirrored."""
        left_right = np.array([1.0, -1.0, 1.0])
        prior = replace(self.prior, position_m=self.prior.position_m * left_right)
        return replace(self, reported=self.reported * left_right, prior=prior)

    def with_errors(self, values: Values) -> "PairMeasurements":
        """Take the systematic errors to have these values (k,), and refined intrinsics to be those that follow."""
        if not len(self.errors):
            return self
        errors = self.errors.at(values)
        camera = errors.camera
        if camera is None:
            return replace(self, errors=errors)
        return replace(self, errors=errors, camera=camera, rays=camera.rays(self.pixels_px))

    def without_errors(self) -> "PairMeasurements":
        """Treat systematic errors as independent noise of the same size: enough to find the pose and the inliers."""
        if not len(self.errors):
            return self
        spread = self.errors.spread(self.reported.T).T
        blurred = self if self.errors.camera is None else self._blurred_by_lens()
        return replace(blurred, sigma_polar=np.hypot(self.sigma_polar, spread), errors=NO_ERRORS)

    def _blurred_by_lens(self) -> "PairMeasurements":
        """Add to each click's noise what the lens may be off by there; what is the same everywhere is a rotation."""
        if self.errors.lens is None:
            return self
        by_parameter = np.nan_to_num(self.camera.parameter_planes(self.rays.T))
        moves = np.einsum("pr,pcn->rcn", self.errors.lens.along_axes, by_parameter)
        moves -= moves.mean(axis=-1, keepdims=True)
        return replace(self, sigma_px=np.sqrt(self.sigma_px**2 + (moves**2).sum(axis=0).mean(axis=0)))

    def scaled(self, noise_scale: Sequence[float] | Values) -> "PairMeasurements":
        """Multiply the assumed sigmas of (click, range, azimuth, elevation)."""
        scale = np.asarray(noise_scale, dtype=np.float64)
        return replace(self, sigma_px=self.sigma_px * scale[0], sigma_polar=self.sigma_polar * scale[1:])


def pair_measurements(pairs: Sequence[Pair], camera: Camera, options: CalibrationOptions) -> PairMeasurements:
    """Stack pairs into arrays; a missing click sigma is replaced by the assumed one."""
    candidates = [candidate for pair in pairs for candidate in pair.candidates]
    points = np.array([candidate.position_radar_m for candidate in candidates]).reshape(-1, 3)
    sigma_polar = np.array([candidate.sigma_polar for candidate in candidates]).reshape(-1, 3)
    flat = is_flat(points)
    if flat:
        sigma_polar[:, 2] = OWN_SIGMA_RAD
    score = np.array([candidate.score for candidate in candidates])
    pixels_px = np.array([pair.pixel_px for pair in pairs]).reshape(-1, 2)
    sigma_px = np.array([options.noise.sigma_px if pair.sigma_px is None else pair.sigma_px for pair in pairs])
    return PairMeasurements(
        camera=camera,
        pixels_px=pixels_px,
        sigma_px=sigma_px,
        rays=camera.rays(pixels_px),
        first=np.concatenate([[0], np.cumsum([len(pair.candidates) for pair in pairs])]).astype(np.int64),
        reported=polar_from_cartesian(points),
        sigma_polar=sigma_polar,
        log_score=np.log(np.clip(score, LEAST_SCORE, 1.0)),
        prior=_prior(options, flat=flat),
        log_outlier=np.log(click_density(pixels_px, sigma_px, camera)),
        returns=shared_returns(pairs, window_s=options.locating.window_s),
        errors=systematic_errors(options, camera, flat=flat),
        flat=flat,
    )


def _prior(options: CalibrationOptions, *, flat: bool) -> CameraPrior:
    height_sigma_m = options.radar.height_sigma_m if flat else 0.0
    measured = options.solving.camera_position
    if measured is None:
        return CameraPrior(np.zeros(3), options.solving.nominal_camera_distance_m, False, height_sigma_m)
    return CameraPrior(np.array(measured.position_m), measured.sigma_m, True, height_sigma_m)


_SAME_ELEVATION_RAD, _SAME_HEIGHT_M = np.deg2rad(0.01), 0.001
"""What files round to: hundredths of a degree, and millimeters."""
_LEAST_POSITIONS = 2
_NEARLY_ALL = 0.9  # share of the positions, a choice: one of ten may be wrong


def is_flat(points_radar_m: Points3) -> bool:
    """Return whether nearly all radar positions (n, 3) have one elevation or one height, up to rounding."""
    if len(points_radar_m) < _LEAST_POSITIONS:
        return False
    height_m = points_radar_m[:, 2]
    elevation_rad = np.arctan2(height_m, np.hypot(points_radar_m[:, 0], points_radar_m[:, 1]))
    return _apart(height_m) < _SAME_HEIGHT_M or _apart(elevation_rad) < _SAME_ELEVATION_RAD


def _apart(values: Values) -> float:
    """Return how far from their median all but a few of the values lie."""
    return float(np.quantile(np.abs(values - np.median(values)), _NEARLY_ALL))


def prior_rows(measurements: PairMeasurements, camera_from_radar: RigidTransform) -> tuple[Values, np.ndarray]:
    """Return the whitened residuals (p + k,) and Jacobian (p + k, 6 + k) of the p rows of the pose's prior and k errors."""
    errors = measurements.errors
    residual, jacobian = measurements.prior.rows(camera_from_radar)
    count = len(residual)
    rows = np.zeros((count + len(errors), 6 + len(errors)))
    rows[:count, :6] = jacobian
    if not len(errors):
        return residual, rows
    rows[count:, 6:] = np.diag(1.0 / errors.sigma)
    return np.concatenate([residual, -errors.values / errors.sigma]), rows


_FAR = 1e6  # standard deviations: the whitened residual of a position the camera cannot see


def linearize(
    camera_from_radar: RigidTransform,
    camera: Camera,
    *,
    pixels_px: Points2,
    sigma_px: Values,
    polar: Points3,
    sigma_polar: Points3,
    at_polar: Points3 | None = None,
) -> Linearization:
    """Linearize and whiten the projection of measured positions about a pose.

    Args:
        camera_from_radar: the pose.
        camera: the intrinsics.
        pixels_px: (n, 2) clicks.
        sigma_px: (n,).
        polar: (n, 3) measured range [m], azimuth, elevation [rad].
        sigma_polar: (n, 3).
        at_polar: (n, 3) the true positions mu to linearize at; None takes the measured ones.
    """
    measured = MeasurementPlanes(pixels_px.T, sigma_px, polar.T, sigma_polar.T)
    at = None if at_polar is None else at_polar.T
    return measured.linearize(camera, camera_from_radar.rotation, camera_from_radar.translation_m, at)


def _turned(rotations: np.ndarray, polar: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return polar positions (3, n) under each rotation as points (..., 3, n), and their derivatives (..., 3, 3, n)."""
    position_m, d_position = position_planes(polar)
    d_polar = (rotations @ d_position.reshape(3, -1)).reshape(*rotations.shape[:-2], *d_position.shape)
    return rotations @ position_m, d_polar


def _sensitivity(
    camera: Camera, polar: np.ndarray, projected_px: np.ndarray, d_point: np.ndarray, to_polar: np.ndarray
) -> Sensitivity:
    matrix_px = camera.matrix_px
    return Sensitivity(polar, d_point, to_polar, projected_px - matrix_px[:2, 2:], float(matrix_px[0, 0]))


def _with_lens(
    at: Sensitivity, camera: Camera, points_camera_m: np.ndarray, errors: Sequence[SystematicError]
) -> Sensitivity:
    """Add the derivatives by the camera's parameters, if an error asks for them."""
    if not any(error.of_lens for error in errors):
        return at
    return replace(at, d_parameter=camera.parameter_planes(points_camera_m))


def _whitened(rows: np.ndarray, sigma_px: Values, sigma_polar: np.ndarray) -> Linearization:
    """Multiply rows (..., 10 + k, 2, n) by W, W S W^T = I for S = C + J V J^T, from the Cholesky factor of the 2 x 2."""
    noisy = rows[..., -3:, :, :] * sigma_polar[:, None, :]
    u, v = noisy[..., 0, :], noisy[..., 1, :]
    click = sigma_px**2
    a = np.sqrt((u * u).sum(axis=-2) + click)
    b = (u * v).sum(axis=-2) / a
    c = np.sqrt((v * v).sum(axis=-2) + click - b * b)
    whitening = np.stack([1.0 / a, -b / (a * c), 1.0 / c], axis=-2)
    whiten_u, whiten_uv, whiten_v = (whitening[..., None, entry, :] for entry in range(3))
    log_determinant = 2.0 * np.log(a * c)
    planes = np.empty_like(rows)
    np.multiply(rows[..., 0, :], whiten_u, out=planes[..., 0, :])
    planes[..., 1, :] = rows[..., 1, :] * whiten_v + rows[..., 0, :] * whiten_uv
    unseen = ~np.isfinite(planes[..., 0, :, :]).all(axis=-2)
    if unseen.any():
        np.copyto(planes, 0.0, where=unseen[..., None, None, :])
        np.copyto(planes[..., 0, :, :], _FAR, where=unseen[..., None, :])
        np.copyto(whitening, 0.0, where=unseen[..., None, :])
        np.copyto(log_determinant, 0.0, where=unseen)
    return Linearization(planes, whitening, log_determinant)


_ANYWHERE = 0.3  # share of the outliers whose click is anywhere on the image
_LEAST_WIDTH = 5.0  # standard deviations of a click
_ALL_OTHERS, _SOME_OTHERS = 300, 100  # of more clicks than the first, so many give the density: work grows linearly


def click_density(pixels_px: Points2, sigma_px: Values, camera: Camera) -> Values:
    """Return the density (n,) of the other clicks at each click [1/px^2], smoothed as far as their neighbours are apart.

    Args:
        pixels_px: (n, 2) the clicks.
        sigma_px: (n,) their standard deviations.
        camera: with the size of the image.
    """
    count = len(pixels_px)
    even = np.full(count, 1.0 / (camera.width_px * camera.height_px))
    if count < 2:
        return even
    chosen = np.linspace(0, count - 1, count if count <= _ALL_OTHERS else _SOME_OTHERS).round().astype(np.int64)
    squared = ((pixels_px[:, None] - pixels_px[chosen]) ** 2).sum(axis=2)
    nth = min(max(round(len(chosen) ** 0.5), 1), len(chosen) - 1)
    width2 = np.maximum(np.partition(squared, nth, axis=1)[:, nth], (_LEAST_WIDTH * sigma_px) ** 2)[:, None]
    kernels = np.exp(-0.5 * squared / width2) / (2.0 * np.pi * width2)
    kernels[chosen, np.arange(len(chosen))] = 0.0
    return np.asarray(_ANYWHERE * even + (1.0 - _ANYWHERE) * kernels.sum(axis=1) / max(len(chosen) - 1, 1))
