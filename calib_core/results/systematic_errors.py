"""Systematic errors: what is wrong with every pair alike, with a prior for each, in the estimate and in the covariance.

With eta these errors, h the radar's way of reporting and o, K the click's and the lens's, the model of `measurement_model` is

    m = h(mu; eta) + noise(V),    z = pi_K(R p(mu) + t + d) + o + noise(C).                                (1)

Undoing h at the current eta gives m'. The pixel then changes with eta by A = J d m' / d eta for errors of the radar, by
d pi / d point for the reflector's offset d, and by the derivative of the lens for its errors. An error is *estimated* with the
pose, as one more unknown with its prior, where it bends the whole pose (a scale of the angles); the small ones only *widen*
the covariance, by B Sigma B^T with B = -H^-1 J^T W A.

The intrinsics' own covariance, if they have one, replaces the default errors of the lens (`lens_prior`): with C the covariance
of the lens errors l and A A^T = C, l = A u with u ~ N(0, I). The estimate knows only u, one independent error of standard
deviation 1 each, so that correlated intrinsics need no more than independent ones, and a covariance without full rank (both
focal lengths tied to one another) is no special case. What is reported is l, by name. If the intrinsics are to be refined, the
errors of the lens are estimated, and the model is linearized through the camera at their present values.

The derivative belongs at the estimated true position mu: at the measured one it is correlated with the noise, and a scale
comes out too large. A new error is one more entry of `systematic_errors`, and of
`calib_core.words.systematic_errors` with what it is called. Files keep what is known of it (`SystematicErrorResult`);
`dominant_errors` and `scaled_angles` find those that matter.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from calib_core.arrays import Matrix66, Values, Vector3, freeze, frozen_array
from calib_core.camera import Camera, CameraCovariance
from calib_core.geometry import CM_PER_M
from calib_core.json_forms import Name
from calib_core.measurements import DataWarning, Unsolvable
from calib_core.options import CalibrationOptions, RadarOptions
from calib_core.radar import RadarErrors

_RADAR_ERRORS = {entry.name for entry in fields(RadarErrors)}


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """The derivatives of the pixels of n pairs at one pose or many, before whitening.

    Attributes:
        polar: (3, n) true positions: range [m], azimuth, elevation [rad].
        d_point: (..., 3, 2, n) d pixel / d point in the camera frame [px/m].
        d_polar: (..., 3, 2, n) d pixel / d polar.
        offset_px: (..., 2, n) projections, from the principal point.
        focal_px: of the camera.
        d_parameter: (..., p, 2, n) d pixel / d parameter of the camera; None if no error asks for it.
    """

    polar: np.ndarray
    d_point: np.ndarray
    d_polar: np.ndarray
    offset_px: np.ndarray
    focal_px: float
    d_parameter: np.ndarray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SystematicError:
    """One error that all pairs share.

    Attributes:
        name: key in files, with its unit; a scale without one.
        sigma: standard deviation of its prior.
        column: d pixel / d error (..., 2, n).
        axis: of the camera along which it shifts the reflector; None for other errors.
        of_lens: whether it is along an axis of the lens prior.
    """

    name: str
    sigma: float
    column: Callable[[Sensitivity], np.ndarray]
    axis: int | None = None
    of_lens: bool = False

    @property
    def of_radar(self) -> bool:
        """Whether it is one of `RadarErrors`, and so can be taken out of reported positions."""
        return self.name in _RADAR_ERRORS


def scale(name: str, sigma: float, coordinate: int) -> SystematicError:
    """Return a scale of the radar's range (0), azimuth (1) or elevation (2)."""

    def column(at: Sensitivity) -> np.ndarray:
        return np.asarray(at.d_polar[..., coordinate, :, :] * -at.polar[coordinate])

    return SystematicError(name, sigma, column)


def elevation_lean(sigma: float) -> SystematicError:
    """Return an elevation that leans with the azimuth; half of it is an exact roll of the radar, which the pose absorbs."""

    def column(at: Sensitivity) -> np.ndarray:
        return np.asarray(at.d_polar[..., 2, :, :] * -at.polar[1])

    return SystematicError("elevation_lean", sigma, column)


