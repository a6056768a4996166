"""Read a table of text: encoding, comments, separator, header, units and decimal commas, then the rows of the columns in use."""

import csv
import math
import re
from array import array
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO, TextIOWrapper
from itertools import islice
from operator import itemgetter
from os import SEEK_END
from pathlib import Path
from typing import BinaryIO

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import RecordingError
from calib_core.recordings.field_words import unit_of_word
from calib_core.recordings.plain_files.source import PlainOptions
from calib_core.recordings.plain_files.tables.times import TABLE_EXAMPLE, TimeReader, time_name
from calib_core.recordings.radar.column_guess import table_meaning, unknown_unit

_SEPARATORS = (",", ";", "\t", "|", " ")
_HEAD_BYTES = 1 << 16
_HEADER_LINES = 60
_COMMENT = re.compile(r"\s*(?:#|%|//)")
_COMMA_NUMBER = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?|nan|[+-]?inf", re.IGNORECASE)
_SAMPLED_ROWS = 2000
_COMMENTS = ("#", "%")
_WORDS = {**dict.fromkeys(("", "-", "na", "n/a", "null", "none"), math.nan), "false": 0.0, "true": 1.0}
_SUSPECT = frozenset({"", " ", "\t", *_COMMENTS})
_WRITTEN_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|nan|[+-]?inf", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class TextTable:
    """How a text file is laid out as a table.

    Attributes:
        path: the file.
        encoding: for Python.
        separator: between cells; a space means any run of spaces.
        names: of the columns, as written; "1", "2", ... if there is no header.
        units: the words of a line of units under the header; () if there is none.
        skipped_lines: how many lines stand before the first row.
        decimal_comma: whether numbers are written as 1,5.
        first_row: cells of the first row; () if there is none.
        first_line: the first line of the file, for messages.
        headless: whether there is no header.
        content: of the file if it was read before, as of a pipe; None to read it as it is needed.
    """

    path: Path
    encoding: str
    separator: str
    names: tuple[str, ...]
    units: tuple[str, ...] = ()
    skipped_lines: int = 1
    decimal_comma: bool = False
    first_row: tuple[str, ...] = ()
    first_line: str = ""
    headless: bool = False
    content: bytes | None = None

    @contextmanager
    def rows(self) -> Iterator[Iterator[list[str]]]:
        """Open the file after its header, as a reader of cells whose line_num counts from there.

        Raises:
            RecordingError: the file cannot be read as text.
        """
        try:
            with TextIOWrapper(_open_text(self.path, self.content), self.encoding, newline="") as file:
                for _ in range(self.skipped_lines):
                    file.readline(_HEAD_BYTES)
                yield csv.reader(file, delimiter=self.separator, skipinitialspace=self.separator == " ")
        except (OSError, UnicodeError, csv.Error) as error:
            raise RecordingError(f"{self.path}: cannot be read as a table: {error}") from error


@dataclass(frozen=True, slots=True, eq=False)
class TableRows:
    """The rows of a table.

    Attributes:
        times_ns: (n,) their times, in the order of the file; 0 if none were asked for.
        values: (n, k) numbers of the columns in use, as written.
        is_cut_off: whether the file ends within a row, which is left out.
    """

    times_ns: TimesNs
    values: np.ndarray
    is_cut_off: bool = False


def _open_text(path: Path, content: bytes | None) -> BinaryIO:
    return path.open("rb") if content is None else BytesIO(content)


def open_text_table(path: Path, content: bytes | None = None) -> TextTable:
    """Find out how a text file is laid out.

    Args:
        path: of the file.
        content: of the file if it was read before.

    Raises:
        RecordingError: it is empty, or cannot be read.
    """
    try:
        with _open_text(path, content) as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from error
    encoding = _encoding(head)
    text = head.decode(encoding, errors="replace")
    if "\0" in text:
        raise RecordingError(
            f"{path}: has zero bytes between its characters, as damaged files have; copy it from its source again"
        )
    lines = text.splitlines()[: _HEADER_LINES + 3]
    if len(head) == _HEAD_BYTES and len(lines) == 1:
        raise RecordingError(f"{path}: the first line has more than {_HEAD_BYTES} bytes; it is not a table of text")
    place, separator = _header_place(lines)
    if place is None:
        return replace(_headless(path, encoding, lines), content=content)
    names = _cells(_COMMENT.sub("", lines[place], count=1) if _COMMENT.match(lines[place]) else lines[place], separator)
    below = [(at, _cells(lines[at], separator)) for at in range(place + 1, len(lines)) if _is_row(lines[at])]
    units: tuple[str, ...] = ()
    skipped = place + 1
    if below and _are_units(below[0][1]):
        units, skipped = below[0][1], below[0][0] + 1
        below = below[1:]
    first = below[0][1] if below else ()
    return TextTable(
        path, encoding, separator, names, units, skipped, separator in ";\t| " and _uses_commas(below), first,
        lines[place] if lines else "", content=content,
    )  # fmt: skip


