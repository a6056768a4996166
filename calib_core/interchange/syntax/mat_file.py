"""A small reader for MATLAB's level 5 mat files: numbers, text and structs of them.

SciPy's reader is compiled and can crash on a damaged file, which must not happen with a file of unknown origin.
The layout is MathWorks' "MAT-File Format", level 5: elements of a tag (type, length) and data, padded to 8 bytes.
"""

import struct
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from calib_core.errors import InputError

_HEADER_BYTES = 128
_MAX_BYTES = 8 * 1024 * 1024
_MAX_DEPTH = 4
_MATRIX, _COMPRESSED = 14, 15
_NUMBERS = {
    1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8", 16: "u1", 17: "u2",
}  # fmt: skip
_STRUCT, _CHAR = 2, 4
_NUMERIC = range(6, 16)


class _LayoutError(ValueError):
    """The bytes do not follow the layout."""


@dataclass(frozen=True, slots=True)
class _Element:
    kind: int
    data: bytes


def load_mat(data: bytes, *, source: str) -> dict[str, Any]:
    """Return the variables of a mat file: arrays, text as str, and structs as dicts of them. Other variables are skipped.

    Raises:
        InputError: it is damaged, or not of level 5 (MATLAB: save with -v7 or -v6).
    """
    endian = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if endian is None:
        raise InputError(f"{source}: not a mat file of level 5; save it with -v7 or -v6")
    try:
        variables = {}
        for element in _elements(data[_HEADER_BYTES:], endian):
            name, value = _variable(_inflated(element, endian), endian, 0)
            if name and value is not None:
                variables[name] = value
        return variables
    except (_LayoutError, struct.error, zlib.error, UnicodeDecodeError, ValueError) as error:
        raise InputError(f"{source}: a damaged mat file ({error}); save it again") from None


def _elements(data: bytes, endian: str) -> list[_Element]:
    """Split bytes into elements; a small one has its data in the tag."""
    elements, at = [], 0
    while at + 8 <= len(data):
        kind, length = struct.unpack_from(f"{endian}II", data, at)
        if kind >> 16:
            kind, length = kind & 0xFFFF, kind >> 16
            start, after = at + 4, at + 8
        else:
            start = at + 8
            after = start + (length if kind == _COMPRESSED else (length + 7) // 8 * 8)
        if start + length > len(data) or (start == at + 4 and length > 4):
            raise _LayoutError(f"an element at byte {at} is longer than the file")
        elements.append(_Element(kind, data[start : start + length]))
        at = after
    return elements


def _inflated(element: _Element, endian: str) -> _Element:
    if element.kind != _COMPRESSED:
        return element
    inflater = zlib.decompressobj()
    data = inflater.decompress(element.data, _MAX_BYTES)
    if inflater.unconsumed_tail:
        raise _LayoutError("it unpacks to more data than a calibration contains")
    inner = _elements(data, endian)
    if len(inner) != 1 or inner[0].kind == _COMPRESSED:
        raise _LayoutError("a compressed element does not hold one variable")
    return inner[0]


def _variable(element: _Element, endian: str, depth: int) -> tuple[str, Any]:
    """Return a matrix element's name and value; None if its class is not supported."""
    if element.kind != _MATRIX or depth > _MAX_DEPTH:
        raise _LayoutError("a variable was expected")
    parts = _elements(element.data, endian)
    if len(parts) < 3:
        return "", None
    flags = struct.unpack_from(f"{endian}I", parts[0].data)[0]
    array_class = flags & 0xFF
    shape = tuple(int(n) for n in np.frombuffer(parts[1].data, f"{endian}i4"))
    name = parts[2].data.decode("ascii")
    if array_class == _STRUCT and shape == (1, 1):
        return name, _struct(parts[3:], endian, depth)
    if array_class == _CHAR and len(parts) > 3:
        return name, _text(parts[3], endian)
    if array_class in _NUMERIC and len(parts) > 3 and not flags & 0x0800:
        return name, _numbers(parts[3], endian).astype(np.float64).reshape(shape, order="F")
    return name, None


def _struct(parts: list[_Element], endian: str, depth: int) -> dict[str, Any]:
    if len(parts) < 2 or len(parts[0].data) < 4:
        raise _LayoutError("a struct has no field names")
    width = struct.unpack_from(f"{endian}i", parts[0].data)[0]
    names = parts[1].data
    if width < 1 or len(names) % width or len(names) // width != len(parts) - 2:
        raise _LayoutError("a struct's names and fields do not match")
    keys = [names[at : at + width].split(b"\0")[0].decode("ascii") for at in range(0, len(names), width)]
    values = [_variable(part, endian, depth + 1)[1] for part in parts[2:]]
    return {key: value for key, value in zip(keys, values, strict=True) if value is not None}


def _text(element: _Element, endian: str) -> str:
    if element.kind in (1, 2, 16):
        return element.data.decode("utf-8")
    return "".join(map(chr, _numbers(element, endian).astype(int).tolist()))


def _numbers(element: _Element, endian: str) -> np.ndarray:
    if element.kind not in _NUMBERS:
        raise _LayoutError(f"numbers of the unknown type {element.kind}")
    return np.frombuffer(element.data, f"{endian}{_NUMBERS[element.kind]}")
