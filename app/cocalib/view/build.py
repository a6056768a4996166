"""Build the View of a session, in one pure call; and the same figures of a calibration as lines of text."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calib_core.association.placement_groups import linked_clicks
from calib_core.measurements import MIN_PAIRS, Unpaired, Unsolvable
from calib_core.options import GatingOptions
from calib_core.results import Calibration, DataWarning, PairResult
from calib_core.results.actions import (
    Action,
    ChooseReturn,
    ClickMore,
    MeasureCameraPosition,
    PlaceReflector,
    ReviewPairs,
    SetOption,
)
from calib_core.results.verdict import SURE_PAIRS, Verdict, by_consequence, consequence_of, verdict_on
from calib_core.words import collecting
from calib_core.words.collecting import few_pairs, many_left
from calib_core.words.outcomes import by_cause, in_sentences
from calib_core.words.text import Words, listed, named, say, sentence, words
from calib_core.words.verdict import action_of, action_words, assumed_words, verdict_line, verdict_rest
from cocalib.session.applying import History
from cocalib.session.state import Outcome, RecordingFacts, Session
from cocalib.view.click_rows import click_rows, disagreement
from cocalib.view.figures import (
    assumed_figures,
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
from cocalib.view.placement_states import SeenPlacements, placement_states, placements_of_clicks
from cocalib.view.reference import Reference, comparison_figures, reference_words, shown_calibration
from cocalib.view.wording import plain


def view(
    history: History,
    facts: RecordingFacts,
    reference: Reference | None = None,
    seen: SeenPlacements | None = None,
) -> View:
    """Return everything there is to draw about the current session.

    Args:
        history: the session with what can be undone and redone.
        facts: the recording's frames.
        reference: a calibration to review; None if there is none.
        seen: the placements that were found in the radar data; None before they have been looked for.
    """
    session = history.present
    outcome = session.outcome
    calibration = outcome if isinstance(outcome, Calibration) else None
    shown = shown_calibration(session, reference)
    stage = _stage(session)
    seen = seen or SeenPlacements()
    of_clicks = placements_of_clicks(session, seen.placements)
    states = placement_states(session, seen, of_clicks)
    left = sum(state in ("open", "guess") for state in states) if states else None
    verdict = verdict_on(outcome if session.clicks else None, left=left, unconfirmed=len(facts.unconfirmed(session)))
    return View(
        revision=session.revision,
        stage=stage,
        status=reference_words(session, reference) if reference and calibration is None else "",
        solving=session.needs_solving,
        checking=session.is_checking,
        solved_revision=session.outcome_revision if outcome is not None else -1,
        can_undo=bool(history.past),
        can_redo=bool(history.future),
        has_calibration=calibration is not None,
        method=session.options.method,
        clicks=click_rows(session, facts, of_clicks),
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
        assumptions=tuple(
            AssumptionRow(one.text, str(sentence(one.text)), str(sentence(one.hint)))
            for one in facts.unconfirmed(session)
        ),
        verdict=verdict_row(verdict, session, left),
        placements=states,
        dismissed=session.dismissed,
        reviewed=session.reviewed,
        acknowledged=session.acknowledged,
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
    labels = [f"{one.label} ({one.abbreviation})" if one.abbreviation else one.label for one in figures]
    figures = tuple(replace(figure, label=label) for figure, label in zip(figures, labels, strict=True))
    width = max(map(len, labels))
    verdict = verdict_on(calibration)
    lines = ["verdict: " + verdict_line(verdict)]
    lines += ["assumes: " + assumed_words(verdict.assumed)] if verdict.assumed else []
    lines += ["next: " + sentence(action_words(verdict))]
    rows = [words(f"{figure.label:<{width}}  {figure.value} {figure.unit}".rstrip()) for figure in figures]
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


_MOST_NAMED = 6


def verdict_row(verdict: Verdict, session: Session, left: int | None) -> VerdictRow:
    """Return the verdict for the page: by the first rule that holds while pairs are few, else as it is stated.

    Args:
        verdict: on the latest outcome.
        session: with that outcome.
        left: how many placements want a click; None if no placement is known.
    """
    outcome = session.outcome if session.clicks else None
    used = [pair for pair in outcome.pairs if not pair.excluded] if isinstance(outcome, Calibration) else []
    misfits = [pair for pair in used if not pair.inlier and pair.rival < 0 and disagreement(session.options).of_pair]
    doubt = max((pair for pair in used if pair.inlier), key=lambda pair: pair.outlier_probability, default=None)
    suspect = named(doubt.id) if doubt is not None and doubt.outlier_probability > _SUSPECT else Words()
    do_not_fit = collecting.misfits_of([pair.id for pair in misfits])
    seen = _Seen(verdict, outcome, tuple(used), do_not_fit, suspect, left != 0, bool(session.clicks))
    rule = next((rule for rule in _RULES if rule.holds(seen)), _AS_STATED)
    asks = rule.kind == "asks"
    action = ReviewPairs((doubt.id,)) if asks and doubt is not None else action_of(verdict)
    asked = collecting.mark_question(suspect) if asks else Words()
    return VerdictRow(
        level="coarse" if rule.kind in ("asks", "wrong") else verdict.level,
        word="" if rule.line else verdict.level,
        line=(rule.line(seen) if rule.line else verdict_rest(verdict)).with_degree_signs(),
        action=asked or sentence(action_words(verdict)),
        assumes=sentence("assumes " + assumed_words(verdict.assumed)) if verdict.assumed else Words(),
        kind=type(action).__name__,
        pairs=action.ids if isinstance(action, ReviewPairs | ChooseReturn) else (),
        key="" if asks else "N" if rule.line and left else _key(verdict, left),
        option=_option(action, session),
        done=verdict.done,
        early=rule.kind == "calm",
        misfits=seen.misfits + "." if misfits else Words(),
    )


_MORE_PAIRS_DECIDE = ("few-pairs", "weak-geometry", "one-pair-decides", "two-poses", "handedness-open")
_SUSPECT = 0.05
"""A pair that is an outlier with more than this probability is worth a look while there are few: 4 of 100 sound sets have one."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """What the rules of the verdict's line ask.

    Attributes:
        verdict: on the outcome.
        outcome: the latest one; None before any click.
        used: the pairs that are not excluded.
        misfits: which are set aside because they do not fit the others; empty if there are none.
        suspect: the one that may be an outlier although the few others cannot tell; empty if there is none.
        more: placements are left, or none is known.
        clicked: there is a click.
    """

    verdict: Verdict
    outcome: Outcome | None
    used: tuple[PairResult, ...]
    misfits: Words
    suspect: Words
    more: bool
    clicked: bool

    @property
    def few(self) -> bool:
        """Whether there is a pose of fewer pairs than a verdict needs, and nothing is wrong that more would not settle."""
        solved = self.outcome if isinstance(self.outcome, Calibration) and self.outcome.options.models_noise else None
        return solved is not None and self.agreeing < SURE_PAIRS and _grave(solved) <= {*_MORE_PAIRS_DECIDE}

    @property
    def agreeing(self) -> int:
        """How many pairs fit."""
        return sum(pair.inlier for pair in self.used)

    @property
    def all_agree(self) -> bool:
        """Whether all pairs fit."""
        return self.agreeing == len(self.used)


def _grave(outcome: Outcome | None) -> set[str]:
    """Return the codes of the warnings that make a verdict coarse or contradictory."""
    warnings = outcome.warnings if isinstance(outcome, Calibration) else ()
    return {one.code for one in warnings if consequence_of(one.code) not in ("limited", "note")}


def _only_large(now: _Seen) -> bool:
    """Return whether only the size of the error is wrong, all pairs agree, and placements are left."""
    return now.verdict.is_only_large and now.more and now.all_agree


def _is(now: _Seen, code: str, **facts: int) -> bool:
    """Return whether there is no pose, for a reason with these facts, other than clicks without a return."""
    outcome = now.outcome
    return (
        isinstance(outcome, Unsolvable)
        and outcome.code == code
        and not outcome.unpaired
        and facts.items() <= outcome.facts.items()
    )


@dataclass(frozen=True, slots=True)
class _Rule:
    """A line of the verdict.

    Attributes:
        holds: when it is said.
        line: what is said; None says the verdict as it is stated.
        kind: whether nothing is wrong; the suspect's mark is asked about; a pair is wrong.
    """

    holds: Callable[[_Seen], object]
    line: Callable[[_Seen], Words] | None
    kind: Literal["stated", "calm", "asks", "wrong"] = "stated"


def _few(
    holds: Callable[[_Seen], object], what: Callable[[_Seen], Words], kind: Literal["calm", "asks", "wrong"]
) -> _Rule:
    """Return a rule for few pairs."""
    return _Rule(lambda now: now.few and holds(now), lambda now: few_pairs(now.agreeing, what(now)), kind)


_AS_STATED = _Rule(lambda _: True, None)
_RULES = (
    _Rule(lambda now: now.verdict.level in ("good", "usable"), None),
    _Rule(lambda now: not now.clicked, lambda _: collecting.NO_CLICKS, "calm"),
    _Rule(lambda now: now.outcome is None, lambda _: collecting.NO_ANSWER, "calm"),
    _Rule(
        lambda now: _is(now, "too-few-pairs"),
        lambda now: few_pairs(now.outcome.facts.get("used", 0) if isinstance(now.outcome, Unsolvable) else 0),
        "calm",
    ),
    _Rule(
        lambda now: _is(now, "no-pose", agreeing=MIN_PAIRS - 1, pairs=MIN_PAIRS),
        lambda _: collecting.MISFIT_OF_FEW,
        "wrong",
    ),
    _few(lambda now: now.misfits, lambda now: now.misfits, "wrong"),
    _few(
        lambda now: any(one.rival >= 0 and not one.inlier for one in now.used),
        lambda _: collecting.RETURN_OPEN,
        "wrong",
    ),
    _few(lambda now: now.all_agree and now.suspect, lambda now: collecting.check(now.suspect), "asks"),
    _few(lambda now: now.all_agree and "two-poses" in _grave(now.outcome), lambda _: collecting.TWO_ANSWERS, "calm"),
    _few(lambda now: now.all_agree, lambda _: collecting.CONSISTENT, "calm"),
    _Rule(
        lambda now: _only_large(now) and now.suspect,
        lambda now: many_left(len(now.used), now.verdict.error, collecting.check(now.suspect)),
        "asks",
    ),
    _Rule(_only_large, lambda now: many_left(len(now.used), now.verdict.error), "calm"),
)
"""What is said while pairs are few, or many are left: the first that holds. From enough pairs on, the verdict as it is stated."""


def _key(verdict: Verdict, left: int | None) -> Literal["", "N", "E"]:
    """Return the key of the page that does or begins the action."""
    if verdict.done:
        return "E"
    collecting = verdict.cause is None or verdict.cause.code == "too-few-pairs"
    more = isinstance(verdict.action, ClickMore) or (verdict.level == "nothing" and collecting)
    return "N" if left and more else ""


def _option(action: Action, session: Session) -> str:
    """Return the path of the option that does the action: what was measured, or a maximum range that leaves returns out."""
    if isinstance(action, MeasureCameraPosition):
        return "solving.camera_position"
    is_near = session.options.gating.max_range_m < GatingOptions().max_range_m
    if is_near and _unpaired(session):
        return "gating.max_range_m"
    return action.name if isinstance(action, SetOption) else ""


def advice_for(calibration: Calibration, verdict: Verdict) -> Advice | None:
    """Return where the next placement would help most; None where that is unknown, as with the paper's method.

    Args:
        calibration: the latest outcome.
        verdict: on it; its action comes first, so that the advice does not contradict it.
    """
    best = calibration.next_placement
    if best is None:
        return None
    said = "" if isinstance(verdict.action, PlaceReflector) else collecting.next_placement_words(best)
    return Advice(best, float(np.linalg.norm(best.position_radar_m)), said)
