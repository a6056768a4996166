"""Positioned reads of one file, safe from many threads, and its first bytes."""

import os
import re
import threading
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol

from calib_core.errors import RecordingError
from calib_core.results import DataWarning

__all__ = ["FileBytes", "FileStretch", "MemoryStretch", "Stretch"]

_BUFFER_BYTES = 1 << 20
_OVERLAP_BYTES = 64
_MAX_SEARCH_BYTES = 1 << 30


class FileBytes:
    """One open file that is read by position; no two readers share a cursor.

    Memory maps are avoided on purpose: a recording cut short under a map kills the process.

    Args:
        path: the file as a person knows it.
        stored: where its bytes really lie, such as an unpacked copy.
        folder: the temporary folder of that copy, removed on closing.
        warnings: what was found out about the file before it was opened.
    """

    def __init__(
        self,
        path: Path,
        *,
        stored: Path | None = None,
        folder: "TemporaryDirectory[str] | None" = None,
        warnings: tuple[DataWarning, ...] = (),
    ) -> None:
        self.path = path
        self.stored = stored or path
        self.warnings = warnings
        self._folder = folder
        try:
            self._file = self.stored.open("rb", buffering=0)
            if hasattr(os, "posix_fadvise"):  # what is read next is told by expect, not guessed
                os.posix_fadvise(self._file.fileno(), 0, 0, os.POSIX_FADV_RANDOM)
            self.size_bytes = os.fstat(self._file.fileno()).st_size
        except OSError as error:
            raise RecordingError(
                f"{path}: cannot be read: {error.strerror}; check the path and its permissions"
            ) from error
        self._lock = threading.Lock()

    def up_to(self, offset: int, size: int) -> bytes:
        """Read at most size bytes from offset; fewer where the file ends."""
        size = max(0, min(size, self.size_bytes - offset))
        offset = min(offset, self.size_bytes)  # one out of a damaged index may be more than the system takes
        try:
            if hasattr(os, "pread"):
                data = os.pread(self._file.fileno(), size, offset)
                while 0 < len(data) < size:  # one call gives 2 GiB at most
                    more = os.pread(self._file.fileno(), size - len(data), offset + len(data))
                    if not more:
                        break
                    data += more
                return data
            with self._lock:
                self._file.seek(offset)
                return self._file.read(size)
        except (OSError, ValueError) as error:
            raise RecordingError(
                f"{self.path}: reading at byte {offset} failed: {error}; is it still there?"
            ) from error

    def expect(self, places: Sequence[tuple[int, int]]) -> None:
        """Tell the system which small pieces, from here to there, are read next: a slow disk gets them all at once."""
        if hasattr(os, "posix_fadvise"):
            for begin, end in places:
                if 0 <= begin < end <= self.size_bytes:
                    os.posix_fadvise(self._file.fileno(), begin, end - begin, os.POSIX_FADV_WILLNEED)

    def at(self, offset: int, size: int) -> bytes:
        """Read exactly size bytes from offset.

        Raises:
            RecordingError: the file ends before.
        """
        data = self.up_to(offset, size)
        if len(data) != size:
            raise RecordingError(
                f"{self.path}: ends at byte {self.size_bytes}, but {size} bytes are expected at byte {offset}; "
                "the file is cut short: copy it again from its source"
            )
        return data

    def close(self) -> None:
        """Close the file; reading afterwards is an error."""
        self._file.close()
        if self._folder is not None:
            self._folder.cleanup()


class Stretch(Protocol):
    """Bytes that are walked over from front to back."""

    size: int

    def up_to(self, offset: int, size: int) -> bytes:
        """Return at most size bytes from offset."""
        ...

    def find(self, pattern: "re.Pattern[bytes]", start: int) -> int:
        """Return where the pattern is found next, -1 where it is not."""
        ...


class MemoryStretch:
    """Bytes in memory."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.size = len(data)

    def up_to(self, offset: int, size: int) -> bytes:
        """Return at most size bytes from offset."""
        return self.data[offset : offset + size]

    def find(self, pattern: "re.Pattern[bytes]", start: int) -> int:
        """Return where the pattern is found next, -1 where it is not."""
        found = pattern.search(self.data, start)
        return found.start() if found else -1


class FileStretch:
    """A part of a file, read about a megabyte at a time.

    Args:
        file: the file.
        start: where the part begins; offsets count from there.
        size: how long it is; cut where the file ends.
    """

    def __init__(self, file: FileBytes, start: int, size: int) -> None:
        self._file = file
        self._start = start
        self.size = max(0, min(size, file.size_bytes - start))
        self._buffer, self._place = b"", 0

    def up_to(self, offset: int, size: int) -> bytes:
        """Return at most size bytes from offset."""
        size = max(0, min(size, self.size - offset))
        if size > _BUFFER_BYTES // 4:
            return self._file.up_to(self._start + offset, size)
        if not self._place <= offset <= self._place + len(self._buffer) - size:
            self._place = offset
            self._buffer = self._file.up_to(self._start + offset, min(_BUFFER_BYTES, self.size - offset))
        return self._buffer[offset - self._place : offset - self._place + size]

    def find(self, pattern: "re.Pattern[bytes]", start: int) -> int:
        """Return where the pattern is found next; -1 where it is not within 1 GiB, or before the end."""
        for place in range(start, min(self.size, start + _MAX_SEARCH_BYTES), _BUFFER_BYTES):
            block = self._file.up_to(self._start + place, min(_BUFFER_BYTES + _OVERLAP_BYTES, self.size - place))
            if found := pattern.search(block):
                return place + found.start()
        return -1
