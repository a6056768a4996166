"""What can happen to a session: one frozen class per event, which is its own JSON form in the journal and from the page."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias

import msgspec
from msgspec import Meta

from calib_core.interchange.own.clicks_json import click_document
from calib_core.interchange.own.documents import ClickDocument
from calib_core.measurements import ChosenReturn, Mark, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions
from calib_core.results import PairResult
from cocalib.session.state import ChosenIntrinsics, Outcome

Id: TypeAlias = Annotated[str, Meta(min_length=1, max_length=100)]


def _tag(name: str) -> str:
    return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name).lstrip("_")


class _Journalled(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag=_tag):
    """An event with a line in the journal."""


class ClickPlaced(_Journalled, frozen=True):
    """The reflector's centre was marked in a frame; a frame may have several.

    Attributes:
        image_time: stamp of the frame.
        pixel_px: column and row.
        mark: how it came to this pixel.
        sigma_px: its standard deviation per axis; None takes the options' value.
    """

    image_time: TimeNs
    pixel_px: tuple[float, float]
    mark: Mark = "clicked"
    sigma_px: float | None = None


class ClickMoved(_Journalled, frozen=True):
    """A click was dragged, nudged or snapped; it then counts, also if it was a guess before."""

    id: Id
    pixel_px: tuple[float, float]
    mark: Mark = "moved"
    sigma_px: float | None = None


class ClickRemoved(_Journalled, frozen=True):
    """A click was deleted."""

    id: Id


class ClickExcluded(_Journalled, frozen=True):
    """A click was excluded, or included again."""

    id: Id
    excluded: bool


class ReturnChosen(_Journalled, frozen=True, rename={"chosen": "return"}):
    """A person said which radar return a click belongs to, or took that back (None)."""

    id: Id
    chosen: ChosenReturn | None


class PlacementDismissed(_Journalled, frozen=True):
    """A placement found in the radar data is not the reflector: it is not offered any more.

    Attributes:
        time: a stamp within it.
        position_m: (x, y, z) of it in the radar frame.
        dismissed: False offers it again.
    """

    time: TimeNs
    position_m: tuple[float, float, float]
    dismissed: bool = True


class MarksReviewed(_Journalled, frozen=True):
    """A person has looked at these clicks and leaves them as they are, or wants to look again."""

    ids: Annotated[tuple[Id, ...], Meta(max_length=10_000)]
    reviewed: bool = True


class WarningsAcknowledged(_Journalled, frozen=True):
    """The user has read the warnings of these codes, or wants to see them again. Not undone with clicks."""

    codes: Annotated[tuple[Id, ...], Meta(max_length=100)]
    acknowledged: bool = True


class OptionsChanged(_Journalled, frozen=True):
    """Options were set, by group and name; those that are not named stay. `settled` names all, so that the journal does."""

    options: dict[str, Any]

    @classmethod
    def of(cls, options: CalibrationOptions) -> "OptionsChanged":
        """Set all options."""
        return cls(msgspec.to_builtins(options))


class Cleared(_Journalled, frozen=True):
    """All clicks were deleted; the options stay."""


class ClicksImported(_Journalled, frozen=True):
    """Clicks from a file were added to the session; they replace clicks in the same frames."""

    clicks: tuple[ClickDocument, ...]

    @classmethod
    def of(cls, clicks: Iterable[ReflectorClick]) -> "ClicksImported":
        """Add these clicks."""
        return cls(tuple(map(click_document, clicks)))


class ColumnsMapped(_Journalled, frozen=True):
    """The recording was opened with these values of --map; the next opening uses them again. Not undone with clicks."""

    column_map: tuple[Annotated[str, Meta(max_length=500)], ...]


class AxesStated(_Journalled, frozen=True):
    """The recording is read with these --radar-axes from here on; None: without. It changes nothing in the session."""

    radar_axes: str | None


class IntrinsicsChosen(_Journalled, frozen=True):
    """Intrinsics were chosen for the session; None goes back to those that it was opened with."""

    intrinsics: ChosenIntrinsics | None


class AssumptionsConfirmed(_Journalled, frozen=True):
    """The user confirmed assumptions about the recording, by their texts. Not undone with clicks."""

    texts: Annotated[tuple[Annotated[str, Meta(max_length=2000)], ...], Meta(max_length=100)]


@dataclass(frozen=True, slots=True)
class Solved:
    """The solver's answer to one revision; an answer to an older revision changes nothing."""

    revision: int
    outcome: Outcome
    checked: tuple[PairResult, ...] = ()


@dataclass(frozen=True, slots=True)
class ScansAdded:
    """Scans have been written that belong to the window of a click: the clicks are solved again. It is not journalled."""


class Undo(_Journalled, frozen=True):
    """Undo the last change."""


class Redo(_Journalled, frozen=True):
    """Redo the change that was undone last."""


JournalStep: TypeAlias = (
    ClickPlaced
    | ClickMoved
    | ClickRemoved
    | ClickExcluded
    | ReturnChosen
    | PlacementDismissed
    | MarksReviewed
    | WarningsAcknowledged
    | OptionsChanged
    | Cleared
    | IntrinsicsChosen
    | ClicksImported
    | ColumnsMapped
    | AxesStated
    | AssumptionsConfirmed
    | Undo
    | Redo
)
"""Steps with a line in the journal; the page may send them, too."""

Step: TypeAlias = JournalStep | Solved | ScansAdded
