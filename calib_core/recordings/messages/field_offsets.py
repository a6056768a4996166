"""Offsets of the numbers in a message: runs at fixed offsets, which NumPy reads in a single call."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np

from calib_core.recordings.messages.definitions import PRIMITIVES, Definition, Field


@dataclass(frozen=True, slots=True, eq=False)
class ElementLayout:
    """Layout of an array of equal elements: padding before the first, one element, and the stride."""

    lead_bytes: int
    element: np.dtype[Any]
    stride_bytes: int


class TypesKey:
    """The types of a definition, hashed by identity so that layouts are computed once."""

    __slots__ = ("types",)

    def __init__(self, definition: Definition) -> None:
        self.types = definition.types

    def __hash__(self) -> int:
        return id(self.types)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TypesKey) and other.types is self.types


Place: TypeAlias = tuple[str, str, int]
"""Dotted name, NumPy format without byte order, byte offset of one number."""


@lru_cache(maxsize=512)
def element_layout(kind: str, phase: int, order: str, aligned: bool, types: TypesKey) -> ElementLayout | None:
    """Return the layout of an array whose first element may begin at phase (modulo 8); None if elements differ in size."""
    single = (Field("", kind),) if kind in PRIMITIVES else types.types.get(kind)
    if single is None:
        return None
    elements: list[list[Place]] = []
    end = phase
    for _ in range(3):
        places, after, whole = walk(types.types, single, end, aligned)
        if not whole or after == end:
            return None
        elements.append(places)
        end = after
    starts = [places[0][2] for places in elements]
    shapes = [
        [(name, code, at - start) for name, code, at in places] for places, start in zip(elements, starts, strict=True)
    ]
    stride = starts[1] - starts[0]
    if shapes[0] != shapes[1] or shapes[1] != shapes[2] or starts[2] - starts[1] != stride:
        return None
    extent = end - starts[2]
    element = np.dtype(order + PRIMITIVES[kind]) if kind in PRIMITIVES else structure(shapes[0], order, extent)
    return ElementLayout(starts[0] - phase, element, stride)


def walk(
    types: Mapping[str, tuple[Field, ...]], fields: tuple[Field, ...], place: int, aligned: bool, prefix: str = ""
) -> tuple[list[Place], int, bool]:
    """Record the offset of each number up to the first variable-size field; return offsets, end, and whether all were fixed."""
    places: list[Place] = []
    for field in fields:
        name = f"{prefix}{field.name}"
        if field.type in PRIMITIVES and field.count != 0:
            code = PRIMITIVES[field.type]
            place += -place % int(code[1]) if aligned else 0
            places.append((name, code if field.count is None else f"({field.count},){code}", place))
            place += int(code[1]) * (field.count or 1)
        elif field.type in types and field.count is None:
            inner, place, whole = walk(types, types[field.type], place, aligned, f"{name}.")
            places.extend(inner)
            if not whole:
                return places, place, False
        else:
            return places, place, False
    return places, place, True


def structure(places: list[Place], order: str, size: int) -> np.dtype[Any]:
    """Build a structured dtype whose field names are dotted."""
    formats = [code.replace(")", f"){order}") if ")" in code else order + code for _, code, _ in places]
    return np.dtype(
        {
            "names": [name for name, _, _ in places],
            "formats": formats,
            "offsets": [at for _, _, at in places],
            "itemsize": size,
        }
    )
