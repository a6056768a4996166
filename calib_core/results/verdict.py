"""The verdict on a calibration: how far to trust it, and the one action that helps most; `calib_core.words` says it.

A good or usable calibration states its error, which holds in 95 % of such calibrations. The limits below and the consequence of
each warning decide the level; docs/warnings.md lists both, and the measured shares.
"""

from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from calib_core.errors import in_words
from calib_core.geometry import CM_PER_M, camera_position_jacobian
from calib_core.measurements import DataWarning, Unsolvable
from calib_core.results.actions import (
    Action,
    ClickFirst,
    ClickMore,
    ConfirmAssumptions,
    Export,
    FollowHint,
    PlaceReflector,
    ReduceError,
    ReviewPairs,
    SetOption,
    Stop,
)
from calib_core.results.calibration import Calibration
from calib_core.results.systematic_errors import scaled_px

_BEYOND = 0.05 / 3.0  # rotation, position and image hold together, so each may fail in a third of the 5 %


@dataclass(frozen=True, slots=True)
class StatedError:
    """The error that holds with 95 %, all figures together, rounded up as it is shown.

    Attributes:
        rotation_deg: angle between the stated and the true rotation; of a radar without elevation, about its up axis.
        position_cm: distance between the camera centers; NaN for a radar without elevation, whose mounting decides it.
        image_px: distance in the image between where a radar position in the middle of the placements reprojects and where
            it is; NaN if unknown.
        range_m: of that position: the median of the placements.
        in_plane: whether the radar measures no elevation.
    """

    rotation_deg: float
    position_cm: float
    image_px: float
    range_m: float
    in_plane: bool


def stated_error(calibration: Calibration) -> StatedError:
    """Return the error that the covariance states.

    Args:
        calibration: with a finite covariance.
    """
    in_plane = not calibration.sees_elevation
    freedom = degrees_of_freedom(calibration.covariance_quantile)
    turned = calibration.camera_from_radar.rotation.T
    to_centre = camera_position_jacobian(calibration.camera_from_radar)
    about_axes = np.concatenate([np.zeros((3, 3)), turned], axis=1)[2 if in_plane else 0 :]
    with np.errstate(over="ignore", invalid="ignore"):  # a file may state any number: beyond all numbers is infinite
        of_centre = to_centre @ calibration.covariance @ to_centre.T
        of_axes = about_axes @ calibration.covariance @ about_axes.T
    position_m = _radius(of_centre, freedom)
    common_px = calibration.options.reflector.click_offset_sigma_px  # the pose follows what all clicks are off by
    image_px2 = (np.float64(calibration.metrics.picture_sigma_px) ** 2 + common_px**2) * np.eye(2)
    ranges_m = [float(np.linalg.norm(pair.point_radar_m)) for pair in calibration.pairs if pair.inlier]
    known = bool(ranges_m) and bool(np.isfinite(image_px2).all())
    return StatedError(
        rotation_deg=_rounded_up(np.rad2deg(_radius(of_axes, freedom))),
        position_cm=float("nan") if in_plane else _rounded_up(CM_PER_M * position_m),
        image_px=_rounded_up(_radius(image_px2, freedom)) if known else float("nan"),
        range_m=float(np.median(ranges_m)) if known else float("nan"),
        in_plane=in_plane,
    )


# degrees of freedom up to which noise is estimated; beyond, F is chi-square to four digits
def degrees_of_freedom(quantile_95: float, *, least: float = 0.5, most: float = 1e5) -> float:
    """Return nu, the degrees of freedom that the quantile of the 6 parameters states: 6 F(6, nu) is at most that with 95 %."""
    from scipy.special import fdtridfd

    # a probability; of NaN, the most
    return max(least, min(most, float(fdtridfd(6.0, 0.95, quantile_95 / 6.0))))


def _radius(covariance: np.ndarray, freedom: float) -> float:
    """Return the length that an error with this covariance (k, k) exceeds in a third of 5 %.

    Its square is a weighted sum of chi-squares over an estimated noise level: trace(S) F(m, nu) with m = trace(S)^2 / trace(S^2)
    degrees of freedom (Satterthwaite), exact along one axis and for equal axes.
    """
    from scipy.special import fdtri

    if not np.isfinite(covariance).all():
        return float("inf")
    largest = float(np.abs(covariance).max())
    if largest <= 0.0:
        return 0.0
    scaled = covariance / largest
    trace = float(np.trace(scaled))
    if trace <= 0.0:
        return 0.0
    effective = trace**2 / float((scaled**2).sum())
    return float(np.sqrt(trace * fdtri(effective, freedom, 1.0 - _BEYOND)) * np.sqrt(largest))


