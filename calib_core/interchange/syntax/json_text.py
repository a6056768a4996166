"""JSON out: the same value gives the same bytes, short things stay on one line, and what is not finite is null."""

import json
import math
from typing import Any

__all__ = ["json_text"]

_WIDTH = 118
_INDENT = "  "


def json_text(content: Any) -> str:
    """Write dicts, lists, strings and numbers as JSON that people can read and diff; ends with a line feed.

    Keys keep their order; floats are written by repr, so that they come back bit for bit.
    """
    return _lines(_finite(content), 0) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return value


def _lines(value: Any, depth: int) -> str:
    """Lay a value out: on one line where it fits, otherwise one entry a line. Long rows of numbers stay whole."""
    compact = json.dumps(value, allow_nan=False)
    whole = len(compact) + depth * len(_INDENT) <= _WIDTH or not isinstance(value, dict | list)
    if whole or (isinstance(value, list) and all(isinstance(item, int | float) for item in value)):
        return compact
    inner, outer = _INDENT * (depth + 1), _INDENT * depth
    if isinstance(value, dict):
        rows = [f"{json.dumps(key)}: {_lines(item, depth + 1)}" for key, item in value.items()]
        return "{\n" + ",\n".join(inner + row for row in rows) + f"\n{outer}}}"
    return "[\n" + ",\n".join(inner + _lines(item, depth + 1) for item in value) + f"\n{outer}]"
