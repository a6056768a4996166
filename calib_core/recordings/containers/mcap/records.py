"""Parse MCAP records: record kinds, schemas, channels and chunks."""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from calib_core.recordings.containers.positioned_reads import Stretch
from calib_core.recordings.containers.sources import Channel, ChannelNotes, StoredChannel

MAGIC = b"\x89MCAP0\r\n"
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = 2, 3, 4, 5, 6, 7, 8
STATISTICS, DATA_END = 11, 15
HEADER, ATTACHMENT, ATTACHMENT_INDEX, METADATA, METADATA_INDEX, SUMMARY_OFFSET = 1, 9, 10, 12, 13, 14
CHUNK_KINDS = frozenset({SCHEMA, CHANNEL, MESSAGE})
BETWEEN_CHUNKS = frozenset({HEADER, SCHEMA, CHANNEL, ATTACHMENT, METADATA, DATA_END})
DATA_KINDS = BETWEEN_CHUNKS - {DATA_END} | {MESSAGE, MESSAGE_INDEX}
SUMMARY_KINDS = frozenset(
    {SCHEMA, CHANNEL, STATISTICS, CHUNK_INDEX, ATTACHMENT_INDEX, METADATA_INDEX, SUMMARY_OFFSET, FOOTER}
)
PRIVATE = 0x80
"""Kinds from here on belong to other programs."""

RECORD = struct.Struct("<BQ")
MESSAGE_HEAD = struct.Struct("<HIQQ")
MAX_RECORD_BYTES = 1 << 28
_CHUNK_HEAD_BYTES = RECORD.size + 40  # without the compression name
_MAX_INDEX_BYTES = 1 << 26
_FORMATS = {"ros1msg": "msg", "ros2msg": "msg", "ros2idl": "idl", "omgidl": "idl"}
_BINARY = ("protobuf", "flatbuffer")


@dataclass(frozen=True, slots=True)
class _Schema:
    name: str
    encoding: str
    data: bytes

    @property
    def text(self) -> str:
        """The definition as text; of a binary one, a character for each byte."""
        return self.data.decode("latin-1" if self.encoding in _BINARY else "utf-8", "replace")


_NO_SCHEMA = _Schema("", "", b"")


class Declarations:
    """The channels found so far."""

    def __init__(self) -> None:
        self._schemas: dict[int, _Schema] = {}
        self._channels: dict[int, tuple[int, str, str, bytes]] = {}

    def note(self, kind: int, body: bytes) -> bool:
        """Record a schema or a channel; other records are ignored.

        Returns:
            False if the record is damaged.
        """
        try:
            if kind == SCHEMA:
                number = int.from_bytes(body[:2], "little")
                name, place = string_at(body, 2)
                encoding, place = string_at(body, place)
                data, _ = _bytes_at(body, place)
                self._schemas.setdefault(number, _Schema(name, encoding, data))
            elif kind == CHANNEL:
                number, schema = struct.unpack_from("<HH", body)
                topic, place = string_at(body, 4)
                encoding, place = string_at(body, place)
                self._channels.setdefault(number, (schema, topic, encoding, body[place:]))
        except struct.error:
            return False
        return True

    def __len__(self) -> int:
        return len(self._channels)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels, each with its schema if there is one."""
        return tuple(self._channel(number, *entry) for number, entry in self._channels.items())

    @property
    def stored(self) -> Mapping[int, StoredChannel]:
        """The channels exactly as they are stored, by number."""
        return {number: self._stored(*entry) for number, entry in self._channels.items()}

    def _channel(self, number: int, schema_number: int, topic: str, encoding: str, _: bytes) -> Channel:
        schema = self._schemas.get(schema_number, _NO_SCHEMA)
        form = _FORMATS.get(schema.encoding, "") if schema.text.strip() else ""
        return Channel(number, topic, schema.name, encoding, schema.text, form)

    def _stored(self, schema_number: int, topic: str, encoding: str, notes: bytes) -> StoredChannel:
        schema = self._schemas.get(schema_number, _NO_SCHEMA)
        return StoredChannel(topic, encoding, schema.name, schema.encoding, schema.data, _mapping(notes))


@dataclass(frozen=True, slots=True)
class ChunkHead:
    """The header before the records of a chunk.

    Attributes:
        size: its length.
        unpacked_bytes: the declared uncompressed size of the chunk.
        compression: "" for none.
        stored_bytes: number of bytes that follow.
        checksum: CRC-32 of the uncompressed bytes; 0 for none.
    """

    size: int
    unpacked_bytes: int
    compression: str
    stored_bytes: int
    checksum: int


def chunk_head(body: bytes) -> ChunkHead | None:
    """Read the header of a chunk's body; None if it is invalid."""
    try:
        compression, place = string_at(body, 28)
        stored = struct.unpack_from("<Q", body, place)[0]
    except struct.error:
        return None
    checksum = int.from_bytes(body[24:28], "little")
    return ChunkHead(place + 8, int.from_bytes(body[16:24], "little"), compression, stored, checksum)


