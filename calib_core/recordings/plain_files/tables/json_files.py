"""Read radar returns from JSON: one return or one scan per line or array element, with nested objects and lists.

The messages that `rostopic echo` and `ros2 topic echo` write as text are read alike.
"""

import re
from array import array
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from calib_core.errors import InputError, RecordingError
from calib_core.input_files import other_kind
from calib_core.parsing import json_rows, json_value
from calib_core.recordings.plain_files.tables.text_tables import TableRows
from calib_core.recordings.plain_files.tables.times import TimeReader
from calib_core.recordings.radar.column_guess import table_meaning

_MAX_BYTES = 1 << 28
_SAMPLED_ROWS = 500
_LAST_BYTES = 1 << 20
_POINTS = ("position", "pos", "xyz", "point", "location", "coordinates")
_NOTHING = ("", "null", "none")
_ECHO = re.compile(r"\s*(?:---\s+)?[A-Za-z_]\w*:(?: .*)?\r?\n")
_ECHO_END = re.compile(r"^---\s*$", re.MULTILINE)
_DEEPEST_INDENT = 100


@dataclass(frozen=True, slots=True)
class JsonTable:
    """The returns of a JSON file as a table; see TextTable.

    Attributes:
        path: the file.
        names: of all fields of the first returns, nested ones dotted.
        sample: cells of the first rows.
        what: kind of file, for the list of files.
    """

    path: Path
    names: tuple[str, ...]
    sample: tuple[tuple[str, ...], ...]
    what: str = "radar JSON"

    @property
    def first_row(self) -> tuple[str, ...]:
        """Cells of the first row; () if there is none."""
        return self.sample[0] if self.sample else ()


def open_json_table(path: Path) -> JsonTable:
    """Find the fields of a JSON file's returns.

    Raises:
        RecordingError: it is not JSON, contains no objects, or is a file of clicks or results.
    """
    first = list(islice(_rows(path), _SAMPLED_ROWS))
    schema = first[0][1].get("schema", "") if first else ""
    if schema.startswith("cocalib/"):
        raise RecordingError(f"{path}: {other_kind(schema, 'a recording') or f'this is a {schema} file'}")
    names = tuple(dict.fromkeys(name for _, row in first for name in row))
    if not names:
        raise RecordingError(
            f"{path}: no objects with named numbers in it; write one object per line, such as "
            '{"time_ns": 1, "x_m": 2, "y_m": 3}'
        )
    what = "messages as text, as topic echo writes them" if is_echo(path) else "radar JSON"
    return JsonTable(path, names, tuple(tuple(row.get(name, "") for name in names) for _, row in first), what)


def read_json_rows(table: JsonTable, places: Sequence[int], times: TimeReader | None) -> TableRows:
    """Read the rows; a last line that is cut off is left out.

    Raises:
        RecordingError: a line is damaged; the message names it.
    """
    stamps, values = array("q"), array("d")
    for line, row in _rows(table.path):
        cells = [row.get(name, "") for name in table.names]
        try:
            numbers = [float("nan" if (cell := cells[place]).lower() in _NOTHING else cell) for place in places]
            stamps.append(times.read(times.key(cells)) if times else 0)
        except (ValueError, OverflowError, RecordingError) as error:
            raise RecordingError(f"{table.path}: line {line}: {error}; fix or remove the line") from error
        values.extend(numbers)
    numbers_of_rows = np.array(values, dtype=np.float64).reshape(-1, len(places))
    return TableRows(np.array(stamps, dtype=np.int64), numbers_of_rows, _is_cut_off(table.path))


def _is_cut_off(path: Path) -> bool:
    """Return whether the last line is not JSON and has no end: its writer was stopped within it."""
    with path.open("rb") as file:
        file.seek(max(path.stat().st_size - _LAST_BYTES, 0))
        end = file.read()
    last = end.rpartition(b"\n")[2]
    if is_echo(path):
        return not end.rstrip().endswith(b"---")
    if not last.strip() or path.suffix.lower() == ".json":
        return False
    try:
        return not json_value(last.decode("utf-8", "replace"), source=path.name)
    except InputError:
        return True


def _rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """Yield every return with its line (or element) number, as the text of its fields."""
    for number, record in _records(path):
        yield from ((number, row) for row in _rows_of(record, "", {}) if row)


def _records(path: Path) -> Iterator[tuple[int, Any]]:
    """Yield the lines of JSON lines, or the elements of an array, or one object."""
    try:
        if is_echo(path):
            yield from _echoed(path)
        elif path.suffix.lower() != ".json":
            yield from _lines(path)
        elif _begins_a_list(path):
            yield from enumerate(json_rows(path, source=str(path), numbers_as_text=True), start=1)
        else:
            yield from _object_or_lines(path)
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f"{path}: cannot be read as JSON: {error}") from error
    except InputError as error:
        raise RecordingError(str(error)) from None


def is_echo(path: Path) -> bool:
    """Return whether a file holds messages as `rostopic echo` writes them: fields by indentation, --- after each message."""
    with path.open("rb") as file:
        head = file.read(_LAST_BYTES).decode("utf-8", "replace")
    return _ECHO.match(head) is not None and _ECHO_END.search(head) is not None


