"""The journal: a first line that identifies the recording, then one line per step, only ever appended to; and its copy.

Every line ends with a checksum over its content and the checksum of the line before. A changed bit, a line that was removed,
inserted, repeated or exchanged breaks this chain; someone who edits a session on purpose can calculate checksums too. A line
counts once its line end is on the disk; what follows the last line end was never confirmed. Nothing is written past damage.
"""

import hashlib
import logging
import os
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec

from calib_core.errors import CalibrationError, InputError
from calib_core.json_forms import to_json
from calib_core.parsing import json_form
from cocalib.session.events import JournalStep, Step
from cocalib.session.file.guarded_folder import GuardedFolder, SessionFileError
from cocalib.session.file.identity import RecordingForm

JOURNAL, COPY = "journal.jsonl", "journal-copy.jsonl"
SCHEMA = "cocalib/session-2"
_DIGITS = 16
_BEFORE, _AFTER = b',"sum":"', b'"}'
_SUM_LENGTH = len(_BEFORE) + _DIGITS + len(_AFTER)
_STEPS_PER_FLUSH = 10
_log = logging.getLogger(__name__)


class _Head(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The first line."""

    schema: str
    cocalib: str
    recording: RecordingForm


class _Version(msgspec.Struct, frozen=True):
    schema: str
    cocalib: str = ""


class Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Any other line: the number of a step, and the step."""

    n: int
    step: JournalStep


@dataclass(frozen=True, slots=True)
class SealedLine:
    """A line as found; whether its checksum is right depends on the line before.

    Attributes:
        content: the JSON object without the checksum.
        sum: the checksum that the line states; "" if it states none.
    """

    content: bytes
    sum: str

    def follows(self, previous: str) -> bool:
        """Return whether the checksum is right, if the line before states `previous`."""
        return self.sum != "" and self.sum == _checksum(previous, self.content)

    @property
    def written(self) -> bytes:
        """The line as it is written, with its line end."""
        return self.content[:-1] + _BEFORE + self.sum.encode() + _AFTER + b"\n"


def sealed(content: bytes, previous: str = "") -> SealedLine:
    """Calculate the checksum of a line.

    Args:
        content: a JSON object with at least one key.
        previous: checksum of the line before; "" for the first.
    """
    return SealedLine(content, _checksum(previous, content))


def taken_apart(line: bytes) -> SealedLine:
    """Separate a line's content from the checksum that it states."""
    end = line[-_SUM_LENGTH:]
    if len(line) <= _SUM_LENGTH or not (end.startswith(_BEFORE) and end.endswith(_AFTER)):
        return SealedLine(line, "")
    return SealedLine(line[:-_SUM_LENGTH] + b"}", end[len(_BEFORE) : -len(_AFTER)].decode("ascii", "replace"))


def _checksum(previous: str, content: bytes) -> str:
    return hashlib.sha256(previous.encode() + b"\n" + content).hexdigest()[:_DIGITS]


def first_line(recording: RecordingForm, *, cocalib: str) -> SealedLine:
    """Return the first line of a new journal.

    Args:
        recording: the recording it belongs to.
        cocalib: version of the program.
    """
    return sealed(msgspec.json.encode(_Head(SCHEMA, cocalib, recording)))


def bytes_of(lines: Sequence[SealedLine]) -> bytes:
    """Return the content of a journal with these lines."""
    return b"".join(line.written for line in lines)


def _content(number: int, step: Step) -> bytes:
    """Return a line without its checksum.

    Raises:
        TypeError: such a step is not journalled.
        ValueError: it could not be read again.
    """
    if not isinstance(step, JournalStep):
        raise TypeError(f"{type(step).__name__} is not journalled")
    content = msgspec.json.encode(Line(number, step), enc_hook=to_json)
    _step(content)
    return content


class Journal:
    """Appends steps to a journal and its copy; each is on the disk when the call returns, and has left the process twice.

    Attributes:
        lines: all of it.
    """

    def __init__(self, folder: GuardedFolder, lines: Sequence[SealedLine]) -> None:
        """Continue a journal; its copy is made, or made like it, if need be.

        Args:
            folder: where it is.
            lines: of the journal; what follows them in its file is removed.
        """
        self._folder = folder
        self.lines = list(lines)
        whole = bytes_of(lines)
        self._file: _OpenFile | None = _OpenFile(folder, JOURNAL, len(whole))
        self._copy: _OpenFile | None = None
        self._copied = len(lines)
        try:
            if folder.read(COPY) != whole:
                folder.replace(COPY, whole)
            self._copy = _OpenFile(folder, COPY, len(whole))
        except OSError as error:
            _log.warning("%s: the copy of the journal cannot be written: %s", folder.path / COPY, error.strerror)

    @property
    def steps(self) -> int:
        """How many steps it holds."""
        return len(self.lines) - 1

    def append(self, step: Step) -> None:
        """Write a step.

        Raises:
            SessionFileError: it could not be written completely, or the journal is not as it was left; the step is not in it.
        """
        path = self._folder.path / JOURNAL
        line = sealed(_content(self.steps + 1, step), self.lines[-1].sum)
        if self._file is None:
            raise SessionFileError(f"{path}: the session is closed; start the program again")
        try:
            if fault := self._file.fault():
                raise SessionFileError(
                    f"{path}: the change could not be saved and was not made: {fault}; put it back as it was and try again, "
                    "or stop the program: it then stores all clicks in another folder, and names it"
                )
            self._file.write(line.written, flush=True)
        except OSError as error:
            if self._file.is_lost:
                self._file = None
            raise SessionFileError(
                f"{path}: the change could not be saved and was not made: {error.strerror}; "
                "free some disk space or make the file writable again, then try again"
            ) from error
        self.lines.append(line)
        self._bring_copy_up_to_date(flush=self.steps % _STEPS_PER_FLUSH == 0)

    def _bring_copy_up_to_date(self, *, flush: bool) -> None:
        """Write to the copy what it lacks; the journal is complete without it, so a failure is only logged."""
        if self._copy is None:
            return
        fault = self._copy.fault()
        try:
            if not fault:
                self._copy.write(bytes_of(self.lines[self._copied :]), flush=flush)
                self._copied = len(self.lines)
        except OSError as error:
            fault = error.strerror or str(error)
        if fault:
            _log.warning("%s: the copy of the journal could not be written: %s", self._folder.path / COPY, fault)
        if self._copy.is_lost:
            self._copy = None

    def fault(self) -> str:
        """Read the journal, verify every line, and return what has happened to it; "" if it is as it was left."""
        return "it could no longer be written" if self._file is None else self._file.whole_fault(self.lines)

    def copy_fault(self) -> str:
        """Return the same of the copy, after writing to it what it lacks."""
        self._bring_copy_up_to_date(flush=True)
        return "it could no longer be written" if self._copy is None else self._copy.whole_fault(self.lines)

    def close(self) -> None:
        """Close both; nothing can be appended afterwards."""
        for file in (self._file, self._copy):
            if file is not None:
                file.close()
        self._file = self._copy = None


class _OpenFile:
    """A file that only this object writes, at its end."""

    def __init__(self, folder: GuardedFolder, name: str, length: int) -> None:
        self._folder, self._name, self._length = folder, name, length
        self._descriptor = folder.open(name, os.O_RDWR)
        try:
            self._truncate()
        except OSError:
            self.close()
            raise

    @property
    def is_lost(self) -> bool:
        """Whether a failed write could not even be taken back, so that nothing may follow it."""
        return self._descriptor < 0

    def write(self, data: bytes, *, flush: bool) -> None:
        """Append data.

        Raises:
            OSError: it could not be written, and was taken back.
        """
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
            if flush:
                os.fsync(self._descriptor)
        except OSError:
            try:
                self._truncate()
            except OSError:
                self.close()
            raise
        self._length += len(data)

    def fault(self) -> str:
        """Return what has happened to its place or its length since it was last written; "" if nothing."""
        if not self._folder.has(self._name, self._descriptor):
            return "the file, or its folder, was deleted, moved or replaced while the session was open"
        size = os.fstat(self._descriptor).st_size
        if size != self._length:
            return f"another program changed its length from {self._length} to {size} bytes"
        return ""

    def whole_fault(self, lines: Sequence[SealedLine]) -> str:
        """Return the same, and whether it still holds these lines."""
        if fault := self.fault():
            return fault
        is_same = self._folder.read_open(self._name, self._descriptor) == bytes_of(lines)
        return "" if is_same else "its content is no longer what was written"

    def close(self) -> None:
        """Close it."""
        descriptor, self._descriptor = self._descriptor, -1  # never closed twice: the number may be reused
        if descriptor >= 0:
            os.close(descriptor)

    def _truncate(self) -> None:
        """Truncate after the last complete line."""
        os.ftruncate(self._descriptor, self._length)
        os.lseek(self._descriptor, self._length, os.SEEK_SET)


@dataclass(frozen=True, slots=True)
class FoundJournal:
    """A journal, or its copy, as found on the disk.

    Attributes:
        recording: the recording it belongs to; None if the first line is damaged.
        head: its first line.
        lines: all lines after the first.
        proven: those of them that follow from the first line.
        faults: what is wrong with the first line and with the last line end, one phrase each.
        torn_bytes: length of what follows the last line end: a step that was being written when the process died.
    """

    recording: RecordingForm | None
    head: SealedLine
    lines: tuple[SealedLine, ...]
    proven: "tuple[ProvenLine, ...]"
    faults: tuple[str, ...]
    torn_bytes: int

    @property
    def sums(self) -> tuple[str, ...]:
        """The checksums of the first line and of the proven ones."""
        return (self.head.sum, *(one.line.sum for one in self.proven))

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps that are proven."""
        return tuple(one.step for one in self.proven)

    @property
    def doubtful(self) -> tuple[int, ...]:
        """The positions of the lines that are not proven."""
        return tuple(sorted(set(range(len(self.lines))) - {one.index for one in self.proven}))

    @property
    def is_sound(self) -> bool:
        """Whether all of it is proven, a torn last line aside."""
        return not self.faults and not self.doubtful

    def why(self, index: int) -> str:
        """Return why the line at a position is not proven."""
        line = self.lines[index]
        if not line.sum:
            return "it has no checksum"
        try:
            _step(line.content)
        except ValueError as error:
            return str(error)
        return "its checksum is wrong, or it does not follow the line before"


@dataclass(frozen=True, slots=True)
class ProvenLine:
    """A line that follows from those before it.

    Attributes:
        index: its position in the lines after the first.
        line: itself.
        step: what it holds.
    """

    index: int
    line: SealedLine
    step: Step


def read_journal(data: bytes, place: str) -> FoundJournal:
    """Take a journal apart and find out what of it is proven.

    Args:
        data: its bytes.
        place: its path, for messages.

    Raises:
        SessionFileError: it was written by a version with another format.
    """
    *raw, tail = data.split(b"\n")
    faults = []
    if tail and raw and taken_apart(tail[:-1]).follows(taken_apart(raw[-1]).sum):
        raw, tail = [*raw, tail[:-1]], b""  # a whole line whose line end was changed
        faults.append(f"the end of line {len(raw)} is damaged")
    head, why = _head(raw[0], place) if raw else (None, _no_line(data))
    if head is None:
        faults.insert(0, f"line 1 is damaged ({why})")
    first, *lines = [taken_apart(line) for line in raw] or [SealedLine(b"", "")]
    return FoundJournal(
        recording=head.recording if head else None,
        head=first,
        lines=tuple(lines),
        proven=following(lines, first.sum),
        faults=tuple(faults),
        torn_bytes=len(tail),
    )


def following(lines: Sequence[SealedLine], previous: str) -> tuple[ProvenLine, ...]:
    """Follow the chain from a checksum through the lines, leaving out those that do not belong to it."""
    found: list[ProvenLine] = []
    for index, line in enumerate(lines):
        if not (previous and line.follows(previous)):
            continue
        try:
            found.append(ProvenLine(index, line, _step(line.content)))
        except ValueError:
            break  # the checksum is right, so another version wrote it
        previous = line.sum
    return tuple(found)


def _no_line(data: bytes) -> str:
    return "it has no end" if data.strip(b"\0") else "it holds only zeros" if data else "the file is empty"


def _head(line: bytes, place: str) -> tuple[_Head | None, str]:
    """Return the first line, or why it is damaged.

    Raises:
        SessionFileError: it is in another version's format.
    """
    found = taken_apart(line)
    if found.sum and not found.follows(""):
        return None, "its checksum is wrong"
    try:
        written = json_form(found.content, _Version)
        if written.schema != SCHEMA:
            raise SessionFileError(
                f"{place}: written as '{written.schema}' by cocalib {written.cocalib}, but this version reads '{SCHEMA}'; "
                "open it with that version, or give another --session folder"
            )
        head = json_form(found.content, _Head)
    except InputError as error:
        return None, str(error)
    return (head, "") if found.sum else (None, "its checksum is missing")


def _step(content: bytes) -> Step:
    """Parse a step.

    Raises:
        ValueError: it is none.
    """
    try:
        return json_form(content, Line).step
    except CalibrationError as error:
        raise ValueError(str(error)) from error
