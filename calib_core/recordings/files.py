"""Positioned reads of one file, safe from many threads, and its first bytes."""

import os
import threading
from pathlib import Path

from calib_core.errors import RecordingError

__all__ = ["FileBytes"]


class FileBytes:
    """One open file that is read by position; no two readers share a cursor.

    Memory maps are avoided on purpose: a recording cut short under a map kills the process.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = path.open("rb", buffering=0)
            self.size_bytes = os.fstat(self._file.fileno()).st_size
        except OSError as error:
            raise RecordingError(
                f"{path}: cannot be read: {error.strerror}; check the path and its permissions"
            ) from error
        self._lock = threading.Lock()

    def up_to(self, offset: int, size: int) -> bytes:
        """Read at most size bytes from offset; fewer where the file ends."""
        size = max(0, min(size, self.size_bytes - offset))
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
