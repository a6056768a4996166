"""MCAP's records: their kinds, and what schemas, channels and chunks say."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

from calib_core.recordings.files import Stretch
from calib_core.recordings.sources import Channel

__all__ = [
    "CHANNEL",
    "CHUNK",
    "CHUNK_INDEX",
    "DATA_END",
    "FOOTER",
    "MAGIC",
    "MAX_RECORD_BYTES",
    "MESSAGE",
    "MESSAGE_HEAD",
    "MESSAGE_INDEX",
    "RECORD",
    "SCHEMA",
    "STATISTICS",
    "ChunkHead",
    "Declarations",
    "chunk_head",
    "string_at",
    "walk",
]

MAGIC = b"\x89MCAP0\r\n"
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = 2, 3, 4, 5, 6, 7, 8
STATISTICS, DATA_END = 11, 15
RECORD = struct.Struct("<BQ")
MESSAGE_HEAD = struct.Struct("<HIQQ")
MAX_RECORD_BYTES = 1 << 28
_FORMATS = {"ros1msg": "msg", "ros2msg": "msg", "ros2idl": "idl", "omgidl": "idl"}


@dataclass(frozen=True, slots=True)
class _Schema:
    name: str
    format: str
    text: str


class Declarations:
    """The channels found so far."""

    def __init__(self) -> None:
        self._schemas: dict[int, _Schema] = {}
        self._channels: dict[int, tuple[int, str, str]] = {}

    def note(self, kind: int, body: bytes) -> bool:
        """Note a schema or a channel; other records are passed over.

        Returns:
            False where the record is damaged.
        """
        try:
            if kind == SCHEMA:
                number = int.from_bytes(body[:2], "little")
                name, place = string_at(body, 2)
                encoding, place = string_at(body, place)
                text, _ = string_at(body, place)
                self._schemas.setdefault(number, _Schema(name, _FORMATS.get(encoding, ""), text))
            elif kind == CHANNEL:
                number, schema = struct.unpack_from("<HH", body)
                topic, place = string_at(body, 4)
                encoding, _ = string_at(body, place)
                self._channels.setdefault(number, (schema, topic, encoding))
        except struct.error:
            return False
        return True

    def __len__(self) -> int:
        return len(self._channels)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels, each with its schema where there is one."""
        return tuple(self._channel(number, *entry) for number, entry in self._channels.items())

    def _channel(self, number: int, schema_number: int, topic: str, encoding: str) -> Channel:
        schema = self._schemas.get(schema_number, _Schema("", "", ""))
        form = schema.format if schema.text.strip() else ""
        return Channel(number, topic, schema.name, encoding, schema.text, form)


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """What comes before the records of a chunk.

    Attributes:
        size: how long it is.
        unpacked_bytes: the size the chunk declares.
        compression: "" for none.
        stored_bytes: how many bytes follow.
    """

    size: int
    unpacked_bytes: int
    compression: str
    stored_bytes: int


def chunk_head(body: bytes) -> ChunkHead | None:
    """Read the head of a chunk's body; None where it is none."""
    try:
        compression, place = string_at(body, 28)
        stored = struct.unpack_from("<Q", body, place)[0]
    except struct.error:
        return None
    return ChunkHead(place + 8, int.from_bytes(body[16:24], "little"), compression, stored)


def walk(stretch: Stretch, place: int = 0) -> Iterator[tuple[int, int, int]]:
    """Walk over records: kind, place of the body, size of the body; ends where a record runs past the end."""
    while place + RECORD.size <= stretch.size:
        kind, size = RECORD.unpack(stretch.up_to(place, RECORD.size))
        start = place + RECORD.size
        if size > stretch.size - start:
            return
        yield kind, start, size
        place = start + size


def string_at(data: bytes, place: int) -> tuple[str, int]:
    """Read a length-prefixed string; return it and the place after it."""
    length = struct.unpack_from("<I", data, place)[0]
    if place + 4 + length > len(data):
        raise struct.error("string runs past its record")
    return data[place + 4 : place + 4 + length].decode("utf-8", "replace"), place + 4 + length
