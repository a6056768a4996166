"""An open session folder: what was in it, how new steps are added, and whether all of it is on the disk at the end."""

import os
import tempfile
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

from calib_core.results import DataWarning
from cocalib.platform.resources import user_session_folder, version
from cocalib.session.applying import History
from cocalib.session.events import AxesStated, Step
from cocalib.session.file.contents import Contents, read_contents, rewrite
from cocalib.session.file.guarded_folder import FolderLock, GuardedFolder, SessionFileError
from cocalib.session.file.identity import recording_form
from cocalib.session.file.journal import COPY, JOURNAL, Journal, SealedLine, bytes_of, first_line
from cocalib.session.state import RecordingFacts


@dataclass(frozen=True, slots=True)
class Restored:
    """What was found in a session folder.

    Attributes:
        folder: its path.
        history: the session, with what can be undone and redone.
        steps: how many steps the journal held; 0 for a new session.
        torn_bytes: length of a half-written last line that was dropped; it had never been confirmed.
        warnings: what else the user must know before continuing.
    """

    folder: Path
    history: History
    steps: int = 0
    torn_bytes: int = 0
    warnings: tuple[DataWarning, ...] = ()

    @property
    def note(self) -> str:
        """A sentence about anything unusual; "" if there is nothing."""
        if self.torn_bytes:
            return "The program stopped while the last change was being written; it is not in the session."
        return ""


@dataclass(frozen=True, slots=True)
class Closed:
    """What is on the disk after a session was closed.

    Attributes:
        folder: of the session.
        clicks: how many it has.
        fault: what was wrong with the folder; "" if everything is there and was verified.
        kept_in: where the clicks are instead; None if they could not be written anywhere.
    """

    folder: Path
    clicks: int
    fault: str = ""
    kept_in: Path | None = None

    @property
    def note(self) -> str:
        """What to tell the user, without a full stop at the end."""
        if not self.fault:
            return f"all clicks are saved in {self.folder}"
        if not self.clicks and self.kept_in is None:
            return f"there were no clicks to save, but {self.fault}"
        if self.kept_in is None:
            return f"the clicks ({self.clicks}) could not be saved: {self.fault}"
        again = "they are used when it is opened again"
        if self.kept_in.parent != self.folder:
            again = f"to continue with them, open the recording with --session {self.kept_in}"
        return f"{self.fault}. All clicks ({self.clicks}) are saved in {self.kept_in}; {again}"


class SessionFile:
    """Stores the steps of one session, from `open_session_file` to `close`. To be used by one thread at a time."""

    def __init__(
        self, folder: GuardedFolder, lock: FolderLock, journal: Journal, restored: Restored, name: str
    ) -> None:
        self.restored = restored
        self._folder = folder
        self._lock = lock
        self._journal = journal
        self._present = restored.history.present
        self._name = name
        self._closed: Closed | None = None

    def append(self, step: Step, history: History) -> None:
        """Store a step on disk before returning; `history` is the state after it.

        Raises:
            SessionFileError: it could not be written; the file is unchanged.
        """
        self._journal.append(step)
        self._present = history.present

    def close(self) -> Closed:
        """Verify what is on the disk, write it elsewhere if it is not all there, and release the folder.

        Returns:
            whether everything is there; if not, where a copy was written. A second call returns the same.
        """
        if self._closed is None:
            self._closed = self._verified()
            self._journal.close()
            self._lock.close()
            self._folder.close()
        return self._closed

    def _verified(self) -> Closed:
        path, clicks = self._folder.path, len(self._present.clicks)
        if not self._folder.is_in_place():
            return self._rescue(f"{path} was deleted, moved or replaced while it was open")
        fault, copy_fault = self._journal.fault(), self._journal.copy_fault()
        if not fault:
            return Closed(path, clicks)
        fault = f"{path / JOURNAL}: {fault}"
        if not copy_fault:
            return Closed(path, clicks, fault, path / COPY)
        return self._rescue(f"{fault}; {COPY}: {copy_fault}")

    def _rescue(self, fault: str) -> Closed:
        """Write the session to the user's folder, or to the system's folder for temporary files."""
        path, count = self._folder.path, len(self._present.clicks)
        if not count:
            return Closed(path, 0, fault)
        for home in (user_session_folder(f"{self._name}-rescued").parent, Path(tempfile.gettempdir())):
            try:
                return Closed(path, count, fault, self._write_copy(home))
            except OSError as error:
                fault = f"{fault}; {home}: {error.strerror or error}"
            except SessionFileError as error:
                fault = f"{fault}; {error}"
        return Closed(path, count, fault)

    def _write_copy(self, home: Path) -> Path:
        number = 1
        plain = "".join(letter if letter.isalnum() or letter in "._-" else "_" for letter in self._name)[:100]
        while os.path.lexists(path := home / f"{plain}-rescued-{number}.cocalib-session"):
            number += 1
        folder = GuardedFolder(path, create=True)
        try:
            whole = bytes_of(self._journal.lines)
            for name in (JOURNAL, COPY):
                folder.replace(name, whole)
            if folder.read(JOURNAL) != whole:
                raise SessionFileError(f"{path}: another program has changed it")
        finally:
            folder.close()
        return path


