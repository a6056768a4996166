"""An open session folder: what was in it, how new steps are added, and whether all of it is on the disk at the end."""

import logging
import os
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from calib_core.results import DataWarning
from cocalib.platform.resources import version
from cocalib.session import History, RecordingFacts, Step
from cocalib.session.file.closing import Closed, rescued, snapshot_fault
from cocalib.session.file.errors import SessionFileError
from cocalib.session.file.guarded_folder import GuardedFolder
from cocalib.session.file.identity import recording_form
from cocalib.session.file.journal import Journal, begin_journal
from cocalib.session.file.journal_reading import JOURNAL
from cocalib.session.file.lock import FolderLock
from cocalib.session.file.reconciling import Contents, read_contents
from cocalib.session.file.rewriting import rewrite
from cocalib.session.file.snapshot import SNAPSHOT, write_snapshot

_STEPS_PER_SNAPSHOT = 10
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Restored:
    """What was found in a session folder.

    Attributes:
        folder: its path.
        history: the session, with what can be undone and redone.
        steps: how many steps the journal held; 0 for a new session.
        torn_bytes: length of a half-written last line that was dropped; it had never been confirmed.
        from_snapshot: the journal was missing or shorter than the snapshot, so the snapshot was used.
        warnings: what else the user must know before continuing.
    """

    folder: Path
    history: History
    steps: int = 0
    torn_bytes: int = 0
    from_snapshot: bool = False
    warnings: tuple[DataWarning, ...] = ()

    @property
    def note(self) -> str:
        """A sentence about anything unusual; "" if there is nothing."""
        if self.from_snapshot:
            return "The journal was missing or damaged. The clicks are from the last snapshot; earlier changes cannot be undone."
        if self.torn_bytes:
            return "The program stopped while the last change was being written; it is not in the session."
        return ""


class SessionFile:
    """Stores the steps of one session, from `open_session_file` to `close`. To be used by one thread at a time."""

    def __init__(
        self, facts: RecordingFacts, folder: GuardedFolder, lock: FolderLock, journal: Journal, restored: Restored
    ) -> None:
        self.restored = restored
        self._recording = recording_form(facts)
        self._folder = folder
        self._lock = lock
        self._journal = journal
        self._history = restored.history
        self._snapshot_steps = -1
        self._snapshot_identity = folder.identity(SNAPSHOT)
        self._closed: Closed | None = None

    def append(self, step: Step, history: History) -> None:
        """Store a step on disk before returning; `history` is the state after it.

        Raises:
            SessionFileError: it could not be written; the file is unchanged.
        """
        self._journal.append(step)
        self._history = history
        if self._journal.steps % _STEPS_PER_SNAPSHOT == 0:
            self.keep_snapshot()

    def close(self) -> Closed:
        """Write the snapshot, verify what is on the disk, and release the folder.

        Returns:
            whether everything is there; if not, where a copy was written. A second call returns the same.
        """
        if self._closed is None:
            self._closed = self._verified()
            self._journal.close()
            self._lock.close()
            self._folder.close()
        return self._closed

    def keep_snapshot(self) -> str:
        """Write the snapshot unless it is up to date; return why that failed, or "".

        The journal is complete without it, so a failure is only logged.
        """
        if self._snapshot_steps == self._journal.steps:
            return ""
        try:
            if self._folder.identity(SNAPSHOT) != self._snapshot_identity:
                raise SessionFileError("another program has changed it")
            self._write_snapshot()
            return ""
        except OSError as error:
            fault = error.strerror or str(error)
        except SessionFileError as error:
            fault = str(error)
        _log.warning("%s: the snapshot could not be written: %s", self._folder.path / SNAPSHOT, fault)
        return fault

    def _write_snapshot(self) -> None:
        present, sums = self._history.present, self._journal.sums
        write_snapshot(self._folder, present, recording=self._recording, sums=sums, cocalib=version())
        self._snapshot_identity = self._folder.identity(SNAPSHOT)
        self._snapshot_steps = self._journal.steps

    def _verified(self) -> Closed:
        present, path = self._history.present, self._folder.path
        fault = self._journal.fault(whole=True)
        if not self._folder.is_in_place():
            return rescued(path, present, self._recording, f"{path} was deleted, moved or replaced while it was open")
        unwritten = self.keep_snapshot() or snapshot_fault(self._folder, present.clicks)
        if not fault:
            return Closed(path, len(present.clicks))
        if not unwritten:
            return Closed(path, len(present.clicks), f"{path / JOURNAL}: {fault}", path / SNAPSHOT)
        return rescued(path, present, self._recording, f"{path / JOURNAL}: {fault}; {SNAPSHOT}: {unwritten}")


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
            opened = _opened(guarded, lock, facts, warnings)
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
    while os.path.lexists(kept := folder.with_name(f"{folder.name}.{number}")):
        number += 1
    try:
        folder.rename(kept)
    except OSError as error:
        raise SessionFileError(f"{folder}: cannot be moved to {kept.name}: {error.strerror}") from error
    return kept


