"""Read ROS 2 bags in SQLite (.db3), one message per row."""

import re
import shutil
import sqlite3
import threading
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import quote

import numpy as np

from calib_core.errors import RecordingError
from calib_core.measurements import DataWarning
from calib_core.recordings.containers.compression import unpack_message
from calib_core.recordings.containers.index_cache import cache_of, heads_from, keep_heads
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.sources import Assumption, Channel, Heads, MessageIndex, StoredChannel

_MAX_VALUE_BYTES = 1 << 28
_BATCH_ROWS = 20_000
_MAX_FAULTS = 4000
_SMALLEST_ROW_BYTES = 16
_NO_END = 1 << 63
_NAME = re.compile(r"\w+/msg/\w+")
_USED = re.compile(r"^\s*(\w+(?:/\w+)?)", re.MULTILINE)
_LONGEST_DEFINITION_BYTES = 1 << 18


@dataclass(frozen=True, slots=True, eq=False)
class FoundRows:
    """The heads of all messages.

    Attributes:
        columns: (n, 3) topic, time [ns], row.
        holes: ranges of row numbers in damaged parts of the file; the end of the last may be unknown.
        strange: number of rows whose time or topic is not a number.
        fault: SQLite's error message for the damage; "" if there is none.
        repeated: number of rows with the number of another row, which a damaged table can contain.
        missed: number of rows that only the table's index of times names.
    """

    columns: np.ndarray
    holes: tuple[tuple[int, int], ...] = ()
    strange: int = 0
    fault: str = ""
    repeated: int = 0
    missed: int = 0

    @property
    def incomplete(self) -> bool:
        """Whether anything is damaged or lost."""
        return bool(self.fault or self.strange or self.repeated or self.missed or self.absent)

    @property
    def absent(self) -> tuple[tuple[int, int], ...]:
        """Ranges of row numbers before the last row that no row has, apart from the holes."""
        numbers = self.columns[:, 2]
        if len(numbers) and int(numbers.max()) == len(numbers):
            return ()  # they count from 1, and none is repeated
        numbers = np.unique(numbers)
        before = np.concatenate([[0], numbers[:-1]]) if len(numbers) else numbers
        places = np.flatnonzero(numbers - before > 1)
        gaps = [(int(before[place]) + 1, int(numbers[place]) - 1) for place in places.tolist()]
        return tuple(gap for gap in gaps if not any(low <= gap[0] and gap[1] <= high for low, high in self.holes))


def connect(file: FileBytes, until_closed: ExitStack) -> sqlite3.Connection:
    """Open a database read-only. A write-ahead log left by a killed recorder is always read too.

    If SQLite cannot read the log in place, on a read-only medium, database and log are copied first.

    Args:
        file: the database.
        until_closed: receives what must be cleaned up when the database is closed.

    Raises:
        RecordingError: SQLite refuses it.
    """
    log = Path(f"{file.stored}-wal")
    if not (log.exists() and log.stat().st_size):
        return open_database(file.path, file.stored, "mode=ro&immutable=1")
    connection = open_database(file.path, file.stored, "mode=ro")
    try:
        connection.execute("SELECT count(*) FROM sqlite_master").fetchall()
    except sqlite3.OperationalError:
        connection.close()
        return _copied(file, log, until_closed)
    except sqlite3.DatabaseError:
        pass  # damaged: reported when it is read
    return connection


def _copied(file: FileBytes, log: Path, until_closed: ExitStack) -> sqlite3.Connection:
    """Copy database and log to a writable folder, and open the copy."""
    folder = until_closed.enter_context(TemporaryDirectory(prefix="cocalib-", ignore_cleanup_errors=True))
    copy = Path(folder) / "copy.db3"
    try:
        shutil.copyfile(file.stored, copy)
        shutil.copyfile(log, f"{copy}-wal")
    except OSError as error:
        raise RecordingError(
            f"{file.path}: its -wal file can only be read in a writable folder, and copying both failed: "
            f"{error.strerror}; copy both files to a writable folder"
        ) from error
    return open_database(file.path, copy, "mode=ro")


def open_database(path: Path, stored: Path, mode: str) -> sqlite3.Connection:
    """Open a database that may be malicious.

    Args:
        path: as the user named it, for messages.
        stored: the file that holds it.
        mode: SQLite's parameters, such as "mode=ro".

    Raises:
        RecordingError: SQLite refuses it.
    """
    address = f"file:{quote(str(stored.resolve()))}?{mode}"
    try:
        connection = sqlite3.connect(address, uri=True, check_same_thread=False, isolation_level=None)
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _MAX_VALUE_BYTES)
        connection.execute("PRAGMA trusted_schema=OFF")
        connection.execute("PRAGMA writable_schema=ON")  # opens truncated files too; nothing is ever written
    except sqlite3.Error as error:
        raise damaged_database(path, error) from error
    connection.text_factory = lambda raw: raw.decode("utf-8", "replace")
    return connection


