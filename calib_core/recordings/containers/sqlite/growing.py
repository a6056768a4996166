"""Read ROS 2 bags in SQLite while they are being written, without holding the recorder up.

With a write-ahead log readers and the writer never wait for each other. Without one, a reader's lock can make the
recorder's next write fail, so such a file is refused. The database is open only while it is read: the recorder merges its log
when it closes the file, and cannot if somebody else has it open at that moment.
"""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.containers.compressed_files import packing_of
from calib_core.recordings.containers.kept_heads import KeptHeads
from calib_core.recordings.containers.sources import Heads, MessageIndex
from calib_core.recordings.containers.sqlite.reader import SqliteSource
from calib_core.recordings.containers.sqlite.recovery import open_database, rows_after
from calib_core.results import DataWarning

_LOOKS_AFTER_A_CHANGE = 5
_NOT_SEEN = (-1, -1)
_VERSIONS = slice(18, 20)
_LOGGED = b"\x02\x02"


class GrowingDatabase(SqliteSource):
    """A .db3 file that is still being written: the rows of finished transactions are indexed as they come."""

    def _connect(self) -> None:
        if self._file.up_to(0, 20)[_VERSIONS] != _LOGGED:
            raise RecordingError(
                f"{self.path}: is written without a write-ahead log, so reading it now could make the recorder lose messages; "
                "open it without --follow once it is complete, or record with the storage preset resilient, or as MCAP"
            )
        self._kept = None
        self._indexes = {}
        self._heads = KeptHeads(by_row=True)
        self._last_row, self._strange = 0, 0
        self._seen, self._looks = (_NOT_SEEN, _NOT_SEEN), _LOOKS_AFTER_A_CHANGE

    @contextmanager
    def _database(self) -> Iterator[sqlite3.Connection]:
        """Open the database, for one thread at a time, until it has been read; a file without a log does not change."""
        with self._lock:
            mode = "mode=ro" if self._log.exists() else "mode=ro&immutable=1"
            connection = open_database(self.path, self._file.stored, mode)
            try:
                yield connection
            finally:
                connection.close()

    @property
    def _log(self) -> Path:
        return Path(f"{self._file.stored}-wal")

    @property
    def is_complete(self) -> bool:
        """Whether the recorder has closed the database: it then removes the log."""
        return not self._log.exists()

    @property
    def later_warnings(self) -> tuple[DataWarning, ...]:
        """Rows that are not messages."""
        if not self._strange:
            return ()
        message = f"{self.path.name}: {self._strange} rows without a time or a topic are skipped"
        return (DataWarning("damaged-file", message, "check the disk of the recorder"),)

    def grow(self) -> int:
        """Index the messages that have been committed since; return how many there are."""
        self._file.look_again()
        self.size_bytes = self._file.size_bytes
        seen = (_state(self._file.stored), _state(self._log))
        self._looks = _LOOKS_AFTER_A_CHANGE if seen != self._seen else self._looks - 1
        self._seen = seen
        if self._looks < 0:
            return 0
        try:
            with self._database() as database:
                found = rows_after(database, self._last_row)
                last = database.execute("SELECT max(id) FROM messages").fetchone()[0] or 0
        except sqlite3.Error as error:
            raise self._damaged(error) from error
        if last < self._last_row:
            raise RecordingError(f"{self.path}: rows that had been read are gone; open the recording again")
        if not len(found.columns):
            return 0
        self._strange += found.strange
        self._add(found.columns)
        return len(found.columns)

    def _add(self, columns: np.ndarray) -> None:
        if not self._last_row:
            self._packed = self._packed or packing_of(self._first_message(int(columns[0, 2]))) is not None
        if not {channel.id for channel in self.channels} >= set(np.unique(columns[:, 0]).tolist()):
            self.channels = self._read_channels()
        assert self._indexes is not None
        for number, new in self._sorted(columns).items():
            self._indexes[number] = self.index(number).followed_by(new)
        self._last_row = int(columns[-1, 2])

    def _first_message(self, row: int) -> bytes:
        rows = self._rows("SELECT data FROM messages WHERE id = ?", row)
        return rows[0][0] if rows and isinstance(rows[0][0], bytes) else b""

    def heads(self, index: MessageIndex, size: int, *, keep: bool = False) -> Heads:
        """Read the first bytes of messages; those to be kept are read once while the file grows."""
        return self._heads.read(index, size, super().heads) if keep else super().heads(index, size)

    def renamed(self, path: Path) -> None:
        """Take note that the recorder has renamed the file."""
        self.path = self._file.path = self._file.stored = path


def _state(path: Path) -> tuple[int, int]:
    """Return size and modification time of a file; zeros if there is none."""
    try:
        stat = path.stat()
    except OSError:
        return 0, 0
    return stat.st_size, stat.st_mtime_ns