def range_bias(sigma_m: float) -> SystematicError:
    """Return a constant error of the range."""

    def column(at: Sensitivity) -> np.ndarray:
        return -at.d_polar[..., 0, :, :]

    return SystematicError("range_bias_m", sigma_m, column)


def squared_height(sigma_m: float) -> SystematicError:
    """Height h of the placements above or below a radar without elevation: the range along its plane is sqrt(r^2 - h^2)."""

    def column(at: Sensitivity) -> np.ndarray:
        return np.asarray(at.d_polar[..., 0, :, :] / (-2.0 * at.polar[0]))

    return SystematicError("squared_height_m2", sigma_m**2, column)


def reflector_offset(axis: int, name: str, sigma_m: float) -> SystematicError:
    """Return a shift of the clicked point from the phase center along an axis of the camera."""

    def column(at: Sensitivity) -> np.ndarray:
        return np.asarray(at.d_point[..., axis, :, :])

    return SystematicError(f"reflector_{name}_m", sigma_m, column, axis=axis)


def click_offset(row: int, name: str, sigma_px: float) -> SystematicError:
    """Return a shift of all clicks along a column (0) or row (1) axis of the image."""

    def column(at: Sensitivity) -> np.ndarray:
        shift = np.zeros_like(at.offset_px)
        shift[..., row, :] = 1.0
        return shift

    return SystematicError(f"click_{name}_px", sigma_px, column)


def along_lens_axis(number: int, axis: Values) -> SystematicError:
    """Return the error of the lens along one axis (p,) of its prior."""

    def column(at: Sensitivity) -> np.ndarray:
        return np.asarray(np.einsum("p,...prn->...rn", axis, np.asarray(at.d_parameter)))

    return SystematicError(f"lens_axis_{number + 1}", 1.0, column, of_lens=True)


def focal_length(sigma: float) -> SystematicError:
    """Return a share by which the focal length is off."""
    return SystematicError("focal_length", sigma, lambda at: at.offset_px)


def radial_distortion(sigma: float) -> SystematicError:
    """Return an amount by which the first radial distortion coefficient is off, whatever the lens model."""

    def column(at: Sensitivity) -> np.ndarray:
        squared = (at.offset_px**2).sum(axis=-2, keepdims=True) / at.focal_px**2
        return np.asarray(at.offset_px * squared)

    return SystematicError("distortion", sigma, column)


_PRIOR_WIDTH_PX = 1920.0
"""Width of the image that the priors of the principal point are stated for."""

_NO_AXIS = 1e-10  # variance along an axis, of the largest, up to which the covariance has no such axis
_LEAST_FOCAL_SHARE = 0.1  # of the given focal length, whatever the pairs say
_UNKNOWN_FOCAL_SHARE = 0.5  # of the focal length: a covariance that allows more is of something else
_UNKNOWN_CENTRE_SHARE = 0.5  # of the image's width or height: the same of the principal point
_FOCAL = 2  # the first parameters of a camera are its focal lengths


