"""The snapshot that earlier versions kept next to the journal, read to open their sessions; until 1.0.

It holds clicks and options at some step, ends with a checksum of its own, and names the journal's lines that it contains by the
first digits of their checksums.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from calib_core.errors import CalibrationError
from calib_core.interchange.own.documents import ClickDocument
from calib_core.json_forms import from_json
from calib_core.measurements import TimeNs
from calib_core.options import CalibrationOptions
from cocalib.option_changes import kept_options
from cocalib.session import (
    AssumptionsConfirmed,
    BoxesLoaded,
    BoxTrack,
    ChosenIntrinsics,
    ClicksImported,
    ColumnsMapped,
    IntrinsicsChosen,
    OptionsChanged,
    PlacementDismissed,
    Step,
    WarningsAcknowledged,
)
from cocalib.session.file.guarded_folder import SessionFileError
from cocalib.session.file.identity import RecordingForm
from cocalib.session.file.journal import SCHEMA, SCHEMA_1, sealed, taken_apart

SNAPSHOT = "session.json"
_DIGITS = 8


class _Snapshot(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    schema: str
    cocalib: str
    recording: RecordingForm
    steps: Annotated[int, Meta(ge=0)]
    options: dict[str, Any]
    clicks: tuple[ClickDocument, ...]
    last: str = ""
    lines: str = ""
    column_map: tuple[str, ...] = ()
    confirmed: tuple[str, ...] = ()
    dismissed: tuple[PlacementDismissed, ...] = ()
    acknowledged: tuple[str, ...] = ()
    boxes: tuple[BoxTrack, ...] = ()
    empty_frames: tuple[TimeNs, ...] = ()
    intrinsics: ChosenIntrinsics | None = None


@dataclass(frozen=True, slots=True)
class FoundSnapshot:
    """A snapshot as found on the disk; its checksum is right.

    Attributes:
        recording: the recording it belongs to.
        count: how many steps of the journal it contains.
        steps: those that lead from an empty session to it.
        last: checksum of the journal's line that holds the last of the steps that it contains; "" in session-1.
        lines: the first digits of the checksums of all lines up to that one, one after another.
        sum: its own checksum.
    """

    recording: RecordingForm
    count: int
    steps: tuple[Step, ...]
    last: str
    lines: str
    sum: str

    def agrees_with(self, sums: Sequence[str]) -> bool:
        """Return whether the journal's lines are those of the snapshot, as far as both have them."""
        shared = "".join(sum_[:_DIGITS] for sum_ in sums[: self.count + 1])
        return self.lines[: len(shared)] == shared


def read_snapshot(data: bytes, place: str) -> FoundSnapshot:
    """Read a snapshot.

    Args:
        data: its bytes.
        place: its path, for messages.

    Raises:
        SessionFileError: it is damaged or of another version.
    """
    found = taken_apart(data.removesuffix(b"\n"))
    if found.sum and (not found.follows("") or not data.endswith(b"\n")):
        raise _damaged(place, "its checksum is wrong")
    try:
        snapshot = msgspec.json.decode(found.content, type=_Snapshot, dec_hook=from_json)
        options = kept_options(snapshot.options)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError, CalibrationError) as error:
        raise _damaged(place, str(error)) from error
    if snapshot.schema not in (SCHEMA, SCHEMA_1):
        raise SessionFileError(f"{place}: written as '{snapshot.schema}', but this version reads '{SCHEMA}'")
    if snapshot.schema != (SCHEMA if found.sum else SCHEMA_1):
        raise _damaged(place, "its checksum is missing")
    return FoundSnapshot(
        recording=snapshot.recording,
        count=snapshot.steps,
        steps=_steps(snapshot, options),
        last=snapshot.last,
        lines=snapshot.lines,
        sum=found.sum or sealed(data).sum,
    )


def _steps(snapshot: _Snapshot, options: CalibrationOptions) -> tuple[Step, ...]:
    reading: tuple[Step, ...] = (ColumnsMapped(snapshot.column_map),) if snapshot.column_map else ()
    reading += (AssumptionsConfirmed(snapshot.confirmed),) if snapshot.confirmed else ()
    reading += (WarningsAcknowledged(snapshot.acknowledged),) if snapshot.acknowledged else ()
    has_boxes = snapshot.boxes or snapshot.empty_frames
    loaded = (BoxesLoaded(snapshot.boxes, snapshot.empty_frames),) if has_boxes else ()
    chosen = (IntrinsicsChosen(snapshot.intrinsics),) if snapshot.intrinsics else ()
    changes = (OptionsChanged.of(options), ClicksImported(snapshot.clicks))
    return (*reading, *chosen, *changes, *snapshot.dismissed, *loaded)


def _damaged(place: str, reason: str) -> SessionFileError:
    return SessionFileError(f"{place}: the snapshot is damaged ({reason})")
