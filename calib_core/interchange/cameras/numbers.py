"""Numbers in a file's parsed values."""

from collections.abc import Mapping
from typing import Any

from calib_core.errors import InputError

_LARGEST = 1e9


def floats(value: Any, *, source: str, place: str, length: int | None = None) -> tuple[float, ...]:
    """Return the finite numbers in a list, a list of rows, or an OpenCV or ROS matrix, row by row.

    Raises:
        InputError: an entry is not a finite number, or there are too few or too many.
    """
    if isinstance(value, Mapping):
        value = value.get("data", ())
    flat: list[float] = []
    for item in value if isinstance(value, list | tuple) else [value]:
        for number in item if isinstance(item, list | tuple) else [item]:
            flat.append(_number(number, source=source, place=place))
    if length is not None and len(flat) != length:
        raise InputError(f"{source}: {place}: expected {length} numbers, found {len(flat)}; correct it")
    return tuple(flat)


def _number(value: Any, *, source: str, place: str) -> float:
    try:
        number = float("nan") if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not abs(number) <= _LARGEST:
        raise InputError(f"{source}: {place}: {str(value)[:60]!r} is not a valid number; correct it")
    return number
