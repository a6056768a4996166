"""Foxglove's own messages, in JSON or Protocol Buffers, as the ROS messages that say the same.

Protocol Buffers are decoded by the descriptor that the channel itself brings (a FileDescriptorSet): the numbers and types of its
fields. Nothing of a descriptor is executed, and messages are nested as deep as Foxglove's are, no deeper.
"""

import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, Any, Final, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta, Struct

from calib_core.errors import InputError, MessageError
from calib_core.parsing import json_form
from calib_core.recordings.containers.sources import Channel

Whole: TypeAlias = Annotated[int, Meta(ge=0, lt=1 << 32)]

_NUMBERS: Final = ("", "UINT8", "INT8", "UINT16", "INT16", "UINT32", "INT32", "FLOAT32", "FLOAT64")
"""Foxglove's types of numbers, in the order of their values."""
_IN_CLOUDS: Final = {
    "INT8": 1,
    "UINT8": 2,
    "INT16": 3,
    "UINT16": 4,
    "INT32": 5,
    "UINT32": 6,
    "FLOAT32": 7,
    "FLOAT64": 8,
}
STAMP_BYTES: Final = 12
HEAD_BYTES: Final = 96
"""Of a message: its stamp is among these, if it comes first."""
_STAMP_IN_JSON: Final = re.compile(
    rb'\s*\{\s*"timestamp"\s*:\s*\{\s*"sec"\s*:\s*(\d{1,10})\s*,\s*"nsec"\s*:\s*(\d{1,9})\s*\}'
)
_HOW: Final = "record it as JSON or protobuf, or convert its messages with flatc --json"


class _Time(Struct, frozen=True):
    sec: Whole = 0
    nsec: Whole = 0


class _Vector(Struct, frozen=True):
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class _Quaternion(Struct, frozen=True):
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


class _Pose(Struct, frozen=True):
    position: _Vector = _Vector()
    orientation: _Quaternion = _Quaternion()


class _Stamped(Struct, frozen=True):
    timestamp: _Time = _Time()
    frame_id: str = ""

    @property
    def header(self) -> bytes:
        return struct.pack("<III", 0, self.timestamp.sec, self.timestamp.nsec) + _string(self.frame_id)


class _CloudField(Struct, frozen=True):
    name: str = ""
    offset: Whole = 0
    type: int | str = 0

    @property
    def kind(self) -> str:
        if isinstance(self.type, str):
            return self.type
        return _NUMBERS[self.type] if 0 <= self.type < len(_NUMBERS) else ""


class _PointCloud(_Stamped, frozen=True):
    pose: _Pose | None = None
    point_stride: Whole = 0
    fields: list[_CloudField] = []
    data: bytes = b""

    @property
    def is_posed(self) -> bool:
        """Whether a pose leads from the points' own frame to the one that is named."""
        return self.pose not in (None, _Pose(), _Pose(orientation=_Quaternion(w=0.0)))

    @property
    def header(self) -> bytes:
        return _Stamped(self.timestamp, "" if self.is_posed else self.frame_id).header

    def ros(self) -> bytes:
        step = self.point_stride
        count = len(self.data) // max(step, 1)
        columns = [
            _string(one.name) + struct.pack("<IBI", one.offset, _IN_CLOUDS[one.kind], 1)
            for one in self.fields
            if one.kind in _IN_CLOUDS
        ]
        described = struct.pack("<III", 1, count, len(columns)) + b"".join(columns)
        rows = struct.pack("<BII", 0, step, step * count)
        return self.header + described + rows + _octets(self.data[: step * count]) + b"\1"


class _CompressedImage(_Stamped, frozen=True):
    data: bytes = b""
    format: str = ""

    def ros(self) -> bytes:
        return self.header + _string(self.format) + _octets(self.data)


class _RawImage(_Stamped, frozen=True):
    width: Whole = 0
    height: Whole = 0
    encoding: str = ""
    step: Whole = 0
    data: bytes = b""

    def ros(self) -> bytes:
        size = struct.pack("<II", self.height, self.width)
        return self.header + size + _string(self.encoding) + struct.pack("<BI", 0, self.step) + _octets(self.data)


class _CameraCalibration(_Stamped, frozen=True):
    width: Whole = 0
    height: Whole = 0
    distortion_model: str = ""
    D: list[float] = []
    K: Annotated[list[float], Meta(max_length=9)] = []
    R: Annotated[list[float], Meta(max_length=9)] = []
    P: Annotated[list[float], Meta(max_length=12)] = []

    def ros(self) -> bytes:
        padded = ((self.K, 9), (self.R, 9), (self.P, 12))
        fixed = [value for part, size in padded for value in (*part, *[0.0] * (size - len(part)))]
        lens = struct.pack("<I", len(self.D)) + np.array([*self.D, *fixed], dtype="<f8").tobytes()
        size = struct.pack("<II", self.height, self.width)
        return self.header + size + _string(self.distortion_model) + lens + struct.pack("<IIIIIIB", *[0] * 6, 0)


