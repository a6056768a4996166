"""Results written by a later version and unknown to this one: found, kept, and put back when the file is written again."""

import json
from collections.abc import Iterator
from typing import Any

from calib_core.interchange.calibration_file import UnknownResult
from calib_core.interchange.syntax.strict_json import fields_of, item_type


def unknown_results(content: Any, document: Any) -> tuple[UnknownResult, ...]:
    """Return every key of parsed JSON that a document type does not have, at any depth.

    Args:
        content: parsed JSON that the type has accepted.
        document: the type to compare with.
    """
    return tuple(_unknown(content, document, ()))


def with_unknown(content: dict[str, Any], kept: tuple[UnknownResult, ...]) -> dict[str, Any]:
    """Put the unknown results back in their places; those whose place is gone are dropped."""
    for result in kept:
        owner: Any = content
        for step in result.place[:-1]:
            owner = _inside(owner, step)
        if isinstance(owner, dict):
            owner.setdefault(result.place[-1], json.loads(result.json_text))
    return content


def _unknown(value: Any, annotation: Any, place: tuple[str | int, ...]) -> Iterator[UnknownResult]:
    if isinstance(value, list):
        for index, item in enumerate(value):
            yield from _unknown(item, item_type(annotation), (*place, index))
    fields = fields_of(annotation)
    if not isinstance(value, dict) or fields is None:
        return
    for key, item in value.items():
        if key in fields:
            yield from _unknown(item, fields[key], (*place, key))
        else:
            yield UnknownResult((*place, key), json.dumps(item))


def _inside(owner: Any, step: str | int) -> Any:
    if isinstance(owner, dict):
        return owner.get(step)
    within = isinstance(owner, list) and isinstance(step, int) and step < len(owner)
    return owner[step] if within else None