def _rounded_up(value: float) -> float:
    """Round up to two digits, so that a figure never states less than the covariance."""
    if value <= 0.0 or not np.isfinite(value):
        return max(value, 0.0)
    # a unit of the second digit
    step = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return float(f"{np.ceil(value / step - 1e-9) * step:.3g}")  # steps: rounding errors of float64 must not add one


VerdictLevel: TypeAlias = Literal["good", "usable", "coarse", "contradictory", "nothing"]
"""How large the error is, or why there is no saying."""

GOOD_DEG, GOOD_CM = 1.0, 10.0
"""A stated error up to these is good."""
USABLE_DEG, USABLE_CM = 3.0, 30.0
"""A stated error up to these is usable; a larger one is coarse. Of a radar without elevation only its yaw is judged: its image
does not depend on how it is mounted, its position does."""
SURE_PAIRS = 8
"""With fewer pairs neither a wrong pair nor a wrong noise level can be detected: the verdict is coarse, and counts up to them."""
HELD_OUT_RATIO = 2.0
"""With a held-out error above this many times the fitted one, single pairs decide: the verdict is not good."""

_CONTRADICTIONS = ("mirrored-axes", "no-pose", "no-consensus", "refinement-diverged")
_NO_PAIR_HELPS = ("principal-point-off",)
_MORE_PAIRS_HELP = ("many-outliers", "repeated-placements")
_NOT_MIRRORED = "handedness-assumed"
_FEW, _EXCLUDED = "few-pairs", "excluded-by-residual"
_LEAST_VARIANCE, _MOST_VARIANCE = 1e-18, 1e12  # [m^2, rad^2]: of a nanometer and of 1,000 km, beyond any pose's
_BY_DEFAULT = SetOption("method", "default")
_MOST_CHECKED = 3
"""Of the clicks with the largest residuals so many are named."""


@dataclass(frozen=True, slots=True)
class Assumed:
    """What a stated error rests on and no pair can show: what moves the pose and leaves every residual as it is.

    Attributes:
        measured: the camera position was measured, and is right; otherwise, that the phase center was clicked.
        not_mirrored: no radar axis is mirrored.
        elevations: the radar's elevations are right.
        principal_point_px: how far the principal point may be off, which the rotation absorbs; NaN if its calibration says so.
    """

    measured: bool
    not_mirrored: bool
    elevations: bool
    principal_point_px: float


@dataclass(frozen=True, slots=True)
class Verdict:
    """How far to trust the result: how large its error is, what could be wrong, and the one action that helps most.

    Attributes:
        level: how large the error is, which holds with 95 %: "good", "usable" or "coarse"; or "contradictory": the data
            contradict the pose or each other; or "nothing": there is no calibration.
        action: the one thing that helps most.
        error: that is stated; None if the method states none, or something else decides.
        cause: what decides the level, if it is not the size of the error.
        rms_px: of the residuals, where a method states no error; NaN otherwise.
        pairs: how many agree, where they are fewer than `SURE_PAIRS`; else 0.
        unconfirmed: how many units, signs or meanings are assumed of the recording.
        everything_clicked: only more than this recording can help.
        assumed: what the stated error rests on; None if there is none.
        excluded: that pairs were left out by their residual; None if they were not.
    """

    level: VerdictLevel
    action: Action
    _: KW_ONLY
    error: StatedError | None = None
    cause: DataWarning | Unsolvable | None = None
    rms_px: float = float("nan")
    pairs: int = 0
    unconfirmed: int = 0
    everything_clicked: bool = False
    assumed: Assumed | None = None
    excluded: DataWarning | None = None

    @property
    def done(self) -> bool:
        """Whether nothing more is needed, or can be had of this recording."""
        return self.everything_clicked or isinstance(self.action, Export)

    @property
    def is_only_large(self) -> bool:
        """Whether nothing but the size of its error makes a calibration coarse: no warning, and enough pairs."""
        return self.level == "coarse" and self.error is not None and self.cause is None and not self.pairs

    def __str__(self) -> str:
        return in_words(self)