_Known: TypeAlias = type[_PointCloud | _CompressedImage | _RawImage | _CameraCalibration]
_SCHEMAS: Final[Mapping[str, tuple[str, _Known]]] = {
    "PointCloud": ("sensor_msgs/PointCloud2", _PointCloud),
    "CompressedImage": ("sensor_msgs/CompressedImage", _CompressedImage),
    "CompressedVideo": ("sensor_msgs/CompressedImage", _CompressedImage),
    "RawImage": ("sensor_msgs/Image", _RawImage),
    "CameraCalibration": ("sensor_msgs/CameraInfo", _CameraCalibration),
}


def _string(text: str) -> bytes:
    return _octets(text.encode())


def _octets(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def is_foxglove(channel: Channel) -> bool:
    """Return whether a channel has messages of Foxglove's own that are read as ROS messages."""
    package, _, name = channel.type.rpartition(".")
    return channel.encoding in ("json", "protobuf") and package == "foxglove" and name in _SCHEMAS


def ros_channel(channel: Channel) -> Channel:
    """Return a channel as the ROS one that its messages are read as; another one than Foxglove's unchanged.

    Raises:
        MessageError: its encoding is not read; the text names a converter.
    """
    if channel.encoding == "flatbuffer":
        raise MessageError(f"topic {channel.topic}: its messages are flatbuffers, which are not read; {_HOW}")
    if not is_foxglove(channel):
        return channel
    return replace(
        channel, type=_SCHEMAS[channel.type.rpartition(".")[2]][0], encoding="ros1", definition="", definition_format=""
    )


def ros_message(channel: Channel, payload: bytes) -> bytes:
    """Return a message of a channel in ROS 1 serialisation; one that is not Foxglove's unchanged.

    Raises:
        MessageError: it does not fit its schema.
    """
    if not is_foxglove(channel):
        return payload
    return _read(channel, payload).ros()


def pose_target(channel: Channel, payload: bytes) -> str | None:
    """Return the frame that the pose of a point cloud leads to, which is not applied; None if there is no such pose."""
    cloud = _read(channel, payload) if is_foxglove(channel) else None
    return cloud.frame_id if isinstance(cloud, _PointCloud) and cloud.is_posed else None


def _read(channel: Channel, payload: bytes) -> _PointCloud | _CompressedImage | _RawImage | _CameraCalibration:
    form = _SCHEMAS[channel.type.rpartition(".")[2]][1]
    try:
        if channel.encoding == "json":
            return json_form(payload, form)
        values = _Decoder(_types(channel.definition)).message(payload, channel.type, 0)
        return msgspec.convert(values, type=form, builtin_types=(bytes,))
    except (InputError, msgspec.DecodeError, RecursionError, ValueError, struct.error) as error:
        raise MessageError(
            f"topic {channel.topic}: a {channel.type} message of {len(payload)} bytes does not fit its schema ({error}); it is "
            "damaged, or of another version"
        ) from error


def ros_head(channel: Channel, head: bytes) -> bytes | None:
    """Return the first 12 bytes of the ROS message, its stamp, from the first bytes of a message; None if it is further on."""
    if channel.encoding == "json":
        match = _STAMP_IN_JSON.match(head)
        return struct.pack("<III", 0, int(match[1]), int(match[2])) if match and int(match[1]) < 1 << 32 else None
    try:
        decoder = _Decoder(_types(channel.definition))
        name, value = next(decoder.values(head, channel.type, 0), ("", None))
        time = msgspec.convert(value, type=_Time) if name == "timestamp" else None
    except (msgspec.ValidationError, ValueError, struct.error):
        return None
    return None if time is None else struct.pack("<III", 0, time.sec, time.nsec)


# -- Protocol Buffers

_MOST_DEPTH: Final = 8
_MOST_DESCRIPTOR: Final = 1 << 20
_TIMES: Final = {"google.protobuf.Timestamp": {"seconds": "sec", "nanos": "nsec"}}
_SCALARS: Final[Mapping[int, tuple[int, str]]] = {  # of a field's type: its wire type, and how NumPy calls it
    1: (1, "<f8"), 2: (5, "<f4"), 3: (0, "i8"), 4: (0, "u8"), 5: (0, "i4"), 6: (1, "<u8"), 7: (5, "<u4"), 8: (0, "u8"),
    13: (0, "u4"), 14: (0, "i4"), 15: (5, "<i4"), 16: (1, "<i8"), 17: (0, "zigzag"), 18: (0, "zigzag"),
}  # fmt: skip
_STRING, _MESSAGE, _BYTES = 9, 11, 12


@dataclass(frozen=True, slots=True)
class _Field:
    name: str
    type: int
    repeated: bool
    type_name: str


_Types: TypeAlias = Mapping[str, Mapping[int, _Field]]


def _varint(data: bytes, place: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = data[place]
        place += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & 0xFFFF_FFFF_FFFF_FFFF, place
    raise ValueError("a number of more than ten bytes")


def _records(data: bytes) -> Iterator[tuple[int, int, int | bytes]]:
    """Yield number, wire type and value of each field of a message, as it is stored.

    Raises:
        ValueError: it ends within a field, or has a wire type that is not read.
    """
    place = 0
    try:
        while place < len(data):
            key, place = _varint(data, place)
            wire, size = key & 7, {1: 8, 5: 4}.get(key & 7, 0)
            if wire == 0:
                value, place = _varint(data, place)
                yield key >> 3, wire, value
                continue
            if wire == 2:
                size, place = _varint(data, place)
            if not size and wire != 2:
                raise ValueError(f"wire type {wire}")
            if place + size > len(data):
                raise ValueError("it ends within a field")
            yield key >> 3, wire, data[place : place + size]
            place += size
    except IndexError:
        raise ValueError("it ends within a number") from None


def _texts(data: bytes, number: int) -> list[bytes]:
    return [value for key, _, value in _records(data) if key == number and isinstance(value, bytes)]


@cache
def _types(definition: str) -> _Types:
    """Read a FileDescriptorSet: the fields of every message, by its full name.

    Raises:
        ValueError: it is none.
    """
    if len(definition) > _MOST_DESCRIPTOR:
        raise ValueError(f"its descriptor has {len(definition)} bytes; at most {_MOST_DESCRIPTOR} are read")
    found: dict[str, Mapping[int, _Field]] = {}
    for file in _texts(definition.encode("latin-1"), 1):
        package = b"".join(_texts(file, 2)[:1]).decode()
        for message in _texts(file, 4):
            _note(found, message, package, 0)
    return found


def _note(found: dict[str, Mapping[int, _Field]], message: bytes, owner: str, depth: int) -> None:
    if depth > _MOST_DEPTH:
        raise ValueError("its descriptor nests types too deeply")
    name = f"{owner}." * bool(owner) + b"".join(_texts(message, 1)[:1]).decode()
    fields = {}
    for entry in _texts(message, 2):
        values = {key: value for key, _, value in _records(entry)}
        texts = {key: value.decode() for key, value in values.items() if isinstance(value, bytes) and key in (1, 6)}
        number, label, kind = (value if isinstance(value := values.get(key, 0), int) else 0 for key in (3, 4, 5))
        fields[number] = _Field(texts.get(1, ""), kind, label == 3, texts.get(6, "").lstrip("."))
    found[name] = fields
    for nested in _texts(message, 3):
        _note(found, nested, name, depth + 1)


@dataclass(frozen=True, slots=True)
class _Decoder:
    """Decodes messages by the types of a descriptor."""

    types: _Types = field(repr=False)

    def message(self, data: bytes, name: str, depth: int) -> dict[str, Any]:
        """Return the values of a message by the names of its fields; lists of repeated ones."""
        fields = {one.name: one for one in self._fields(name).values()}
        values: dict[str, Any] = {}
        for key, value in self.values(data, name, depth):
            if not fields[key].repeated:
                values[key] = value
            elif isinstance(value, list):
                values.setdefault(key, []).extend(value)
            else:
                values.setdefault(key, []).append(value)
        return {_TIMES.get(name, {}).get(key, key): value for key, value in values.items()}

    def values(self, data: bytes, name: str, depth: int) -> Iterator[tuple[str, Any]]:
        """Yield the name and the value of each field of a message, packed numbers as a list; unknown fields are skipped.

        Raises:
            ValueError: it does not fit its descriptor, or is nested too deeply.
        """
        if depth > _MOST_DEPTH:
            raise ValueError("it is nested too deeply")
        known = self._fields(name)
        for number, wire, value in _records(data):
            if number in known:
                yield known[number].name, self._value(known[number], wire, value, depth)

    def _fields(self, name: str) -> Mapping[int, _Field]:
        if name not in self.types:
            raise ValueError(f"its descriptor does not describe {name}")
        return self.types[name]

    def _value(self, known: _Field, wire: int, value: int | bytes, depth: int) -> Any:
        if isinstance(value, bytes) and wire == 2:
            if known.type == _MESSAGE:
                return self.message(value, known.type_name, depth + 1)
            if known.type == _STRING:
                return value.decode("utf-8", "replace")
            if known.type == _BYTES:
                return value
            return self._packed(known, value)
        expected, form = _SCALARS.get(known.type, (-1, ""))
        if wire != expected:
            raise ValueError(f"its field {known.name} has wire type {wire}")
        return _signed(value, form) if isinstance(value, int) else np.frombuffer(value, form)[0].item()

    def _packed(self, known: _Field, data: bytes) -> list[Any]:
        expected, form = _SCALARS.get(known.type, (-1, ""))
        if expected < 0 or not known.repeated:
            raise ValueError(f"its field {known.name} has another type")
        if expected:
            return list(np.frombuffer(data, form).tolist())
        values, place = [], 0
        while place < len(data):
            value, place = _varint(data, place)
            values.append(_signed(value, form))
        return values


def _signed(value: int, form: str) -> int:
    if form == "zigzag":
        return value >> 1 ^ -(value & 1)
    return value - (1 << 64) if form.startswith("i") and value >> 63 else value
