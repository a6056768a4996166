"""What the user has done so far, as a value: Session, the events that change it, and the pure functions that apply them.

Nothing here deals with files, threads or screens.
"""

from app.session.applying import EventError, apply
from app.session.events import (
    AssumptionsConfirmed,
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    ClicksImported,
    ColumnsMapped,
    Event,
    OptionsChanged,
    OptionsEdited,
    PlacementDismissed,
    Redo,
    ReturnChosen,
    ScansAdded,
    Solved,
    Step,
    Undo,
    WarningsAcknowledged,
)
from app.session.history import History, advance, settled
from app.session.state import AssumedReading, DismissedPlacement, Outcome, RecordingFacts, Session

__all__ = [
    "AssumedReading",
    "AssumptionsConfirmed",
    "Cleared",
    "ClickExcluded",
    "ClickMoved",
    "ClickPlaced",
    "ClickRemoved",
    "ClicksImported",
    "ColumnsMapped",
    "DismissedPlacement",
    "Event",
    "EventError",
    "History",
    "OptionsChanged",
    "OptionsEdited",
    "Outcome",
    "PlacementDismissed",
    "RecordingFacts",
    "Redo",
    "ReturnChosen",
    "ScansAdded",
    "Session",
    "Solved",
    "Step",
    "Undo",
    "WarningsAcknowledged",
    "advance",
    "apply",
    "settled",
]
