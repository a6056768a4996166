"""What a verdict says, and what its action is: its line, its action and what it assumes."""

from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from calib_core.measurements import DataWarning, Unsolvable
from calib_core.results.actions import (
    Action,
    CalibrateLens,
    ChooseReturn,
    ClickFirst,
    ClickMore,
    ConfirmAssumptions,
    Export,
    FollowHint,
    MeasureCameraPosition,
    PlaceReflector,
    ReduceError,
    ReviewPairs,
    SetOption,
    SpreadPlacements,
    Stop,
)
from calib_core.results.verdict import SURE_PAIRS, Assumed, StatedError, Verdict, VerdictLevel
from calib_core.words.outcomes import outcome_remark
from calib_core.words.remark import Remark
from calib_core.words.systematic_errors import remedy_of
from calib_core.words.text import Words, join, listed, option, words
from calib_core.words.warnings import warning_remark

_CORNER = "the inner corner, where the three plates meet"


@dataclass(frozen=True, slots=True)
class StatedVerdict:
    """A verdict as a file holds it.

    Attributes:
        level: how large the error is, which holds with 95 %: "good", "usable" or "coarse"; or "contradictory": the data
            contradict the pose or each other; or "nothing": there is no calibration.
        reason: the stated error, or what contradicts; then how many pairs were left out by their residual; without a full stop.
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


def stated_verdict(verdict: Verdict) -> StatedVerdict:
    """Return a verdict as text, with pairs by their ids and options by their names."""
    return StatedVerdict(
        verdict.level,
        reason(verdict).text(),
        action_words(verdict).text(),
        assumed_words(verdict.assumed).text(),
    )


_BETWEEN: dict[str, str] = {"good": ": within ", "usable": ": within ", "nothing": " yet: "}


def verdict_line(verdict: Verdict) -> Words:
    """Return level and reason: "usable: within 0.5 deg, 6 cm (95 %); 7 px at 20 m"."""
    return verdict.level + verdict_rest(verdict)


def verdict_rest(verdict: Verdict) -> Words:
    """Return what follows the level in a verdict's line."""
    return _BETWEEN.get(verdict.level, ": ") + reason(verdict)


def error_text(error: StatedError) -> str:
    """Return a stated error within a sentence: "0.5 deg, 6 cm (95 %); 7 px at 9 m"."""
    pose = (
        f"{error.rotation_deg:g} deg of yaw"
        if error.in_plane
        else f"{error.rotation_deg:g} deg, {error.position_cm:g} cm"
    )
    image = f"; {error.image_px:g} px at {error.range_m:.0f} m" if np.isfinite(error.image_px) else ""
    return f"{pose} (95 %){image}{'; height and tilt assumed' if error.in_plane else ''}"


def reason(verdict: Verdict) -> Words:
    """Return the stated error, or what decides instead, as a phrase; then how many pairs were left out by their residual."""
    return join((_reason(verdict), _excluded_words(verdict.excluded)), "; ")


def _excluded_words(excluded: DataWarning | None) -> str:
    if excluded is None:
        return ""
    facts = excluded.facts
    if "ids" not in facts:  # read from a file
        return "pairs excluded by residual"
    return f"{len(facts['ids'])} excluded by residual (AED of all {facts['all_aed_px']:.3g} px)"


def _reason(verdict: Verdict) -> Words:
    if verdict.unconfirmed:
        one = verdict.unconfirmed == 1
        return words(
            f"{verdict.unconfirmed} of the recording's units or axes {'is' if one else 'are'} assumed, not confirmed"
        )
    cause = None if verdict.cause is None else cause_remark(verdict).message
    if verdict.level in ("contradictory", "nothing"):
        return cause or words("no placement is clicked")
    if verdict.error is None:
        spread = f"the method states no error of its pose; its residuals are {verdict.rms_px:.3g} px (RMS)"
        return join((spread, cause or ""), "; ")
    if verdict.pairs:  # so few pairs do not show how large the error is
        return cause or words(f"{verdict.pairs} of {SURE_PAIRS} pairs")
    error = error_text(verdict.error)
    if verdict.level in ("good", "usable"):
        return words(error)
    return join((cause or "", f"within {error}"), "; ")


def cause_remark(verdict: Verdict) -> Remark:
    """Return what a verdict's cause says."""
    return (
        outcome_remark(verdict.cause) if isinstance(verdict.cause, Unsolvable) else warning_remark(_warning_of(verdict))
    )


def _warning_of(verdict: Verdict) -> DataWarning:
    assert isinstance(verdict.cause, DataWarning)  # the caller asks for a cause
    return verdict.cause


