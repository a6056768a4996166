"""The journal: a first line that identifies the recording, then one line per step, only ever appended to.

Every line ends with a checksum chained to the line before (`checksums`). A line counts once its line end is on the disk; what
follows the last line end was never confirmed. What breaks the chain is damage, and nothing is written past it.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec

from app.session import Step
from app.session.file.checksums import SealedLine, line_bytes, sealed, taken_apart
from app.session.file.errors import SessionFileError
from app.session.file.guarded_folder import GuardedFolder
from app.session.file.identity import RecordingForm
from app.session.file.step_json import StepForm, form_of_step, step_from_form
from calib_core.errors import CalibrationError

__all__ = [
    "JOURNAL",
    "SCHEMA",
    "SCHEMA_1",
    "DoubtfulLine",
    "FoundJournal",
    "Journal",
    "begin_journal",
    "read_journal",
    "steps_after",
]

JOURNAL = "journal.jsonl"
SCHEMA, SCHEMA_1 = "cocalib/session-2", "cocalib/session-1"
"""What is written, and what older versions wrote: lines without checksums."""


class _Head(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    schema: str
    cocalib: str
    recording: RecordingForm
    continues: str = ""


class _Version(msgspec.Struct, frozen=True):
    schema: str
    cocalib: str = ""


class _Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    n: int
    step: StepForm


@dataclass(frozen=True, slots=True)
class DoubtfulLine:
    """A line that does not follow from the lines before it.

    Attributes:
        index: in the lines after the first.
        why: what is wrong with it.
    """

    index: int
    why: str


@dataclass(frozen=True, slots=True)
class FoundJournal:
    """A journal as found on the disk.

    Attributes:
        recording: the recording it belongs to; None if the first line is damaged.
        schema: which format it is in.
        continues: checksum of the snapshot it was started from; "" if it was started empty.
        steps: those that are proven: each follows the one before, from the first line on.
        sums: checksums of the first line and of these steps; empty for session-1.
        faults: what is wrong with the first line and with the last line end, one phrase each.
        lines: all lines after the first, to look for steps after a snapshot.
        doubtful: those of `lines` that are not proven.
        sound_bytes: its length up to the last line end, or to the first fault.
        torn_bytes: length of what follows the last line end: a step that was being written when the process died.
    """

    recording: RecordingForm | None
    schema: str
    continues: str
    steps: tuple[Step, ...]
    sums: tuple[str, ...]
    faults: tuple[str, ...]
    lines: tuple[SealedLine, ...]
    doubtful: tuple[DoubtfulLine, ...]
    sound_bytes: int
    torn_bytes: int


def begin_journal(
    folder: GuardedFolder, recording: RecordingForm, steps: Sequence[Step], *, cocalib: str, continues: str = ""
) -> tuple[str, ...]:
    """Create or replace a journal in one atomic write; return the checksums of its lines.

    Args:
        folder: where it goes.
        recording: the recording it belongs to.
        steps: its initial steps.
        cocalib: version of the program.
        continues: checksum of the snapshot that the steps come from; "" if they do not.

    Raises:
        SessionFileError: what is there is no journal of this user.
        OSError: it cannot be written.
    """
    contents = [msgspec.json.encode(_Head(SCHEMA, cocalib, recording, continues))]
    contents += [_content(number, step) for number, step in enumerate(steps, start=1)]
    lines: list[SealedLine] = []
    for content in contents:
        lines.append(sealed(content, lines[-1].sum if lines else ""))
    folder.replace(JOURNAL, b"".join(line_bytes(line) + b"\n" for line in lines))
    return tuple(line.sum for line in lines)


def read_journal(data: bytes, place: str) -> FoundJournal:
    """Take a journal apart and find out what of it is proven.

    Args:
        data: its bytes.
        place: its path, for messages.

    Raises:
        SessionFileError: it was written by a version with another format.
    """
    *lines, tail = data.split(b"\n")
    if tail and lines and _is_line_with_damaged_end(tail, lines[-1]):
        lines, tail = [*lines, tail[:-1]], b""
        return _read(lines, data, 0, place, damaged_end=True)
    return _read(lines, data, len(tail), place)


def steps_after(journal: FoundJournal, previous: str) -> tuple[tuple[Step, ...], tuple[str, ...], tuple[int, ...]]:
    """Find the steps that follow a checksum, wherever their lines are.

    Returns:
        the steps, their checksums, and the positions of their lines.
    """
    return _chain(journal.lines, previous)


class Journal:
    """Appends steps to a journal; each is on the disk when the call returns."""

    def __init__(self, folder: GuardedFolder, descriptor: int, sums: Sequence[str], length: int) -> None:
        """Continue a journal.

        Args:
            folder: where it is.
            descriptor: of the open journal; closed by `close`.
            sums: checksums of its lines.
            length: in bytes, up to its last line end; what follows is removed.
        """
        self._folder = folder
        self._descriptor = descriptor
        self.sums = list(sums)
        self._length = length
        self._cut()

    @property
    def steps(self) -> int:
        """How many steps it holds."""
        return len(self.sums) - 1

    def append(self, step: Step) -> None:
        """Write a step.

        Raises:
            SessionFileError: it could not be written completely, or the journal is not as it was left; the step is not in it.
        """
        line = sealed(_content(self.steps + 1, step), self.sums[-1])
        self._write(line_bytes(line) + b"\n")
        self.sums.append(line.sum)

    def fault(self, *, whole: bool = False) -> str:
        """Return what has happened to the file since it was last written; "" if it is as it was left.

        Args:
            whole: read it and verify every line, instead of looking at its place and length only.
        """
        if self._descriptor < 0:
            return "it is closed"
        if not self._folder.has(JOURNAL, self._descriptor):
            return "the file, or its folder, was deleted, moved or replaced while the session was open"
        size = os.fstat(self._descriptor).st_size
        if size != self._length:
            return f"another program changed its length from {self._length} to {size} bytes"
        if whole:
            found = read_journal(self._folder.read_open(JOURNAL, self._descriptor), JOURNAL)
            if found.faults or found.doubtful or found.torn_bytes or list(found.sums) != self.sums:
                return "its content is no longer what was written"
        return ""

    def close(self) -> None:
        """Close the file; nothing can be appended afterwards."""
        descriptor, self._descriptor = self._descriptor, -1  # never a valid descriptor: the old number may be reused
        if descriptor >= 0:
            os.close(descriptor)

    def _write(self, line: bytes) -> None:
        path = self._folder.path / JOURNAL
        if self._descriptor < 0:
            raise SessionFileError(f"{path}: the session is closed and the change was not made; start again")
        rest = memoryview(line)
        try:
            if fault := self.fault():
                raise SessionFileError(
                    f"{path}: the change could not be saved and was not made: {fault}; put it back as it was and try again, "
                    "or stop the program: it then stores all clicks in another folder, and names it"
                )
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
            os.fsync(self._descriptor)
        except OSError as error:
            self._take_back()
            raise SessionFileError(
                f"{path}: the change could not be saved and was not made: {error.strerror}; "
                "free some disk space or restore the folder, then try again"
            ) from error
        self._length += len(line)

    def _take_back(self) -> None:
        """Remove what a failed write left; if even that fails, close the journal."""
        try:
            self._cut()
        except OSError:
            self.close()

    def _cut(self) -> None:
        """Truncate after the last complete line."""
        os.ftruncate(self._descriptor, self._length)
        os.lseek(self._descriptor, self._length, os.SEEK_SET)


def _content(number: int, step: Step) -> bytes:
    return msgspec.json.encode(_Line(number, form_of_step(step)))


def _read(raw: Sequence[bytes], data: bytes, torn: int, place: str, *, damaged_end: bool = False) -> FoundJournal:
    head, why = _head(raw[0], place) if raw else (None, "the file is empty")
    faults = [f"line 1 is damaged ({why})"] if head is None else []
    if head is not None and head.schema == SCHEMA_1:
        return _read_1(head, raw, len(data) - torn, torn)
    first, *lines = [taken_apart(line) for line in raw] or [SealedLine(b"", "")]
    steps, sums, positions = _chain(lines, first.sum)
    doubtful = tuple(
        DoubtfulLine(index, _why(lines[index])) for index in sorted(set(range(len(lines))) - set(positions))
    )
    if damaged_end:
        faults.append(f"the end of line {len(raw)} is damaged")
    return FoundJournal(
        recording=head.recording if head else None,
        schema=SCHEMA,
        continues=head.continues if head else "",
        steps=steps,
        sums=(first.sum, *sums),
        faults=tuple(faults),
        lines=tuple(lines),
        doubtful=doubtful,
        sound_bytes=len(data) - torn,
        torn_bytes=torn,
    )


def _read_1(head: _Head, raw: Sequence[bytes], sound_bytes: int, torn: int) -> FoundJournal:
    """Read lines without checksums up to the first one that is damaged."""
    steps: list[Step] = []
    why = ""
    for line in raw[1:]:
        try:
            steps.append(_step(line, len(steps) + 1))
        except ValueError as error:
            why = str(error)
            break
    lines = tuple(SealedLine(line, "") for line in raw[1:])
    doubtful = tuple(DoubtfulLine(index, why) for index in range(len(steps), len(lines)))
    return FoundJournal(head.recording, SCHEMA_1, "", tuple(steps), (), (), lines, doubtful, sound_bytes, torn)


def _head(line: bytes, place: str) -> tuple[_Head | None, str]:
    """Return the first line, or why it is damaged.

    Raises:
        SessionFileError: it is in another version's format.
    """
    found = taken_apart(line)
    if found.sum and not found.follows(""):
        return None, "its checksum is wrong"
    try:
        written = msgspec.json.decode(found.content, type=_Version)
        if written.schema not in (SCHEMA, SCHEMA_1):
            raise SessionFileError(
                f"{place}: written as '{written.schema}' by cocalib {written.cocalib}, but this version reads '{SCHEMA}'; "
                "open it with that version, or give another --session folder"
            )
        head = msgspec.json.decode(found.content, type=_Head)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        return None, str(error)
    if head.schema != (SCHEMA if found.sum else SCHEMA_1):
        return None, "its checksum is missing"
    return head, ""


def _chain(lines: Sequence[SealedLine], previous: str) -> tuple[tuple[Step, ...], tuple[str, ...], tuple[int, ...]]:
    """Follow the chain from a checksum through the lines, leaving out those that do not belong to it."""
    steps: list[Step] = []
    sums: list[str] = []
    positions: list[int] = []
    for index, line in enumerate(lines):
        if not (previous and line.follows(previous)):
            continue
        try:
            steps.append(_step(line.content, None))
        except ValueError:
            break  # the checksum is right, so another version wrote it
        previous = line.sum
        sums.append(line.sum)
        positions.append(index)
    return tuple(steps), tuple(sums), tuple(positions)


def _step(content: bytes, number: int | None) -> Step:
    """Parse a step.

    Raises:
        ValueError: it is none, or has another number.
    """
    try:
        read = msgspec.json.decode(content, type=_Line)
        step = step_from_form(read.step)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError, CalibrationError) as error:
        raise ValueError(str(error)) from error
    if number is not None and read.n != number:
        raise ValueError(f"found step {read.n}, expected step {number}")
    return step


def _why(line: SealedLine) -> str:
    """Return why a line is not in the chain."""
    if not line.sum:
        return "it has no checksum"
    try:
        _step(line.content, None)
    except ValueError as error:
        return str(error)
    return "its checksum is wrong, or it does not follow the line before"


def _is_line_with_damaged_end(tail: bytes, before: bytes) -> bool:
    """Tell a whole line whose line end was changed from one that was being written when the process died."""
    line = taken_apart(tail[:-1])
    return line.follows(taken_apart(before).sum)