@dataclass(frozen=True, slots=True, eq=False)
class LensPrior:
    """How the intrinsics may be wrong together: q errors, independent along the axes of their joint covariance.

    Attributes:
        camera: the given intrinsics.
        names: (q,) of the errors, as in files.
        moves: (p, q) change of the p `Camera.parameters` with each error.
        axes: (q, r) A, with A A^T the covariance of the errors.
    """

    camera: Camera
    names: tuple[str, ...]
    moves: np.ndarray
    axes: np.ndarray

    def __post_init__(self) -> None:
        freeze(self, moves=(None, len(self.names)), axes=(len(self.names), None))

    def __len__(self) -> int:
        return self.axes.shape[1]

    @property
    def sigma(self) -> Values:
        """Standard deviations of the errors before any pair: (q,)."""
        return np.asarray(np.sqrt((self.axes**2).sum(axis=1)))

    @property
    def along_axes(self) -> np.ndarray:
        """Change of the camera's parameters along each axis: (p, r)."""
        return np.asarray(self.moves @ self.axes)

    def camera_at(self, values: Values, covariance: np.ndarray | None = None) -> Camera:
        """Return the intrinsics with errors of these values (r,) along the axes taken out.

        Args:
            values: along the axes.
            covariance: (r, r) of these values; None leaves the camera without one.
        """
        parameters = self.camera.parameters + self.along_axes @ values
        least = _LEAST_FOCAL_SHARE * self.camera.parameters[:_FOCAL]
        parameters[:_FOCAL] = np.maximum(parameters[:_FOCAL], least)
        return self.camera.with_parameters(
            parameters, None if covariance is None else self._camera_covariance(covariance)
        )

    def _camera_covariance(self, covariance: np.ndarray) -> CameraCovariance:
        """Return the covariance of the camera's parameters that any error moves."""
        moved = self.moves.any(axis=1)
        along = self.along_axes[moved]
        names = tuple(self.camera.parameter_names[row] for row in np.flatnonzero(moved).tolist())
        matrix = along @ covariance @ along.T
        return CameraCovariance(names, (matrix + matrix.T) / 2.0)


_EXACT = RadarErrors()
_NONE = 1e-30  # a standard deviation up to this counts as 0; the square of its reciprocal must stay finite
_SMALL = 1e-4  # standard deviations over which a derivative is taken


@dataclass(frozen=True, slots=True, eq=False)
class SystematicErrors:
    """All errors of a set of pairs, and the present values of the estimated ones.

    Attributes:
        estimated: unknowns of the fit.
        widening: errors that only widen the covariance.
        values: (k,) of the estimated ones; 0 is no error.
        lens: whose axes the errors of the lens are; None if the default ones are assumed.
    """

    estimated: tuple[SystematicError, ...] = ()
    widening: tuple[SystematicError, ...] = ()
    values: Values = None  # type: ignore[assignment]
    lens: LensPrior | None = None

    def __post_init__(self) -> None:
        values = np.zeros(len(self.estimated)) if self.values is None else self.values
        object.__setattr__(self, "values", frozen_array(values, (len(self.estimated),)))

    def __len__(self) -> int:
        return len(self.estimated)

    @property
    def sigma(self) -> Values:
        """Standard deviations of the priors of the estimated errors: (k,)."""
        return np.array([one.sigma for one in self.estimated])

    @property
    def prior_information(self) -> np.ndarray:
        """Inverse covariance of the priors of the estimated errors: (k, k)."""
        return np.diag(self.sigma**-2.0) if len(self) else np.zeros((0, 0))

    @property
    def offset_m(self) -> Vector3:
        """The reflector's offset from the clicked point, in the camera frame: (3,)."""
        offset_m = np.zeros(3)
        for one, value in zip(self.estimated, self.values.tolist(), strict=True):
            if one.axis is not None:
                offset_m[one.axis] = value
        return offset_m

    @property
    def squared(self) -> float:
        """Squared distance of the values from their priors, in standard deviations."""
        return float(((self.values / self.sigma) ** 2).sum()) if len(self) else 0.0

    @property
    def refined(self) -> slice:
        """The places of the lens's errors among the estimated ones; empty if the intrinsics are not refined."""
        places = [k for k, one in enumerate(self.estimated) if one.of_lens]
        return slice(places[0], places[-1] + 1) if places else slice(0, 0)

    @property
    def camera(self) -> Camera | None:
        """The refined intrinsics at the present values; None if they are not refined."""
        return self.camera_known_to(None)

    def camera_known_to(self, covariance: np.ndarray | None) -> Camera | None:
        """Return the same with the covariance (r, r) of their errors along the axes of the prior."""
        if self.lens is None:
            return None
        places = self.refined
        if places.start == places.stop:
            return None
        return self.lens.camera_at(self.values[places], covariance)

    def at(self, values: Values) -> "SystematicErrors":
        """Return the same errors with other values."""
        return replace(self, values=values)

    @property
    def radar(self) -> RadarErrors:
        """The values of the radar's errors."""
        if not self.estimated:
            return _EXACT
        return RadarErrors.named(
            {one.name: value for one, value in zip(self.estimated, self.values.tolist(), strict=True)}
        )

    def polar_change(self, polar: np.ndarray, moves: np.ndarray) -> np.ndarray:
        """Return how positions (3, n) change if the errors change by a small amount for each of them.

        Args:
            polar: range [m], azimuth, elevation [rad], corrected by the present values.
            moves: (n, k) changes of the values.
        """
        change = np.zeros_like(polar)
        for one, move in zip(self.estimated, moves.T, strict=True):
            if one.of_radar:
                small = _SMALL * one.sigma
                change += (RadarErrors.named({one.name: small}).corrected_polar(polar) - polar) * (move / small)
        return change

    def spread(self, polar: np.ndarray) -> np.ndarray:
        """Return the standard deviations (3, n) that the radar's errors add to each position as if they were independent."""
        variance = np.zeros_like(polar)
        for one in self.estimated:
            if one.of_radar:
                variance += (RadarErrors.named({one.name: one.sigma}).corrected_polar(polar) - polar) ** 2
        return np.asarray(np.sqrt(variance))