def _opened(
    folder: GuardedFolder, lock: FolderLock, facts: RecordingFacts, warnings: tuple[DataWarning, ...]
) -> SessionFile:
    found = read_contents(folder, facts)
    about = (*warnings, *(_about(found, facts, folder) if found else ()))
    if found is None:
        sums, torn_bytes = begin_journal(folder, recording_form(facts), (), cocalib=version()), 0
    elif found.needs_writing:
        _, sums = rewrite(folder, found, recording_form(facts))
        torn_bytes = 0
    else:
        assert found.journal is not None
        sums, torn_bytes = found.journal.sums, found.journal.torn_bytes
        if found.faults:
            folder.back_up(SNAPSHOT)
    journal = _continued(folder, sums, torn_bytes)
    history = found.history if found else History()
    from_snapshot = found is not None and found.from_snapshot
    restored = Restored(folder.path, history, len(sums) - 1, torn_bytes, from_snapshot, about)
    opened = SessionFile(facts, folder, lock, journal, restored)
    if about:
        opened.keep_snapshot()  # so that the current axes are stored even if the process is killed
    return opened


def _continued(folder: GuardedFolder, sums: tuple[str, ...], torn_bytes: int) -> Journal:
    """Open the journal that was read or written for appending."""
    descriptor = folder.open(JOURNAL, os.O_RDWR)
    try:
        return Journal(folder, descriptor, sums, os.fstat(descriptor).st_size - torn_bytes)
    except OSError:
        os.close(descriptor)
        raise


def _about(found: Contents, facts: RecordingFacts, folder: GuardedFolder) -> tuple[DataWarning, ...]:
    """Return what the user must know about the session before continuing.

    Raises:
        SessionFileError: the files disagree in a way that a person must decide.
    """
    if not found.is_complete:
        raise SessionFileError(
            f"{folder.path}: the session is damaged: {'; '.join(found.faults)}; nothing was changed. "
            f"See what can be kept: cocalib session repair {folder.path}"
        )
    before = found.snapshot.recording if found.snapshot else found.recording
    faults = _about_faults(found) if found.faults else ()
    if not found.steps:
        return faults
    return (*faults, *_about_axes(before.radar_axes, facts.radar_axes))


def _about_faults(found: Contents) -> tuple[DataWarning, ...]:
    clicks = len(found.history.present.clicks)
    source = "the snapshot, with what follows it in the journal" if found.from_snapshot else "the journal"
    message = (
        f"the session was damaged: {'; '.join(found.faults)}; it continues with the {clicks} clicks in {source}; "
        "as far as the files show, none is missing"
    )
    hint = "the damaged files are kept next to the new ones, with .backup-1 or the next number in their names"
    return (DataWarning("session-damaged", message, hint),)


def _about_axes(before: str | None, now: str | None) -> tuple[DataWarning, ...]:
    """Warn that the radar is read differently from last time; the clicks are pixels and stay valid."""
    if before == now:
        return ()
    was, is_now = (f"with --radar-axes {axes}" if axes else "without --radar-axes" for axes in (before, now))
    message = f"the session was last opened {was}, now {is_now}: all clicks are solved again with the new axes"
    again = f"start again with --radar-axes {before}" if before else "start again without --radar-axes"
    return (DataWarning("other-axes", message, f"if that was not intended, {again}"),)
