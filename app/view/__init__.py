"""What the screen shows, as a value: `view(session)` is pure, and every client draws the same View."""

from app.view.build import view
from app.view.following import FollowState, Pace, advice_words, pace_words
from app.view.model import Advice, ClickRow, ClickState, Ellipse, Figure, Level, Stage, View
from app.view.reference import Reference, shown_calibration
from app.view.summary import summary_lines
from app.view.wording import sentence, warning_in_sentences

__all__ = [
    "Advice",
    "ClickRow",
    "ClickState",
    "Ellipse",
    "Figure",
    "FollowState",
    "Level",
    "Pace",
    "Reference",
    "Stage",
    "View",
    "advice_words",
    "pace_words",
    "sentence",
    "shown_calibration",
    "summary_lines",
    "view",
    "warning_in_sentences",
]
