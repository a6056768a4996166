"""The verdict on a calibration: how far to trust it, in one line, and the one action that helps most.

A good or usable calibration states its error, which holds in 95 % of such calibrations. The limits below and the consequence of
each warning decide the level; docs/warnings.md lists both, and the measured shares.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from calib_core.geometry import camera_position_jacobian
from calib_core.measurements import DataWarning, Unsolvable
from calib_core.results.calibration import Calibration, NextPlacement
from calib_core.results.systematic_errors import scaled_px

_BEYOND = 0.05 / 3.0  # rotation, position and picture hold together, so each may fail in a third of the 5 %
_LEAST_FREEDOM, _MOST_FREEDOM = 0.5, 1e5
_HALVINGS = 60


@dataclass(frozen=True, slots=True)
class StatedError:
    """The error that holds with 95 %, all figures together, rounded up as it is shown.

    Attributes:
        rotation_deg: angle between the stated and the true rotation; of a radar without elevation, about its up axis.
        position_cm: distance between the camera centres; NaN for a radar without elevation, whose mounting decides it.
        picture_px: distance in the picture between where a radar position in the middle of the placements reprojects and where
            it is; NaN if unknown.
        range_m: of that position: the median of the placements.
        in_plane: whether the radar measures no elevation.
    """

    rotation_deg: float
    position_cm: float
    picture_px: float
    range_m: float
    in_plane: bool

    @property
    def text(self) -> str:
        """The figures within a sentence: "0.5 deg, 6 cm (95 %); 7 px at 9 m"."""
        pose = (
            f"{self.rotation_deg:g} deg of yaw"
            if self.in_plane
            else f"{self.rotation_deg:g} deg, {self.position_cm:g} cm"
        )
        picture = f"; {self.picture_px:g} px at {self.range_m:.0f} m" if np.isfinite(self.picture_px) else ""
        return f"{pose} (95 %){picture}{'; height and tilt assumed' if self.in_plane else ''}"


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
    picture_px2 = (np.float64(calibration.metrics.picture_sigma_px) ** 2 + common_px**2) * np.eye(2)
    ranges_m = [float(np.linalg.norm(pair.point_radar_m)) for pair in calibration.pairs if pair.inlier]
    known = bool(ranges_m) and bool(np.isfinite(picture_px2).all())
    return StatedError(
        rotation_deg=_rounded_up(np.rad2deg(_radius(of_axes, freedom))),
        position_cm=float("nan") if in_plane else _rounded_up(100.0 * position_m),
        picture_px=_rounded_up(_radius(picture_px2, freedom)) if known else float("nan"),
        range_m=float(np.median(ranges_m)) if known else float("nan"),
        in_plane=in_plane,
    )


def degrees_of_freedom(quantile_95: float) -> float:
    """Return nu, the degrees of freedom that the quantile of the 6 parameters states: 6 F(6, nu) is at most that with 95 %."""
    from scipy.special import fdtri

    if not quantile_95 > 6.0 * fdtri(6.0, _MOST_FREEDOM, 0.95):
        return _MOST_FREEDOM
    if quantile_95 >= 6.0 * fdtri(6.0, _LEAST_FREEDOM, 0.95):
        return _LEAST_FREEDOM
    low, high = np.log(_LEAST_FREEDOM), np.log(_MOST_FREEDOM)
    for _ in range(_HALVINGS):  # 6 F(6, nu) falls with nu; importing scipy.optimize would take a third of a second
        middle = 0.5 * (low + high)
        low, high = (middle, high) if 6.0 * fdtri(6.0, np.exp(middle), 0.95) > quantile_95 else (low, middle)
    return float(np.exp(high))


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
    step = 10.0 ** (np.floor(np.log10(value)) - 1.0)
    return float(f"{np.ceil(value / step - 1e-9) * step:.3g}")


VerdictLevel: TypeAlias = Literal["good", "usable", "coarse", "contradictory", "nothing"]
"""How large the error is, or why there is no saying."""

GOOD_DEG, GOOD_CM = 1.0, 10.0
"""A stated error up to these is good."""
USABLE_DEG, USABLE_CM = 3.0, 30.0
"""A stated error up to these is usable; a larger one is coarse. Of a radar without elevation only its yaw is judged: its picture
does not depend on how it is mounted, its position does."""
SURE_PAIRS = 8
"""With fewer pairs neither a wrong pair nor a wrong noise level can be detected: the verdict is coarse, and counts up to them."""
HELD_OUT_RATIO = 2.0
"""With a held-out error above this many times the fitted one, single pairs decide: the verdict is not good."""

_CONTRADICTIONS = ("mirrored-axes", "no-pose", "no-consensus", "refinement-diverged")
_MORE_PAIRS_HELP = ("many-outliers", "repeated-placements")
_NOT_MIRRORED = "handedness-assumed"
_FEW = "few-pairs"
_BETWEEN = {"good": ": within ", "usable": ": within ", "nothing": " yet: "}
_LEAST_VARIANCE, _MOST_VARIANCE = 1e-18, 1e12
_CORNER = "the reflector's inner corner, where its three sheets meet"
DONE = "Done: export the calibration"
"""The action when nothing more is needed."""
ALL_CLICKED = "Done with this recording: every placement is clicked"
"""How the action begins when only more than this recording would help."""
_DEFAULT_METHOD = "Solve with the default method, which states the error of the pose and leaves wrong pairs out"


@dataclass(frozen=True, slots=True)
class Verdict:
    """How far to trust the result: how large its error is, what could be wrong, and the one action that helps most.

    Attributes:
        level: how large the error is, which holds with 95 %: "good", "usable" or "coarse"; or "contradictory": the data
            contradict the pose or each other; or "nothing": there is no calibration.
        reason: the stated error, or what contradicts; without a full stop.
        action: the one thing that helps most; a sentence without a full stop.
        assumes: what the stated error rests on and no pair can show; without a full stop, empty if there is nothing.
    """

    level: VerdictLevel
    reason: str
    action: str
    assumes: str = ""

    @property
    def line(self) -> str:
        """Level and reason: "usable: within 0.5 deg, 6 cm (95 %); 7 px at 20 m"."""
        return f"{self.level}{_BETWEEN.get(self.level, ': ')}{self.reason}"

    def __str__(self) -> str:
        return f"{self.line}\n  {self.action}"


def verdict_on(outcome: Calibration | Unsolvable | None, *, left: int | None = None, unconfirmed: int = 0) -> Verdict:
    """Judge an outcome.

    Args:
        outcome: what the solver returned; None before any click.
        left: how many placements of the recording have no click yet; None if that is not known.
        unconfirmed: how many units, signs or meanings are assumed of the recording and not confirmed.
    """
    if outcome is None:
        where = "Go to a placement" if left else "Go to a frame in which the reflector stands still"
        return Verdict("nothing", "no placement is clicked", f"{where} and click {_CORNER}")
    if isinstance(outcome, Unsolvable):
        level: VerdictLevel = "contradictory" if outcome.code in _CONTRADICTIONS else "nothing"
        if left and outcome.code == "too-few-pairs" and not outcome.unpaired:
            return Verdict(level, outcome.reason, _click_the_rest(left))
        return Verdict(level, outcome.reason, _capitalized(outcome.hint))
    warning = next(iter(by_consequence(outcome.warnings)), None)
    if warning is not None and consequence_of(warning.code) == "contradictory":
        by_default = outcome.options.models_noise
        return Verdict("contradictory", warning.message, _capitalized(warning.hint) if by_default else _DEFAULT_METHOD)
    if unconfirmed:
        reason = f"{unconfirmed} of the recording's units or axes {'is' if unconfirmed == 1 else 'are'} assumed, not confirmed"
        return Verdict("coarse", reason, "Confirm what is assumed about the recording, or state what is right")
    if not _states_error(outcome):
        return _without_covariance(outcome, warning)
    return replace(_judged(outcome, stated_error(outcome), warning, left), assumes=_assumption(outcome))


def _assumption(calibration: Calibration) -> str:
    """Return what no pair can show: what moves the pose and leaves every residual as it is, or a wrong camera position."""
    if calibration.options.solving.camera_position is None:
        first, whose = "you clicked the very point that the radar sees", "its"
    else:
        alone_cm = _alone_cm(calibration)
        known = f" (the pairs alone place it within {alone_cm:g} cm)" if np.isfinite(alone_cm) else ""
        first, whose = f"the camera was measured right{known}", "the radar's"
    mirrored = any(warning.code == _NOT_MIRRORED for warning in calibration.warnings)
    sides = "no radar axis is mirrored, " if mirrored else ""
    heights = f"{whose} elevations are right, and " if calibration.sees_elevation else ""
    return f"{first}, {sides}{heights}{_centre_assumed(calibration)}"


def _centre_assumed(calibration: Calibration) -> str:
    """Return what is assumed of the principal point: the rotation absorbs its error, so that no pair shows it."""
    given, sigma_px = calibration.given_camera or calibration.camera, calibration.options.lens.principal_point_sigma_px
    if given.covariance is not None or not sigma_px:
        return "the picture is neither cropped nor resized"
    within_px = 2.0 * scaled_px(sigma_px, given)
    return f"the picture is neither cropped nor resized, its principal point right to {within_px:.2g} px"


def _alone_cm(calibration: Calibration) -> float:
    """Return how well the camera's place would be known without its measurement [cm]; NaN if that is not known.

    With P the covariance of the place and M what of it the measurement leaves, P^-1 (P - M) P^-1 is the information of the pairs.
    """
    if calibration.covariance_parts is None or not calibration.sees_elevation:
        return float("nan")
    to_centre = camera_position_jacobian(calibration.camera_from_radar)
    with np.errstate(all="ignore"):  # a file may state any number
        whole = to_centre @ calibration.covariance @ to_centre.T
        measured = to_centre @ calibration.covariance_parts.camera_position @ to_centre.T
        inverse = np.linalg.pinv(whole) if np.isfinite(whole).all() else whole
        information = inverse @ (whole - measured) @ inverse
    if not np.isfinite(information).all():
        return float("nan")
    values, axes = np.linalg.eigh(information)
    if not values[0] > 0.0:
        return float("nan")
    alone = (axes / values) @ axes.T
    return _rounded_up(100.0 * _radius(alone, degrees_of_freedom(calibration.covariance_quantile)))


def placement_words(best: NextPlacement) -> str:
    """Say where a placement is: "4.5 m ahead, 2.1 m to the left"."""
    x_m, y_m, _ = best.position_radar_m
    if abs(y_m) < 0.1 * abs(x_m):
        return f"{x_m:.1f} m straight ahead"
    return f"{x_m:.1f} m ahead, {abs(y_m):.1f} m to the {'left' if y_m > 0 else 'right'}"


def _capitalized(phrase: str) -> str:
    return phrase[:1].upper() + phrase[1:]


def _states_error(calibration: Calibration) -> bool:
    """Return whether the covariance can be one of a pose in metres and radians; a file may state anything."""
    variances = np.diag(calibration.covariance)
    return bool(np.isfinite(calibration.covariance).all()) and bool(
        ((variances > _LEAST_VARIANCE) & (variances < _MOST_VARIANCE)).all()
    )


def _without_covariance(calibration: Calibration, warning: DataWarning | None) -> Verdict:
    """Judge a pose whose method states no error, as the paper's: nothing can be promised of it."""
    spread = f"its residuals are {calibration.metrics.rms_px:.3g} px (RMS)"
    reason = f"the method states no error of its pose; {spread}"
    if warning is not None and consequence_of(warning.code) == "coarse":
        return Verdict("coarse", f"{reason}; {warning.message}", _DEFAULT_METHOD)
    return Verdict("coarse", reason, _DEFAULT_METHOD)


