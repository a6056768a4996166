"""Build the View of a session, in one pure call; and the same figures of a calibration as lines of text."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from calib_core.association.placement_groups import linked_clicks
from calib_core.association.placements import Placement
from calib_core.measurements import MIN_PAIRS, Unpaired, Unsolvable
from calib_core.options import GatingOptions
from calib_core.results import Calibration, DataWarning, NextPlacement
from calib_core.results.actions import (
    Action,
    ChooseReturn,
    ClickMore,
    MeasureCameraPosition,
    PlaceReflector,
    ReviewPairs,
    SetOption,
)
from calib_core.results.verdict import SURE_PAIRS, Verdict, by_consequence, consequence_of, stated_error, verdict_on
from calib_core.words.outcomes import by_cause, in_sentences
from calib_core.words.text import Words, listed, named, say, sentence, words
from calib_core.words.verdict import (
    action_of,
    action_words,
    assumed_words,
    error_text,
    placement_words,
    verdict_line,
    verdict_rest,
)
from cocalib.session.applying import History
from cocalib.session.state import RecordingFacts, Session
from cocalib.view.click_rows import click_rows
from cocalib.view.figures import (
    assumed_figures,
    firm_text,
    metric_figures,
    pose_figures,
    refined_sentences,
    residual_limit_px,
    systematic_errors,
    uncertainty_sentences,
)
from cocalib.view.model import (
    Advice,
    AssumptionRow,
    Figure,
    Stage,
    SystematicErrorTable,
    VerdictRow,
    View,
    WarningRow,
    warning_row,
)
from cocalib.view.reference import Reference, comparison_figures, reference_words, shown_calibration
from cocalib.view.wording import plain


def view(
    history: History,
    facts: RecordingFacts,
    reference: Reference | None = None,
    placements: Sequence[Placement] | None = None,
) -> View:
    """Return everything there is to draw about the current session.

    Args:
        history: the session with what can be undone and redone.
        facts: the recording's frames.
        reference: a calibration to review; None if there is none.
        placements: found in the radar data; None before they have been looked for.
    """
    session = history.present
    outcome = session.outcome
    calibration = outcome if isinstance(outcome, Calibration) else None
    shown = shown_calibration(session, reference)
    stage = _stage(session)
    verdict = _shown_verdict(session, facts, placements)
    return View(
        revision=session.revision,
        stage=stage,
        status=_status(session, facts, reference),
        solving=session.needs_solving,
        checking=session.is_checking,
        solved_revision=session.outcome_revision if outcome is not None else -1,
        can_undo=bool(history.past),
        can_redo=bool(history.future),
        has_calibration=calibration is not None,
        method=session.options.method,
        clicks=click_rows(session, facts),
        metrics=metric_figures(calibration),
        pose=pose_figures(shown) if shown else (),
        pose_assumed=assumed_figures(shown) if shown else (),
        systematic_errors=systematic_errors(shown) if shown else SystematicErrorTable(),
        warnings=_warnings(calibration, verdict) if facts.has_images else (warning_row(DataWarning("no-camera")),),
        options=session.options,
        residual_limit_px=residual_limit_px(calibration) if calibration else None,
        advice=advice_for(calibration, verdict) if calibration else None,
        reference=reference.name if reference else "",
        comparison=comparison_figures(reference, calibration) if reference and calibration else (),
        assumptions=_assumptions(session, facts),
        verdict=verdict_row(verdict, session, placements),
        dismissed=session.dismissed,
        acknowledged=session.acknowledged,
    )


def _assumptions(session: Session, facts: RecordingFacts) -> tuple[AssumptionRow, ...]:
    return tuple(
        AssumptionRow(one.text, str(sentence(one.text)), str(sentence(one.hint))) for one in facts.unconfirmed(session)
    )


def _stage(session: Session) -> Stage:
    if not session.clicks:
        return "collecting"
    if session.needs_solving:
        return "solving"
    if isinstance(session.outcome, Calibration):
        return "solved"
    return "collecting" if _waits_for_clicks(session) else "unsolvable"


def _missing(session: Session) -> int:
    """Return how many placements are still needed to solve; clicks without a radar position do not count."""
    unseen = {row.id for row in _unpaired(session)}
    usable = sum(click.counts and click.id not in unseen for click in session.clicks)
    return max(0, MIN_PAIRS - usable)


def _unpaired(session: Session) -> tuple[Unpaired, ...]:
    """Return the current clicks without a radar position, according to the latest outcome."""
    here = {click.id for click in session.clicks}
    return tuple(row for row in session.outcome.unpaired if row.id in here) if session.outcome else ()


def _waits_for_clicks(session: Session) -> bool:
    """Return whether more placements are all that is missing, according to the latest outcome."""
    blocked = isinstance(session.outcome, Unsolvable) and session.outcome.code != "too-few-pairs"
    return _missing(session) > 0 and not blocked


def _status(session: Session, facts: RecordingFacts, reference: Reference | None) -> str:
    """Return what the status line adds to what is going on."""
    found = session.outcome
    if not isinstance(found, Calibration):
        return "" if reference is None else reference_words(session, reference)
    asked = sum(pair.rival >= 0 and not pair.inlier and not pair.excluded for pair in found.pairs)
    changed = len({click.id for click in session.clicks} & session.changed_returns)
    told = (
        f"{asked} pair{' needs' if asked == 1 else 's need'} a return (C)" if asked else "",
        "" if found.sees_elevation else firm_text(found),
        "1 click changed its return" if changed == 1 else f"{changed} clicks changed their return" if changed else "",
        "unconfirmed assumptions" if facts.unconfirmed(session) else "",
    )
    return "  ·  ".join(filter(None, told))


def _warnings(calibration: Calibration | None, verdict: Verdict) -> tuple[WarningRow, ...]:
    """Return the warnings, the gravest first, but the one that the verdict's line says."""
    warnings = by_consequence(calibration.warnings if calibration else ())
    return tuple(warning_row(warning) for warning in warnings if warning is not verdict.cause)