def crc_position(position: int, compression: str) -> int:
    """Return the position of a chunk's checksum, given the position of its data."""
    return position - 16 - len(compression)


@dataclass(frozen=True, slots=True)
class ChunkInfo:
    """The summary's entry for one chunk.

    Attributes:
        start_ns: log time of its first message.
        position: of its record in the file.
        record_bytes: size of that record.
        channels: those with messages in it, if it is indexed.
        index_bytes: length of the message indexes after it.
        compression: "" for none.
        stored_bytes: its size in the file.
        size_bytes: its uncompressed size.
    """

    start_ns: int
    position: int
    record_bytes: int
    channels: tuple[int, ...]
    index_bytes: int
    compression: str
    stored_bytes: int
    size_bytes: int

    @property
    def data_position(self) -> int:
        """The position of its data."""
        return self.position + _CHUNK_HEAD_BYTES + len(self.compression)

    @property
    def index_place(self) -> tuple[int, int]:
        """The begin and end of its message indexes."""
        begin = self.position + self.record_bytes
        return begin, begin + self.index_bytes

    def inside(self, file_bytes: int) -> bool:
        """Return whether it lies within a file of this size."""
        return self.data_position + self.stored_bytes <= file_bytes and self.index_bytes <= _MAX_INDEX_BYTES


def chunk_info(body: bytes) -> ChunkInfo | None:
    """Read a chunk index record; None if it is damaged."""
    try:
        start_ns, _, position, length, map_bytes = struct.unpack_from("<QQQQI", body)
        channels = tuple(number for number, _ in struct.iter_unpack("<HQ", body[36 : 36 + map_bytes]))
        index_bytes = struct.unpack_from("<Q", body, 36 + map_bytes)[0]
        compression, place = string_at(body, 44 + map_bytes)
        stored, size = struct.unpack_from("<QQ", body, place)
    except struct.error:
        return None
    return ChunkInfo(start_ns, position, length, channels, index_bytes, compression, stored, size)


def statistics(body: bytes) -> tuple[int, Mapping[int, int]]:
    """Read the number of messages, in total and by channel, ignoring truncated entries."""
    entries = body[46 : 46 + int.from_bytes(body[42:46], "little")]
    by_channel = dict(struct.iter_unpack("<HQ", entries[: len(entries) // 10 * 10]))
    return int.from_bytes(body[:8], "little"), by_channel


def walk(stretch: Stretch, place: int = 0) -> Iterator[tuple[int, int, int]]:
    """Iterate over records (kind, offset of the body, size of the body); stop at a record that extends past the end."""
    while place + RECORD.size <= stretch.size:
        kind, size = RECORD.unpack(stretch.up_to(place, RECORD.size))
        start = place + RECORD.size
        if size > stretch.size - start:
            return
        yield kind, start, size
        place = start + size


def string_at(data: bytes, place: int) -> tuple[str, int]:
    """Read a length-prefixed string; return it and the offset after it."""
    found, place = _bytes_at(data, place)
    return found.decode("utf-8", "replace"), place


def _bytes_at(data: bytes, index: int) -> tuple[bytes, int]:
    length = struct.unpack_from("<I", data, index)[0]
    if index + 4 + length > len(data):
        raise struct.error("string extends past its record")
    return data[index + 4 : index + 4 + length], index + 4 + length


def _mapping(data: bytes) -> ChannelNotes:
    """Read a map of strings; what is damaged is left out."""
    entries = []
    try:
        data, place = _bytes_at(data, 0)[0], 0
        while place < len(data):
            key, place = string_at(data, place)
            value, place = string_at(data, place)
            entries.append((key, value))
    except struct.error:
        pass
    return tuple(entries)
