"""The verdict on a calibration: how far to trust it, in one line, and the one action that helps most.

A good or usable calibration states its error, which holds in 95 % of such calibrations. The limits below and the consequence of
each warning decide the level; docs/warnings.md lists both, and the measured shares.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from calib_core.diagnostics.consequence import Consequence, by_consequence, consequence_of
from calib_core.measurements import Unsolvable
from calib_core.results import Calibration, DataWarning, NextPlacement
from calib_core.stated_error import StatedError, stated_error

VerdictLevel: TypeAlias = Literal["good", "usable", "weak", "contradictory", "nothing"]

GOOD_DEG, GOOD_CM = 1.0, 10.0
"""A stated error up to these is good."""
USABLE_DEG, USABLE_CM = 3.0, 30.0
"""A stated error up to these is usable; a larger one is weak. Of a radar without elevation only its yaw is judged: its picture
does not depend on how it is mounted, its position does."""
SURE_PAIRS = 8
"""With fewer pairs neither a wrong pair nor a wrong noise level can be detected: the verdict is weak."""
HELD_OUT_RATIO = 2.0
"""With a held-out error above this many times the fitted one, single pairs decide: the verdict is not good."""

_CONTRADICTIONS = ("mirrored-axes", "no-pose", "camera-position-contradicted", "no-consensus", "refinement-diverged")
_ABOUT_FIGURES = ("weak-geometry", "few-pairs")
_MORE_PAIRS_HELP = (*_ABOUT_FIGURES, "one-pair-decides")
_BETWEEN = {"good": " to ", "usable": " to ", "nothing": " yet: "}
_LEAST_VARIANCE, _MOST_VARIANCE = 1e-18, 1e12
_CORNER = "the reflector's inner corner, where its three sheets meet"
DONE = "Done: export the calibration"
"""The action when nothing more is needed."""
ALL_CLICKED = "Done with this recording: every placement is clicked"
"""How the action begins when only more than this recording would help."""
_DEFAULT_METHOD = "Solve with the default method, which states the error of the pose and leaves wrong pairs out"


@dataclass(frozen=True, slots=True)
class Verdict:
    """How far a calibration can be trusted.

    Attributes:
        level: "good" and "usable" state an error that holds with 95 %; "weak" is not to be relied on; "contradictory": the
            data contradict the pose or each other; "nothing": there is no calibration.
        reason: the stated error, or what is wrong; without a full stop.
        action: the one thing that helps most; a sentence without a full stop.
    """

    level: VerdictLevel
    reason: str
    action: str

    @property
    def line(self) -> str:
        """Level and reason: "usable to 0.5 deg, 6 cm (95 %); 7 px at 20 m"."""
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
        return Verdict("weak", reason, "Confirm what is assumed about the recording, or state what is right")
    if not _states_error(outcome):
        return _without_covariance(outcome, warning)
    return _judged(outcome, stated_error(outcome), warning, left)


def placement_words(best: NextPlacement) -> str:
    """Say where a placement is: "4.5 m ahead, 2.1 m to the left"."""
    x_m, y_m, _ = best.position_radar_m
    side = (
        "straight ahead" if abs(y_m) < 0.1 * abs(x_m) else f"{abs(y_m):.1f} m to the {'left' if y_m > 0 else 'right'}"
    )
    return f"{x_m:.1f} m ahead, {side}"


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
    if warning is not None and consequence_of(warning.code) == "weak":
        return Verdict("weak", f"{reason}; {warning.message}", _DEFAULT_METHOD)
    return Verdict("weak", reason, _DEFAULT_METHOD)


def _judged(calibration: Calibration, error: StatedError, warning: DataWarning | None, left: int | None) -> Verdict:
    """Judge a pose by its gravest warning and its stated error."""
    consequence: Consequence = "note" if warning is None else consequence_of(warning.code)
    count = sum(pair.inlier for pair in calibration.pairs)
    if warning is not None and consequence == "weak":
        hint = _capitalized(warning.hint)
        action = _click_the_rest(left) if left and warning.code in _MORE_PAIRS_HELP else hint
        if warning.code not in _ABOUT_FIGURES:
            return Verdict("weak", warning.message, action)
        few = f", from only {count} pairs" if warning.code == "few-pairs" else ""
        return Verdict("weak", f"uncertain to {error.text}{few}", action)
    if count < SURE_PAIRS:
        return Verdict("weak", f"uncertain to {error.text}, from only {count} pairs", _most_helpful(calibration, left))
    if error.rotation_deg > USABLE_DEG or error.position_cm > USABLE_CM:
        return Verdict("weak", f"uncertain to {error.text}", _most_helpful(calibration, left))
    steady = not calibration.metrics.held_out_aed_px > HELD_OUT_RATIO * calibration.metrics.aed_px
    small = error.rotation_deg <= GOOD_DEG and error.position_cm <= GOOD_CM and steady
    if small and consequence == "note":
        return Verdict("good", error.text, _when_good(calibration, left))
    better = (
        _capitalized(warning.hint) if small and warning is not None and not left else _most_helpful(calibration, left)
    )
    return Verdict("usable", error.text, f"{ALL_CLICKED}. {better}" if left == 0 else better)


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
    return "No further placement would help noticeably: state less noise among the options if the radar is better than that"