NO_ERRORS = SystematicErrors()


def systematic_errors(options: CalibrationOptions, camera: Camera, *, flat: bool) -> SystematicErrors:
    """List the errors of a set of pairs, with the priors of the options; a sigma of 0 leaves an error out.

    Args:
        options: with the priors.
        camera: the intrinsics.
        flat: whether the radar does not measure elevation.
    """
    taped = options.solving.camera_position is not None
    lens = lens_prior(options, camera)
    estimated = [scale("azimuth_scale", _azimuth_scale_sigma(options.radar, flat=flat), 1)]
    if flat:
        estimated.append(squared_height(options.radar.height_sigma_m))
    else:
        estimated.append(scale("elevation_scale", options.radar.elevation_scale_sigma, 2))
    estimated.append(range_bias(options.radar.range_bias_sigma_m))
    reflector = [reflector_offset(axis, name, options.reflector.offset_sigma_m) for axis, name in enumerate(_AXES)]
    widening = [
        scale("range_scale", options.radar.range_scale_sigma, 0),
        *(click_offset(row, _AXES[row], sigma) for row, sigma in enumerate(_click_sigma_px(options, camera, lens))),
        *_default_lens(options, camera, lens),
    ]
    if not flat:
        widening.append(elevation_lean(options.radar.elevation_lean_sigma))
    (estimated if taped else widening).extend(reflector)
    if lens is not None:
        (estimated if options.refining.intrinsics else widening).extend(_lens(lens))
    return SystematicErrors(
        tuple(one for one in estimated if one.sigma > _NONE),
        tuple(one for one in widening if one.sigma > _NONE),
        lens=lens,
    )


def _azimuth_scale_sigma(radar: RadarOptions, *, flat: bool) -> float:
    """Return the prior of the azimuth's scale; a tilt a of a radar without elevation scales azimuths by 1 / cos(a)."""
    if not (flat and radar.azimuth_scale_sigma):
        return radar.azimuth_scale_sigma
    tilted = np.sqrt(3.0) / 2.0 * np.deg2rad(radar.tilt_sigma_deg) ** 2  # rms of a^2 / 2
    return float(np.hypot(radar.azimuth_scale_sigma, tilted))


_AXES = ("right", "down", "forward")


def _click_sigma_px(options: CalibrationOptions, camera: Camera, lens: LensPrior | None) -> tuple[float, float]:
    """Return the standard deviation of what clicks and principal point together are off by; no pair tells them apart.

    A lens with a prior of its own brings its principal point along.
    """
    clicks_px = options.reflector.click_offset_sigma_px
    if lens is not None:
        return clicks_px, clicks_px
    principal_point_px = scaled_px(options.lens.principal_point_sigma_px, camera)
    if not principal_point_px:
        return clicks_px, clicks_px
    off_px, doubt = off_middle_px(camera), doubt_of_image(camera) ** 0.5
    right, down = np.hypot(np.hypot(clicks_px, principal_point_px), doubt * off_px).tolist()
    return right, down


