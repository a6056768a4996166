"""The journal: a first line that identifies the recording, then one line per step, only ever appended to.

A line counts once its line end is on the disk; what follows the last line end was never confirmed. Any other damage is an
error: the journal is not read past it, and nothing is written.
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
    """The result of replaying a journal.

    Attributes:
        history: the session, with what can be undone and redone.
        steps: how many steps it holds.
        kept_bytes: its length up to the last line end.
        torn_bytes: length of what follows: a step that was being written when the process died.
        radar_axes: what the user specified about the radar's axes when the journal was started.
    """

    history: History
    steps: int
    kept_bytes: int
    torn_bytes: int
    radar_axes: str | None


def begin_journal(path: Path, facts: RecordingFacts, steps: Sequence[Step], cocalib: str) -> None:
    """Create a journal in one atomic write.

    Args:
        path: where it goes.
        facts: the recording it belongs to.
        steps: its initial steps.
        cocalib: version of the program.

    Raises:
        OSError: it cannot be written.
    """
    lines: list[msgspec.Struct] = [_Head(SCHEMA, cocalib, recording_form(facts))]
    lines += [_Line(number, form_of_step(step)) for number, step in enumerate(steps, start=1)]
    write_whole(path, b"".join(msgspec.json.encode(line) + b"\n" for line in lines))


def replay(path: Path, facts: RecordingFacts) -> Replayed:
    """Replay a journal.

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
            SessionFileError: it could not be written completely; the journal is unchanged.
        """
        self._write(msgspec.json.encode(_Line(self.steps + 1, form_of_step(step))))
        self.steps += 1

    def close(self) -> None:
        """Close the file; nothing can be appended afterwards."""
        descriptor, self._descriptor = self._descriptor, -1  # never a valid descriptor: the old number may be reused
        if descriptor >= 0:
            os.close(descriptor)

    def _write(self, line: bytes) -> None:
        if self._descriptor < 0:
            raise SessionFileError(f"{self._path}: the session is closed and the change was not made; start again")
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
                f"{self._path}: the change could not be saved and was not made: {error.strerror}; "
                "free some disk space or restore the folder, then try again"
            ) from error
        self._length += len(line) + 1

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


def _head(line: bytes, path: Path) -> _Head:
    try:
        head = msgspec.json.decode(line, type=_Head)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise _damaged(path, 1, str(error)) from error
    if head.schema != SCHEMA:
        raise SessionFileError(
            f"{path}: written as '{head.schema}' by cocalib {head.cocalib}, but this version reads '{SCHEMA}'; "
            "open it with that version, or give another --session folder"
        )
    return head


def _replayed(history: History, line: bytes, number: int, path: Path, facts: RecordingFacts) -> History:
    try:
        read = msgspec.json.decode(line, type=_Line)
        if read.n != number:
            raise _damaged(path, number + 1, f"found step {read.n}, expected step {number}")
        return advance(history, step_from_form(read.step), facts)
    except SessionFileError:
        raise
    except (msgspec.DecodeError, UnicodeDecodeError, CalibrationError) as error:
        raise _damaged(path, number + 1, str(error)) from error


def _damaged(path: Path, line: int, reason: str) -> SessionFileError:
    return SessionFileError(
        f"{path}: line {line} is damaged ({reason}); nothing was changed. To continue from the last snapshot, session.json in "
        f"the same folder, rename {path.name} and open the recording again; to start over, give another --session folder"
    )
