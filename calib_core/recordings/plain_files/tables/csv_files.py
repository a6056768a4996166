"""Read radar returns from CSV and other text tables, whatever their column names, separators and units."""

import math
import re
from array import array
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from operator import itemgetter
from os import SEEK_END

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.plain_files.reading_options import PlainOptions
from calib_core.recordings.plain_files.tables.column_names import COLUMN_SPELLINGS, TIME_QUANTITIES
from calib_core.recordings.plain_files.tables.columns import TableColumns, units_of
from calib_core.recordings.plain_files.tables.text_tables import TABLE_EXAMPLE, TableRows, TextTable
from calib_core.recordings.plain_files.tables.times import TimeReader

CSV_EXAMPLE = TABLE_EXAMPLE
_SAMPLED_ROWS = 2000
_SHOWN_SPELLINGS = 18
_COMMENTS = ("#", "%")
_SUSPECT = frozenset({"", " ", "\t", *_COMMENTS})
_WRITTEN_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|nan|[+-]?inf", re.IGNORECASE)


def csv_columns() -> tuple[str, ...]:
    """Return the table rows of columns and units for the documentation."""
    rows = []
    for quantity, spellings in COLUMN_SPELLINGS.items():
        units = {"time": "ns, us, ms, s, or dates"}.get(quantity, "")
        if not units and quantity not in TIME_QUANTITIES:
            units = ", ".join(units_of(quantity))
        names = ", ".join(f"`{spelling}`" for spelling in spellings[:_SHOWN_SPELLINGS])
        rows.append(f"| {quantity} | {names} | {units} |")
    return tuple(rows)


def require_header(table: TextTable, options: PlainOptions) -> None:
    """Refuse a table without a header unless --map says which columns are which.

    Raises:
        RecordingError: there is neither.
    """
    if table.headless and not any(one.column.isdigit() for one in options.mapped):
        raise RecordingError(
            f"{table.path}: no header; the first line is '{table.first_line[:80].strip()}'; write one above it that names "
            f"columns and units, such as {CSV_EXAMPLE}, or count the columns: --map time=1:s --map x=2:m --map y=3:m"
        )


def first_rows(table: TextTable) -> list[list[str]]:
    """Return the first rows."""
    with table.rows() as rows:
        return [row for row in islice(rows, _SAMPLED_ROWS) if _is_data(row)]


def _is_data(row: Sequence[str]) -> bool:
    return bool(row) and any(map(str.strip, row)) and not row[0].lstrip().startswith(_COMMENTS)


def read_rows(table: TextTable, columns: TableColumns, times: TimeReader | None) -> TableRows:
    """Read the rows; a last one that is cut off is left out.

    Raises:
        RecordingError: a row is damaged; the message names its line.
    """
    listed = any(_is_list(table.first_row[c.place]) for c in columns.values if c.place < len(table.first_row))
    with table.rows() as rows:
        return _read_lists(table, columns, times, rows) if listed else _read_numbers(table, columns, times, rows)


def _read_numbers(
    table: TextTable, columns: TableColumns, times: TimeReader | None, rows: Iterator[list[str]]
) -> TableRows:
    stamps, values = array("q"), array("d")  # eight bytes per number; a Python list would take forty
    cells, comma = _cells_of(columns), table.decimal_comma
    key = times.key if times else _no_time
    known, time = None, 0
    for number, row in enumerate(rows, start=table.skipped_lines + 1):
        if not row or (row[0][:1] in _SUSPECT and not _is_data(row)):
            continue
        try:
            if (text := key(row)) != known:
                known, time = text, times.read(text) if times else 0
            written = cells(row)
            try:
                numbers = list(map(float, written))
            except ValueError:
                numbers = [_number(cell.replace(",", ".") if comma else cell) for cell in written]
        except (ValueError, IndexError, OverflowError, RecordingError) as error:
            if _is_end(table, rows):
                return _rows(stamps, values, columns, is_cut_off=True)
            raise _damaged(table, number, error) from error
        stamps.append(time)
        values.extend(numbers)
    return _rows(stamps, values, columns)


def _rows(
    stamps: "array[int]", values: "array[float]", columns: TableColumns, *, is_cut_off: bool = False
) -> TableRows:
    times_ns = np.array(stamps, dtype=np.int64)
    return TableRows(times_ns, np.array(values, dtype=np.float64).reshape(-1, len(columns.values)), is_cut_off)


def _is_end(table: TextTable, rows: Iterator[list[str]]) -> bool:
    """Return whether no row follows and the file does not end with a line feed: its writer was stopped within a row."""
    if next(rows, None) is not None:
        return False
    with table.path.open("rb") as file:
        file.seek(-2, SEEK_END)
        return b"\n" not in file.read()


def _no_time(_: Sequence[str]) -> object:
    return None


def _cells_of(columns: TableColumns) -> Callable[[Sequence[str]], Sequence[str]]:
    places = [column.place for column in columns.values]
    return itemgetter(*places)


def _damaged(table: TextTable, number: int, error: Exception) -> RecordingError:
    why = "too few columns" if isinstance(error, IndexError) else str(error)
    return RecordingError(f"{table.path}: line {number}: {why}; fix or remove the line")


def _number(text: str) -> float:
    return (
        math.nan
        if not text or text.isspace() or text.strip().lower() in ("-", "na", "n/a", "null", "none")
        else float(text)
    )


def _is_list(cell: str) -> bool:
    """Return whether a cell holds several numbers, such as [1.0, 2.0] or 1;2;3."""
    text = cell.strip()
    return text[:1] in ("[", "(", "{") or (
        len(_WRITTEN_NUMBER.findall(text)) > 1 and bool(re.search(r"[;|\s]", text)) and not re.search(r"[:/]", text)
    )


def _read_lists(
    table: TextTable, columns: TableColumns, times: TimeReader | None, rows: Iterator[list[str]]
) -> TableRows:
    """Read rows that hold a scan each: every column is a list of as many numbers, or one number for all returns."""
    stamps, values = array("q"), array("d")
    cells = _cells_of(columns)
    for number, split in enumerate(rows, start=table.skipped_lines + 1):
        if not _is_data(split):
            continue
        row = _joined(split, table.separator) if len(split) > len(table.names) else split
        try:
            lists = [_list(text) for text in cells(row)]
            count = max(map(len, lists))
            if any(len(one) not in (1, count) for one in lists):
                raise ValueError(f"lists of {' and '.join(str(len(one)) for one in lists)} numbers in one row")
            time = times.read(times.key(row)) if times else 0
        except (ValueError, IndexError, OverflowError, RecordingError) as error:
            if _is_end(table, rows):
                return _rows(stamps, values, columns, is_cut_off=True)
            raise _damaged(table, number, error) from error
        full = [one * count if len(one) == 1 else one for one in lists]
        stamps.extend([time] * count)
        values.extend(value for one in zip(*full, strict=True) for value in one)
    return _rows(stamps, values, columns)


def _joined(row: Sequence[str], separator: str) -> list[str]:
    """Join the cells of lists that are separated like the columns and not quoted."""
    joined: list[str] = []
    depth = 0
    for cell in row:
        if depth > 0:
            joined[-1] += separator + cell
        else:
            joined.append(cell)
        depth += cell.count("[") + cell.count("(") - cell.count("]") - cell.count(")")
    return joined


def _list(cell: str) -> list[float]:
    text = cell.strip().strip("[](){} ")
    if not text:
        return []
    words = [word for word in re.split(r"[,;|\s]+", text) if word]
    return [float(word) for word in words]