OFF_MIDDLE, _OFF_MIDDLE_ELSEWHERE = 0.035, 0.15
"""Standard deviation of a principal point from the image's middle per axis, over its width and height: of right intrinsics
(KITTI, TUM RGB-D, EuRoC, nuScenes and Cityscapes publish 0.2 to 4.6 %, webcams up to 8 %), and of those of another image."""
_ELSEWHERE = 0.002  # probability of intrinsics that belong to another image, before the principal point is looked at


def off_middle_px(camera: Camera) -> Values:
    """Return how far the principal point is from the image's middle, right and down: (2,); zeros for a part of an image, or if
    the intrinsics say themselves how well it is known."""
    if camera.covariance is not None or camera.is_part:
        return np.zeros(2)
    return np.asarray(camera.matrix_px[:2, 2] - (np.array([camera.width_px, camera.height_px]) - 1.0) / 2.0)


def doubt_of_image(camera: Camera) -> float:
    """Return the probability that the intrinsics belong to another image, by their principal point alone."""
    share = off_middle_px(camera) / np.array([camera.width_px, camera.height_px])
    spread = _OFF_MIDDLE_ELSEWHERE / OFF_MIDDLE
    ratio = share @ share / OFF_MIDDLE**2 * (1.0 - spread**-2.0) / 2.0 - 2.0 * np.log(spread)
    return float(1.0 / (1.0 + (1.0 / _ELSEWHERE - 1.0) * np.exp(-ratio)))


def scaled_px(sigma_px: float, camera: Camera) -> float:
    """Return a standard deviation of the principal point in a camera's pixels, as the options state it for a usual width."""
    return sigma_px * camera.width_px / _PRIOR_WIDTH_PX


def _default_lens(options: CalibrationOptions, camera: Camera, lens: LensPrior | None) -> list[SystematicError]:
    """Return the errors of a lens of which nobody said how well it is known; a refined pinhole has no distortion of its own."""
    if lens is None:
        return [focal_length(options.lens.focal_length_sigma), radial_distortion(options.lens.distortion_sigma)]
    refined_pinhole = camera.covariance is None and not len(camera.distortion)
    return [radial_distortion(options.lens.distortion_sigma)] if refined_pinhole else []


def _lens(prior: LensPrior) -> list[SystematicError]:
    return [along_lens_axis(k, axis) for k, axis in enumerate(prior.along_axes.T)]


def lens_prior(options: CalibrationOptions, camera: Camera) -> LensPrior | None:
    """Return the prior of the intrinsics: their own covariance, or the one to refine them with; None if there is neither.

    Args:
        options: which say whether the intrinsics are refined, and how far off they are if nobody said.
        camera: the given intrinsics.
    """
    if camera.covariance is not None:
        known = camera.covariance
        rows = [camera.parameter_names.index(name) for name in known.order]
        names = tuple(f"lens_{name}" for name in known.order)
        return LensPrior(camera, names, np.eye(len(camera.parameters))[:, rows], _root(known.matrix))
    if not options.refining.intrinsics:
        return None
    refining, count = options.refining, len(camera.parameters)
    principal_point_px = scaled_px(refining.principal_point_sigma_px, camera)
    sigma = [refining.focal_length_sigma, principal_point_px, principal_point_px, refining.distortion_sigma]
    names = ("focal_length", "principal_right_px", "principal_down_px", "distortion")
    moves = np.zeros((count, 4))
    moves[:_FOCAL, 0] = camera.parameters[:_FOCAL]
    moves[2, 1] = moves[3, 2] = 1.0
    moves[4:5, 3] = 1.0
    kept = [k for k in range(4) if moves[:, k].any()]  # a pinhole has no coefficient
    return LensPrior(
        camera, tuple(names[k] for k in kept), moves[:, kept], _root(np.diag(np.square(sigma))[kept][:, kept])
    )