def damaged_database(path: Path, error: object) -> RecordingError:
    """Return the error for a database that SQLite cannot read."""
    why = " ".join(str(error).split())[:200]
    return RecordingError(
        f"{path}: not a readable ROS 2 SQLite bag ({why}); if the recorder was killed, keep the -wal file "
        "next to it in a writable folder; otherwise copy the file again"
    )


def first_rows(connection: sqlite3.Connection, count: int) -> FoundRows:
    """Read topic, time and number of the first count rows, and nothing after them.

    Raises:
        sqlite3.Error: they are damaged.
    """
    batches, strange = _batches(
        connection, "SELECT topic_id, timestamp, id FROM messages ORDER BY id LIMIT ?", (count,)
    )
    return FoundRows(_joined(batches), strange=strange)


def rows_after(connection: sqlite3.Connection, last: int) -> FoundRows:
    """Read topic, time and number of the rows after one, in order.

    Raises:
        sqlite3.Error: they are damaged.
    """
    query = "SELECT topic_id, timestamp, id FROM messages WHERE id > ? ORDER BY id"
    batches, strange = _batches(connection, query, (last,))
    return FoundRows(_joined(batches), strange=strange)


def scan_rows(connection: sqlite3.Connection, path: Path) -> FoundRows:
    """Read topic, time and number of every row, row by row around damaged pages.

    Args:
        connection: to the database.
        path: of the database; its size limits the number of rows.
    """
    try:
        batches, strange = _batches(connection, "SELECT topic_id, timestamp, id FROM messages", ())
        rows = FoundRows(_joined(batches), strange=strange)
    except sqlite3.Error as error:
        fault = " ".join(str(error).split())
        rows = _around_damage(connection, _last_row(connection, path), fault)
    rows = replace(rows, missed=max(0, _count_rows(connection) - len(rows.columns) - rows.strange))
    if (np.diff(rows.columns[:, 2]) > 0).all():
        return rows
    _, first = np.unique(rows.columns[:, 2], return_index=True)
    return replace(rows, columns=rows.columns[np.sort(first)], repeated=len(rows.columns) - len(first))


def _count_rows(connection: sqlite3.Connection) -> int:
    """Count the rows, which SQLite does in the table's smallest index; 0 if that is damaged."""
    try:
        return int(connection.execute("SELECT count(*) FROM messages").fetchone()[0])
    except sqlite3.Error:
        return 0


def _batches(connection: sqlite3.Connection, query: str, values: tuple[int, ...]) -> tuple[list[np.ndarray], int]:
    """Run a query; return its rows of integers, and the number of other rows."""
    batches, strange = [], 0
    cursor = connection.execute(query, values)
    while rows := cursor.fetchmany(_BATCH_ROWS):
        try:
            batches.append(np.fromiter(chain.from_iterable(rows), dtype=np.int64, count=3 * len(rows)).reshape(-1, 3))
        except (TypeError, ValueError, OverflowError):
            good = [row for row in rows if all(type(value) is int for value in row)]
            strange += len(rows) - len(good)
            batches.append(np.array(good, dtype=np.int64).reshape(-1, 3))
    return batches, strange


def _joined(batches: list[np.ndarray]) -> np.ndarray:
    return np.concatenate(batches) if batches else np.zeros((0, 3), dtype=np.int64)


def _last_row(connection: sqlite3.Connection, path: Path) -> int:
    try:
        last = connection.execute("SELECT max(id) FROM messages").fetchone()[0]
    except sqlite3.Error:
        last = None
    return last if isinstance(last, int) and last > 0 else path.stat().st_size // _SMALLEST_ROW_BYTES


def _around_damage(connection: sqlite3.Connection, last: int, fault: str) -> FoundRows:
    """Bisect failing ranges of rows until they are small, widest first, with a limited number of queries."""
    waiting = deque([(0, last)])
    batches: list[np.ndarray] = []
    holes: list[tuple[int, int]] = []
    strange = faults = 0
    while waiting:
        low, high = waiting.popleft()
        try:
            query = "SELECT topic_id, timestamp, id FROM messages WHERE id BETWEEN ? AND ?"
            found, odd = _batches(connection, query, (low, high))
            batches.extend(found)
            strange += odd
        except sqlite3.Error:
            faults += 1
            if low == high or faults > _MAX_FAULTS:
                holes.append((low, high))
                continue
            middle = (low + high) // 2
            waiting.extend([(low, middle), (middle + 1, high)])
    columns = _joined(batches)
    final = int(columns[:, 2].max(initial=0))
    merged = [(low, _NO_END if low > final else high) for low, high in _merged(holes)]
    return FoundRows(columns, tuple(merged), strange, fault)