def verdict_on(outcome: Calibration | Unsolvable | None, *, left: int | None = None, unconfirmed: int = 0) -> Verdict:
    """Judge an outcome.

    Args:
        outcome: what the solver returned; None before any click.
        left: how many placements of the recording have no click yet; None if that is not known.
        unconfirmed: how many units, signs or meanings are assumed of the recording and not confirmed.
    """
    if outcome is None:
        return Verdict("nothing", ClickFirst(bool(left)))
    if isinstance(outcome, Unsolvable):
        level: VerdictLevel = "contradictory" if outcome.code in _CONTRADICTIONS else "nothing"
        waits = left and outcome.code == "too-few-pairs" and not outcome.unpaired
        return Verdict(level, ClickMore(left) if waits else FollowHint(), cause=outcome)
    warning = next(iter(by_consequence(outcome.warnings)), None)
    if warning is not None and consequence_of(warning.code) == "contradictory":
        by_default = outcome.options.models_noise
        return Verdict("contradictory", FollowHint() if by_default else _BY_DEFAULT, cause=warning)
    if unconfirmed:
        return Verdict("coarse", ConfirmAssumptions(), unconfirmed=unconfirmed)
    excluded = next((one for one in outcome.warnings if one.code == _EXCLUDED), None)
    if not _states_error(outcome):
        grave = warning if warning is not None and consequence_of(warning.code) == "coarse" else None
        return Verdict("coarse", _BY_DEFAULT, cause=grave, rms_px=outcome.metrics.rms_px, excluded=excluded)
    verdict = _verdict_of_pose(outcome, stated_error(outcome), warning, left)
    return replace(verdict, assumed=_assumptions_of(outcome), excluded=excluded)


def _assumptions_of(calibration: Calibration) -> Assumed:
    given, sigma_px = calibration.given_camera or calibration.camera, calibration.options.lens.principal_point_sigma_px
    known = given.covariance is not None or not sigma_px
    return Assumed(
        measured=calibration.options.solving.camera_position is not None,
        not_mirrored=any(warning.code == _NOT_MIRRORED for warning in calibration.warnings),
        elevations=calibration.sees_elevation,
        principal_point_px=float("nan") if known else 2.0 * scaled_px(sigma_px, given),
    )


def _states_error(calibration: Calibration) -> bool:
    """Return whether the covariance can be one of a pose in meters and radians; a file may state anything."""
    variances = np.diag(calibration.covariance)
    return bool(np.isfinite(calibration.covariance).all()) and bool(
        ((variances > _LEAST_VARIANCE) & (variances < _MOST_VARIANCE)).all()
    )


def _verdict_of_pose(
    calibration: Calibration, error: StatedError, warning: DataWarning | None, left: int | None
) -> Verdict:
    """Judge a pose by its stated error, and by its gravest warning."""
    consequence: Consequence = "note" if warning is None else consequence_of(warning.code)
    count = sum(pair.inlier for pair in calibration.pairs)
    few_pairs = count if count < SURE_PAIRS else 0
    if warning is not None and consequence == "coarse":
        more = left and warning.code in _MORE_PAIRS_HELP
        by: Action = ClickMore(left) if more else FollowHint()
        return Verdict("coarse", by, error=error, cause=warning, pairs=few_pairs)
    if few_pairs:
        few = next((one for one in calibration.warnings if one.code == _FEW), None)
        action = _most_helpful(calibration, left) if few is None or left else FollowHint()
        return Verdict("coarse", action, error=error, cause=few, pairs=few_pairs)
    if error.rotation_deg > USABLE_DEG or error.position_cm > USABLE_CM:
        return Verdict("coarse", _most_helpful(calibration, left), error=error)
    steady = not calibration.metrics.held_out_aed_px > HELD_OUT_RATIO * calibration.metrics.aed_px
    small = error.rotation_deg <= GOOD_DEG and error.position_cm <= GOOD_CM and steady
    if small and consequence == "note":
        return Verdict("good", _when_good(calibration, left), error=error)
    warned = warning is not None and not left and (small or warning.code in _NO_PAIR_HELPS)
    action = FollowHint() if warned else _most_helpful(calibration, left)
    return Verdict("usable", action, error=error, cause=warning if warned else None, everything_clicked=left == 0)


def _when_good(calibration: Calibration, left: int | None) -> Action:
    """Say that it is done once every placement is clicked, or no further one would help."""
    best = calibration.next_placement
    return ClickMore(left, or_export=True) if left and not (best is not None and best.may_stop) else Export()


