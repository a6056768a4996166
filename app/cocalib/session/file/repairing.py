"""Look at a session without its recording: what is wrong, what can be kept; and repair it."""

from dataclasses import dataclass
from pathlib import Path

from calib_core.measurements import ReflectorClick
from cocalib.session.file.errors import SessionFileError
from cocalib.session.file.guarded_folder import GuardedFolder
from cocalib.session.file.lock import FolderLock
from cocalib.session.file.reconciling import Contents, read_contents
from cocalib.session.file.rewriting import rewrite


@dataclass(frozen=True, slots=True)
class Repair:
    """What a session proves, or what was written again from that.

    Attributes:
        folder: of the session.
        recording: name of its recording.
        clicks: those that are proven, sorted by time.
        steps: how many steps lead to them; those that a snapshot stands for are not counted.
        from_snapshot: the clicks are those of the snapshot and of what follows it in the journal.
        faults: what is wrong, one phrase each; empty for a sound session.
        is_complete: whether everything that was confirmed is kept, as far as the files can prove.
        unproven: how many lines of the journal are left out.
        torn_bytes: length of a half-written last step, which was never confirmed.
        backups: names of the copies of the old files, once it is repaired.
    """

    folder: Path
    recording: str
    clicks: tuple[ReflectorClick, ...]
    steps: int
    from_snapshot: bool
    faults: tuple[str, ...]
    is_complete: bool
    unproven: int
    torn_bytes: int
    backups: tuple[str, ...] = ()


def inspect_session(folder: Path) -> Repair:
    """Return what a session proves; nothing is changed.

    Raises:
        SessionFileError: there is none, or nothing of it can be proven, or it is not a folder with files of this user.
    """
    guarded = GuardedFolder(folder)
    try:
        return _repair(folder, _contents(guarded))
    finally:
        guarded.close()


def repair_session(folder: Path) -> Repair:
    """Write a damaged session again from what it proves; the old files are kept as backups. A sound one stays as it is.

    Raises:
        SessionFileError: as for `inspect_session`, or another process has it open, or it cannot be written.
    """
    guarded = GuardedFolder(folder)
    lock: FolderLock | None = None
    try:
        lock = FolderLock(guarded)
        found = _contents(guarded)
        backups = rewrite(guarded, found, found.recording)[0] if found.faults else ()
        return _repair(folder, found, backups)
    except OSError as error:
        raise SessionFileError(f"{folder}: cannot be repaired: {error.strerror}") from error
    finally:
        if lock is not None:
            lock.close()
        guarded.close()


def _contents(folder: GuardedFolder) -> Contents:
    try:
        found = read_contents(folder)
    except OSError as error:
        raise SessionFileError(f"{folder.path}: cannot be read: {error.strerror}") from error
    if found is None:
        raise SessionFileError(f"{folder.path}: holds no session; give a folder whose name ends in .cocalib-session")
    return found


def _repair(folder: Path, found: Contents, backups: tuple[str, ...] = ()) -> Repair:
    journal = found.journal
    return Repair(
        folder=folder,
        recording=found.recording.name,
        clicks=found.history.present.clicks,
        steps=len(found.steps),
        from_snapshot=found.from_snapshot,
        faults=found.faults,
        is_complete=found.is_complete,
        unproven=0 if found.is_complete else found.left_out,
        torn_bytes=journal.torn_bytes if journal else 0,
        backups=backups,
    )