def _echoed(path: Path) -> Iterator[tuple[int, Any]]:
    """Yield the messages with the line that each begins in; a last one without --- is left out, see _is_cut_off."""
    message: deque[tuple[int, str]] = deque()
    begin = 1
    with path.open(encoding="utf-8-sig") as file:
        for number, line in enumerate(file, start=1):
            text = line.strip()
            if text != "---":
                message.extend([(len(line) - len(line.lstrip()), text)] if text else [])
                continue
            if message:
                yield begin, _echoed_block(message, message[0][0], path)
            if message:
                raise RecordingError(
                    f"{path}: '{message[0][1][:40]}', above line {number}, is indented like nothing above it"
                )
            begin = number + 1


def _echoed_block(lines: deque[tuple[int, str]], indent: int, path: Path) -> Any:
    """Take the lines of one value, which are indented alike and followed by deeper ones: a list, an object or a number."""
    if indent > _DEEPEST_INDENT:
        raise RecordingError(f"{path}: '{lines[0][1][:40]}' is nested too deeply; is it the right file?")
    values: list[Any] = []
    fields: dict[str, Any] = {}
    while lines and lines[0][0] == indent:
        text = lines.popleft()[1]
        if text == "-" or text.startswith("- "):
            if text != "-":
                lines.appendleft((indent + 2, text[2:].strip()))
            values.append(_echoed_block(lines, lines[0][0], path) if lines and lines[0][0] > indent else "")
        elif key := re.match(r"([A-Za-z_]\w*):(?: +|$)", text):
            rest = text[key.end() :].strip()
            inner = lines[0] if lines and not rest else (-1, "")
            nested = inner[0] > indent or (inner[0] == indent and inner[1][:2] in ("-", "- "))
            fields[key[1]] = _echoed_block(lines, inner[0], path) if nested else _echoed_value(rest)
        else:
            return _echoed_value(text)
    return values or fields


def _echoed_value(text: str) -> Any:
    if text.startswith("[") and text.endswith("]"):
        return [part.strip() for part in text[1:-1].split(",")] if text[1:-1].strip() else []
    return text.strip("\"'")


def _begins_a_list(path: Path) -> bool:
    with path.open(encoding="utf-8-sig") as file:
        return file.read(_LAST_BYTES).lstrip().startswith("[")


def _object_or_lines(path: Path) -> Iterator[tuple[int, Any]]:
    text = path.read_text(encoding="utf-8-sig") if path.stat().st_size <= _MAX_BYTES else ""
    try:
        whole = json_value(text, source=str(path), numbers_as_text=True)
    except InputError as error:
        if text and not re.search(r"\}\s*\n", text):
            raise RecordingError(f"{error}; JSON lines, one object per line, are read in any size") from None
        yield from _lines(path)
    else:
        yield 1, whole


def _lines(path: Path) -> Iterator[tuple[int, Any]]:
    with path.open(encoding="utf-8-sig") as file:
        for number, line in enumerate(file, start=1):
            if line.strip():
                try:
                    yield number, json_value(line.rstrip(), source=f"{path}: line {number}", numbers_as_text=True)
                except InputError as error:
                    if number > 1 and not line.endswith("\n"):
                        return  # see _is_cut_off
                    raise RecordingError(f"{error}; fix or remove the line") from None


def _rows_of(value: Any, prefix: str, above: Mapping[str, str]) -> Iterator[dict[str, str]]:
    """Yield the returns in a value: the elements of its lists of objects, the entries of its lists, or itself."""
    if isinstance(value, list):
        value = {str(number): part for number, part in enumerate(value)}
    if not isinstance(value, dict):
        return
    single: dict[str, str] = {}
    lists: dict[str, list[Any]] = {}
    _sort_fields(value, prefix, single, lists)
    nested = {name: parts for name, parts in lists.items() if any(isinstance(part, dict | list) for part in parts)}
    if nested:
        inherited = {**single, **above}
        for name, parts in nested.items():
            for part in parts:
                yield from _rows_of(part, f"{name}.", inherited)
        return
    length = max((len(parts) for parts in lists.values()), default=0)
    full = {name: parts for name, parts in lists.items() if len(parts) == length}
    if not lists or any(map(_is_coordinate, single)):  # of one return: its lists are a covariance or the like
        yield {**single, **above}
        return
    for number in range(length):
        yield {**{name: _text(parts[number]) for name, parts in full.items()}, **single, **above}


@cache
def _is_coordinate(name: str) -> bool:
    meaning = table_meaning(name)
    return meaning is not None and meaning.quantity in ("x", "range")


def _sort_fields(value: Mapping[str, Any], prefix: str, single: dict[str, str], lists: dict[str, list[Any]]) -> None:
    """Sort the fields of an object into single values and lists; names of nested objects are dotted."""
    for key, part in value.items():
        name = f"{prefix}{key}"
        if isinstance(part, dict):
            _sort_fields(part, f"{name}.", single, lists)
        elif isinstance(part, list) and key.lower() in _POINTS and _is_point(part):
            single.update({f"{name}.{axis}": _text(number) for axis, number in zip("xyz", part, strict=False)})
        elif isinstance(part, list):
            lists[name] = part
        else:
            single[name] = _text(part)


def _is_point(part: Sequence[Any]) -> bool:
    return len(part) in (2, 3) and not any(isinstance(number, dict | list) for number in part)


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "1" if value else "0"
    return "" if value is None else str(value)