def action_of(verdict: Verdict) -> Action:
    """Return what a verdict advises, with "do what the hint says" and "learn more of an error" resolved."""
    if isinstance(verdict.action, FollowHint):
        return cause_remark(verdict).action or verdict.action
    if isinstance(verdict.action, ReduceError):
        return remedy_of(verdict.action.name, measured=verdict.action.measured).action
    return verdict.action


def action_words(verdict: Verdict) -> Words:
    """Return the one thing to do, as a sentence without a full stop."""
    follows = isinstance(verdict.action, FollowHint)
    best = capitalized(cause_remark(verdict).hint) if follows else words_of(verdict.action)
    return join(
        ("Done with this recording: every placement is clicked" if verdict.everything_clicked else "", best), ". "
    )


@singledispatch
def words_of(action: Action) -> Words:
    """Return what to do, as a sentence without a full stop."""
    raise TypeError(f"no words for {type(action).__name__}")


@words_of.register
def _(action: ClickFirst) -> Words:
    where = "Go to a placement" if action.placements_known else "Go to a frame in which the reflector stands still"
    return words(f"{where} and click {_CORNER}")


@words_of.register
def _(action: ClickMore) -> Words:
    if action.count is None:
        left = "Click more placements"
    elif action.count == 1:
        left = "Click the placement that is left"
    else:
        left = f"Click the {action.count} placements that are left"
    return words(f"{left}, or export the calibration" if action.or_export else left)


@words_of.register
def _(action: PlaceReflector) -> Words:
    percent = 100.0 * (1.0 - 1.0 / action.gain)
    where = placement_words(action.position_radar_m[0], action.position_radar_m[1])
    return words(f"Put the reflector {where}: {percent:.0f} % less uncertainty")


@words_of.register
def _(action: ReduceError) -> Words:
    return capitalized(remedy_of(action.name, measured=action.measured).phrase) + " would help most"


@words_of.register
def _(action: SetOption) -> Words:
    if (action.name, action.value) == ("method", "default"):
        return words("Solve with the default method, which states the error of the pose and leaves wrong pairs out")
    return "Set " + option(action.name, action.value)


@words_of.register
def _(action: ReviewPairs) -> Words:
    return "Check " + listed(action.ids)


@words_of.register
def _(action: ChooseReturn) -> Words:
    return "Choose the return of " + listed(action.ids)


@words_of.register(MeasureCameraPosition)
@words_of.register(CalibrateLens)
@words_of.register(ConfirmAssumptions)
@words_of.register(Export)
@words_of.register(Stop)
def _(action: Action) -> Words:
    return words(_FIXED[type(action)])


_FIXED: dict[type, str] = {
    MeasureCameraPosition: "Measure the camera position with a tape",
    CalibrateLens: "Calibrate the lens",
    ConfirmAssumptions: "Confirm what is assumed about the recording, or state what is right",
    Export: "Done: export the calibration",
    Stop: "This is as good as this radar gets: no further placement would help noticeably",
}


@words_of.register
def _(action: SpreadPlacements) -> Words:
    at = {
        "edges": "at both edges of the image",
        "heights": "at several heights (a tripod)",
        "near": "nearer to the radar",
    }
    return words(f"Add placements {at.get(action.at, '')}".rstrip())


def placement_words(forward_m: float, left_m: float) -> str:
    """Say where a placement is: "4.5 m ahead and 2.1 m left"."""
    if abs(left_m) < 0.1 * abs(forward_m):
        return f"{forward_m:.1f} m straight ahead"
    return f"{forward_m:.1f} m ahead and {abs(left_m):.1f} m {'left' if left_m > 0 else 'right'}"


def assumed_words(assumed: Assumed | None) -> Words:
    """Return what no pair can show, as a phrase; nothing if nothing is assumed."""
    if assumed is None:
        return Words()
    first = "a correct camera position" if assumed.measured else "clicks on the phase center"
    principal_point = f"the principal point within {assumed.principal_point_px:.2g} px"
    parts = (
        first,
        "unmirrored radar axes" if assumed.not_mirrored else "",
        "correct elevations" if assumed.elevations else "",
        "a full-size image",
        principal_point if np.isfinite(assumed.principal_point_px) else "",
    )
    return join(parts, ", ")


def capitalized(phrase: Words) -> Words:
    """Begin with a capital letter."""
    first = phrase.parts[0] if phrase else ""
    if not isinstance(first, str):
        return phrase
    return Words((first[:1].upper() + first[1:], *phrase.parts[1:]))
