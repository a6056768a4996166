"""Write small MCAP files of JSON messages, in one uncompressed chunk with its index, and read them back.

The layout is the MCAP specification's, version 0: records of a kind, a length and a body between two magic numbers.
"""

import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from calib_core.errors import InputError

MCAP_MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _CHUNK_INDEX = range(1, 9)
_STATISTICS, _METADATA, _METADATA_INDEX, _DATA_END = 11, 12, 13, 15
_RECORD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_CHUNK_HEAD = struct.Struct("<QQQI")
_MAX_BYTES = 8 * 1024 * 1024


@dataclass(frozen=True, slots=True)
class McapMessage:
    """One JSON message on a topic of its own.

    Attributes:
        topic: what it is published on.
        schema_name: the name of its type.
        schema: its JSON Schema; empty when read.
        data: the message as JSON.
    """

    topic: str
    schema_name: str
    schema: bytes
    data: bytes


@dataclass(frozen=True, slots=True)
class McapFile:
    """What is in a small MCAP file.

    Attributes:
        messages: in file order.
        metadata: of each name, texts by key.
    """

    messages: tuple[McapMessage, ...]
    metadata: Mapping[str, Mapping[str, str]]


def mcap_bytes(file: McapFile) -> bytes:
    """Return an MCAP file; every message has the time 0."""
    schemas, channels, messages = [], [], []
    for number, message in enumerate(file.messages, start=1):
        schema = struct.pack("<H", number) + _string(message.schema_name) + _string("jsonschema")
        channel = struct.pack("<HH", number, number) + _string(message.topic) + _string("json") + _map({})
        schemas.append(_record(_SCHEMA, schema + struct.pack("<I", len(message.schema)) + message.schema))
        channels.append(_record(_CHANNEL, channel))
        messages.append(_record(_MESSAGE, _MESSAGE_HEAD.pack(number, 0, 0, 0) + message.data))
    declared = b"".join(schemas) + b"".join(channels)
    head = MCAP_MAGIC + _record(_HEADER, _string("") + _string("cocalib"))
    chunk, chunk_index = _chunk(declared, messages, at=len(head))
    data, indexes = head + chunk, [chunk_index]
    for name, entries in file.metadata.items():
        record = _record(_METADATA, _string(name) + _map(entries))
        indexes.append(_record(_METADATA_INDEX, struct.pack("<QQ", len(data), len(record)) + _string(name)))
        data += record
    data += _record(_DATA_END, struct.pack("<I", 0))
    summary = declared + _statistics(len(messages), len(file.metadata)) + b"".join(indexes)
    footer = _RECORD.pack(_FOOTER, 20) + struct.pack("<QQ", len(data), 0)
    checksum = struct.pack("<I", zlib.crc32(summary + footer))
    return data + summary + footer + checksum + MCAP_MAGIC


def _chunk(declared: bytes, messages: Sequence[bytes], *, at: int) -> tuple[bytes, bytes]:
    """Return one chunk followed by the index of each channel, and the record that points to them."""
    records = declared + b"".join(messages)
    head = _CHUNK_HEAD.pack(0, 0, len(records), zlib.crc32(records)) + _string("")
    chunk = _record(_CHUNK, head + struct.pack("<Q", len(records)) + records)
    indexes, places, offset = b"", b"", len(declared)
    for number, message in enumerate(messages, start=1):
        places += struct.pack("<HQ", number, at + len(chunk) + len(indexes))
        indexes += _record(_MESSAGE_INDEX, struct.pack("<HIQQ", number, 16, 0, offset))
        offset += len(message)
    pointer = (
        struct.pack("<QQQQI", 0, 0, at, len(chunk), len(places))
        + places
        + struct.pack("<Q", len(indexes))
        + _string("")
        + struct.pack("<QQ", len(records), len(records))
    )
    return chunk + indexes, _record(_CHUNK_INDEX, pointer)


