"""ROS 2 bags in SQLite (.db3): messages by row."""

import sqlite3
import threading
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
            columns = np.array(rows, dtype=np.int64).reshape(-1, 2)
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
        """Read the first bytes of many messages."""
        rows = np.zeros((len(index), size), dtype=np.uint8)
        lengths = np.zeros(len(index), dtype=np.int64)
        small = not self._packed and self._mean_bytes(index) < _SMALL_BYTES
        found = self._short_heads(index, size) if small else {}
        fault = ""
        for place, number in enumerate(index.chunk.tolist()):
            try:
                head, length = found[number] if number in found else self._head(number, size)
            except RecordingError as error:
                lengths[place], fault = -1, fault or str(error)
                continue
            rows[place, : len(head)] = np.frombuffer(head, dtype=np.uint8)
            lengths[place] = length
        return Heads(rows, lengths, fault)

    def _mean_bytes(self, index: MessageIndex) -> float:
        if not len(index):
            return 0.0
        some = index.chunk[:: max(1, len(index) // 20)].tolist()
        query = "SELECT length(data) FROM messages WHERE id = ?"
        return float(np.mean([row[0] or 0 for number in some for row in self._rows(query, number)] or [0]))

    def _short_heads(self, index: MessageIndex, size: int) -> dict[int, tuple[bytes, int]]:
        """Read the heads of short messages in one query per 100,000 rows."""
        found: dict[int, tuple[bytes, int]] = {}
        wanted = set(index.chunk.tolist())
        low, high = int(index.chunk.min()), int(index.chunk.max())
        query = (
            "SELECT id, substr(data, 1, ?), length(data) FROM messages WHERE id BETWEEN ? AND ? AND topic_id IN "
            "(SELECT topic_id FROM messages WHERE id = ?)"
        )
        for first in range(low, high + 1, 100_000):
            last = min(first + 99_999, high)
            for number, head, length in self._rows(query, size, first, last, low):
                if number in wanted:
                    found[number] = (head, length)
        return found

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
