"""Where sessions are: the folder of a recording, also after it was renamed or moved, and the list of all of them."""

import os
import re
import tempfile
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from calib_core.results import DataWarning
from cocalib.platform.resources import SESSION_SUFFIX, state_folder, user_session_folder
from cocalib.session.events import ColumnsMapped
from cocalib.session.file.contents import inspect_session
from cocalib.session.file.guarded_folder import GuardedFolder, SessionFileError, lock_holder
from cocalib.session.file.identity import RecordingForm, has_dates, is_same_recording
from cocalib.session.file.journal import COPY, JOURNAL, read_journal
from cocalib.session.state import RecordingFacts

_HEAD_BYTES = 1 << 16
_FILES = (JOURNAL, COPY)
_SET_ASIDE = re.compile(re.escape(SESSION_SUFFIX) + r"\.[0-9]+$")


@dataclass(frozen=True, slots=True)
class FoundFolder:
    """Where the session of a recording is, or starts.

    Attributes:
        path: of the folder.
        warnings: what the user must know about this choice.
    """

    path: Path
    warnings: tuple[DataWarning, ...] = ()


@dataclass(frozen=True, slots=True)
class _Candidate:
    path: Path
    recording: RecordingForm
    changed_at_s: float


def find_session_folder(paths: Sequence[Path], facts: RecordingFacts) -> FoundFolder:
    """Return the folder named after a recording if it has the session, else one whose session has the same stamps.

    Args:
        paths: the files or folders of the recording, at least one; the first names the session.
        facts: the open recording.
    """
    named = recording_session_folder(paths)
    own = _candidate(named)
    if named.is_symlink() or (own is None and holds_session_files(named)):
        return FoundFolder(named)  # opening it says what is wrong
    if own is not None and is_same_recording(own.recording, facts):
        return FoundFolder(named)
    places = dict.fromkeys([*(path.resolve().parent for path in paths), state_folder() / "sessions"])
    folders = [folder for place in places for folder in _session_folders_in(place) if folder != named]
    same = [
        candidate
        for folder in folders
        if (candidate := _candidate(folder)) is not None and is_same_recording(candidate.recording, facts)
    ]
    found = _choose_newest(named, sorted(same, key=lambda candidate: -candidate.changed_at_s), facts)
    return FoundFolder(
        found.path, (*found.warnings, *_closed_folder_warnings([each for each in folders if _is_of(each, paths[0])]))
    )


def has_session_of(folder: Path, facts: RecordingFacts) -> bool:
    """Return whether a folder has a session that can be read, of a recording with these frames."""
    candidate = _candidate(folder)
    return candidate is not None and is_same_recording(candidate.recording, facts)


def remembered_map(folder: Path) -> tuple[str, ...]:
    """Return the values of --map that a session was last opened with; none if it has none or cannot be read.

    Args:
        folder: of the session. Opening the session afterwards reports whatever is wrong with it.
    """
    try:
        with closing(GuardedFolder(folder)) as guarded:
            data = guarded.read(JOURNAL) or guarded.read(COPY) or b""
            steps = read_journal(data, str(folder)).steps
    except (SessionFileError, OSError):
        return ()
    return next((step.column_map for step in reversed(steps) if isinstance(step, ColumnsMapped)), ())


def _choose_newest(named: Path, same: Sequence[_Candidate], facts: RecordingFacts) -> FoundFolder:
    """Choose the newest session that can be continued, and tell about all others."""
    usable = [candidate for candidate in same if has_dates(candidate.recording) and is_writable(candidate.path)]
    chosen = usable[0] if usable else None
    warnings = [_other_session_warning(candidate, facts) for candidate in same if candidate is not chosen]
    if chosen is None:
        return FoundFolder(named, tuple(warnings))
    of = "" if chosen.recording.name == facts.name else f" of '{chosen.recording.name}'"
    message = f"continuing the session{of} in {chosen.path}, which has the frames of {facts.name}"
    hint = f"to start a new session instead, give another folder: --session {named}"
    return FoundFolder(chosen.path, (DataWarning.reported("session-of-other-name", message, hint), *warnings))


def _other_session_warning(candidate: _Candidate, facts: RecordingFacts) -> DataWarning:
    """Tell about a session of the same stamps that is not continued."""
    of = f"the session of '{candidate.recording.name}' in {candidate.path}"
    message = f"{of} has the same frames as {facts.name} and is not used"
    if not has_dates(candidate.recording):
        message += ", since the stamps are no dates and another recording may have the same"
    if not is_writable(candidate.path):
        export = f"cocalib session export {candidate.path} --out clicks.json"
        hint = f"it cannot be written; take its clicks over: {export}, then start again with --clicks clicks.json"
    else:
        hint = f"to continue it, start again with --session {candidate.path}"
    return DataWarning.reported("session-not-used", message, hint)


def _is_of(folder: Path, recording: Path) -> bool:
    """Return whether a session folder next to a recording is named after it."""
    recording = recording.resolve()
    return folder.parent == recording.parent and folder.name.startswith(f"{recording.name}.")


