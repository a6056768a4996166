"""What a session folder proves: journal and copy read by one reader and taken together; and its repair."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from calib_core.errors import CalibrationError
from calib_core.measurements import ReflectorClick
from cocalib.session.applying import History, advance
from cocalib.session.events import AxesStated, Step
from cocalib.session.file.guarded_folder import FolderLock, GuardedFolder, SessionFileError
from cocalib.session.file.identity import RecordingForm, facts_of, require_same_recording
from cocalib.session.file.journal import (
    COPY,
    JOURNAL,
    FoundJournal,
    SealedLine,
    bytes_of,
    following,
    read_journal,
)
from cocalib.session.state import RecordingFacts


@dataclass(frozen=True, slots=True)
class Contents:
    """The session that the files of a folder prove together.

    Attributes:
        recording: the recording it belongs to.
        radar_axes: with which it was last opened.
        history: the session, with what can be undone and redone.
        steps: the steps that lead to it, from an empty session.
        lines: of the journal that holds these steps.
        is_written: the journal has exactly these lines, and at most a torn last one after them.
        faults: what is wrong, one phrase each.
        is_complete: whether nothing that was confirmed can be missing, as far as the files can prove.
        left_out: how many lines are not proven.
        torn_bytes: length of a step that was being written when the process died; it had never been confirmed.
    """

    recording: RecordingForm
    radar_axes: str | None
    history: History
    steps: tuple[Step, ...]
    lines: tuple[SealedLine, ...]
    is_written: bool
    faults: tuple[str, ...]
    is_complete: bool
    left_out: int
    torn_bytes: int

    @property
    def stated_axes(self) -> str | None:
        """The radar axes of the last opening that the journal states."""
        return _axes(self.recording, self.steps)


@dataclass(frozen=True, slots=True)
class _Replayed:
    """The steps that fit, and why the next one does not."""

    history: History
    steps: tuple[Step, ...]
    fault: str = ""


def read_contents(folder: GuardedFolder, facts: RecordingFacts | None = None) -> Contents | None:
    """Read a session; None if the folder holds none.

    Args:
        folder: with the session.
        facts: the recording, which must be the session's; None if it is not at hand.

    Raises:
        SessionFileError: nothing of it can be proven, it is of another recording or of another version, or a file is not a
            regular file of this user.
        OSError: it cannot be read.
    """
    journal, copy = _read(folder, JOURNAL), _read(folder, COPY)
    if journal is None and copy is None:
        return None
    recordings = [found.recording for found in (journal, copy) if found is not None and found.recording]
    if not recordings:
        faults = [fault for found in (journal, copy) if found for fault in found.faults]
        raise SessionFileError(
            f"{folder.path}: nothing of the session can be proven: {'; '.join(faults)}; nothing was changed. "
            "Restore the folder from a backup, or rename it to start over"
        )
    if facts is None:
        facts = facts_of(recordings[0])
    else:
        require_same_recording(recordings[0], facts, folder.path)
    return _merged_contents(journal, copy, recordings[0], facts)


def rewrite(folder: GuardedFolder, contents: Contents) -> tuple[str, ...]:
    """Write a journal and its copy again from what was proven; a process killed on the way leaves files that agree.

    Returns:
        the names of the backups of the old files.

    Raises:
        SessionFileError: a file is not a regular file of this user.
        OSError: something cannot be written; what was not replaced stays.
    """
    backups = tuple(kept for name in (JOURNAL, COPY) if (kept := folder.back_up(name)) is not None)
    for name in (JOURNAL, COPY):
        folder.replace(name, bytes_of(contents.lines))
    return backups


def _read(folder: GuardedFolder, name: str) -> FoundJournal | None:
    data = folder.read(name)
    return None if data is None else read_journal(data, str(folder.path / name))


def _merged_contents(
    journal: FoundJournal | None, copy: FoundJournal | None, recording: RecordingForm, facts: RecordingFacts
) -> Contents:
    """Follow the chain from the sound first line through both files, so that what one has lost comes from the other."""
    files = [found for found in (journal, copy) if found is not None]
    starts = sorted((found for found in files if found.recording), key=lambda found: -len(found.proven))
    start = journal if journal and journal.is_sound else starts[0]
    lines = [start.head, *(one.line for one in start.proven)]
    steps = list(start.steps)
    while more := max((following(found.lines, lines[-1].sum) for found in files), key=len):
        lines += [one.line for one in more]
        steps += [one.step for one in more]
    replayed = _replay(steps, facts)
    sums = {line.sum for line in lines}
    agree = all(sums.issuperset(found.sums[0 if found.recording else 1 :]) for found in files)
    faults = [*_faults(journal, ""), *_faults(copy, "in the copy, ")]
    if not agree:
        faults.append("the journal and its copy do not belong together")
    elif journal is None:
        faults.append("the journal is missing")
    elif journal.is_sound and len(lines) > len(journal.sums):
        faults.append(f"the journal holds {len(journal.proven)} steps, its copy {len(steps)}")
    left_out = [[index for index in found.doubtful if found.lines[index].sum not in sums] for found in files]
    return Contents(
        recording=recording,
        radar_axes=_axes(recording, replayed.steps),
        history=replayed.history,
        steps=replayed.steps,
        lines=tuple(lines[: len(replayed.steps) + 1]),
        is_written=journal is not None and journal.is_sound and len(journal.sums) == len(lines),
        faults=(*faults, *filter(None, [replayed.fault])),
        is_complete=agree
        and not replayed.fault
        and all(index < len(steps) for unproven in left_out for index in unproven),
        left_out=max(map(len, left_out)),
        torn_bytes=journal.torn_bytes if journal else 0,
    )


def _faults(journal: FoundJournal | None, where: str) -> tuple[str, ...]:
    """Return what is wrong with a file, one phrase each."""
    if journal is None:
        return ()
    faults = [f"{where}{fault}" for fault in journal.faults]
    if doubtful := journal.doubtful:
        faults.append(f"{where}line {doubtful[0] + 2} is damaged ({journal.why(doubtful[0])})")
    if len(doubtful) > 1:
        faults.append(f"{where}{len(doubtful) - 1} lines after it do not follow from what is before it")
    return tuple(faults)


def _replay(steps: Sequence[Step], facts: RecordingFacts) -> _Replayed:
    """Apply the steps from an empty session on, up to one that does not fit."""
    history = History()
    for number, step in enumerate(steps):
        try:
            history = advance(history, step, facts)
        except CalibrationError as error:
            return _Replayed(history, tuple(steps[:number]), f"step {number + 1} does not fit: {error}")
    return _Replayed(history, tuple(steps))


def _axes(recording: RecordingForm, steps: Sequence[Step]) -> str | None:
    stated = [step.radar_axes for step in steps if isinstance(step, AxesStated)]
    return stated[-1] if stated else recording.radar_axes


@dataclass(frozen=True, slots=True)
class Repair:
    """What a session proves, or what was written again from that.

    Attributes:
        folder: of the session.
        recording: name of its recording.
        clicks: those that are proven, sorted by time.
        steps: how many steps lead to them.
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
    faults: tuple[str, ...]
    is_complete: bool
    unproven: int
    torn_bytes: int
    backups: tuple[str, ...] = ()

    @property
    def torn(self) -> str:
        """What is left out of a half-written last step, as a clause; "" if there is none."""
        return f"a last step of {self.torn_bytes} bytes was never confirmed and is left out" if self.torn_bytes else ""


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
        contents = _contents(guarded)
        backups = rewrite(guarded, contents) if contents.faults else ()
        return _repair(folder, contents, backups)
    except OSError as error:
        raise SessionFileError(f"{folder}: cannot be repaired: {error.strerror}") from error
    finally:
        if lock is not None:
            lock.close()
        guarded.close()


def _contents(folder: GuardedFolder) -> Contents:
    try:
        contents = read_contents(folder)
    except OSError as error:
        raise SessionFileError(f"{folder.path}: cannot be read: {error.strerror}") from error
    if contents is None:
        raise SessionFileError(f"{folder.path}: holds no session; give a folder whose name ends in .cocalib-session")
    return contents


def _repair(folder: Path, contents: Contents, backups: tuple[str, ...] = ()) -> Repair:
    return Repair(
        folder=folder,
        recording=contents.recording.name,
        clicks=contents.history.present.clicks,
        steps=len(contents.steps),
        faults=contents.faults,
        is_complete=contents.is_complete,
        unproven=0 if contents.is_complete else contents.left_out,
        torn_bytes=contents.torn_bytes,
        backups=backups,
    )