def summary_lines(calibration: Calibration) -> tuple[Words, ...]:
    """Return the verdict, the figures, aligned, then what they rest on, the pairs that disagree and the warnings, gravest first.

    For a radar without elevation what it determines comes first, and what it does not follows in one line.
    """
    metrics, pose, assumed = metric_figures(calibration), pose_figures(calibration), assumed_figures(calibration)
    metrics = (*metrics, *_placements(calibration))
    figures = (*pose, *metrics) if assumed else (*metrics, *pose)
    figures = tuple(replace(figure, label=_full_label(figure)) for figure in figures)
    width = max(len(figure.label) for figure in figures)
    verdict = verdict_on(calibration)
    lines = ["verdict: " + verdict_line(verdict)]
    lines += ["assumes: " + assumed_words(verdict.assumed)] if verdict.assumed else []
    lines += ["next: " + sentence(action_words(verdict))]
    rows = [words(_line(figure, width)) for figure in figures]
    if assumed:
        parts = ", ".join(f"{figure.label} {figure.value} {figure.unit}" for figure in assumed)
        rows.insert(len(pose), words(f"assumed, because this radar measures no elevation: {parts}"))
    lines += rows
    if verdict.level != "contradictory":
        lines += ["uncertainty: " + line for line in uncertainty_sentences(calibration)]
    lines += ["intrinsics: " + words(line) for line in refined_sentences(calibration)]
    disagreeing = [pair for pair in calibration.pairs if not pair.inlier and not pair.excluded and pair.rival < 0]
    lines += [
        say(
            "disagrees: {pair}: {distance} px from its radar position",
            pair=named(pair.id),
            distance=plain(pair.distance_px),
        )
        for pair in disagreeing[:_MOST_NAMED]
    ]
    left = len(disagreeing) - _MOST_NAMED
    lines += [words(f"disagree: {left} more")] if left > 0 else []
    lines += [
        "warning: " + in_sentences(warning)
        for warning in by_consequence(calibration.warnings)
        if warning is not verdict.cause
    ]
    for ids, first in by_cause(calibration.unpaired):
        lines.append(say("unpaired: {pairs}: {why}", pairs=listed(ids), why=in_sentences(first)))
    return tuple(lines)