def _merged(holes: list[tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    merged: list[tuple[int, int]] = []
    for low, high in sorted(holes):
        if merged and low == merged[-1][1] + 1:
            merged[-1] = (merged[-1][0], high)
        else:
            merged.append((low, high))
    return tuple(merged)


def _rows_text(low: int, high: int) -> str:
    return f"from {low} on" if high == _NO_END else str(low) if low == high else f"{low} to {high}"


def lost_row_warnings(path: Path, rows: FoundRows, unknown: int) -> list[DataWarning]:
    """Warn about what was lost in a database.

    Args:
        path: the file.
        rows: its rows.
        unknown: number of rows of topics that the file does not describe.
    """
    lost = []
    if rows.fault:
        where = ", ".join(_rows_text(low, high) for low, high in rows.holes[:3])
        lost.append(
            f"it is damaged or truncated ({rows.fault}): {len(rows.columns)} messages were recovered; "
            + (
                f"rows {where}{', ...' if len(rows.holes) > 3 else ''} are lost"
                if where
                else "none are known to be lost"
            )
        )
    if rows.repeated:
        lost.append(
            f"{rows.repeated} rows have the number of another row, so others are lost; each number is used once"
        )
    if rows.missed and not rows.holes:
        lost.append(f"{rows.missed} rows that its index of times names are lost")
    if rows.absent and not rows.strange:
        where = ", ".join(_rows_text(low, high) for low, high in rows.absent[:3])
        count = sum(high - low + 1 for low, high in rows.absent)
        lost.append(
            f"{count} rows are absent ({where}{', ...' if len(rows.absent) > 3 else ''}): they were deleted or are lost"
        )
    if rows.strange:
        lost.append(f"{rows.strange} rows without a time or a topic are skipped")
    if unknown:
        lost.append(f"{unknown} messages belong to topics that the file does not describe, and are skipped")
    if not lost:
        return []
    return [
        DataWarning.reported("damaged-file", f"{path.name}: {'; '.join(lost)}", "copy the file again from its source")
    ]


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

    def __init__(self, file: FileBytes, *, packed: bool = False, first_rows: int | None = None) -> None:
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
            if not text.strip():
                text = _definition_beside(self.path.parent, str(kind))
                form = "msg" if text else ""
            channels.append(Channel(number, str(topic), str(kind), str(encoding), text, form))
        return tuple(channels)

    def _definitions(self) -> dict[Any, tuple[str, str]]:
        """Read the definitions; if they are damaged, well-known ones are used."""
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions ORDER BY id DESC"
        try:
            return {name: (_FORMATS.get(form, ""), str(text or "")) for name, form, text in self._rows(query)}
        except RecordingError as error:
            warning = DataWarning.reported(
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
        for channel in self.channels:
            notes = ((_QUALITY, str(quality[channel.id])),) if quality.get(channel.id) else ()
            language = languages.get(channel.definition_format, "")
            definition = channel.definition.encode() if language else b""
            found[channel.id] = StoredChannel(
                channel.topic, channel.encoding, channel.type, language, definition, notes
            )
        return found

    def index(self, channel_id: int) -> MessageIndex:
        """Return the locations of a channel's messages; SQLite scans the heads of all rows once, for all channels."""
        if self._indexes is None:
            rows = self._all_rows()
            self._indexes = self._sorted(rows.columns)
            known = {channel.id for channel in self.channels}
            unknown = sum(len(index) for number, index in self._indexes.items() if number not in known)
            self.warnings = (*self.warnings, *lost_row_warnings(self.path, rows, unknown))
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
            rows = scan_rows(database, self.path)
        if self._kept is not None and not rows.incomplete:
            self._kept.put("rows", {"columns": rows.columns})
        return rows

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
        data = rows[0][0]
        return unpack_message(data, where=f"{self.path}: row {chunk}") if self._packed else data

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


def _definition_beside(folder: Path, kind: str) -> str:
    """Return the definition of a type and of those it uses, from files PACKAGE/msg/TYPE.msg beside a bag that has none."""
    texts: dict[str, str] = {}
    waiting = [kind]
    for name in waiting:
        text = "" if name in texts else _definition_text(folder, name, standard=name != kind)
        if text:
            texts[name] = text if name == kind else f"\n{'=' * 80}\nMSG: {name}\n{text}"
            used = (one if "/" in one else f"{name.partition('/')[0]}/{one}" for one in _USED.findall(text))
            waiting += sorted({one.replace("/", "/msg/") for one in used} - {*waiting})
    return "".join(texts.values())


def _definition_text(folder: Path, name: str, *, standard: bool) -> str:
    """Return a type's own file, or what every ROS 2 installs; "" if there is neither."""
    file = folder / f"{name}.msg"
    if _NAME.fullmatch(name) and file.is_file() and file.stat().st_size <= _LONGEST_DEFINITION_BYTES:
        return file.read_text("utf-8", errors="replace")
    if not standard:
        return ""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    return store.generate_msgdef(name, ros_version=2)[0] if name in store.types else ""
