"""Read small MCAP files of JSON messages in uncompressed chunks.

The layout is the MCAP specification's, version 0: records of a kind, a length and a body between two magic numbers.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from calib_core.errors import InputError

MCAP_MAGIC = b"\x89MCAP0\r\n"
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _METADATA, _DATA_END = 3, 4, 5, 6, 12, 15
_RECORD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_CHUNK_HEAD = struct.Struct("<QQQI")
_MAX_BYTES = 8 * 1024 * 1024


@dataclass(frozen=True, slots=True)
class McapMessage:
    """One JSON message.

    Attributes:
        schema_name: the name of its type.
        data: the message as JSON.
    """

    schema_name: str
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
        self._schemas_of_channels: dict[int, int] = {}

    def take(self, kind: int, body: bytes) -> bool:
        """Keep what a record says; return False if it declares messages that are not JSON."""
        if kind == _SCHEMA:
            self._schemas[int.from_bytes(body[:2], "little")] = _text_at(body, 2)[0]
        elif kind == _CHANNEL:
            number, schema = struct.unpack_from("<HH", body)
            _, at = _text_at(body, 4)
            self._schemas_of_channels[number] = schema
            return _text_at(body, at)[0] == "json"
        elif kind == _MESSAGE:
            schema = self._schemas_of_channels[_MESSAGE_HEAD.unpack_from(body)[0]]
            self.messages.append(McapMessage(self._schemas.get(schema, ""), body[_MESSAGE_HEAD.size :]))
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
