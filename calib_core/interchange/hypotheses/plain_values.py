"""The values in a file of any syntax, npy among them: mappings, lists, text and arrays of numbers, whatever wrote them."""

import re
from collections.abc import Mapping
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.npy_file import is_npy, load_npy, load_npz

_MOST_NUMBERS = 64
_DEEPEST = 40
_MOST_ROWS = 10_000


def plain_values(content: Content, *, source: str) -> Any:
    """Return what a file contains: mappings, lists, text, numbers and arrays; None if there is nothing of the kind.

    Args:
        content: one reading of the file.
        source: the name of the file in error messages.

    Raises:
        InputError: an array in it is damaged, or is not of numbers.
    """
    if content.syntax == "archive":
        return load_npz(content.members, source=source)
    if content.syntax == "mat":
        return dict(content.variables)
    if content.syntax == "bytes":
        return load_npy(content.data, source=source) if is_npy(content.data) else None
    if content.syntax == "xml" and content.value is None:
        return {content.root.tag: _element(content.root)}
    return _rows(content.lines) if content.syntax == "lines" else content.value


def _element(element: Element, depth: int = 0) -> Any:
    """Return an element of XML as a mapping of its attributes and children, or as its text."""
    inner: dict[str, Any] = dict(element.attrib)
    for child in element if depth < _DEEPEST else ():
        value = _element(child, depth + 1)
        before = inner.get(child.tag)
        if before is None:
            inner[child.tag] = value
        else:
            inner[child.tag] = [*before, value] if isinstance(before, list) else [before, value]
    return inner or (element.text or "").strip()


def _rows(lines: tuple[str, ...]) -> Any:
    """Return lines of numbers as their rows, without a line of names above them; None if something else is among them."""
    if len(lines) > _MOST_ROWS:
        return None
    rows = [_text_numbers(line.partition("#")[0]) for line in lines]
    rows = rows[1:] if len(rows) > 1 and rows[0] is None and not re.search(r"\d", lines[0]) else rows
    return None if any(row is None for row in rows) else rows


def array_of(value: Any) -> np.ndarray | None:
    """Return the numbers of a value as an array without axes of length 1; None if it is anything else.

    Args:
        value: an array, a list, rows of lists, a text of numbers, or a matrix as OpenCV and ROS write it (rows, cols, data).
    """
    found = _numbers(value)
    if found is None or not 1 < found.size <= _MOST_NUMBERS:
        return None
    return np.squeeze(found)


def _numbers(value: Any, depth: int = 0) -> np.ndarray | None:
    if isinstance(value, np.ndarray):
        return value if value.dtype.kind == "f" else None
    if isinstance(value, str):
        return _text_numbers(value)
    if isinstance(value, Mapping) and "data" in value:
        return _shaped(_numbers(value["data"], depth + 1), value.get("rows"), value.get("cols"))
    if not isinstance(value, list | tuple) or len(value) > _MOST_NUMBERS or depth > 2:
        return None
    singles = [number_of(item) for item in value]
    if all(single is not None for single in singles):
        return np.array(singles, dtype=np.float64)
    rows = [_numbers(item, depth + 1) for item in value]
    if not rows or any(row is None or row.shape != rows[0].shape for row in rows if rows[0] is not None):
        return None
    return None if rows[0] is None else np.array(rows)


def number_of(value: Any) -> float | None:
    """Return a number, also one that is written as text or as an array of one; None if it is anything else."""
    if isinstance(value, np.ndarray):
        return float(value.ravel()[0]) if value.size == 1 and value.dtype.kind == "f" else None
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        return float(value)
    except (ValueError, OverflowError):
        return None


def _text_numbers(text: str) -> np.ndarray | None:
    words = text.translate(str.maketrans("[](),;", "      ")).split()
    if not 1 <= len(words) <= _MOST_NUMBERS:
        return None
    try:
        return np.array(words, dtype=np.float64)
    except ValueError:
        return None


def _shaped(numbers: np.ndarray | None, rows: Any, columns: Any) -> np.ndarray | None:
    """Return numbers in the rows and columns that a matrix states, if they fit."""
    height, width = number_of(rows), number_of(columns)
    if numbers is None or height is None or width is None or not height >= 1 or height * width != numbers.size:
        return numbers
    return numbers.reshape(int(height), -1) if height.is_integer() and width.is_integer() else numbers