def _placements(calibration: Calibration) -> tuple[Figure, ...]:
    """Return at how many placements the clicks are, each of which makes one pair; nothing where each click counts by itself."""
    pairs = [pair.measured for pair in calibration.pairs if not pair.excluded and pair.measured is not None]
    if not calibration.options.models_noise or not pairs:
        return ()
    count = len(linked_clicks(pairs, calibration.options))
    return (Figure("placements", "placements (pairs)", f"{count}", "", ""),)


def _full_label(figure: Figure) -> str:
    return f"{figure.label} ({figure.abbreviation})" if figure.abbreviation else figure.label


def _line(figure: Figure, width: int) -> str:
    return f"{figure.label:<{width}}  {figure.value} {figure.unit}".rstrip()


_SAME_M = 0.5
_MOST_NAMED = 6
_OF_PAIRS = ("doubtful-pair", "agreeing-outliers", "many-outliers")


def placements_left(session: Session, placements: Sequence[Placement] | None) -> int | None:
    """Return how many placements have no click; None if no placement is known.

    An excluded click counts, since its placement was looked at; a mark that nobody has touched does not. A dismissed placement
    is not the reflector.
    """
    if not placements:
        return None
    times = [click.image_time for click in session.clicks if click.counts or click.excluded]
    clicked = (any(placement.start <= time <= placement.end for time in times) for placement in placements)
    return sum(
        not (done or is_dismissed(placement, session)) for placement, done in zip(placements, clicked, strict=True)
    )


def is_dismissed(placement: Placement, session: Session) -> bool:
    """Return whether the user said that a placement is not the reflector."""
    at = [one for one in session.dismissed if placement.start <= one.time <= placement.end]
    return any(float(np.linalg.norm(placement.position_radar_m - one.position_m)) < _SAME_M for one in at)


def _shown_verdict(session: Session, facts: RecordingFacts, placements: Sequence[Placement] | None) -> Verdict:
    """Return the verdict on the latest outcome; without one, on what is there."""
    left = placements_left(session, placements)
    outcome = session.outcome if session.clicks else None
    return verdict_on(outcome, left=left, unconfirmed=len(facts.unconfirmed(session)))


def verdict_row(verdict: Verdict, session: Session, placements: Sequence[Placement] | None) -> VerdictRow:
    """Return the verdict for the page; as long as only more pairs are missing, how many there are, and how far they lead."""
    left = placements_left(session, placements)
    early = Words()
    if verdict.level not in ("good", "usable"):
        early = _early_line(session) or (_large_so_far(verdict, session) if left != 0 else Words())
    worst = _fits_worst(session) if early else ""
    action = ReviewPairs((worst,)) if worst else action_of(verdict)
    asked = (
        say("Is the mark of {pair} on the inner corner?", pair=named(worst))
        if worst
        else sentence(action_words(verdict))
    )
    return VerdictRow(
        level=verdict.level,
        word="" if early else verdict.level,
        line=early or verdict_rest(verdict).with_degree_signs(),
        action=asked,
        assumes=sentence("assumes " + assumed_words(verdict.assumed)) if verdict.assumed else Words(),
        kind=type(action).__name__,
        pairs=action.ids if isinstance(action, ReviewPairs | ChooseReturn) else (),
        key="" if worst else "N" if early and left else _key(verdict, session, left),
        option=_option(action, session),
        done=verdict.done,
        early=bool(early) and not worst,
    )


_MORE_PAIRS_DECIDE = ("few-pairs", "weak-geometry", "one-pair-decides", "two-poses", "handedness-open")
_SUSPECT = 0.05
"""A pair that is an outlier with more than this probability is worth a look while there are few: 4 of 100 sound sets have one."""


