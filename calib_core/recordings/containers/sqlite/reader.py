"""Read ROS 2 bags in SQLite (.db3), one message per row."""

import sqlite3
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from calib_core.errors import RecordingError
from calib_core.measurements import DataWarning
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.containers.compression import unpack_message
from calib_core.recordings.containers.index_cache import cache_of, heads_from, keep_heads
from calib_core.recordings.containers.sources import Channel, Heads, MessageIndex, StoredChannel
from calib_core.recordings.containers.sqlite.recovery import (
    FoundRows,
    about_rows,
    connect,
    damaged_database,
    first_rows,
    scan_rows,
)

if TYPE_CHECKING:
    from calib_core.recordings.containers.positioned_reads import FileBytes

MAGIC = b"SQLite format 3\0"
_FORMATS = {"ros2msg": "msg", "ros2idl": "idl"}
_QUALITY = "offered_qos_profiles"
_SMALL_BYTES = 4096
_QUERY_ROWS = 20_000


class SqliteSource:
    """One .db3 file.

    Args:
        file: the file; only its path and size are used, since SQLite reads it itself.
        packed: each message is a separate Zstandard frame (compression_mode: MESSAGE in metadata.yaml).
        first_rows: read only this many rows, and refuse damaged ones; None reads all.
    """

    def __init__(self, file: "FileBytes", *, packed: bool = False, first_rows: int | None = None) -> None:
        self.path, self.size_bytes = file.path, file.size_bytes
        self.warnings: tuple[DataWarning, ...] = file.warnings
        self._file = file
        self._packed = packed
        self._first_rows = first_rows
        self._lock = threading.Lock()
        self._indexes: dict[int, MessageIndex] | None = None
        self._until_closed = ExitStack()
        log = Path(f"{file.stored}-wal")
        self._kept = None if log.exists() and log.stat().st_size else cache_of(file)
        try:
            self._connect()
            self.channels: tuple[Channel, ...] = self._read_channels()
            if not self.channels:
                self.index(0)  # warns about messages of unknown topics
        except RecordingError:
            self._until_closed.close()
            raise

    def _connect(self) -> None:
        """Open the database, until the file is closed."""
        self._connection = connect(self._file, self._until_closed)
        self._until_closed.callback(self._connection.close)

    @contextmanager
    def _database(self) -> Iterator[sqlite3.Connection]:
        """Give the database to one thread at a time."""
        with self._lock:
            yield self._connection

    @property
    def counts(self) -> Mapping[int, int]:
        """Empty: a database does not store its number of rows."""
        return {}

    @property
    def assumptions(self) -> tuple[Assumption, ...]:
        """None: a ROS recording declares its fields."""
        return ()

    @property
    def later_warnings(self) -> tuple[DataWarning, ...]:
        """Empty: damage is found on opening, or in the messages themselves."""
        return ()

    @property
    def container(self) -> str:
        """The format and its compression."""
        return "ROS 2 SQLite, zstd" if self._packed else "ROS 2 SQLite"

    def _damaged(self, error: object) -> RecordingError:
        return damaged_database(self.path, error)

    def _rows(self, query: str, *values: Any) -> list[tuple[Any, ...]]:
        try:
            with self._database() as database:
                return database.execute(query, values).fetchall()
        except (sqlite3.Error, UnicodeDecodeError) as error:  # the latter if the message contains a damaged name
            raise self._damaged(error) from error

    def _read_channels(self) -> tuple[Channel, ...]:
        tables = {row[0] for row in self._rows("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not {"messages", "topics"} <= tables:
            raise RecordingError(
                f"{self.path}: an SQLite file without the tables of a ROS 2 bag (messages, topics); "
                "open a file written by ros2 bag record"
            )
        definitions = self._definitions() if "message_definitions" in tables else {}
        channels = []
        for number, topic, kind, encoding in self._rows("SELECT id, name, type, serialization_format FROM topics"):
            form, text = definitions.get(kind, ("", ""))
            form = form if text.strip() else ""
            channels.append(Channel(number, str(topic), str(kind), str(encoding), text, form))
        return tuple(channels)

    def _definitions(self) -> dict[Any, tuple[str, str]]:
        """Read the definitions; if they are damaged, well-known ones are used."""
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions ORDER BY id DESC"
        try:
            return {name: (_FORMATS.get(form, ""), str(text or "")) for name, form, text in self._rows(query)}
        except RecordingError as error:
            warning = DataWarning(
                "definitions-damaged",
                f"{self.path.name}: its message definitions cannot be read; well-known ones are used instead ({error})",
                "copy the file again from its source",
            )
            self.warnings = (*self.warnings, warning)
        return {}

    def stored_channels(self) -> Mapping[int, StoredChannel]:
        """Return the topics as stored, by number, with the quality of service that their publishers offered."""
        have = {row[1] for row in self._rows("PRAGMA table_info(topics)")}
        quality = dict(self._rows("SELECT id, offered_qos_profiles FROM topics")) if _QUALITY in have else {}
        languages = {form: language for language, form in _FORMATS.items()}
        found = {}
        for one in self.channels:
            notes = ((_QUALITY, str(quality[one.id])),) if quality.get(one.id) else ()
            language = languages.get(one.definition_format, "")
            definition = one.definition.encode() if language else b""
            found[one.id] = StoredChannel(one.topic, one.encoding, one.type, language, definition, notes)
        return found

    def index(self, channel_id: int) -> MessageIndex:
        """Return the locations of a channel's messages; SQLite scans the heads of all rows once, for all channels."""
        if self._indexes is None:
            found = self._all_rows()
            self._indexes = self._sorted(found.columns)
            known = {channel.id for channel in self.channels}
            unknown = sum(len(index) for number, index in self._indexes.items() if number not in known)
            self.warnings = (*self.warnings, *about_rows(self.path, found, unknown))
        empty = np.zeros(0, dtype=np.int64)
        return self._indexes.get(channel_id, MessageIndex(empty, empty, empty))

    def _all_rows(self) -> FoundRows:
        """Return topic, time and number of every row, from the cache if possible."""
        if self._first_rows is not None:
            return self._beginning(self._first_rows)
        kept = self._kept.get("rows") if self._kept is not None else None
        if kept is not None and kept.keys() == {"columns"} and kept["columns"].dtype == np.int64:
            return FoundRows(kept["columns"].reshape(-1, 3))
        with self._database() as database:
            found = scan_rows(database, self.path)
        if self._kept is not None and not found.incomplete:
            self._kept.put("rows", {"columns": found.columns})
        return found

    def _beginning(self, count: int) -> FoundRows:
        try:
            with self._database() as database:
                return first_rows(database, count)
        except sqlite3.Error as error:
            raise self._damaged(error) from error

    def _sorted(self, columns: np.ndarray) -> dict[int, MessageIndex]:
        topics = columns[:, 0]
        zeros = np.zeros(len(columns), dtype=np.int64)
        return {
            int(number): MessageIndex.sorted_from(columns[rows, 1], columns[rows, 2], zeros[rows])
            for number in np.unique(topics)
            for rows in (np.flatnonzero(topics == number),)
        }

    def read(self, chunk: int, offset: int) -> bytes:
        """Read one whole message; chunk is its row."""
        rows = self._rows("SELECT data FROM messages WHERE id = ?", chunk)
        if not rows:
            raise self._damaged(f"row {chunk} is missing")
        if not isinstance(rows[0][0], bytes):
            raise self._damaged(f"row {chunk} contains no bytes")
        return self._unpacked(rows[0][0], chunk)

    def _unpacked(self, data: bytes, row: int) -> bytes:
        return unpack_message(data, where=f"{self.path}: row {row}") if self._packed else data

    def heads(self, index: MessageIndex, size: int, *, keep: bool = False) -> Heads:
        """Read the first bytes of many messages: short ones by query, long ones without their overflow pages."""
        cache = self._kept if keep else None
        kept = heads_from(cache, index, size)
        if kept is None:
            kept = self._read_heads(index, size)
            keep_heads(cache, index, size, kept)
        return kept

    def _read_heads(self, index: MessageIndex, size: int) -> Heads:
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
        """Read the heads of short messages, a range of rows per query; rows not found keep the length -1."""
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
                continue  # many rows of other topics in between: single reads are cheaper
            try:
                answer = self._rows(query, size, int(stretch[0]), int(stretch[-1]))
            except RecordingError:
                continue  # damaged somewhere: read one by one
            found = sorted(
                (row for row in answer if type(row[1]) is bytes), key=lambda row: row[0]
            )  # damage may disorder them
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
            with self._database() as database, database.blobopen("messages", "data", row, readonly=True) as blob:
                return blob.read(size), len(blob)
        except sqlite3.Error as error:
            raise self._damaged(error) from error

    def close(self) -> None:
        """Close the database."""
        with self._lock:
            self._until_closed.close()
        self._file.close()
