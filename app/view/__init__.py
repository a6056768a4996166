"""What the screen shows, as a value: `view(session)` is pure, and every client draws the same View."""

from app.view.drawing import view
from app.view.drawn import Advice, CautionRow, ClickRow, ClickState, Ellipse, Figure, Level, Stage, View
from app.view.summary import summary_lines
from app.view.wording import sentence

__all__ = [
    "Advice",
    "CautionRow",
    "ClickRow",
    "ClickState",
    "Ellipse",
    "Figure",
    "Level",
    "Stage",
    "View",
    "sentence",
    "summary_lines",
    "view",
]
