"""Write JSON: the same value gives the same bytes, short values stay on one line, non-finite numbers become null."""

import json
import math
from typing import Any

_WIDTH = 118
_INDENT = "  "


def json_text(content: Any) -> str:
    """Write dicts, lists, strings and numbers as JSON that is easy to read and diff; ends with a line feed.

    Keys keep their order; floats are written with repr, so they read back bit for bit.
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
    """Format a value on one line if it fits, otherwise one entry per line. Long lists of numbers are not broken."""
    compact = json.dumps(value, allow_nan=False)
    whole = len(compact) + depth * len(_INDENT) <= _WIDTH or not isinstance(value, dict | list)
    if whole or (isinstance(value, list) and all(isinstance(item, int | float) for item in value)):
        return compact
    inner, outer = _INDENT * (depth + 1), _INDENT * depth
    if isinstance(value, dict):
        rows = [f"{json.dumps(key)}: {_lines(item, depth + 1)}" for key, item in value.items()]
        return "{\n" + ",\n".join(inner + row for row in rows) + f"\n{outer}}}"
    return "[\n" + ",\n".join(inner + _lines(item, depth + 1) for item in value) + f"\n{outer}]"
