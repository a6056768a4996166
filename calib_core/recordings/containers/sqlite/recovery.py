"""Open SQLite databases safely: logs of killed recorders, truncated and damaged files, malicious contents."""

import shutil
import sqlite3
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import quote

import numpy as np

from calib_core.errors import RecordingError
from calib_core.measurements import DataWarning
from calib_core.recordings.containers.positioned_reads import FileBytes

_MAX_VALUE_BYTES = 1 << 28
_BATCH_ROWS = 20_000
_MAX_FAULTS = 4000
_SMALLEST_ROW_BYTES = 16
_NO_END = 1 << 63


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
        found = FoundRows(_joined(batches), strange=strange)
    except sqlite3.Error as error:
        fault = " ".join(str(error).split())
        found = _around_damage(connection, _last_row(connection, path), fault)
    found = replace(found, missed=max(0, _counted(connection) - len(found.columns) - found.strange))
    if (np.diff(found.columns[:, 2]) > 0).all():
        return found
    _, first = np.unique(found.columns[:, 2], return_index=True)
    return replace(found, columns=found.columns[np.sort(first)], repeated=len(found.columns) - len(first))


def _counted(connection: sqlite3.Connection) -> int:
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
            batches.append(np.fromiter(_flat(rows), dtype=np.int64, count=3 * len(rows)).reshape(-1, 3))
        except (TypeError, ValueError, OverflowError):
            good = [row for row in rows if all(type(value) is int for value in row)]
            strange += len(rows) - len(good)
            batches.append(np.array(good, dtype=np.int64).reshape(-1, 3))
    return batches, strange


def _flat(rows: list[tuple[int, int, int]]) -> Iterator[int]:
    for row in rows:
        yield from row


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


def about_rows(path: Path, found: FoundRows, unknown: int) -> list[DataWarning]:
    """Warn about what was lost in a database.

    Args:
        path: the file.
        found: its rows.
        unknown: number of rows of topics that the file does not describe.
    """
    lost = []
    if found.fault:
        where = ", ".join(_rows_text(low, high) for low, high in found.holes[:3])
        lost.append(
            f"it is damaged or truncated ({found.fault}): {len(found.columns)} messages were recovered; "
            + (
                f"rows {where}{', ...' if len(found.holes) > 3 else ''} are lost"
                if where
                else "none are known to be lost"
            )
        )
    if found.repeated:
        lost.append(
            f"{found.repeated} rows have the number of another row, so others are lost; each number is used once"
        )
    if found.missed and not found.holes:
        lost.append(f"{found.missed} rows that its index of times names are lost")
    if found.absent and not found.strange:
        where = ", ".join(_rows_text(low, high) for low, high in found.absent[:3])
        count = sum(high - low + 1 for low, high in found.absent)
        lost.append(
            f"{count} rows are absent ({where}{', ...' if len(found.absent) > 3 else ''}): they were deleted or are lost"
        )
    if found.strange:
        lost.append(f"{found.strange} rows without a time or a topic are skipped")
    if unknown:
        lost.append(f"{unknown} messages belong to topics that the file does not describe, and are skipped")
    if not lost:
        return []
    return [DataWarning("damaged-file", f"{path.name}: {'; '.join(lost)}", "copy the file again from its source")]
