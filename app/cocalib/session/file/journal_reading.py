"""Read a journal: take it apart, follow its chain of checksums, and say what is proven and what is not."""

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec

from calib_core.errors import CalibrationError
from calib_core.measurements import time_from_json
from cocalib.option_changes import kept_options
from cocalib.session import JournalStep, OptionsChanged, Step
from cocalib.session.file.checksums import SealedLine, taken_apart
from cocalib.session.file.errors import SessionFileError
from cocalib.session.file.identity import RecordingForm

JOURNAL = "journal.jsonl"
SCHEMA, SCHEMA_1 = "cocalib/session-2", "cocalib/session-1"
"""What is written, and what older versions wrote: lines without checksums."""


class Head(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """The first line; `continues` is the checksum of the snapshot it was started from."""

    schema: str
    cocalib: str
    recording: RecordingForm
    continues: str = ""


class _Version(msgspec.Struct, frozen=True):
    schema: str
    cocalib: str = ""


class Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Any other line: the number of a step, and the step."""

    n: int
    step: JournalStep


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


def _read(raw: Sequence[bytes], data: bytes, torn: int, place: str, *, damaged_end: bool = False) -> FoundJournal:
    head, why = _head(raw[0], place) if raw else (None, _no_line(data))
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


def _no_line(data: bytes) -> str:
    return "it has no end" if data.strip(b"\0") else "it holds only zeros" if data else "the file is empty"


def _read_1(head: Head, raw: Sequence[bytes], sound_bytes: int, torn: int) -> FoundJournal:
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


def _head(line: bytes, place: str) -> tuple[Head | None, str]:
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
        head = msgspec.json.decode(found.content, type=Head)
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
        read = msgspec.json.decode(content, type=Line, dec_hook=time_from_json)
        step: Step = read.step
        if isinstance(step, OptionsChanged):
            step = OptionsChanged.of(kept_options(step.options))
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