def _encoding(head: bytes) -> str:
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if head[1:200:2].count(0) > len(head[:200]) // 4:
        return "utf-16-le"
    try:
        head[: len(head) - 4 if len(head) == _HEAD_BYTES else None].decode("utf-8")
    except UnicodeDecodeError as error:
        return "utf-8-sig" if len(head) - error.start < 4 and len(head) == _HEAD_BYTES else "cp1252"
    return "utf-8-sig"


def _is_row(line: str) -> bool:
    return bool(line.strip()) and not _COMMENT.match(line)


def _cells(line: str, separator: str) -> tuple[str, ...]:
    row = next(
        csv.reader(
            [line.strip() if separator == " " else line], delimiter=separator, skipinitialspace=separator == " "
        ),
        [],
    )
    return tuple(cell.strip() for cell in row)


def _header_place(lines: Sequence[str]) -> tuple[int | None, str]:
    """Return the line and the separator with the most names of quantities; None if no line has two of them."""
    best: tuple[int, int | None, str] = (1, None, ",")
    for index, line in enumerate(lines[:_HEADER_LINES]):
        bare = _COMMENT.sub("", line, count=1) if _COMMENT.match(line) else line
        for separator in _SEPARATORS:
            if separator not in bare:
                continue
            known = sum(1 for cell in _cells(bare, separator) if cell and is_known(cell))
            if known > best[0]:
                best = known, index, separator
    if best[1] is not None:
        return best[1], best[2]
    first = next((index for index, line in enumerate(lines) if _is_row(line)), None)
    if first is None or _looks_numeric(lines[first]):
        return None, ","
    return first, max(",;\t|", key=lines[first].count)


def _looks_numeric(line: str) -> bool:
    cells = [cell for cell in re.split(r"[,;\t| ]+", line.strip()) if cell]
    return bool(cells) and sum(1 for cell in cells if _NUMBER.fullmatch(cell)) > len(cells) / 2


def _headless(path: Path, encoding: str, lines: Sequence[str]) -> TextTable:
    first = next((index for index, line in enumerate(lines) if _is_row(line)), None)
    if first is None:
        raise RecordingError(
            f"{path}: the file is empty; the first line must name columns and units, such as {TABLE_EXAMPLE}"
        )
    line = lines[first]
    separator = next((mark for mark in ";\t|," if mark in line), " ")
    row = _cells(line, separator)
    names = tuple(str(number) for number in range(1, len(row) + 1))
    comma = separator in ";\t|" and _uses_commas([(first, row)])
    return TextTable(path, encoding, separator, names, (), first, comma, row, line, headless=True)


def _are_units(cells: Sequence[str]) -> bool:
    """Return whether a line holds units: words and no number."""
    words = [cell.strip("[]() ") for cell in cells]
    return any(words) and not any(re.search(r"\d", word) and not word.startswith("m") for word in words) and all(
        len(word) <= 12 for word in words
    ) and any(_known_unit(word) for word in words if word)  # fmt: skip


def is_known(cell: str) -> bool:
    """Return whether a cell is the name of a quantity or of a time."""
    return time_name(cell) is not None or table_meaning(cell) is not None or unknown_unit(cell) is not None


def _known_unit(word: str) -> bool:
    unit = unit_of_word(word)
    return unit is not None and unit.dimension != "level"


def _uses_commas(rows: Sequence[tuple[int, Sequence[str]]]) -> bool:
    cells = [cell for _, row in rows for cell in row]
    return any(_COMMA_NUMBER.fullmatch(cell) for cell in cells) and not any(
        re.fullmatch(r"[+-]?\d+\.\d+", cell) for cell in cells
    )


def require_header(table: TextTable, options: PlainOptions) -> None:
    """Refuse a table without a header unless --map says which columns are which.

    Raises:
        RecordingError: there is neither.
    """
    if table.headless and not any(one.column.isdigit() for one in options.mapped):
        raise RecordingError(
            f"{table.path}: no header; the first line is '{table.first_line[:80].strip()}'; write one above it that names "
            f"columns and units, such as {TABLE_EXAMPLE}, or count the columns: --map time=1:s --map x=2:m --map y=3:m"
        )


def first_rows(table: TextTable) -> list[list[str]]:
    """Return the first rows."""
    with table.rows() as rows:
        return [row for row in islice(rows, _SAMPLED_ROWS) if _is_data(row)]