def _closed_folder_warnings(folders: Sequence[Path]) -> tuple[DataWarning, ...]:
    """Tell about folders with the recording's name that may not be looked into, such as another user's."""
    faults = []
    for folder in folders:
        try:
            GuardedFolder(folder).close()
        except SessionFileError as error:
            faults.append(str(error))
    hint = "to continue with its clicks, do that; a new session is started otherwise"
    return tuple(
        DataWarning.reported("session-not-used", f"a session next to the recording is not used: {fault}", hint)
        for fault in faults
    )


def _candidate(path: Path) -> _Candidate | None:
    """Return what a folder's session says about its recording; None if there is none or it cannot be read."""
    try:
        folder = GuardedFolder(path)
    except SessionFileError:
        return None
    try:
        recording = _recording(folder)
        changed = max((folder.changed_at_s(name) or 0.0 for name in _FILES), default=0.0)
        return None if recording is None else _Candidate(path, recording, changed)
    except (SessionFileError, OSError):
        return None
    finally:
        folder.close()


def _recording(folder: GuardedFolder) -> RecordingForm | None:
    for name in _FILES:
        head = (folder.read(name, at_most=_HEAD_BYTES) or b"").partition(b"\n")[0]
        recording = read_journal(head + b"\n", str(folder.path / name)).recording if head else None
        if recording is not None:
            return recording
    return None


def holds_session_files(folder: Path) -> bool:
    """Return whether a folder has a file of a session, be it sound or not."""
    return any((folder / name).exists() or (folder / name).is_symlink() for name in _FILES)


def recording_session_folder(paths: Sequence[Path]) -> Path:
    """Return the session folder of a recording: an existing one, else next to the recording, else in the state folder.

    Args:
        paths: the files or folders of the recording, at least one; the first names the session.
    """
    first = paths[0].resolve()
    adjacent = first.parent / f"{first.name}{SESSION_SUFFIX}"  # also of /
    in_state_folder = user_session_folder(first.name, key=str(first))
    for folder in (adjacent, in_state_folder):
        if folder.is_dir() and is_writable(folder):
            return folder
    return adjacent if is_writable(adjacent.parent) else in_state_folder


def unused_session_folder(folder: Path) -> Path:
    """Return a name that no session has yet: the given one, or that with a number, such as NAME-2.cocalib-session."""
    number, free = 1, folder
    while os.path.lexists(free):
        number += 1
        free = folder.with_name(f"{folder.name.removesuffix(SESSION_SUFFIX)}-{number}{SESSION_SUFFIX}")
    return free


def _session_folders_in(folder: Path, *, set_aside: bool = False) -> tuple[Path, ...]:
    """Return the session folders directly in a folder, by name; none if it cannot be read.

    Args:
        folder: where to look.
        set_aside: also those that --fresh has renamed.
    """
    try:
        names = sorted(path.name for path in folder.iterdir())
    except OSError:
        return ()
    return tuple(
        folder / name
        for name in names
        if name.endswith(SESSION_SUFFIX) or (set_aside and _SET_ASIDE.search(name) is not None)
    )


def is_writable(folder: Path) -> bool:
    """Try to write: permission bits do not cover read-only media, quotas and network folders."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


@dataclass(frozen=True, slots=True)
class SessionSummary:
    """One session.

    Attributes:
        folder: its path.
        recording: name of its recording; "" if unknown.
        clicks: how many it has, or how many are proven.
        steps: how many steps its journal holds.
        changed_at_s: when it was last changed, in seconds since the epoch; None if unknown.
        state: "sound", "torn" (its last step was never confirmed), "damaged", "open" (in another process), or "unreadable".
        about: what is wrong, or which process has it open.
    """

    folder: Path
    recording: str
    clicks: int
    steps: int
    changed_at_s: float | None
    state: str
    about: str


def session_summaries(places: Sequence[Path]) -> tuple[SessionSummary, ...]:
    """Return the sessions in some places and in the user's folder.

    Args:
        places: session folders, recordings, or folders that hold either; folders in them are not searched.
    """
    folders = [folder for place in (*places, state_folder() / "sessions") for folder in _folders(place)]
    return tuple(_summary(folder) for folder in dict.fromkeys(folder.absolute() for folder in folders))


def _folders(path: Path) -> tuple[Path, ...]:
    if holds_session_files(path):
        return (path,)
    inside = _session_folders_in(path, set_aside=True)
    named = recording_session_folder([path]) if path.exists() else path
    return (*inside, named) if named.is_dir() and named not in inside else inside


def _summary(path: Path) -> SessionSummary:
    changed, holder = None, ""
    try:
        folder = GuardedFolder(path)
        try:
            changed = max(filter(None, map(folder.changed_at_s, _FILES)), default=None)
            holder = lock_holder(folder)
        finally:
            folder.close()
        repair = inspect_session(path)
    except (SessionFileError, OSError) as error:
        return SessionSummary(path, "", 0, 0, changed, "unreadable", str(error))
    state = "open" if holder else "damaged" if repair.faults else "torn" if repair.torn_bytes else "sound"
    about = "; ".join(filter(None, (holder, *repair.faults, repair.torn)))
    return SessionSummary(path, repair.recording, len(repair.clicks), repair.steps, changed, state, about)
