"""The journal: a first line that identifies the recording, then one line per step, only ever appended to.

Every line ends with a checksum chained to the line before (`checksums`). A line counts once its line end is on the disk; what
follows the last line end was never confirmed. What breaks the chain is damage, and nothing is written past it.
"""

import os
from collections.abc import Sequence

import msgspec

from calib_core.measurements import time_to_json
from cocalib.session import JournalStep, Step
from cocalib.session.file.checksums import SealedLine, line_bytes, sealed
from cocalib.session.file.errors import SessionFileError
from cocalib.session.file.guarded_folder import GuardedFolder
from cocalib.session.file.identity import RecordingForm
from cocalib.session.file.journal_reading import JOURNAL, SCHEMA, Head, Line, read_journal


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
    contents = [msgspec.json.encode(Head(SCHEMA, cocalib, recording, continues))]
    contents += [_content(number, step) for number, step in enumerate(steps, start=1)]
    lines: list[SealedLine] = []
    for content in contents:
        lines.append(sealed(content, lines[-1].sum if lines else ""))
    folder.replace(JOURNAL, b"".join(line_bytes(line) + b"\n" for line in lines))
    return tuple(line.sum for line in lines)


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
            return "it could no longer be written"
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
                "free some disk space or make the file writable again, then try again"
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
    if not isinstance(step, JournalStep):
        raise TypeError(f"{type(step).__name__} is not journalled")
    return msgspec.json.encode(Line(number, step), enc_hook=time_to_json)
