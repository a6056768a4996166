"""Decode messages in ROS 1 serialisation or CDR by walking through the definition.

NumPy reads a run of values at fixed offsets in a single call, so decoding a list of a thousand radar returns takes no
more Python code than a list of one.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NoReturn, TypeAlias

import numpy as np

from calib_core.arrays import Values
from calib_core.errors import MessageError
from calib_core.recordings.messages.definitions import PRIMITIVES, Definition, Field

Value: TypeAlias = "int | float | str | Message | np.ndarray | list[Any]"
_STRINGS = ("string", "wstring")
Place: TypeAlias = tuple[str, str, int]
"""Dotted name, NumPy format without byte order, byte offset of one number."""


@dataclass(frozen=True, slots=True, eq=False)
class Message:
    """A decoded message: values by field name. Lists of fixed-size messages are structured arrays."""

    type: str
    values: Mapping[str, Value]

    def __contains__(self, name: str) -> bool:
        return name in self.values

    def __getitem__(self, name: str) -> Value:
        return self.values[name]

    def whole(self, name: str) -> int:
        """Return an integer field."""
        value = self._field(name)
        return value if isinstance(value, int) else self._refuse(name, "an integer")

    def text(self, name: str) -> str:
        """Return a string field."""
        value = self._field(name)
        return value if isinstance(value, str) else self._refuse(name, "a string")

    def message(self, name: str) -> "Message":
        """Return a nested message."""
        value = self._field(name)
        return value if isinstance(value, Message) else self._refuse(name, "a message")

    def array(self, name: str) -> np.ndarray:
        """Return an array of numbers as recorded."""
        value = self._field(name)
        return value if isinstance(value, np.ndarray) else self._refuse(name, "an array of numbers")

    def octets(self, name: str) -> np.ndarray:
        """Return an array of bytes."""
        value = self.array(name)
        return value.view(np.uint8) if value.dtype.itemsize == 1 or not len(value) else self._refuse(name, "bytes")

    def numbers(self, name: str, count: int) -> Values:
        """Return an array of the given number of numbers."""
        value = self.array(name)
        if len(value) != count or value.dtype.names is not None:
            self._refuse(name, f"{count} numbers")
        with np.errstate(invalid="ignore"):  # damaged bytes may hold signalling NaN
            return value.astype(np.float64)

    def messages(self, name: str) -> "list[Message]":
        """Return a list of messages of variable size; empty for any empty list."""
        value = self._field(name)
        fits = isinstance(value, list) and all(isinstance(element, Message) for element in value)
        return value if isinstance(value, list) and fits else self._refuse(name, "a list of messages")

    def count(self, name: str) -> int:
        """Return how many elements an array holds."""
        value = self._field(name)
        return len(value) if isinstance(value, list | np.ndarray) else self._refuse(name, "an array")

    def _field(self, name: str) -> Value:
        return self.values[name] if name in self.values else self._refuse(name, "a field of it")

    def _refuse(self, name: str, what: str) -> NoReturn:
        raise MessageError(f"a {self.type} message has a non-standard layout: {name} is not {what}; it cannot be used")

    def number(self, path: str) -> float:
        """Return a single number; path is a dotted name."""
        try:
            return float(_value_at(self, path.split(".")))
        except (KeyError, TypeError, ValueError):
            return self._refuse(path, "a number")

    def column(self, name: str, path: str) -> np.ndarray:
        """Return one number, or one fixed array, of each message in a list: (n,) or (n, k); path is a dotted name."""
        value = self._field(name)
        if isinstance(value, np.ndarray) and path in (value.dtype.names or ()):
            with np.errstate(invalid="ignore"):  # damaged bytes may hold signalling NaN
                return value[path].astype(np.float64)
        if not isinstance(value, list):
            self._refuse(name, f"a list with {path}")
        return np.array([_value_at(element, path.split(".")) for element in value], dtype=np.float64)


def _value_at(element: Any, parts: list[str]) -> Any:
    for part in parts:
        element = element[part]
    return element


def payload_byte_order(payload: bytes, definition: Definition) -> str:
    """Return the byte order that the message declares, "<" or ">".

    Raises:
        MessageError: the encapsulation is not plain CDR.
    """
    if definition.encoding == "ros1":
        return "<"
    if len(payload) < 4 or payload[0] != 0 or payload[1] not in (0, 1):
        raise MessageError(
            f"a {definition.type} message begins with {payload[:4].hex() or 'nothing'}, which is not plain CDR (0000 or 0001); "
            "record it with ROS 2's default serialisation"
        )
    return "<" if payload[1] else ">"


def decode(definition: Definition, payload: bytes) -> Message:
    """Decode one message.

    Raises:
        MessageError: the bytes do not fit the definition.
    """
    reader = _Reader(payload, payload_byte_order(payload, definition), definition)
    try:
        return reader.message(definition.type)
    except (struct.error, ValueError, UnicodeDecodeError) as error:
        raise _misfit(definition, payload, error) from error


def _misfit(definition: Definition, payload: bytes, error: Exception) -> MessageError:
    return MessageError(
        f"a {definition.type} message of {len(payload)} bytes does not fit its definition ({error}); "
        "it is damaged, or the recording contains the definition of another version"
    )


class _Reader:
    """A cursor over one message."""

    def __init__(self, data: bytes, order: str, definition: Definition) -> None:
        self.data = data
        self.order = order
        self.definition = definition
        self.aligned = definition.encoding == "cdr"
        self.origin = 4 if self.aligned else 0
        self.place = self.origin

    def align(self, size: int) -> None:
        if self.aligned:
            self.place += -(self.place - self.origin) % size

    def number(self, kind: str) -> Any:
        code = PRIMITIVES[kind]
        size = int(code[1])
        self.align(size)
        value = np.frombuffer(self.data, dtype=self.order + code, count=1, offset=self.place)[0].item()
        self.place += size
        return value

    def whole32(self) -> int:
        self.align(4)
        value: int = struct.unpack_from(self.order + "I", self.data, self.place)[0]
        self.place += 4
        return value

    def string(self, kind: str) -> str:
        length = self.whole32()
        size = length * (2 if kind == "wstring" else 1)
        raw = self.data[self.place : self.place + size]
        if len(raw) < size:
            raise ValueError(f"a string of {length} characters runs past the end")
        self.place += size
        if kind == "wstring":
            return raw.decode("utf-16-le" if self.order == "<" else "utf-16-be", "replace")
        return (raw[:-1] if self.aligned and raw.endswith(b"\0") else raw).decode("utf-8", "replace")

    def message(self, name: str) -> Message:
        return Message(name, {field.name: self.value(field) for field in self.definition.types[name]})

    def value(self, field: Field) -> Value:
        if field.count is not None:
            return self.array(field)
        if field.type in PRIMITIVES:
            number: Value = self.number(field.type)
            return number
        return self.string(field.type) if field.type in _STRINGS else self.message(field.type)

    def array(self, field: Field) -> Value:
        count = field.count or self.whole32()
        if count > len(self.data):
            raise ValueError(f"{field.name} claims {count} elements in a message of {len(self.data)} bytes")
        if not count:
            return np.zeros(0) if field.type in PRIMITIVES else []
        layout = element_layout(
            field.type, (self.place - self.origin) % 8, self.order, self.aligned, TypesKey(self.definition)
        )
        if layout is None:
            single = Field(field.name, field.type)
            return [self.value(single) for _ in range(count)]
        first = self.place + layout.lead_bytes
        values = np.ndarray((count,), layout.element, self.data, first, (layout.stride_bytes,))
        self.place = first + layout.stride_bytes * (count - 1) + layout.element.itemsize
        return values


@dataclass(frozen=True, slots=True)
class Pin:
    """Offset and value of a string's length; messages in which all of these are equal have the same layout."""

    offset: int
    length: bytes


