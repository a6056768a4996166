"""What a session folder proves: journal and copy read by one reader and taken together; and its repair."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from calib_core.errors import CalibrationError
from calib_core.measurements import ReflectorClick
from cocalib.platform.resources import version
from cocalib.session import AxesStated, History, RecordingFacts, Step, advance
from cocalib.session.file.guarded_folder import FolderLock, GuardedFolder, SessionFileError
from cocalib.session.file.identity import RecordingForm, facts_of, require_same_recording
from cocalib.session.file.journal import (
    COPY,
    JOURNAL,
    SCHEMA_1,
    FoundJournal,
    SealedLine,
    bytes_of,
    following,
    new_lines,
    read_journal,
)
from cocalib.session.file.snapshot import SNAPSHOT, FoundSnapshot, read_snapshot


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
        from_snapshot: the clicks are those of a snapshot, of an earlier version; what was before cannot be undone.
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
    from_snapshot: bool
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
    snapshot, snapshot_fault = (None, "") if copy else _read_snapshot(folder)
    if journal is None and copy is None and snapshot is None and not snapshot_fault:
        return None
    recordings = [found.recording for found in (journal, copy, snapshot) if found is not None and found.recording]
    if not recordings:
        faults = [*(fault for found in (journal, copy) if found for fault in found.faults), snapshot_fault]
        raise SessionFileError(
            f"{folder.path}: nothing of the session can be proven: {'; '.join(filter(None, faults))}; nothing was changed. "
            "Restore the folder from a backup, or rename it to start over"
        )
    if facts is None:
        facts = facts_of(recordings[0])
    else:
        require_same_recording(recordings[0], facts, folder.path)
    if copy is None and (snapshot or snapshot_fault or (journal and journal.schema == SCHEMA_1)):
        return _of_earlier_version(journal, snapshot, snapshot_fault, recordings[0], facts)
    return _together(journal, copy, recordings[0], facts)


def rewrite(folder: GuardedFolder, found: Contents) -> tuple[str, ...]:
    """Write a journal and its copy again from what was proven; a process killed on the way leaves files that agree.

    Returns:
        the names of the backups of the old files.

    Raises:
        SessionFileError: a file is not a regular file of this user.
        OSError: something cannot be written; what was not replaced stays.
    """
    backups = tuple(kept for name in (JOURNAL, COPY, SNAPSHOT) if (kept := folder.back_up(name)) is not None)
    for name in (JOURNAL, COPY):
        folder.replace(name, bytes_of(found.lines))
    return backups


def _read(folder: GuardedFolder, name: str) -> FoundJournal | None:
    data = folder.read(name)
    return None if data is None else read_journal(data, str(folder.path / name))


def _read_snapshot(folder: GuardedFolder) -> tuple[FoundSnapshot | None, str]:
    """Return the snapshot of an earlier version, or why it cannot be used."""
    data = folder.read(SNAPSHOT)
    if data is None:
        return None, ""
    try:
        return read_snapshot(data, SNAPSHOT), ""
    except SessionFileError as error:
        return None, str(error)


def _together(
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
    replayed = _replayed(steps, facts)
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
        from_snapshot=False,
        faults=(*faults, *filter(None, [replayed.fault])),
        is_complete=agree
        and not replayed.fault
        and all(index < len(steps) for unproven in left_out for index in unproven),
        left_out=max(map(len, left_out)),
        torn_bytes=journal.torn_bytes if journal else 0,
    )


def _faults(found: FoundJournal | None, where: str) -> tuple[str, ...]:
    """Return what is wrong with a file, one phrase each."""
    if found is None:
        return ()
    faults = [f"{where}{fault}" for fault in found.faults]
    if doubtful := found.doubtful:
        faults.append(f"{where}line {doubtful[0] + 2} is damaged ({found.why(doubtful[0])})")
    if len(doubtful) > 1:
        faults.append(f"{where}{len(doubtful) - 1} lines after it do not follow from what is before it")
    return tuple(faults)


def _replayed(steps: Sequence[Step], facts: RecordingFacts) -> _Replayed:
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


def _of_earlier_version(
    journal: FoundJournal | None,
    snapshot: FoundSnapshot | None,
    snapshot_fault: str,
    recording: RecordingForm,
    facts: RecordingFacts,
) -> Contents:
    """Take a journal and the snapshot that earlier versions kept instead of a copy; until 1.0."""
    by_journal = _replayed(journal.steps if journal else (), facts)
    later = following(journal.lines, snapshot.last) if journal and snapshot and snapshot.last else ()
    agree = not (journal and snapshot) or _agree(journal, snapshot, by_journal, facts)
    best, from_snapshot = by_journal, False
    if snapshot and (journal is None or agree or not journal.is_sound):
        count = 1 if journal and journal.continues == snapshot.sum else snapshot.count
        by_snapshot = _replayed((*snapshot.steps, *(one.step for one in later)), facts)
        length = count + len(by_snapshot.steps) - len(snapshot.steps)
        if journal is None or length > len(by_journal.steps):
            best, from_snapshot = by_snapshot, True
    proven = {one.index for one in later} if from_snapshot else set()
    left_out = [index for index in (journal.doubtful if journal else ()) if index not in proven]
    faults = [*_faults(journal, ""), *filter(None, (best.fault, snapshot_fault))]
    if not agree:
        faults.append("journal and snapshot do not belong together")
    elif journal and snapshot and from_snapshot and not faults:
        faults.append(f"the journal holds {len(by_journal.steps)} steps, its snapshot {snapshot.count}")
    continues = snapshot.sum if snapshot else ""
    is_written = journal is not None and not from_snapshot and bool(journal.sums) and journal.is_sound
    kept = (journal.head, *(one.line for one in journal.proven)) if journal and is_written else None
    return Contents(
        recording=recording,
        radar_axes=snapshot.recording.radar_axes if snapshot else _axes(recording, best.steps),
        history=best.history,
        steps=best.steps,
        lines=kept or new_lines(recording, best.steps, cocalib=version(), continues=continues),
        is_written=is_written,
        from_snapshot=from_snapshot,
        faults=tuple(faults),
        is_complete=agree and not best.fault and _is_covered(journal, snapshot, sorted(proven), left_out),
        left_out=len(left_out),
        torn_bytes=journal.torn_bytes if journal else 0,
    )


def _agree(
    journal: FoundJournal | None, snapshot: FoundSnapshot | None, by_journal: _Replayed, facts: RecordingFacts
) -> bool:
    """Return whether the snapshot is of this journal: by its lines' checksums, or without these by its clicks and options."""
    assert journal is not None
    assert snapshot is not None
    if journal.continues and journal.continues == snapshot.sum:
        return True
    if journal.sums and snapshot.lines:
        return snapshot.agrees_with(journal.sums)
    mine, other = journal.recording, snapshot.recording
    if mine and (mine.start, mine.width_px, mine.height_px) != (other.start, other.width_px, other.height_px):
        return False
    if len(by_journal.steps) < snapshot.count:
        return True
    then = _replayed(by_journal.steps[: snapshot.count], facts).history.present
    kept = _replayed(snapshot.steps, facts).history.present
    return (then.clicks, then.options) == (kept.clicks, kept.options)