def read_cells(table: TextTable, index: int) -> list[str]:
    """Return the cells of one column, "" where a row is too short."""
    with table.rows() as rows:
        return [row[index].strip() if index < len(row) else "" for row in rows if _is_data(row)]


def _is_data(row: Sequence[str]) -> bool:
    return bool(row) and any(map(str.strip, row)) and not row[0].lstrip().startswith(_COMMENTS)


def read_rows(table: TextTable, places: Sequence[int], times: TimeReader | None) -> TableRows:
    """Read the rows; a last one that is cut off is left out.

    Raises:
        RecordingError: a row is damaged; the message names its line.
    """
    listed = any(_is_list(table.first_row[place]) for place in places if place < len(table.first_row))
    with table.rows() as rows:
        return _read_lists(table, places, times, rows) if listed else _read_numbers(table, places, times, rows)


def _read_numbers(
    table: TextTable, places: Sequence[int], times: TimeReader | None, rows: Iterator[list[str]]
) -> TableRows:
    stamps, values = array("q"), array("d")  # eight bytes per number; a Python list would take forty
    cells, comma, width = itemgetter(*places), table.decimal_comma, len(table.names)
    key = times.key if times else _no_time
    known, time = None, 0
    for number, row in enumerate(rows, start=table.skipped_lines + 1):
        if not row or (row[0][:1] in _SUSPECT and not _is_data(row)):
            continue
        try:
            if len(row) > width and any(map(str.strip, row[width:])):
                raise ValueError(f"{len(row)} values in {width} columns")
            if (text := key(row)) != known:
                known, time = text, times.read(text) if times else 0
            written = cells(row)
            try:
                numbers = list(map(float, written))
            except ValueError:
                numbers = [_number(cell.replace(",", ".") if comma else cell) for cell in written]
        except (ValueError, IndexError, OverflowError, RecordingError) as error:
            if _is_end(table, rows):
                return _rows(stamps, values, len(places), is_cut_off=True)
            raise _damage_error(table, number, error) from error
        stamps.append(time)
        values.extend(numbers)
    return _rows(stamps, values, len(places))


def _rows(stamps: "array[int]", values: "array[float]", width: int, *, is_cut_off: bool = False) -> TableRows:
    times_ns = np.array(stamps, dtype=np.int64)
    return TableRows(times_ns, np.array(values, dtype=np.float64).reshape(-1, width), is_cut_off)


def _is_end(table: TextTable, rows: Iterator[list[str]]) -> bool:
    """Return whether no row follows and the file does not end with a line feed: its writer was stopped within a row."""
    if next(rows, None) is not None:
        return False
    with _open_text(table.path, table.content) as file:
        file.seek(-2, SEEK_END)
        return b"\n" not in file.read()


def _no_time(_: Sequence[str]) -> object:
    return None


def _damage_error(table: TextTable, number: int, error: Exception) -> RecordingError:
    why = "too few columns" if isinstance(error, IndexError) else str(error)
    return RecordingError(f"{table.path}: line {number}: {why}; fix or remove the line")


def _number(text: str) -> float:
    word = text.strip().lower()
    return _WORDS[word] if word in _WORDS else float(text)


def _is_list(cell: str) -> bool:
    """Return whether a cell holds several numbers, such as [1.0, 2.0] or 1;2;3."""
    text = cell.strip()
    return text[:1] in ("[", "(", "{") or (
        len(_WRITTEN_NUMBER.findall(text)) > 1 and bool(re.search(r"[;|\s]", text)) and not re.search(r"[:/]", text)
    )


def _read_lists(
    table: TextTable, places: Sequence[int], times: TimeReader | None, rows: Iterator[list[str]]
) -> TableRows:
    """Read rows that hold a scan each: every column is a list of as many numbers, or one number for all returns."""
    stamps, values = array("q"), array("d")
    cells = itemgetter(*places)
    for number, split in enumerate(rows, start=table.skipped_lines + 1):
        if not _is_data(split):
            continue
        row = _join_cells(split, table.separator) if len(split) > len(table.names) else split
        try:
            lists = [_list(text) for text in cells(row)]
            count = max(map(len, lists))
            if any(len(one) not in (1, count) for one in lists):
                raise ValueError(f"lists of {' and '.join(str(len(one)) for one in lists)} numbers in one row")
            time = times.read(times.key(row)) if times else 0
        except (ValueError, IndexError, OverflowError, RecordingError) as error:
            if _is_end(table, rows):
                return _rows(stamps, values, len(places), is_cut_off=True)
            raise _damage_error(table, number, error) from error
        full = [one * count if len(one) == 1 else one for one in lists]
        stamps.extend([time] * count)
        values.extend(value for one in zip(*full, strict=True) for value in one)
    return _rows(stamps, values, len(places))


def _join_cells(row: Sequence[str], separator: str) -> list[str]:
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