def _judged(calibration: Calibration, error: StatedError, warning: DataWarning | None, left: int | None) -> Verdict:
    """Judge a pose by its stated error, and by its gravest warning."""
    consequence: Consequence = "note" if warning is None else consequence_of(warning.code)
    count = sum(pair.inlier for pair in calibration.pairs)
    if warning is not None and consequence == "coarse":
        more = left and warning.code in _MORE_PAIRS_HELP
        action = _click_the_rest(left) if left and more else _capitalized(warning.hint)
        return Verdict("coarse", f"{warning.message}; uncertain to {error.text}", action)
    if count < SURE_PAIRS:
        told = next((one for one in calibration.warnings if one.code == _FEW), None)
        seen = f"{count} of {SURE_PAIRS} pairs" if told is None else told.message
        helpful = _most_helpful(calibration, left) if told is None or left else _capitalized(told.hint)
        return Verdict("coarse", f"{seen}; uncertain to {error.text}", helpful)
    if error.rotation_deg > USABLE_DEG or error.position_cm > USABLE_CM:
        return Verdict("coarse", f"uncertain to {error.text}", _most_helpful(calibration, left))
    steady = not calibration.metrics.held_out_aed_px > HELD_OUT_RATIO * calibration.metrics.aed_px
    small = error.rotation_deg <= GOOD_DEG and error.position_cm <= GOOD_CM and steady
    if small and consequence == "note":
        return Verdict("good", error.text, _when_good(calibration, left))
    better = (
        _capitalized(warning.hint) if small and warning is not None and not left else _most_helpful(calibration, left)
    )
    return Verdict("usable", error.text, f"{ALL_CLICKED}. {better}" if left == 0 else better)


