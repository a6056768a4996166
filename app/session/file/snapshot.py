"""The snapshot: clicks and options at some step, replaced as a whole, to restart from if the journal is lost."""

from pathlib import Path
from typing import Any

import msgspec

from app.option_changes import options_from_tree
from app.session import (
    AssumptionsConfirmed,
    ClicksImported,
    ColumnsMapped,
    OptionsChanged,
    RecordingFacts,
    Session,
    Step,
)
from app.session.file.errors import SessionFileError
from app.session.file.identity import SCHEMA, RecordingForm, recording_form, require_same_recording
from app.session.file.step_json import ClickForm, click_from_form, form_of_click
from app.whole_file import write_whole

__all__ = ["read_snapshot", "snapshot_axes", "write_snapshot"]


class _Snapshot(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    schema: str
    cocalib: str
    recording: RecordingForm
    steps: int
    options: dict[str, Any]
    clicks: tuple[ClickForm, ...]
    column_map: tuple[str, ...] = ()
    confirmed: tuple[str, ...] = ()


def write_snapshot(path: Path, session: Session, *, facts: RecordingFacts, steps: int, cocalib: str) -> None:
    """Replace the snapshot atomically: a reader sees the old one or the new one, never a part.

    Raises:
        OSError: it cannot be written; the old one stays.
    """
    snapshot = _Snapshot(
        schema=SCHEMA,
        cocalib=cocalib,
        recording=recording_form(facts),
        steps=steps,
        options=msgspec.to_builtins(session.options),
        clicks=tuple(form_of_click(click) for click in session.clicks),
        column_map=session.column_map,
        confirmed=session.confirmed,
    )
    write_whole(path, msgspec.json.format(msgspec.json.encode(snapshot), indent=1) + b"\n")


def snapshot_axes(path: Path, otherwise: str | None) -> str | None:
    """Return what was specified about the radar's axes when the snapshot was written.

    Args:
        path: of the snapshot.
        otherwise: returned if the snapshot is missing or damaged, since the journal does not need it.
    """
    try:
        return msgspec.json.decode(path.read_bytes(), type=_Snapshot).recording.radar_axes
    except (OSError, msgspec.DecodeError, UnicodeDecodeError):
        return otherwise


def read_snapshot(path: Path, facts: RecordingFacts) -> tuple[Step, ...]:
    """Return the steps that lead from an empty session to the snapshot.

    Raises:
        SessionFileError: it is damaged, of another version, or of another recording.
    """
    try:
        snapshot = msgspec.json.decode(path.read_bytes(), type=_Snapshot)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise SessionFileError(
            f"{path}: the snapshot is damaged ({error}); move it away to start over, or give another --session folder"
        ) from error
    if snapshot.schema != SCHEMA:
        raise SessionFileError(
            f"{path}: written as '{snapshot.schema}', but this version reads '{SCHEMA}'; move it away"
        )
    require_same_recording(snapshot.recording, facts, path.parent)
    clicks = ClicksImported(tuple(click_from_form(click) for click in snapshot.clicks))
    reading: tuple[Step, ...] = (ColumnsMapped(snapshot.column_map),) if snapshot.column_map else ()
    reading += (AssumptionsConfirmed(snapshot.confirmed),) if snapshot.confirmed else ()
    return (*reading, OptionsChanged(options_from_tree(snapshot.options)), clicks)
