"""Results that stay as they were read when a file is written again.

Results of a later version are unknown to this one. Results that follow from others are computed again with the last digit
that this processor gives, which need not be the one in the file.
"""

import json
import math
from collections.abc import Iterator
from typing import Any

from calib_core.interchange.calibration_file import KeptResult
from calib_core.interchange.syntax.strict_json import fields_of, item_type

_DERIVED = (
    ("camera_from_radar", "quaternion_wxyz"),
    ("radar_from_camera",),
    ("sigma",),
    ("pairs", "residual_px"),
    ("pairs", "distance_px"),
)
"""The keys of what follows from other results, without the indices of lists."""
_ROUNDING = 1e-9
"""How far rounding moves a derived number of 1 or less, at most; a larger difference means that what it follows from changed."""


def kept_results(content: Any, document: Any) -> tuple[KeptResult, ...]:
    """Return every key of parsed JSON that a document type does not have, at any depth, and every derived number.

    Args:
        content: parsed JSON that the type has accepted.
        document: the type to compare with.
    """
    return tuple(_kept(content, document, ()))


def with_kept(content: dict[str, Any], kept: tuple[KeptResult, ...]) -> dict[str, Any]:
    """Put results back in their places; those whose place is gone or whose number has changed are dropped."""
    for result in kept:
        owner: Any = content
        for step in result.place[:-1]:
            owner = _inside(owner, step)
        if isinstance(owner, dict):
            key, value = result.place[-1], json.loads(result.json_text)
            if key not in owner or _is_rounding(owner[key], value):
                owner[key] = value
    return content


def _kept(value: Any, annotation: Any, place: tuple[str | int, ...]) -> Iterator[KeptResult]:
    if isinstance(value, list):
        for index, item in enumerate(value):
            yield from _kept(item, item_type(annotation), (*place, index))
    fields = fields_of(annotation)
    if not isinstance(value, dict) or fields is None:
        return
    for key, item in value.items():
        inner = (*place, key)
        if key not in fields or (not isinstance(item, dict) and _is_derived(inner)):
            yield KeptResult(inner, json.dumps(item))
        else:
            yield from _kept(item, fields[key], inner)


def _is_derived(place: tuple[str | int, ...]) -> bool:
    keys = tuple(step for step in place if isinstance(step, str))
    return any(keys[: len(one)] == one for one in _DERIVED)


def _is_rounding(computed: Any, stated: Any) -> bool:
    """Return whether two values are the same numbers but for rounding."""
    if isinstance(computed, list | tuple) and isinstance(stated, list):
        return len(computed) == len(stated) and all(map(_is_rounding, computed, stated))
    both = isinstance(computed, float) and isinstance(stated, int | float)
    return both and math.isclose(computed, stated, rel_tol=_ROUNDING, abs_tol=_ROUNDING)


def _inside(owner: Any, step: str | int) -> Any:
    if isinstance(owner, dict):
        return owner.get(step)
    within = isinstance(owner, list) and isinstance(step, int) and step < len(owner)
    return owner[step] if within else None