def is_only_large(verdict: Verdict, calibration: Calibration) -> bool:
    """Return whether nothing but the size of its error makes a calibration coarse: no warning, too few pairs, or what is assumed.

    A coarse verdict that says what the stated error assumes judges that error.
    """
    judged = verdict.level == "coarse" and verdict.assumes != ""
    warned = any(consequence_of(one.code) == "coarse" for one in calibration.warnings)
    return judged and not warned and sum(pair.inlier for pair in calibration.pairs) >= SURE_PAIRS


def _click_the_rest(left: int) -> str:
    return f"Click the {left} placements that are left" if left > 1 else "Click the placement that is left"


def _when_good(calibration: Calibration, left: int | None) -> str:
    """Say that it is done once every placement is clicked, or no further one would help."""
    best = calibration.next_placement
    if left and not (best is not None and best.may_stop):
        return f"{_click_the_rest(left)}, or export the calibration"
    return DONE


def _most_helpful(calibration: Calibration, left: int | None) -> str:
    """Return what reduces the uncertainty most: a placement, or what is known of an error that all pairs share.

    Knowing an error with a share s of a variance leaves 1 - s of it, so it gains 1 / sqrt(1 - s).
    """
    best, dominant = calibration.next_placement, calibration.dominant_errors()
    if left and (best is None or not best.may_stop):
        return _click_the_rest(left)
    share = max((max(one.position_share, one.rotation_share) for one in dominant), default=0.0)
    if dominant and (best is None or best.may_stop or best.gain * np.sqrt(max(1.0 - share, 1e-9)) < 1.0):
        return dominant[0].action
    if best is not None and not best.may_stop:
        percent = 100.0 * (1.0 - 1.0 / best.gain)
        return f"Put the reflector {placement_words(best)}: that would reduce the pose uncertainty by {percent:.0f} %"
    return "No further placement would help noticeably: the radar's noise allows no more"