def _most_helpful(calibration: Calibration, left: int | None) -> Action:
    """Return what reduces the uncertainty most: a placement, better clicks, or what is known of an error that all pairs share.

    A calibration read from a file knows no placement: it says nothing of further ones.

    Knowing an error with a share s of a variance leaves 1 - s of it, so it gains 1 / sqrt(1 - s). Clicks are to be checked if the
    scatter of the pairs has the largest share, and is larger than what the assumed noise explains.
    """
    best, dominant = calibration.next_placement, calibration.dominant_errors()
    if left and (best is None or not best.may_stop):
        return ClickMore(left)
    share = max((max(one.position_share, one.rotation_share) for one in dominant), default=0.0)
    scatter, metrics = _scatter_share(calibration), calibration.metrics
    if scatter > share and metrics.chi2 > metrics.degrees_of_freedom:
        return ReviewPairs(_largest_residuals(calibration))
    # share of the variance left at least, as all of it may be that error's: no root of less than 0
    gains_more = best is not None and best.gain * np.sqrt(max(1.0 - share, 1e-9)) < 1.0
    if dominant and (best is None or best.may_stop or gains_more):
        return ReduceError(dominant[0].largest.name, calibration.options.solving.camera_position is not None)
    if best is not None and not best.may_stop:
        forward_m, left_m, up_m = best.position_radar_m.tolist()
        return PlaceReflector((forward_m, left_m, up_m), best.gain)
    return Stop() if best is not None else Export()


def _scatter_share(calibration: Calibration) -> float:
    """Return the part of the variance that comes from the scatter of the pairs, of position or rotation; 0 if it is unknown."""
    parts = calibration.covariance_parts
    if parts is None:
        return 0.0
    stated, others = np.diag(calibration.covariance), np.diag(parts.systematic + parts.camera_position)
    return max(1.0 - float(others[part].sum() / stated[part].sum()) for part in (slice(0, 3), slice(3, 6)))


def _largest_residuals(calibration: Calibration) -> tuple[str, ...]:
    """Return the pairs with the largest residuals for their noise, the largest first."""
    pairs = [pair for pair in calibration.pairs if pair.inlier and np.isfinite(pair.expected_covariance_px2).all()]
    squared = {
        pair.id: pair.residual_px @ np.linalg.solve(pair.expected_covariance_px2, pair.residual_px) for pair in pairs
    }
    return tuple(sorted(squared, key=lambda one: -float(squared[one]))[:_MOST_CHECKED])


Consequence: TypeAlias = Literal["contradictory", "coarse", "limited", "note"]
"""What a warning says of the pose: another one is as likely or the input is not what it claims to be; the stated error does
not hold; it rests on an assumption, so it cannot be called good; nothing."""

CODES: dict[Consequence, tuple[str, ...]] = {
    "contradictory": (
        "clocks-apart",
        "radar-mostly-missing",
        "algorithm-1-contradicted",
        "behind-camera",
        "mirrored-axes",
        "units-suspected",
        "pixels-suspected",
        "no-consensus",
        "camera-position-contradicted",
        "two-poses",
        "handedness-open",
        "camera-far-away",
    ),
    "coarse": (
        "radar-missing",
        "camera-position-doubtful",
        "damaged-recording",
        "lost-returns",
        "many-outliers",
        "residuals-too-large",
        "intrinsics-suspected",
        "one-row",
        "shared-error-suspected",
        "clock-bias-suspected",
        "radar-axes-suspected",
        "radar-in-vehicle-frame",
        "repeated-placements",
    ),
    "limited": (
        "agreeing-outliers",
        "one-pair-decides",
        "weak-geometry",
        _FEW,
        "principal-point-off",
        "flat-radar",
        "choices-unused",
        "uncertain-association",
        "camera-turned",
        "smooth-angle-errors",
        "lens-or-radar-scale",
        _NOT_MIRRORED,
        "nobody-confirmed",
    ),
    "note": (_EXCLUDED, "angle-scale", "placement-ranges"),
}
"""The codes of each consequence, the gravest first."""
_RANKED: dict[str, tuple[int, Consequence]] = {
    code: (rank, consequence)
    for rank, (consequence, code) in enumerate((one, code) for one, codes in CODES.items() for code in codes)
}


def consequence_of(code: str) -> Consequence:
    """Return what a warning with this code does to the verdict; one that is not about the pose does nothing."""
    return _RANKED[code][1] if code in _RANKED else "note"


def by_consequence(warnings: Iterable[DataWarning]) -> tuple[DataWarning, ...]:
    """Return the warnings with the gravest first; those that say nothing of the pose come last, as they were given."""
    return tuple(sorted(warnings, key=lambda warning: _RANKED.get(warning.code, (len(_RANKED), "note"))[0]))
