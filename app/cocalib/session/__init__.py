"""What the user has done so far, as a value: Session, the events that change it, and the pure functions that apply them.

Nothing here deals with files, threads or screens.
"""

from cocalib.session.applying import apply
from cocalib.session.box_tracks import BoxEdges, BoxKeyframe, BoxTrack
from cocalib.session.chosen_intrinsics import ChosenIntrinsics
from cocalib.session.event_checks import EventError
from cocalib.session.events import (
    AssumptionsConfirmed,
    AxesStated,
    BoxDrawn,
    BoxesLoaded,
    BoxHidden,
    BoxKeyframeRemoved,
    BoxLabelled,
    BoxMoved,
    BoxRemoved,
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    ClicksImported,
    ColumnsMapped,
    IntrinsicsChosen,
    JournalStep,
    OptionsChanged,
    PlacementDismissed,
    Redo,
    ReturnChosen,
    ScansAdded,
    Solved,
    Step,
    Undo,
    WarningsAcknowledged,
)
from cocalib.session.history import History, advance, settled
from cocalib.session.state import AssumedReading, DismissedPlacement, Outcome, RecordingFacts, Session

__all__ = [
    "AssumedReading",
    "AssumptionsConfirmed",
    "AxesStated",
    "BoxDrawn",
    "BoxEdges",
    "BoxHidden",
    "BoxKeyframe",
    "BoxKeyframeRemoved",
    "BoxLabelled",
    "BoxMoved",
    "BoxRemoved",
    "BoxTrack",
    "BoxesLoaded",
    "ChosenIntrinsics",
    "Cleared",
    "ClickExcluded",
    "ClickMoved",
    "ClickPlaced",
    "ClickRemoved",
    "ClicksImported",
    "ColumnsMapped",
    "DismissedPlacement",
    "EventError",
    "History",
    "IntrinsicsChosen",
    "JournalStep",
    "OptionsChanged",
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