def _early_line(session: Session) -> Words:
    """Return how many pairs there are of those that the verdict needs; nothing if there are enough, or something else is wrong.

    With fewer, a second pose that fits is what few pairs look like: it contradicts nothing until they are enough.
    """
    outcome = session.outcome if session.clicks else None
    if outcome is None:
        return words("No answer yet" if session.clicks else "No clicks yet")
    if isinstance(outcome, Unsolvable):
        waits = outcome.code == "too-few-pairs" and not outcome.unpaired
        return words(f"{len(outcome.pairs)} of {SURE_PAIRS} pairs" if waits else "")
    used = [pair for pair in outcome.pairs if not pair.excluded]
    grave = [warning.code for warning in outcome.warnings if consequence_of(warning.code) not in ("limited", "note")]
    sound = all(pair.inlier for pair in used) and all(code in _MORE_PAIRS_DECIDE for code in grave)
    if not outcome.options.models_noise or len(used) >= SURE_PAIRS or not sound:
        return Words()
    worst = _fits_worst(session)
    seems = words("two answers fit so far" if "two-poses" in grave else "looks consistent")
    if worst:
        seems = say("check {pair}", pair=named(worst))
    return say("{count} of {needed} pairs; {seems}", count=len(used), needed=SURE_PAIRS, seems=seems)


def _large_so_far(verdict: Verdict, session: Session) -> Words:
    """Return how many pairs agree, and how large the error still is; nothing if a pair does not agree, or something is wrong."""
    outcome = session.outcome
    if not isinstance(outcome, Calibration) or not verdict.is_only_large:
        return Words()
    pairs = [pair for pair in outcome.pairs if not pair.excluded]
    if not all(pair.inlier for pair in pairs):
        return Words()
    worst = _fits_worst(session)
    agree = say("; check {pair}", pair=named(worst)) if worst else words(" agree")
    within = error_text(stated_error(outcome))
    return say("{count} pairs{agree}; so far within {within}", count=len(pairs), agree=agree, within=within)


def _fits_worst(session: Session) -> str:
    """Return the pair that may be an outlier although the few others cannot tell; "" if there is none."""
    pairs = session.outcome.pairs if isinstance(session.outcome, Calibration) else ()
    worst = max((pair for pair in pairs if pair.inlier), key=lambda pair: pair.outlier_probability, default=None)
    return worst.id if worst is not None and worst.outlier_probability > _SUSPECT else ""


def _key(verdict: Verdict, session: Session, left: int | None) -> Literal["", "N", "E", "J"]:
    """Return the key of the page that does or begins the action."""
    if verdict.done:
        return "E"
    if isinstance(verdict.cause, DataWarning) and verdict.level == "contradictory":
        return "J" if verdict.cause.code in _OF_PAIRS else ""
    collecting = verdict.cause is None or verdict.cause.code == "too-few-pairs"
    return (
        "N" if left and (isinstance(verdict.action, ClickMore) or (verdict.level == "nothing" and collecting)) else ""
    )


def _option(action: Action, session: Session) -> str:
    """Return the path of the option that does the action: what was measured, or a maximum range that leaves returns out."""
    if isinstance(action, MeasureCameraPosition):
        return "solving.camera_position"
    is_near = session.options.gating.max_range_m < GatingOptions().max_range_m
    if is_near and _unpaired(session):
        return "gating.max_range_m"
    return action.name if isinstance(action, SetOption) else ""


_NOTICEABLE = 0.05


def advice_for(calibration: Calibration, verdict: Verdict) -> Advice | None:
    """Return where the next placement would help most; None where that is unknown, as with the paper's method.

    Args:
        calibration: the latest outcome.
        verdict: on it; its action comes first, so that the advice does not contradict it.
    """
    best = calibration.next_placement
    if best is None:
        return None
    return Advice(best, float(np.linalg.norm(best.position_radar_m)), _advice_words(best, verdict))


def _advice_words(best: NextPlacement, verdict: Verdict) -> str:
    """Return where a placement would help most; "" if the verdict's action says it."""
    if isinstance(verdict.action, PlaceReflector):
        return ""
    if best.may_stop:
        return "Further placements would not help noticeably."
    amount = f"{100 * (1 - 1 / best.gain):.0f} %" if best.gain > 1 + _NOTICEABLE else "slightly"
    return f"One more placement {placement_words(*best.position_radar_m[:2].tolist())}: {amount} less uncertainty."
