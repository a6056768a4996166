"""Chunked files that are being written: they only grow, and what has been read of them does not change."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.sources import MessageIndex
from calib_core.results import DataWarning

_REMEMBERED_BYTES = 64


class AppendedFile:
    """The part of a file that has been read, up to a position that only moves forward.

    Args:
        file: the file.
        place: the end of what has been read.
    """

    def __init__(self, file: FileBytes, place: int) -> None:
        self._file = file
        self.move_to(place)

    def look_again(self) -> bool:
        """Return whether the file has grown beyond what has been read.

        Raises:
            RecordingError: it has been truncated or overwritten.
        """
        self._file.look_again()
        if self._file.size_bytes < self.place:
            raise RecordingError(
                f"{self._file.path}: was truncated to {self._file.size_bytes} bytes after {self.place} bytes had been read; "
                "open the recording again"
            )
        if self._last_bytes() != self._before:
            raise RecordingError(
                f"{self._file.path}: was overwritten after {self.place} bytes had been read; open the recording again"
            )
        return self._file.size_bytes > self.place

    def move_to(self, place: int) -> None:
        """Move forward to the end of what has been read now."""
        self.place = place
        self._before = self._last_bytes()

    def _last_bytes(self) -> bytes:
        count = min(_REMEMBERED_BYTES, self.place)
        return self._file.up_to(self.place - count, count)


def with_messages(index: MessageIndex, found: Sequence[tuple[int, int, int]]) -> MessageIndex:
    """Return an index with further messages, as (receive time [ns], chunk, offset)."""
    new = np.array(found, dtype=np.int64)
    return index.followed_by(MessageIndex.sorted_from(new[:, 0], new[:, 1], new[:, 2]))


def damaged_chunks(path: Path, count: int, fault: str) -> tuple[DataWarning, ...]:
    """Warn about chunks that could not be read in full; empty if there are none.

    Args:
        path: of the file.
        count: number of these chunks.
        fault: what is wrong with the first of them.
    """
    if not count:
        return ()
    message = f"{path.name}: {count} of the chunks read so far {'are' if count > 1 else 'is'} damaged ({fault})"
    return (DataWarning("damaged-file", message, "check the disk of the recorder; what was read of them is used"),)