def _root(covariance: np.ndarray) -> np.ndarray:
    """Return A (q, r) with A A^T the covariance (q, q) of rank r."""
    sigma = np.sqrt(np.diag(covariance))
    scale = np.where(sigma > 0.0, sigma, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = values > _NO_AXIS * values.max(initial=0.0)
    return np.asarray(scale[:, None] * vectors[:, kept] * np.sqrt(values[kept]))


def useless_covariance(camera: Camera, *, refining: bool) -> Unsolvable | None:
    """A covariance of the intrinsics that knows nothing of the lens, or leaves nothing to refine; None if neither."""
    known = camera.covariance
    if known is None:
        return None
    size_px = np.array([camera.width_px, camera.height_px])
    limits_px = [*(_UNKNOWN_FOCAL_SHARE * camera.parameters[:_FOCAL]), *(_UNKNOWN_CENTRE_SHARE * size_px)]
    for name, value_px, limit_px in zip(camera.parameter_names, camera.parameters, limits_px, strict=False):
        if (sigma_px := known.sigma(name)) > limit_px:
            return Unsolvable(
                "useless-lens-covariance", {"parameter": name, "value_px": float(value_px), "sigma_px": float(sigma_px)}
            )
    if refining and not known.matrix.diagonal().any():
        return Unsolvable("useless-lens-covariance")
    return None


def shared_out(mixed: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Divide what correlated errors do to a pose among them: (6, q), not negative, adding up to what all of them do.

    Of the errors made uncorrelated by the symmetric root of their correlation, each is nearest to the one it stands for.

    Args:
        mixed: (6, q) covariance of pose and errors.
        covariance: (q, q) of the errors, which need not have full rank.
    """
    sigma = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(sigma > 0.0, sigma, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    kept = values > _NO_AXIS * values.max(initial=0.0)
    whitened = (vectors[:, kept] / np.sqrt(values[kept])) @ vectors[:, kept].T
    return np.asarray((mixed / scale @ whitened) ** 2)


_DOMINANT_SHARE = 1.0 / 3.0  # of the variance of position or rotation: knowing less gains less than 22 % (a choice)
_UNDETERMINED = 0.97  # of the prior's sigma: the pairs say nothing
_BEYOND = 3.0  # standard deviations of the prior


@dataclass(frozen=True, slots=True)
class SystematicErrorResult:
    """One error that all pairs share; value and sigmas have the unit in its name, the shares are of the pose's variance.

    Attributes:
        name: key in files, with its unit; scales and shares have none.
        value: estimated; for an error that is not taken out of the pose, what the residuals suggest.
        sigma: standard deviation of that value.
        prior_sigma: the same before any pair, as the options state it.
        estimated: whether the pose was estimated together with it; otherwise it only widens the covariance.
        position_share: its part of the variance of the translation, 0 to 1.
        rotation_share: the same of the rotation.
    """

    name: Name
    value: float
    sigma: float
    prior_sigma: float
    estimated: bool = True
    position_share: float = 0.0
    rotation_share: float = 0.0

    @property
    def of_lens(self) -> bool:
        """Whether it is one of the intrinsics."""
        return self.name.startswith(("lens_", "principal_", "focal_length", "distortion"))


@dataclass(frozen=True, slots=True)
class DominantError:
    """An error, or one along several axes, with a third or more of the variance of the position, the rotation or both.

    Attributes:
        largest: of one kind, such as the clicks' distance from the phase center along three axes.
        position_share: their part of the variance of the translation; 0 if below a third.
        rotation_share: the same of the rotation.
        position_cm: standard deviation of the whole translation.
        rotation_deg: the same of the rotation.
    """

    largest: SystematicErrorResult
    position_share: float
    rotation_share: float
    position_cm: float
    rotation_deg: float


_FAMILIES = ("reflector_", "click_", "principal_", "lens_")


def family_of(name: str) -> str:
    """Return what errors along several axes have in common, as the beginning of their names; the name of one that is alone."""
    return next((family for family in _FAMILIES if name.startswith(family)), name)


def dominant_errors(errors: Sequence[SystematicErrorResult], covariance: Matrix66) -> tuple[DominantError, ...]:
    """Find the errors that make up most of the uncertainty, the largest share first: at most one each of position and rotation.

    Args:
        errors: all that the pairs share.
        covariance: (6, 6) of (dt, dtheta) [m, rad].
    """
    families: dict[str, list[SystematicErrorResult]] = {}
    for error in errors:
        families.setdefault(family_of(error.name), []).append(error)
    shares = {
        name: (_sum_of(rows, "position_share"), _sum_of(rows, "rotation_share")) for name, rows in families.items()
    }
    chosen: dict[str, list[float]] = {}
    for part in (0, 1):
        most = max(shares, key=lambda name: shares[name][part], default="")
        if most and shares[most][part] >= _DOMINANT_SHARE:
            chosen.setdefault(most, [0.0, 0.0])[part] = shares[most][part]
    position_cm = CM_PER_M * float(np.sqrt(np.trace(covariance[:3, :3])))
    rotation_deg = float(np.rad2deg(np.sqrt(np.trace(covariance[3:, 3:]))))
    dominant = [
        DominantError(
            max(families[name], key=lambda row: row.position_share + row.rotation_share),
            position,
            rotation,
            position_cm,
            rotation_deg,
        )
        for name, (position, rotation) in chosen.items()
    ]
    return tuple(sorted(dominant, key=lambda error: -max(error.position_share, error.rotation_share)))


def rescaled(
    errors: Sequence[SystematicErrorResult], position: float, rotation: float
) -> tuple[SystematicErrorResult, ...]:
    """Multiply the shares of the position's and of the rotation's variance, as when only a part of that variance is meant."""
    return tuple(
        replace(error, position_share=position * error.position_share, rotation_share=rotation * error.rotation_share)
        for error in errors
    )


def _sum_of(rows: Sequence[SystematicErrorResult], share: str) -> float:
    return min(float(sum(getattr(row, share) for row in rows)), 1.0)


def is_determined(error: SystematicErrorResult) -> bool:
    """Return whether the pairs say anything about an error."""
    return error.sigma <= _UNDETERMINED * error.prior_sigma


def is_beyond_its_prior(error: SystematicErrorResult) -> bool:
    """Whether an error was estimated so large that what was stated of it before any pair cannot be right."""
    return error.estimated and 0.0 < _BEYOND * error.prior_sigma < abs(error.value)


_CLEAR_SIGMAS, _NOTABLE_SCALE = 3.0, 0.015  # and a share of the angle, as docs/warnings.md states (a choice)
_LEAST_TOLD = 0.005  # share of the prior variance that the pairs must take away for an estimate of their own
_SCALES = ("azimuth_scale", "elevation_scale")


def scaled_angles(errors: Sequence[SystematicErrorResult], *, flat: bool, measured: bool) -> list[DataWarning]:
    """Tell of scaled angles that the pairs clearly show, within what is assumed of them.

    Args:
        errors: all that the pairs share, with what is known of them.
        flat: whether the radar does not measure elevation.
        measured: whether the camera position was measured, so that its error is one of the causes.
    """
    return [
        _angle_scale(error, flat=flat, measured=measured)
        for error in errors
        if error.name in _SCALES and _is_clear(error) and abs(error.value) > _NOTABLE_SCALE
    ]


def _is_clear(error: SystematicErrorResult) -> bool:
    return error.estimated and abs(error.value) > _CLEAR_SIGMAS * error.sigma


def _angle_scale(error: SystematicErrorResult, *, flat: bool, measured: bool) -> DataWarning:
    size, sigma = _by_pairs_alone(error)
    facts = {
        "error": error.name,
        "value": float(np.copysign(size, error.value)),
        "sigma": sigma,
        "flat": flat,
        "measured": measured,
    }
    return DataWarning("angle-scale", facts)


def _by_pairs_alone(result: SystematicErrorResult) -> tuple[float, float]:
    """Return size and standard deviation of an error without its prior, which draws the estimate to 0.

    With p the prior and s what is left of it, the estimate is k = 1 - s^2 / p^2 times that of the pairs alone.
    """
    prior, share = result.prior_sigma, max(1.0 - (result.sigma / result.prior_sigma) ** 2, _LEAST_TOLD)
    variance = result.sigma**2 - ((1.0 - share) * prior) ** 2
    return abs(result.value) / share, float(np.sqrt(max(variance, 0.0))) / share
