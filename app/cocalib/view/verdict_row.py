"""The verdict as the page shows it: one line, the action, the key that does it, and where to put the reflector next."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from calib_core.association.placements import Placement
from calib_core.measurements import Unsolvable
from calib_core.results import Calibration, NextPlacement
from calib_core.results.verdict import ALL_CLICKED, DONE, Verdict, by_consequence, placement_words, verdict_on
from cocalib.session import RecordingFacts, Session
from cocalib.view.model import Advice, VerdictRow
from cocalib.view.wording import sentence

_SAME_M = 0.5
_OF_PAIRS = ("doubtful-pair", "agreeing-outliers", "many-outliers")


def placements_left(session: Session, placements: Sequence[Placement] | None) -> int | None:
    """Return how many placements have no click; None if no placement is known.

    An excluded click counts, since its placement was looked at; a mark that nobody has touched does not. A dismissed placement
    is not the reflector.
    """
    if not placements:
        return None
    times = [click.image_time for click in session.clicks if click.counts or click.excluded]
    clicked = (any(one.start <= time <= one.end for time in times) for one in placements)
    return sum(not (done or is_dismissed(one, session)) for one, done in zip(placements, clicked, strict=True))


def is_dismissed(placement: Placement, session: Session) -> bool:
    """Return whether the user said that a placement is not the reflector."""
    at = [one for one in session.dismissed if placement.start <= one.time <= placement.end]
    return any(float(np.linalg.norm(placement.position_radar_m - one.position_m)) < _SAME_M for one in at)


def shown_verdict(session: Session, facts: RecordingFacts, placements: Sequence[Placement] | None) -> Verdict:
    """Return the verdict on the latest outcome; without one, on what is there."""
    left = placements_left(session, placements)
    outcome = session.outcome if session.clicks else None
    return verdict_on(outcome, left=left, unconfirmed=len(facts.unconfirmed(session)))


def verdict_row(verdict: Verdict, session: Session, placements: Sequence[Placement] | None) -> VerdictRow:
    """Return the verdict for the page."""
    return VerdictRow(
        level=verdict.level,
        line=verdict.line,
        action=sentence(verdict.action),
        key=_key(verdict, session, placements_left(session, placements)),
        done=_is_done(verdict),
    )


def _is_done(verdict: Verdict) -> bool:
    return verdict.action == DONE or verdict.action.startswith(ALL_CLICKED)


def _key(verdict: Verdict, session: Session, left: int | None) -> Literal["", "N", "E", "J"]:
    """Return the key of the page that does or begins the action."""
    if _is_done(verdict):
        return "E"
    outcome = session.outcome
    if isinstance(outcome, Calibration) and outcome.options.models_noise and verdict.level == "contradictory":
        return "J" if outcome.warnings and by_consequence(outcome.warnings)[0].code in _OF_PAIRS else ""
    collecting = outcome is None or (isinstance(outcome, Unsolvable) and outcome.code == "too-few-pairs")
    return "N" if left and (collecting or verdict.action.startswith("Click the ")) else ""


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
    return Advice(best, float(np.linalg.norm(best.position_radar_m)), _words(best, verdict))


def _words(best: NextPlacement, verdict: Verdict) -> str:
    """Return the verdict's action, and where a placement would help most if it is another one."""
    where = placement_words(best)
    if where in verdict.action:
        return sentence(verdict.action)
    if best.may_stop:
        return f"{sentence(verdict.action)} No further placement would reduce the pose uncertainty noticeably."
    amount = f"by {100 * (1 - 1 / best.gain):.0f} %" if best.gain > 1 + _NOTICEABLE else "slightly"
    return f"{sentence(verdict.action)} A placement {where}, would reduce the pose uncertainty {amount}."
