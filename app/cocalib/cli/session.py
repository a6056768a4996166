"""`cocalib session`: list, repair and export sessions."""

import sys
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from calib_core.errors import InputError
from calib_core.input_files import no_such
from cocalib.cli.flags import OutFile, Output, OutputFlags, Switch, called
from cocalib.platform.files import write_whole

if TYPE_CHECKING:
    from cocalib.session.file.contents import Repair
    from cocalib.session.file.finding import SessionSummary


@dataclass(frozen=True, slots=True)
class Session:
    """List the sessions of recordings, repair a damaged one, or export its clicks."""

    action: Annotated[Literal["list", "repair", "export"], tyro.conf.Positional, called("ACTION")]
    """What to do: list, repair or export."""
    place: Annotated[tuple[Path, ...], tyro.conf.Positional, called("FOLDER...")] = ()
    """Session folders (.cocalib-session), recordings, or folders that hold them; for `list` the current folder if omitted."""
    json: Switch = False
    """With list: print JSON instead of text."""
    yes: Switch = False
    """With repair: write what can be kept; the old files are kept as backups."""
    out: OutFile = None
    """With export: output file (cocalib/clicks-1 JSON)."""
    output: Output = field(default_factory=OutputFlags)

    def run(self) -> int:
        """Run the action; return the exit code."""
        self._require_fitting()
        if self.action == "list":
            return self._list()
        folder = _session_folder(self.place[0])
        return self._repair(folder) if self.action == "repair" else self._export(folder)

    def _require_fitting(self) -> None:
        """Refuse options of another action, and a wrong number of places.

        Raises:
            InputError: they do not fit.
        """
        for name, given, action in (
            ("--json", self.json, "list"),
            ("--yes", self.yes, "repair"),
            ("--out", self.out is not None, "export"),
            ("--force", self.output.force, "export"),
        ):
            if given and self.action != action:
                raise InputError(f"{name} applies to session {action} only; see cocalib session --help")
        if self.action != "list" and len(self.place) != 1:
            raise InputError(
                f"session {self.action} takes one session folder, or its recording; {len(self.place)} given"
            )
        if self.action == "export" and self.out is None:
            raise InputError("session export needs the name of the new file: --out clicks.json")

    def _list(self) -> int:
        from cocalib.session.file.finding import session_summaries

        for place in self.place:
            if not place.exists():
                raise InputError(no_such(place))
        found = session_summaries(self.place or (Path(),))
        if self.json:
            import msgspec

            print(msgspec.json.format(msgspec.json.encode([_document(each) for each in found]), indent=2).decode())
        else:
            print(_printable("\n".join(_table(found))) if found else "no sessions here or in your user folder")
        return 0

    def _repair(self, folder: Path) -> int:
        from cocalib.session.file.contents import inspect_session, repair_session

        found = repair_session(folder) if self.yes else inspect_session(folder)
        print(_printable("\n".join(_findings(found))))
        if not found.faults:
            print(
                "Nothing to repair: opening the session drops that step."
                if found.torn_bytes
                else "Sound; nothing to repair."
            )
            return 0
        if self.yes:
            print(f"Repaired. The old files are kept as {' and '.join(found.backups)}.")
            return 0
        print(
            f"Nothing was changed. To write this and keep the old files as backups: cocalib session repair {folder} --yes"
        )
        return 1

    def _export(self, folder: Path) -> int:
        from calib_core.interchange.own.clicks_json import write_clicks
        from cocalib.session.file.contents import inspect_session

        assert self.out is not None
        found = inspect_session(folder)
        write_whole(self.out, write_clicks(found.clicks))
        print(_printable(f"{_click_count(len(found.clicks), 'click')} of {found.recording} written to {self.out}"))
        if not found.is_complete or found.torn_bytes:
            print(_printable("\n".join(f"cocalib: {line}" for line in _findings(found))), file=sys.stderr)
        return 0 if found.is_complete else 3


def _session_folder(path: Path) -> Path:
    """Return a session folder as given, or the one of a recording.

    Raises:
        InputError: there is none.
    """
    from cocalib.session.file.finding import holds_session_files, recording_session_folder

    if not path.exists() and not path.is_symlink():
        raise InputError(f"{path}: no such folder; find sessions with cocalib session list FOLDER")
    if ".cocalib-session" in path.name or holds_session_files(path):
        return path
    folder = recording_session_folder([path])
    if not folder.is_dir():
        raise InputError(
            f"{path}: has no session next to it or in your user folder; find sessions with cocalib session list"
        )
    return folder


def _findings(repair: "Repair") -> list[str]:
    """Return what a session proves and what is wrong with it, line by line."""
    lines = [f"{repair.folder}: session of {repair.recording}", *(f"  {fault}" for fault in repair.faults)]
    lines.append(
        f"  proven: {_click_count(len(repair.clicks), 'click')}, from {_click_count(repair.steps, 'step')} of the journal"
    )
    if repair.unproven:
        lines.append(f"  not proven, and left out: {_click_count(repair.unproven, 'line')} of the journal")
    elif repair.faults and repair.is_complete:
        lines.append("  as far as the files show, no click is missing")
    elif repair.faults:
        lines.append("  which of the two files is right cannot be proven; the other one stays as a backup")
    if repair.torn_bytes:
        lines.append(f"  {repair.torn}")
    return lines


def _click_count(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _table(sessions: "tuple[SessionSummary, ...]") -> list[str]:
    from calib_core.recordings import table_lines

    rows = [("state", "clicks", "steps", "last change", "recording", "folder")]
    rows += [
        (
            each.state,
            str(each.clicks),
            str(each.steps),
            "?" if each.changed_at_s is None else f"{datetime.fromtimestamp(each.changed_at_s):%Y-%m-%d %H:%M:%S}",
            each.recording or "?",
            str(each.folder),
        )
        for each in sessions
    ]
    lines = list(table_lines(rows))
    for index, each in reversed(list(enumerate(sessions, start=1))):
        if each.about:
            lines.insert(index + 1, f"  {each.about}")
    return lines


def _document(session: "SessionSummary") -> dict[str, object]:
    changed = session.changed_at_s
    return {
        "folder": str(session.folder),
        "recording": session.recording,
        "clicks": session.clicks,
        "steps": session.steps,
        "changed": None
        if changed is None
        else datetime.fromtimestamp(changed).astimezone().isoformat(timespec="seconds"),
        "state": session.state,
        "about": session.about,
    }


def _printable(text: str) -> str:
    """Replace what a terminal would act on: names in a session file are whatever was written there."""
    return "".join(letter if letter.isprintable() or letter == "\n" else "?" for letter in text)