def _statistics(message_count: int, metadata_count: int) -> bytes:
    counts = b"".join(struct.pack("<HQ", number, 1) for number in range(1, message_count + 1))
    body = struct.pack("<QHIIIIQQ", message_count, message_count, message_count, 0, metadata_count, 1, 0, 0)
    return _record(_STATISTICS, body + struct.pack("<I", len(counts)) + counts)


def load_mcap(data: bytes, *, source: str) -> McapFile | None:
    """Return what is in a small MCAP file of JSON messages; None for a recording: large, compressed, or of other messages.

    Raises:
        InputError: it is damaged.
    """
    if len(data) > _MAX_BYTES:
        return None
    try:
        return _loaded(data)
    except (struct.error, UnicodeDecodeError, IndexError, KeyError) as error:
        raise InputError(f"{source}: a damaged MCAP file ({error}); export it again") from None


def _loaded(data: bytes) -> McapFile | None:
    found = _Found()
    for kind, body in _records(data[len(MCAP_MAGIC) :]):
        if kind == _DATA_END:
            break
        if kind is None or not found.take(kind, body):
            return None
    return McapFile(tuple(found.messages), found.metadata)


class _Found:
    """What the records so far hold."""

    def __init__(self) -> None:
        self.messages: list[McapMessage] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[int, str]] = {}

    def take(self, kind: int, body: bytes) -> bool:
        """Keep what a record says; return False if it declares messages that are not JSON."""
        if kind == _SCHEMA:
            self._schemas[int.from_bytes(body[:2], "little")] = _text_at(body, 2)[0]
        elif kind == _CHANNEL:
            number, schema = struct.unpack_from("<HH", body)
            topic, at = _text_at(body, 4)
            self._channels[number] = (schema, topic)
            return _text_at(body, at)[0] == "json"
        elif kind == _MESSAGE:
            schema, topic = self._channels[_MESSAGE_HEAD.unpack_from(body)[0]]
            data = body[_MESSAGE_HEAD.size :]
            self.messages.append(McapMessage(topic, self._schemas.get(schema, ""), b"", data))
        elif kind == _METADATA:
            name, at = _text_at(body, 0)
            self.metadata[name] = _map_at(body, at)
        return True


def _records(data: bytes) -> Iterator[tuple[int | None, bytes]]:
    """Yield the records and those in uncompressed chunks; the kind of a compressed chunk is None.

    A chunk within a chunk is not allowed and is not looked into.
    """
    for kind, body in _top_records(data):
        if kind != _CHUNK:
            yield kind, body
            continue
        compression, start = _text_at(body, _CHUNK_HEAD.size)
        if compression:
            yield None, b""
            return
        yield from _top_records(body[start + 8 :])


def _top_records(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at + _RECORD.size <= len(data):
        kind, length = _RECORD.unpack_from(data, at)
        at += _RECORD.size
        body = data[at : at + length]
        if len(body) < length:
            raise struct.error(f"a record at byte {at} is longer than the file")
        at += length
        yield kind, body


def _record(kind: int, body: bytes) -> bytes:
    return _RECORD.pack(kind, len(body)) + body


def _string(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def _map(entries: Mapping[str, str]) -> bytes:
    data = b"".join(_string(key) + _string(value) for key, value in entries.items())
    return struct.pack("<I", len(data)) + data


def _text_at(body: bytes, at: int) -> tuple[str, int]:
    """Return the string at a place, and the place after it."""
    end = at + 4 + struct.unpack_from("<I", body, at)[0]
    if end > len(body):
        raise struct.error(f"a text of {end - at - 4} bytes is longer than its record")
    return body[at + 4 : end].decode(), end


def _map_at(body: bytes, at: int) -> dict[str, str]:
    end, at, found = at + 4 + struct.unpack_from("<I", body, at)[0], at + 4, {}
    while at < end:
        key, at = _text_at(body, at)
        found[key], at = _text_at(body, at)
    return found
