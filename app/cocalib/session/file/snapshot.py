"""The snapshot: clicks and options at some step, replaced as a whole, to restart from if the journal is lost or cut.

It ends with a checksum of its own, and names the journal's lines that it contains by the first digits of their checksums.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from calib_core.errors import CalibrationError
from calib_core.interchange.own.clicks_json import click_document, click_of
from calib_core.interchange.own.documents import ClickDocument
from calib_core.measurements import ReflectorClick, TimeNs, time_from_json, time_to_json
from calib_core.options import CalibrationOptions
from cocalib.option_changes import kept_options
from cocalib.session import (
    AssumptionsConfirmed,
    BoxesLoaded,
    BoxTrack,
    ChosenIntrinsics,
    ClicksImported,
    ColumnsMapped,
    DismissedPlacement,
    IntrinsicsChosen,
    OptionsChanged,
    PlacementDismissed,
    Session,
    Step,
    WarningsAcknowledged,
)
from cocalib.session.file.checksums import line_bytes, sealed, taken_apart
from cocalib.session.file.errors import SessionFileError
from cocalib.session.file.guarded_folder import GuardedFolder
from cocalib.session.file.identity import RecordingForm
from cocalib.session.file.journal_reading import SCHEMA, SCHEMA_1

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
        clicks: sorted by time.
        options: of that step.
        last: checksum of the journal's line that holds the last of these steps; "" in session-1.
        lines: the first digits of the checksums of all lines up to that one, one after another.
        sum: its own checksum.
        column_map: the user's --map of that step.
        confirmed: the assumptions about the recording that were confirmed by then.
        dismissed: the placements that were dismissed.
        acknowledged: the codes of the warnings that were read.
        boxes: around moving objects.
        empty_frames: frames that a file of boxes says are without any.
        intrinsics: those that were chosen for the session.
    """

    recording: RecordingForm
    count: int
    clicks: tuple[ReflectorClick, ...]
    options: CalibrationOptions
    last: str
    lines: str
    sum: str
    column_map: tuple[str, ...] = ()
    confirmed: tuple[str, ...] = ()
    dismissed: tuple[DismissedPlacement, ...] = ()
    acknowledged: tuple[str, ...] = ()
    boxes: tuple[BoxTrack, ...] = ()
    empty_frames: tuple[TimeNs, ...] = ()
    intrinsics: ChosenIntrinsics | None = None

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps that lead from an empty session to the snapshot."""
        reading: tuple[Step, ...] = (ColumnsMapped(self.column_map),) if self.column_map else ()
        reading += (AssumptionsConfirmed(self.confirmed),) if self.confirmed else ()
        reading += (WarningsAcknowledged(self.acknowledged),) if self.acknowledged else ()
        dismissals = (PlacementDismissed(one.time, one.position_m) for one in self.dismissed)
        has_boxes = self.boxes or self.empty_frames
        loaded = (BoxesLoaded(self.boxes, self.empty_frames),) if has_boxes else ()
        chosen = (IntrinsicsChosen(self.intrinsics),) if self.intrinsics else ()
        return (
            *reading,
            *chosen,
            OptionsChanged.of(self.options),
            ClicksImported.of(self.clicks),
            *dismissals,
            *loaded,
        )

    def agrees_with(self, sums: Sequence[str]) -> bool:
        """Return whether the journal's lines are those of the snapshot, as far as both have them."""
        shared = _marks(sums[: self.count + 1])
        return self.lines[: len(shared)] == shared


def write_snapshot(
    folder: GuardedFolder, session: Session, *, recording: RecordingForm, sums: Sequence[str], cocalib: str
) -> None:
    """Replace the snapshot atomically: a reader sees the old one or the new one, never a part.

    Args:
        folder: where it goes.
        session: what it holds.
        recording: the recording it belongs to.
        sums: checksums of the journal's lines, up to this state.
        cocalib: version of the program.

    Raises:
        SessionFileError: what is there is no snapshot of this user.
        OSError: it cannot be written; the old one stays.
    """
    snapshot = _Snapshot(
        schema=SCHEMA,
        cocalib=cocalib,
        recording=recording,
        steps=len(sums) - 1,
        options=msgspec.to_builtins(session.options),
        clicks=tuple(map(click_document, session.clicks)),
        last=sums[-1],
        lines=_marks(sums),
        column_map=session.column_map,
        confirmed=session.confirmed,
        dismissed=tuple(PlacementDismissed(one.time, one.position_m) for one in session.dismissed),
        acknowledged=session.acknowledged,
        boxes=session.boxes,
        empty_frames=session.empty_frames,
        intrinsics=session.intrinsics,
    )
    folder.replace(SNAPSHOT, line_bytes(sealed(msgspec.json.encode(snapshot, enc_hook=time_to_json))) + b"\n")


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
        snapshot = msgspec.json.decode(found.content, type=_Snapshot, dec_hook=time_from_json)
        if snapshot.schema not in (SCHEMA, SCHEMA_1):
            raise SessionFileError(f"{place}: written as '{snapshot.schema}', but this version reads '{SCHEMA}'")
        if snapshot.schema != (SCHEMA if found.sum else SCHEMA_1):
            raise _damaged(place, "its checksum is missing")
        return FoundSnapshot(
            recording=snapshot.recording,
            count=snapshot.steps,
            clicks=tuple(sorted(map(click_of, snapshot.clicks))),
            options=kept_options(snapshot.options),
            last=snapshot.last,
            lines=snapshot.lines,
            column_map=snapshot.column_map,
            confirmed=snapshot.confirmed,
            dismissed=tuple(DismissedPlacement(one.time, one.position_m) for one in snapshot.dismissed),
            acknowledged=snapshot.acknowledged,
            boxes=snapshot.boxes,
            empty_frames=snapshot.empty_frames,
            intrinsics=snapshot.intrinsics,
            sum=found.sum or sealed(data).sum,
        )
    except SessionFileError:
        raise
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError, CalibrationError) as error:
        raise _damaged(place, str(error)) from error


def _marks(sums: Sequence[str]) -> str:
    return "".join(sum_[:_DIGITS] for sum_ in sums)


def _damaged(place: str, reason: str) -> SessionFileError:
    return SessionFileError(f"{place}: the snapshot is damaged ({reason})")