def fixed_part(definition: Definition, payload: bytes) -> tuple[np.dtype[Any], tuple[Pin, ...]]:
    """Return the layout of the numbers after the header in this message, up to the first array of variable length.

    All messages whose string lengths match the pins have this layout.

    Raises:
        MessageError: the bytes do not fit the definition.
    """
    try:
        return _fixed_part(definition, payload)
    except (struct.error, ValueError) as error:
        raise _misfit(definition, payload, error) from error


def _fixed_part(definition: Definition, payload: bytes) -> tuple[np.dtype[Any], tuple[Pin, ...]]:
    reader = _Reader(payload, payload_byte_order(payload, definition), definition)
    first, *rest = definition.fields
    reader.value(first)
    places: list[Place] = []
    pins = [Pin(12, payload[12:16])] if first.type == "std_msgs/Header" else []
    end = reader.place
    for field in rest:
        if field.type == "string" and field.count is None:
            reader.align(4)
            pins.append(Pin(reader.place, payload[reader.place : reader.place + 4]))
            reader.value(field)
            continue
        begin = reader.place - reader.origin
        found, after, whole = walk(definition.types, (field,), begin, reader.aligned)
        places.extend((name, code, at + reader.origin) for name, code, at in found)
        reader.place = after + reader.origin
        end = reader.place if found else end
        if not whole:
            break
    return structure(places, reader.order, end), tuple(pin for pin in pins if pin.offset < end)


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
