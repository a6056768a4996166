"""What can happen to a session: one frozen class per event."""

from dataclasses import dataclass
from typing import TypeAlias

from calib_core.measurements import ChosenReturn, Mark, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions
from calib_core.results import PairResult
from cocalib.option_changes import OptionChange
from cocalib.session.box_tracks import BoxEdges, BoxTrack
from cocalib.session.chosen_intrinsics import ChosenIntrinsics
from cocalib.session.state import Outcome


@dataclass(frozen=True, slots=True)
class ClickPlaced:
    """The reflector's centre was marked in a frame; a frame may have several.

    Attributes:
        image_time: stamp of the frame.
        u_px: column.
        v_px: row.
        mark: how it came to this pixel; None in journals of versions that kept one click per frame: a click that the frame
            already has is then moved.
        sigma_px: its standard deviation per axis; None takes the options' value.
    """

    image_time: TimeNs
    u_px: float
    v_px: float
    mark: Mark | None = "clicked"
    sigma_px: float | None = None


@dataclass(frozen=True, slots=True)
class ClickMoved:
    """A click was dragged, nudged or snapped; it then counts, also if it was a guess before."""

    id: str
    u_px: float
    v_px: float
    mark: Mark = "moved"
    sigma_px: float | None = None


@dataclass(frozen=True, slots=True)
class ClickRemoved:
    """A click was deleted."""

    id: str


@dataclass(frozen=True, slots=True)
class ClickExcluded:
    """A click was excluded, or included again."""

    id: str
    excluded: bool


@dataclass(frozen=True, slots=True)
class ReturnChosen:
    """A person said which radar return a click belongs to, or took that back (None)."""

    id: str
    chosen: ChosenReturn | None


@dataclass(frozen=True, slots=True)
class PlacementDismissed:
    """A placement found in the radar data is not the reflector: it is not offered any more.

    Attributes:
        time: a stamp within it.
        position_m: (x, y, z) of it in the radar frame.
        dismissed: False offers it again.
    """

    time: TimeNs
    position_m: tuple[float, float, float]
    dismissed: bool = True


@dataclass(frozen=True, slots=True)
class WarningsAcknowledged:
    """The user has read the warnings of these codes, or wants to see them again. Not undone with clicks."""

    codes: tuple[str, ...]
    acknowledged: bool = True


@dataclass(frozen=True, slots=True)
class OptionsChanged:
    """All options were set."""

    options: CalibrationOptions


@dataclass(frozen=True, slots=True)
class OptionsEdited:
    """Some options were set; the others stay. `settled` turns this into OptionsChanged."""

    changes: tuple[OptionChange, ...]


@dataclass(frozen=True, slots=True)
class Cleared:
    """All clicks were deleted; the options stay."""


@dataclass(frozen=True, slots=True)
class ClicksImported:
    """Clicks from a file were added to the session; they replace clicks in the same frames."""

    clicks: tuple[ReflectorClick, ...]


@dataclass(frozen=True, slots=True)
class BoxDrawn:
    """A box was drawn around an object that had none so far.

    Attributes:
        image_time: stamp of the frame.
        edges_px: of the box.
        label: the object's class, such as "person".
    """

    image_time: TimeNs
    edges_px: BoxEdges
    label: str


@dataclass(frozen=True, slots=True)
class BoxMoved:
    """The box of an object was corrected in a frame, which makes that frame a keyframe.

    Attributes:
        id: of the track.
        image_time: stamp of the frame.
        edges_px: of the box.
    """

    id: str
    image_time: TimeNs
    edges_px: BoxEdges


@dataclass(frozen=True, slots=True)
class BoxHidden:
    """An object is hidden, or out of the picture, from a frame on until its next keyframe."""

    id: str
    image_time: TimeNs


@dataclass(frozen=True, slots=True)
class BoxKeyframeRemoved:
    """What was said about an object in a frame was taken back; with its last box, the track goes."""

    id: str
    image_time: TimeNs


@dataclass(frozen=True, slots=True)
class BoxRemoved:
    """All boxes of an object were deleted."""

    id: str


@dataclass(frozen=True, slots=True)
class BoxLabelled:
    """An object was given another class."""

    id: str
    label: str


@dataclass(frozen=True, slots=True)
class BoxesLoaded:
    """Boxes from a file took the place of all boxes.

    Attributes:
        tracks: one per object.
        empty_frames: stamps of the frames that were annotated and have no box.
    """

    tracks: tuple[BoxTrack, ...]
    empty_frames: tuple[TimeNs, ...] = ()


@dataclass(frozen=True, slots=True)
class ColumnsMapped:
    """The recording was opened with these values of --map; the next opening uses them again. Not undone with clicks."""

    column_map: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class IntrinsicsChosen:
    """Intrinsics were chosen for the session; None goes back to those that it was opened with."""

    intrinsics: ChosenIntrinsics | None


@dataclass(frozen=True, slots=True)
class AssumptionsConfirmed:
    """The user confirmed assumptions about the recording, by their texts. Not undone with clicks."""

    texts: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Solved:
    """The solver's answer to one revision; an answer to an older revision changes nothing."""

    revision: int
    outcome: Outcome
    checked: tuple[PairResult, ...] = ()


@dataclass(frozen=True, slots=True)
class ScansAdded:
    """Scans have been written that belong to the window of a click: the clicks are solved again. It is not journalled."""


@dataclass(frozen=True, slots=True)
class Undo:
    """Undo the last change."""


@dataclass(frozen=True, slots=True)
class Redo:
    """Redo the change that was undone last."""


Event: TypeAlias = (
    ClickPlaced
    | ClickMoved
    | ClickRemoved
    | ClickExcluded
    | ReturnChosen
    | PlacementDismissed
    | WarningsAcknowledged
    | OptionsChanged
    | OptionsEdited
    | Cleared
    | ClicksImported
    | IntrinsicsChosen
    | BoxDrawn
    | BoxMoved
    | BoxHidden
    | BoxKeyframeRemoved
    | BoxRemoved
    | BoxLabelled
    | BoxesLoaded
    | ScansAdded
    | ColumnsMapped
    | AssumptionsConfirmed
    | Solved
)
Step: TypeAlias = Event | Undo | Redo