def open_session_file(folder: Path, facts: RecordingFacts, warnings: tuple[DataWarning, ...] = ()) -> SessionFile:
    """Open the session in a folder, or start one there.

    Args:
        folder: created if missing.
        facts: the recording, which must be the one that the session belongs to.
        warnings: what is known about the choice of the folder.

    Raises:
        SessionFileError: it cannot be written, is open in another process, is damaged, is of another recording, or holds a link
            or another user's file. What is on the disk is unchanged.
    """
    with ExitStack() as stack:
        try:
            guarded = GuardedFolder(folder, create=True)
            stack.callback(guarded.close)
            lock = FolderLock(guarded)
            stack.callback(lock.close)
            opened = _open_folder(guarded, lock, facts, warnings)
        except OSError as error:
            raise SessionFileError(
                f"{folder}: cannot be used: {error.strerror}; give another --session folder"
            ) from error
        stack.pop_all()
        return opened


def set_aside(folder: Path) -> Path | None:
    """Rename a session folder, adding a number, so that the next open starts a new session.

    Returns:
        where it is now; None when there was none.

    Raises:
        SessionFileError: another process has it open, it cannot be moved, or it is a link or another user's.
    """
    if not os.path.lexists(folder):
        return None
    guarded = GuardedFolder(folder)
    try:
        FolderLock(guarded).close()
    finally:
        guarded.close()
    number = 1
    while os.path.lexists(kept := folder.parent / f"{folder.name}.{number}"):
        number += 1
    try:
        folder.rename(kept)
    except OSError as error:
        raise SessionFileError(f"{folder}: cannot be moved to {kept.name}: {error.strerror}") from error
    return kept


def _open_folder(
    folder: GuardedFolder, lock: FolderLock, facts: RecordingFacts, warnings: tuple[DataWarning, ...]
) -> SessionFile:
    contents = read_contents(folder, facts)
    if contents is None:
        lines: tuple[SealedLine, ...] = (first_line(recording_form(facts), cocalib=version()),)
        folder.replace(JOURNAL, bytes_of(lines))
        restored = Restored(folder.path, History(), warnings=warnings)
    else:
        lines = contents.lines
        about = (*warnings, *_restored_warnings(contents, facts, folder))
        if not contents.is_written:
            rewrite(folder, contents)
        elif contents.faults:
            folder.back_up(COPY)
        torn = contents.torn_bytes if contents.is_written else 0
        restored = Restored(folder.path, contents.history, len(lines) - 1, torn, about)
    journal = Journal(folder, lines)
    opened = SessionFile(folder, lock, journal, restored, facts.name)
    if contents is not None and contents.stated_axes != facts.radar_axes:
        with suppress(SessionFileError):  # on a full disk, the next opening warns again
            journal.append(AxesStated(facts.radar_axes))
    return opened


def _restored_warnings(contents: Contents, facts: RecordingFacts, folder: GuardedFolder) -> tuple[DataWarning, ...]:
    """Return what the user must know about the session before continuing.

    Raises:
        SessionFileError: the files disagree in a way that a person must decide.
    """
    if not contents.is_complete:
        raise SessionFileError(
            f"{folder.path}: the session is damaged: {'; '.join(contents.faults)}; nothing was changed. "
            f"See what can be kept: cocalib session repair {folder.path}"
        )
    faults = _fault_warnings(contents) if contents.faults else ()
    if all(isinstance(step, AxesStated) for step in contents.steps):
        return faults
    return (*faults, *_axes_warnings(contents.radar_axes, facts.radar_axes))


def _fault_warnings(contents: Contents) -> tuple[DataWarning, ...]:
    clicks = len(contents.history.present.clicks)
    message = (
        f"the session was damaged: {'; '.join(contents.faults)}; it continues with the {clicks} clicks in the journal and its "
        "copy; as far as the files show, none is missing"
    )
    hint = "the damaged files are kept next to the new ones, with .backup-1 or the next number in their names"
    return (DataWarning.reported("session-damaged", message, hint),)


def _axes_warnings(before: str | None, now: str | None) -> tuple[DataWarning, ...]:
    """Warn that the radar is read differently from last time; the clicks are pixels and stay valid."""
    if before == now:
        return ()
    was, is_now = (f"with --radar-axes {axes}" if axes else "without --radar-axes" for axes in (before, now))
    message = f"the session was last opened {was}, now {is_now}: all clicks are solved again with the new axes"
    again = f"start again with --radar-axes {before}" if before else "start again without --radar-axes"
    return (DataWarning.reported("other-axes", message, f"if that was not intended, {again}"),)
