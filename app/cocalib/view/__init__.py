"""What the screen shows, as a value: `view(session)` is pure, and every client draws the same View."""

from cocalib.view.build import is_dismissed, summary_lines, view
from cocalib.view.candidates import CandidateRow, PairCandidates, click_candidates, pair_of_click
from cocalib.view.following import FollowState, Pace, advice_words, pace_words
from cocalib.view.model import (
    Advice,
    ClickRow,
    ClickState,
    Ellipse,
    Figure,
    Level,
    Stage,
    View,
    WarningRow,
    warning_row,
)
from cocalib.view.reference import Reference, shown_calibration
from cocalib.view.wording import sentence

__all__ = [
    "Advice",
    "CandidateRow",
    "ClickRow",
    "ClickState",
    "Ellipse",
    "Figure",
    "FollowState",
    "Level",
    "Pace",
    "PairCandidates",
    "Reference",
    "Stage",
    "View",
    "WarningRow",
    "advice_words",
    "click_candidates",
    "is_dismissed",
    "pace_words",
    "pair_of_click",
    "sentence",
    "shown_calibration",
    "summary_lines",
    "view",
    "warning_row",
]