Consequence: TypeAlias = Literal["contradictory", "coarse", "limited", "note"]
"""What a warning says of the pose: another one is as likely or the input is not what it claims to be; the stated error does
not hold; it rests on an assumption, so it cannot be called good; nothing."""

_CODES: dict[Consequence, tuple[str, ...]] = {
    "contradictory": (
        "clocks-apart",
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
        "damaged-recording",
        "lost-returns",
        "many-outliers",
        "intrinsics-suspected",
        "shared-error-suspected",
        "clock-bias-suspected",
        "radar-axes-suspected",
        "repeated-placements",
    ),
    "limited": (
        "agreeing-outliers",
        "doubtful-pair",
        "one-pair-decides",
        "weak-geometry",
        _FEW,
        "residuals-too-large",
        "flat-radar",
        "choices-unused",
        "uncertain-association",
        "smooth-angle-errors",
        "angle-scale",
        "lens-or-radar-scale",
        _NOT_MIRRORED,
        "nobody-confirmed",
    ),
}
"""The codes of each consequence, the gravest first."""
_RANKED: dict[str, tuple[int, Consequence]] = {
    code: (rank, consequence)
    for rank, (consequence, code) in enumerate((one, code) for one, codes in _CODES.items() for code in codes)
}


def consequence_of(code: str) -> Consequence:
    """Return what a warning with this code does to the verdict; one that is not about the pose does nothing."""
    return _RANKED[code][1] if code in _RANKED else "note"


def by_consequence(warnings: Iterable[DataWarning]) -> tuple[DataWarning, ...]:
    """Return the warnings with the gravest first; those that say nothing of the pose come last, as they were given."""
    return tuple(sorted(warnings, key=lambda warning: _RANKED.get(warning.code, (len(_RANKED), "note"))[0]))
