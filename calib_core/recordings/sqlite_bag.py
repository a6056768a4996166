"""ROS 2 bags in SQLite (.db3): messages by row."""

import sqlite3
import threading
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.compression import unpack_message
from calib_core.recordings.sources import Channel, Heads, MessageIndex
from calib_core.results import Caution

if TYPE_CHECKING:
    from calib_core.recordings.files import FileBytes

__all__ = ["MAGIC", "SqliteSource"]

MAGIC = b"SQLite format 3\0"
_FORMATS = {"ros2msg": "msg", "ros2idl": "idl"}
_SMALL_BYTES = 4096
_QUERY_ROWS = 20_000


class SqliteSource:
    """One .db3 file.

    Args:
        file: the file; only its path and size are used, SQLite reads it by itself.
        packed: each message is a Zstandard frame of its own (compression_mode: MESSAGE in metadata.yaml).
    """

    def __init__(self, file: "FileBytes", *, packed: bool = False) -> None:
        self.path, self.size_bytes = file.path, file.size_bytes
        self.cautions: tuple[Caution, ...] = ()
        self._packed = packed
        self._lock = threading.Lock()
        file.close()
        self._connection = self._connect()
        self.channels: tuple[Channel, ...] = self._read_channels()

    @property
    def container(self) -> str:
        """Name the format and its compression."""
        return "ROS 2 SQLite, zstd" if self._packed else "ROS 2 SQLite"

    def _connect(self) -> sqlite3.Connection:
        """Open for reading only. A write-ahead log left by a killed recorder is read too, never passed over."""
        log = Path(f"{self.path}-wal")
        mode = "mode=ro" if log.exists() and log.stat().st_size else "mode=ro&immutable=1"
        address = f"file:{quote(str(self.path.resolve()))}?{mode}"
        try:
            connection = sqlite3.connect(address, uri=True, check_same_thread=False, isolation_level=None)
        except sqlite3.Error as error:
            raise self._damaged(error) from error
        connection.text_factory = lambda raw: raw.decode("utf-8", "replace")
        return connection

    def _damaged(self, error: object) -> RecordingError:
        why = " ".join(str(error).split())[:200]
        return RecordingError(
            f"{self.path}: not a readable ROS 2 SQLite bag ({why}); if the recorder was killed, keep the -wal file "
            "beside it in a writable folder; otherwise copy the file again"
        )

    def _rows(self, query: str, *values: Any) -> list[tuple[Any, ...]]:
        try:
            with self._lock:
                return self._connection.execute(query, values).fetchall()
        except (sqlite3.Error, UnicodeDecodeError) as error:  # the second where a damaged name is in the message
            raise self._damaged(error) from error

    def _read_channels(self) -> tuple[Channel, ...]:
        tables = {row[0] for row in self._rows("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not {"messages", "topics"} <= tables:
            raise RecordingError(
                f"{self.path}: an SQLite file without the tables of a ROS 2 bag (messages, topics); "
                "give a file that ros2 bag record wrote"
            )
        definitions: dict[Any, tuple[str, str]] = {}
        if "message_definitions" in tables:
            query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions ORDER BY id DESC"
            definitions = {name: (_FORMATS.get(form, ""), str(text or "")) for name, form, text in self._rows(query)}
        channels = []
        for number, topic, kind, encoding in self._rows("SELECT id, name, type, serialization_format FROM topics"):
            form, text = definitions.get(kind, ("", ""))
            form = form if text.strip() else ""
            channels.append(Channel(number, str(topic), str(kind), str(encoding), text, form))
        return tuple(channels)

    def index(self, channel_id: int) -> MessageIndex:
        """Tell where the messages of a channel lie: SQLite walks over all rows' heads once."""
        rows = self._rows("SELECT timestamp, id FROM messages WHERE topic_id = ?", channel_id)
        try:
            columns = np.fromiter(chain.from_iterable(rows), dtype=np.int64, count=2 * len(rows)).reshape(-1, 2)
        except (TypeError, ValueError, OverflowError) as error:
            raise self._damaged(f"a row without a time: {error}") from error
        return MessageIndex.sorted_from(columns[:, 0], columns[:, 1], np.zeros(len(columns), dtype=np.int64))

    def read(self, chunk: int, offset: int) -> bytes:
        """Read one message whole; chunk is its row."""
        rows = self._rows("SELECT data FROM messages WHERE id = ?", chunk)
        if not rows:
            raise self._damaged(f"row {chunk} is gone")
        if not isinstance(rows[0][0], bytes):
            raise self._damaged(f"row {chunk} holds no bytes")
        return self._unpacked(rows[0][0], chunk)

    def _unpacked(self, data: bytes, row: int) -> bytes:
        return unpack_message(data, where=f"{self.path}: row {row}") if self._packed else data

    def heads(self, index: MessageIndex, size: int) -> Heads:
        """Read the first bytes of many messages: short ones by query, long ones without their overflow pages."""
        rows = np.zeros((len(index), size), dtype=np.uint8)
        lengths = np.full(len(index), -1, dtype=np.int64)
        if not self._packed and len(index) > 1:
            self._fill_by_query(index, rows, lengths)
        fault = ""
        for place in np.flatnonzero(lengths < 0).tolist():
            try:
                head, length = self._head(int(index.chunk[place]), size)
            except RecordingError as error:
                fault = fault or str(error)
                continue
            rows[place, : len(head)] = np.frombuffer(head, dtype=np.uint8)
            lengths[place] = length
        return Heads(rows, lengths, fault)

    def _fill_by_query(self, index: MessageIndex, rows: np.ndarray, lengths: np.ndarray) -> None:
        """Read the heads of short messages, a stretch of rows per query; what is not found keeps the length -1."""
        size = rows.shape[1]
        order = np.argsort(index.chunk)
        numbers = index.chunk[order]
        query = (
            f"SELECT id, CASE WHEN length(data) <= {_SMALL_BYTES} THEN substr(data, 1, ?) END, length(data) "
            "FROM messages WHERE id BETWEEN ? AND ? ORDER BY id"
        )
        for first in range(0, len(numbers), _QUERY_ROWS):
            stretch = numbers[first : first + _QUERY_ROWS]
            if int(stretch[-1] - stretch[0]) > 4 * _QUERY_ROWS:
                continue  # many rows of other topics lie between: one by one is cheaper
            found = [row for row in self._rows(query, size, int(stretch[0]), int(stretch[-1])) if type(row[1]) is bytes]
            ids = np.fromiter((row[0] for row in found), dtype=np.int64, count=len(found))
            heads = np.frombuffer(b"".join(row[1].ljust(size, b"\0") for row in found), dtype=np.uint8).reshape(
                -1, size
            )
            sizes = np.fromiter((row[2] for row in found), dtype=np.int64, count=len(found))
            places = np.searchsorted(ids, stretch)
            there = np.flatnonzero(np.isin(stretch, ids))
            into = order[first : first + _QUERY_ROWS][there]
            rows[into], lengths[into] = heads[places[there]], sizes[places[there]]

    def _head(self, row: int, size: int) -> tuple[bytes, int]:
        """Read one message's first bytes without its overflow pages."""
        if self._packed:
            data = self.read(row, 0)
            return data[:size], len(data)
        try:
            with self._lock, self._connection.blobopen("messages", "data", row, readonly=True) as blob:
                return blob.read(size), len(blob)
        except sqlite3.Error as error:
            raise self._damaged(error) from error

    def close(self) -> None:
        """Close the database."""
        with self._lock:
            self._connection.close()
