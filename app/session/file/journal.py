"""The journal: a first line that names the recording, then one line per step, only ever appended to.

A line counts once its line end is on the disk; what follows the last line end was never confirmed to anybody. Any other
damage is refused: the journal is not read past it, and nothing is written.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from app.session import History, RecordingFacts, Step, advance
from app.session.file.errors import SessionFileError
from app.session.file.identity import SCHEMA, RecordingForm, recording_form, require_same_recording
from app.session.file.step_json import StepForm, form_of_step, step_from_form
from app.whole_file import write_whole
from calib_core.errors import CalibrationError

__all__ = ["Journal", "Replayed", "begin_journal", "replay"]


class _Head(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    schema: str
    cocalib: str
    recording: RecordingForm


class _Line(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    n: int
    step: StepForm


@dataclass(frozen=True, slots=True)
class Replayed:
    """What a journal led to.

    Attributes:
        history: the session, with what can be undone and redone.
        steps: how many steps it holds.
        kept_bytes: its length up to the last line end.
        torn_bytes: what follows that: a step that was being written when the process died.
        radar_axes: what a person said about the radar's axes when the journal was begun.
    """

    history: History
    steps: int
    kept_bytes: int
    torn_bytes: int
    radar_axes: str | None


def begin_journal(path: Path, facts: RecordingFacts, steps: Sequence[Step], cocalib: str) -> None:
    """Make a journal, all at once.

    Args:
        path: where it goes.
        facts: the recording it belongs to.
        steps: what it holds from the beginning.
        cocalib: version of the program.

    Raises:
        OSError: it cannot be written.
    """
    lines: list[msgspec.Struct] = [_Head(SCHEMA, cocalib, recording_form(facts))]
    lines += [_Line(number, form_of_step(step)) for number, step in enumerate(steps, start=1)]
    write_whole(path, b"".join(msgspec.json.encode(line) + b"\n" for line in lines))


def replay(path: Path, facts: RecordingFacts) -> Replayed:
    """Live through a journal again.

    Raises:
        SessionFileError: it is damaged, of another version, or of another recording.
        OSError: it cannot be read.
    """
    data = path.read_bytes()
    kept_bytes = data.rfind(b"\n") + 1
    head, *lines = data[:kept_bytes].split(b"\n")
    recording = _head(head, path).recording
    require_same_recording(recording, facts, path.parent)
    history = History()
    for number, line in enumerate(lines[:-1], start=1):
        history = _replayed(history, line, number, path, facts)
    return Replayed(history, max(0, len(lines) - 1), kept_bytes, len(data) - kept_bytes, recording.radar_axes)


class Journal:
    """Appends steps to a journal; each is on the disk when the call returns."""

    def __init__(self, path: Path, replayed: Replayed) -> None:
        self._path = path
        self.steps = replayed.steps
        self._length = replayed.kept_bytes
        self._descriptor = os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0))
        self._cut()

    def append(self, step: Step) -> None:
        """Write a step.

        Raises:
            SessionFileError: it could not be written whole; the journal is as before.
        """
        self._write(msgspec.json.encode(_Line(self.steps + 1, form_of_step(step))))
        self.steps += 1

    def close(self) -> None:
        """Let go of the file; nothing can be appended any more."""
        descriptor, self._descriptor = self._descriptor, -1  # a number that is never a file: others reuse the old one
        if descriptor >= 0:
            os.close(descriptor)

    def _write(self, line: bytes) -> None:
        if self._descriptor < 0:
            raise SessionFileError(f"{self._path}: the session is closed, so the change was not made; start again")
        rest = memoryview(line + b"\n")
        try:
            if os.fstat(self._descriptor).st_nlink == 0:
                raise FileNotFoundError(2, "the file was deleted while the session was open")
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
            os.fsync(self._descriptor)
        except OSError as error:
            self._take_back()
            raise SessionFileError(
                f"{self._path}: the change could not be kept, so it was not made: {error.strerror}; "
                "make room or restore the folder, then do it again"
            ) from error
        self._length += len(line) + 1

    def _take_back(self) -> None:
        """Drop what a failed write left; where even that fails, write nothing more behind it."""
        try:
            self._cut()
        except OSError:
            self.close()

    def _cut(self) -> None:
        """Drop what follows the last whole line."""
        os.ftruncate(self._descriptor, self._length)
        os.lseek(self._descriptor, self._length, os.SEEK_SET)


def _head(line: bytes, path: Path) -> _Head:
    try:
        head = msgspec.json.decode(line, type=_Head)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise _damaged(path, 1, str(error)) from error
    if head.schema != SCHEMA:
        raise SessionFileError(
            f"{path}: written as '{head.schema}' by cocalib {head.cocalib}, this version reads '{SCHEMA}'; "
            "open it with that version, or give another --session folder"
        )
    return head


def _replayed(history: History, line: bytes, number: int, path: Path, facts: RecordingFacts) -> History:
    try:
        read = msgspec.json.decode(line, type=_Line)
        if read.n != number:
            raise _damaged(path, number + 1, f"step {read.n} stands where step {number} belongs")
        return advance(history, step_from_form(read.step), facts)
    except SessionFileError:
        raise
    except (msgspec.DecodeError, UnicodeDecodeError, CalibrationError) as error:
        raise _damaged(path, number + 1, str(error)) from error


def _damaged(path: Path, line: int, reason: str) -> SessionFileError:
    return SessionFileError(
        f"{path}: line {line} is damaged ({reason}); nothing was changed. To go on from the last snapshot beside it, "
        f"session.json, rename {path.name} and open the recording again; to begin anew, give another --session folder"
    )
