"""An open session folder: what was in it, and how new steps are added."""

import logging
from dataclasses import dataclass
from pathlib import Path

from app.resources import version
from app.session import History, RecordingFacts, Step
from app.session.file.errors import SessionFileError
from app.session.file.journal import Journal, begin_journal, replay
from app.session.file.lock import FolderLock
from app.session.file.snapshot import read_snapshot, snapshot_axes, write_snapshot
from calib_core.results import DataWarning

__all__ = ["Restored", "SessionFile", "open_session_file", "set_aside"]

_JOURNAL, _SNAPSHOT = "journal.jsonl", "session.json"
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
        from_snapshot: the journal was missing, so the snapshot was used.
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
            return (
                "The journal was missing. The clicks are from the last snapshot, and earlier changes cannot be undone."
            )
        if self.torn_bytes:
            return "The program stopped while the last change was being written; it is not in the session."
        return ""


class SessionFile:
    """Stores the steps of one session, from `open_session_file` to `close`. To be used by one thread at a time."""

    def __init__(self, facts: RecordingFacts, lock: FolderLock, journal: Journal, restored: Restored) -> None:
        self.restored = restored
        self._facts = facts
        self._lock = lock
        self._journal = journal
        self._history = restored.history
        self._snapshot_steps = -1

    def append(self, step: Step, history: History) -> None:
        """Store a step on disk before returning; `history` is the state after it.

        Raises:
            SessionFileError: it could not be written; the file is unchanged.
        """
        self._journal.append(step)
        self._history = history
        if self._journal.steps % _STEPS_PER_SNAPSHOT == 0:
            self.keep_snapshot()

    def close(self) -> None:
        """Write the snapshot and release the folder."""
        self.keep_snapshot()
        self._journal.close()
        self._lock.close()

    def keep_snapshot(self) -> None:
        """Write the snapshot unless it is up to date; the journal is complete, so a failure is only logged."""
        if self._snapshot_steps == self._journal.steps:
            return
        path, steps = self.restored.folder / _SNAPSHOT, self._journal.steps
        try:
            write_snapshot(path, self._history.present, facts=self._facts, steps=steps, cocalib=version())
            self._snapshot_steps = steps
        except OSError as error:
            _log.warning("%s: the snapshot could not be written: %s; the journal is complete", path, error.strerror)


def open_session_file(folder: Path, facts: RecordingFacts) -> SessionFile:
    """Open the session in a folder, or start one there.

    Args:
        folder: created if missing.
        facts: the recording, which must be the one that the session belongs to.

    Raises:
        SessionFileError: it cannot be written, is open in another process, is damaged, or is of another recording.
            What is on the disk is unchanged.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SessionFileError(
            f"{folder}: cannot be created: {error.strerror}; give another --session folder"
        ) from error
    lock = FolderLock(folder)
    try:
        journal, restored = _opened(folder, facts)
    except OSError as error:
        lock.close()
        raise SessionFileError(f"{folder}: cannot be used: {error.strerror}; give another --session folder") from error
    except SessionFileError:
        lock.close()
        raise
    opened = SessionFile(facts, lock, journal, restored)
    if restored.warnings:
        opened.keep_snapshot()  # so that the current axes are stored even if the process is killed
    return opened


def set_aside(folder: Path) -> Path | None:
    """Rename a session folder, adding a number, so that the next open starts a new session.

    Returns:
        where it is now; None when there was none.

    Raises:
        SessionFileError: another process has it open, or it cannot be moved.
    """
    if not folder.exists():
        return None
    FolderLock(folder).close()
    number = 1
    while (kept := folder.with_name(f"{folder.name}.{number}")).exists():
        number += 1
    try:
        folder.rename(kept)
    except OSError as error:
        raise SessionFileError(f"{folder}: cannot be moved to {kept.name}: {error.strerror}") from error
    return kept


def _opened(folder: Path, facts: RecordingFacts) -> tuple[Journal, Restored]:
    path, snapshot = folder / _JOURNAL, folder / _SNAPSHOT
    from_snapshot = not path.exists() and snapshot.exists()
    if not path.exists():
        begin_journal(path, facts, read_snapshot(snapshot, facts) if from_snapshot else (), version())
    replayed = replay(path, facts)
    warnings = _about_axes(snapshot_axes(snapshot, replayed.radar_axes), facts.radar_axes) if replayed.steps else ()
    return Journal(path, replayed), Restored(
        folder, replayed.history, replayed.steps, replayed.torn_bytes, from_snapshot, warnings
    )


def _about_axes(before: str | None, now: str | None) -> tuple[DataWarning, ...]:
    """Warn that the radar is read differently from last time; the clicks are pixels and stay valid."""
    if before == now:
        return ()
    was, is_now = (f"with --radar-axes {axes}" if axes else "without --radar-axes" for axes in (before, now))
    message = f"the session was last opened {was}, now {is_now}: all clicks are solved again with the new axes"
    again = f"start again with --radar-axes {before}" if before else "start again without --radar-axes"
    return (DataWarning("other-axes", message, f"if that was not intended, {again}"),)
