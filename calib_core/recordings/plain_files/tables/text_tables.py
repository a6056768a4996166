"""Read a table of text: its encoding, comments, separator, header, units and decimal commas, without knowing what it means."""

import csv
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import RecordingError
from calib_core.recordings.plain_files.tables.column_names import read_column_name

TABLE_EXAMPLE = "time_ns,x_m,y_m,z_m,doppler_mps,snr_db"
_SEPARATORS = (",", ";", "\t", "|", " ")
_HEAD_BYTES = 1 << 16
_HEADER_LINES = 60
_COMMENT = re.compile(r"\s*(?:#|%|//)")
_COMMA_NUMBER = re.compile(r"[+-]?\d+,\d+(?:[eE][+-]?\d+)?")
_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?|nan|[+-]?inf", re.IGNORECASE)


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

    @contextmanager
    def rows(self) -> Iterator[Iterator[list[str]]]:
        """Open the file after its header, as a reader of cells whose line_num counts from there.

        Raises:
            RecordingError: the file cannot be read as text.
        """
        try:
            with self.path.open(newline="", encoding=self.encoding) as file:
                for _ in range(self.skipped_lines):
                    file.readline(_HEAD_BYTES)
                yield _reader(file, self.separator)
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


def _reader(file: TextIO, separator: str) -> Iterator[list[str]]:
    return csv.reader(file, delimiter=separator, skipinitialspace=separator == " ")


def open_text_table(path: Path) -> TextTable:
    """Find out how a text file is laid out.

    Raises:
        RecordingError: it is empty, or cannot be read.
    """
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from error
    encoding = _encoding(head)
    text = head.decode(encoding, errors="replace")
    lines = text.splitlines()[: _HEADER_LINES + 3]
    if len(head) == _HEAD_BYTES and len(lines) == 1:
        raise RecordingError(f"{path}: the first line has more than {_HEAD_BYTES} bytes; it is not a table of text")
    place, separator = _header_place(lines)
    if place is None:
        return _headless(path, encoding, lines)
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
        lines[place] if lines else "",
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
    for place, line in enumerate(lines[:_HEADER_LINES]):
        bare = _COMMENT.sub("", line, count=1) if _COMMENT.match(line) else line
        for separator in _SEPARATORS:
            if separator not in bare:
                continue
            known = sum(1 for cell in _cells(bare, separator) if cell and read_column_name(cell) is not None)
            if known > best[0]:
                best = known, place, separator
    if best[1] is not None:
        return best[1], best[2]
    first = next((place for place, line in enumerate(lines) if _is_row(line)), None)
    if first is None or _looks_numeric(lines[first]):
        return None, ","
    return first, max(",;\t|", key=lines[first].count)


def _looks_numeric(line: str) -> bool:
    cells = [cell for cell in re.split(r"[,;\t| ]+", line.strip()) if cell]
    return bool(cells) and sum(1 for cell in cells if _NUMBER.fullmatch(cell)) > len(cells) / 2


def _headless(path: Path, encoding: str, lines: Sequence[str]) -> TextTable:
    first = next((place for place, line in enumerate(lines) if _is_row(line)), None)
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
    ) and any(read_column_name(f"x [{word}]") and _known_unit(word) for word in words if word)  # fmt: skip


def _known_unit(word: str) -> bool:
    return any(
        (found := read_column_name(f"{name} [{word}]")) and found.unit_is_known
        for name in ("x", "azimuth", "doppler", "time")
    )


def _uses_commas(rows: Sequence[tuple[int, Sequence[str]]]) -> bool:
    cells = [cell for _, row in rows for cell in row]
    return any(_COMMA_NUMBER.fullmatch(cell) for cell in cells) and not any(
        re.fullmatch(r"[+-]?\d+\.\d+", cell) for cell in cells
    )