def _is_covered(
    journal: FoundJournal | None, snapshot: FoundSnapshot | None, positions: Sequence[int], left_out: Sequence[int]
) -> bool:
    """Return whether all lines that are left out are before the snapshot's last one, so that it contains their steps."""
    if journal is None or not (left_out or journal.sums[:1] == ("",)):
        return True
    if snapshot is None or not snapshot.last:
        return False
    ends = [*positions, *(index for index, line in enumerate(journal.lines) if line.sum == snapshot.last)]
    return bool(ends) and all(index <= min(ends) for index in left_out)


@dataclass(frozen=True, slots=True)
class Repair:
    """What a session proves, or what was written again from that.

    Attributes:
        folder: of the session.
        recording: name of its recording.
        clicks: those that are proven, sorted by time.
        steps: how many steps lead to them; those that a snapshot stands for are not counted.
        from_snapshot: the clicks are those of a snapshot, of an earlier version, and of what follows it in the journal.
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
        found = _contents(guarded)
        backups = rewrite(guarded, found) if found.faults else ()
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
    return Repair(
        folder=folder,
        recording=found.recording.name,
        clicks=found.history.present.clicks,
        steps=len(found.steps),
        from_snapshot=found.from_snapshot,
        faults=found.faults,
        is_complete=found.is_complete,
        unproven=0 if found.is_complete else found.left_out,
        torn_bytes=found.torn_bytes,
        backups=backups,
    )
