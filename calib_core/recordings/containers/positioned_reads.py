"""Thread-safe positioned reads of a file."""

import os
import re
import threading
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol

from calib_core.errors import RecordingError
from calib_core.measurements import DataWarning

_BUFFER_BYTES = 1 << 20
_OVERLAP_BYTES = 64
_MAX_SEARCH_BYTES = 1 << 30


class FileBytes:
    """One open file, read by position, without a shared cursor.

    Memory maps are avoided on purpose: truncating a mapped recording would kill the process.

    Args:
        path: the file as named by the user.
        stored: the file that holds its bytes, such as a decompressed copy.
        folder: the temporary folder of that copy, removed on closing.
        warnings: what was found about the file before it was opened.
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
            if hasattr(os, "posix_fadvise"):  # prefetching is controlled by expect, not guessed
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
        offset = min(offset, self.size_bytes)  # an offset from a damaged index may exceed the system's limit
        try:
            if hasattr(os, "pread"):
                data = os.pread(self._file.fileno(), size, offset)
                while 0 < len(data) < size:  # one call returns at most 2 GiB
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

    def look_again(self) -> None:
        """Take in the present size of a file that is being written."""
        self.size_bytes = os.fstat(self._file.fileno()).st_size

    def expect(self, places: Sequence[tuple[int, int]]) -> None:
        """Announce the next small reads (begin, end) to the system, so that a slow disk can fetch them together."""
        if hasattr(os, "posix_fadvise"):
            for begin, end in places:
                if 0 <= begin < end <= self.size_bytes:
                    os.posix_fadvise(self._file.fileno(), begin, end - begin, os.POSIX_FADV_WILLNEED)

    def at(self, offset: int, size: int) -> bytes:
        """Read exactly size bytes from offset.

        Raises:
            RecordingError: the file is too short.
        """
        data = self.up_to(offset, size)
        if len(data) != size:
            raise RecordingError(
                f"{self.path}: ends at byte {self.size_bytes}, but {size} bytes are expected at byte {offset}; "
                "the file is truncated: copy it again from its source"
            )
        return data

    def close(self) -> None:
        """Close the file; it cannot be read afterwards."""
        self._file.close()
        if self._folder is not None:
            self._folder.cleanup()


class Stretch(Protocol):
    """Bytes that are scanned from front to back."""

    size: int

    def up_to(self, offset: int, size: int) -> bytes:
        """Return at most size bytes from offset."""

    def find(self, pattern: "re.Pattern[bytes]", start: int) -> int:
        """Return where the pattern is found next, -1 where it is not."""


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
        start: position of the part; offsets count from there.
        size: its length, limited by the end of the file.
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
        """Return the offset of the next match of the pattern; -1 if there is none within 1 GiB or before the end."""
        for index in range(start, min(self.size, start + _MAX_SEARCH_BYTES), _BUFFER_BYTES):
            block = self._file.up_to(self._start + index, min(_BUFFER_BYTES + _OVERLAP_BYTES, self.size - index))
            if found := pattern.search(block):
                return index + found.start()
        return -1
