"""What a session folder holds: journal and snapshot read, verified and compared; nothing is written here."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.errors import CalibrationError
from cocalib.session import History, RecordingFacts, Step, advance
from cocalib.session.file.errors import SessionFileError
from cocalib.session.file.guarded_folder import GuardedFolder
from cocalib.session.file.identity import RecordingForm, facts_of, require_same_recording
from cocalib.session.file.journal_reading import (
    JOURNAL,
    SCHEMA_1,
    DoubtfulLine,
    FoundJournal,
    read_journal,
    steps_after,
)
from cocalib.session.file.snapshot import SNAPSHOT, FoundSnapshot, read_snapshot


@dataclass(frozen=True, slots=True)
class Contents:
    """The best session that journal and snapshot prove.

    Attributes:
        recording: the recording it belongs to.
        history: the session, with what can be undone and redone.
        steps: the steps that lead to it, from an empty session.
        from_snapshot: the clicks are those of the snapshot; what was before cannot be undone.
        faults: what is wrong, one phrase each.
        is_complete: whether nothing that was confirmed can be missing, as far as the files can prove.
        left_out: how many lines of the journal are not proven.
        journal: the journal as found; None if there is none.
        snapshot: the snapshot as found; None if there is none, or it is damaged.
    """

    recording: RecordingForm
    history: History
    steps: tuple[Step, ...]
    from_snapshot: bool
    faults: tuple[str, ...]
    is_complete: bool
    left_out: int
    journal: FoundJournal | None
    snapshot: FoundSnapshot | None

    @property
    def needs_writing(self) -> bool:
        """Whether the journal must be written again before a step can be added."""
        journal = self.journal
        return journal is None or self.from_snapshot or bool(journal.faults or journal.doubtful) or self.is_session_1

    @property
    def is_session_1(self) -> bool:
        """Whether the journal has no checksums, as older versions wrote it."""
        return self.journal is not None and self.journal.schema == SCHEMA_1


@dataclass(frozen=True, slots=True)
class _Version:
    """One way to read the session: from the journal alone, or from the snapshot and what follows it in the journal."""

    history: History
    steps: tuple[Step, ...]
    count: int
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
    journal_data, snapshot_data = folder.read(JOURNAL), folder.read(SNAPSHOT)
    if journal_data is None and snapshot_data is None:
        return None
    journal = None if journal_data is None else read_journal(journal_data, str(folder.path / JOURNAL))
    snapshot, snapshot_fault = _snapshot(snapshot_data, folder)
    recording = _recording(journal, snapshot, snapshot_fault, folder)
    if facts is None:
        facts = facts_of(recording)
    else:
        require_same_recording(recording, facts, folder.path)
    return _reconciled(journal, snapshot, snapshot_fault, recording, facts)


def _snapshot(data: bytes | None, folder: GuardedFolder) -> tuple[FoundSnapshot | None, str]:
    """Return the snapshot, or why it cannot be used."""
    if data is None:
        return None, ""
    try:
        return read_snapshot(data, SNAPSHOT), ""
    except SessionFileError as error:
        return None, str(error)


def _recording(
    journal: FoundJournal | None, snapshot: FoundSnapshot | None, snapshot_fault: str, folder: GuardedFolder
) -> RecordingForm:
    if journal is not None and journal.recording is not None:
        return journal.recording
    if snapshot is not None:
        return snapshot.recording
    faults = [fault for fault in (*(journal.faults if journal else ()), snapshot_fault) if fault]
    raise SessionFileError(
        f"{folder.path}: nothing of the session can be proven: {'; '.join(faults)}; nothing was changed. "
        "Restore the folder from a backup, or rename it to start over"
    )


def _reconciled(
    journal: FoundJournal | None,
    snapshot: FoundSnapshot | None,
    snapshot_fault: str,
    recording: RecordingForm,
    facts: RecordingFacts,
) -> Contents:
    by_journal = _replayed(journal.steps if journal else (), facts)
    agrees = snapshot is None or journal is None or _agree(journal, snapshot, recording, by_journal, facts)
    by_snapshot, positions = _from_snapshot(journal, snapshot, facts) if snapshot else (None, ())
    from_snapshot = by_snapshot is not None and _is_better(by_snapshot, by_journal, journal, agrees)
    best = by_snapshot if by_snapshot is not None and from_snapshot else by_journal
    left_out = _left_out(journal, positions if from_snapshot else ())
    faults = [*(journal.faults if journal else ()), *_phrases(left_out), *filter(None, (best.fault, snapshot_fault))]
    if not agrees:
        faults.append("journal and snapshot do not belong together")
    elif journal is not None and snapshot is not None and from_snapshot and not faults:
        faults.append(f"the journal holds {by_journal.count} steps, its snapshot {snapshot.count}")
    return Contents(
        recording=recording,
        history=best.history,
        steps=best.steps,
        from_snapshot=from_snapshot,
        faults=tuple(faults),
        is_complete=agrees and not best.fault and _is_covered(journal, snapshot, positions, left_out),
        left_out=len(left_out),
        journal=journal,
        snapshot=snapshot,
    )


def _left_out(journal: FoundJournal | None, positions: Sequence[int]) -> tuple[DoubtfulLine, ...]:
    """Return the lines that follow neither from the first line nor from the snapshot."""
    proven = set(positions)
    return tuple(line for line in journal.doubtful if line.index not in proven) if journal else ()


def _phrases(lines: Sequence[DoubtfulLine]) -> tuple[str, ...]:
    if not lines:
        return ()
    first = f"line {lines[0].index + 2} is damaged ({lines[0].why})"
    return (
        (first, f"{len(lines) - 1} lines after it do not follow from what is before it") if len(lines) > 1 else (first,)
    )


def _replayed(steps: Sequence[Step], facts: RecordingFacts, count: int = 0) -> _Version:
    """Apply the steps from an empty session on, up to one that does not fit.

    Args:
        steps: from a journal, or from a snapshot.
        facts: the recording.
        count: of the steps that the first ones stand for, beyond their own number.
    """
    history = History()
    for number, step in enumerate(steps):
        try:
            history = advance(history, step, facts)
        except CalibrationError as error:
            return _Version(
                history, tuple(steps[:number]), number + count, f"step {number + 1 + count} does not fit: {error}"
            )
    return _Version(history, tuple(steps), len(steps) + count)


def _from_snapshot(
    journal: FoundJournal | None, snapshot: FoundSnapshot, facts: RecordingFacts
) -> tuple[_Version, tuple[int, ...]]:
    """Return the snapshot with the steps that follow it in the journal, and the positions of their lines."""
    later, _, positions = steps_after(journal, snapshot.last) if journal and snapshot.last else ((), (), ())
    superseded = journal is not None and journal.continues == snapshot.sum
    count = 1 if superseded else snapshot.count
    return _replayed((*snapshot.steps, *later), facts, count - len(snapshot.steps)), positions


def _is_better(snapshot: _Version, journal: _Version, found: FoundJournal | None, agrees: bool) -> bool:
    """Return whether the snapshot leads further than the journal; a whole journal comes before a snapshot of something else."""
    if found is None:
        return True
    if not agrees and not (found.faults or found.doubtful):
        return False
    return snapshot.count > journal.count


def _agree(
    journal: FoundJournal,
    snapshot: FoundSnapshot,
    recording: RecordingForm,
    by_journal: _Version,
    facts: RecordingFacts,
) -> bool:
    """Return whether the snapshot is of this journal: by its lines' checksums, or without these by its clicks and options."""
    if journal.continues and journal.continues == snapshot.sum:
        return True
    if journal.sums and snapshot.lines:
        return snapshot.agrees_with(journal.sums)
    mine, other = recording, snapshot.recording
    if (mine.start, mine.width_px, mine.height_px) != (other.start, other.width_px, other.height_px):
        return False
    if by_journal.count < snapshot.count:
        return True
    then = _replayed(by_journal.steps[: snapshot.count], facts).history.present
    return (then.clicks, then.options) == (snapshot.clicks, snapshot.options)


def _is_covered(
    journal: FoundJournal | None,
    snapshot: FoundSnapshot | None,
    positions: Sequence[int],
    left_out: Sequence[DoubtfulLine],
) -> bool:
    """Return whether all lines that are left out are before the snapshot's last one, so that it contains their steps."""
    if journal is None or not (left_out or journal.sums[:1] == ("",)):
        return True
    if snapshot is None or not snapshot.last:
        return False
    ends = [*positions, *(index for index, line in enumerate(journal.lines) if line.sum == snapshot.last)]
    return bool(ends) and all(line.index <= min(ends) for line in left_out)
