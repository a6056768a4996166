"""Bags without an index: what a killed recorder, a full disk or a broken copy left behind.

The file is walked from its beginning. Every whole message is found, also those in a chunk that is cut off; what is
lost is said in bytes.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from calib_core.errors import RecordingError
from calib_core.recordings.chunks import Chunk
from calib_core.recordings.compression import MAX_CHUNK_BYTES, unpack_what_is_there
from calib_core.recordings.files import FileBytes

__all__ = ["FoundInBag", "Record", "fields_of", "scan_bag"]

_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
_U32 = struct.Struct("<I")
_MAX_HEADER_BYTES = 1 << 24


@dataclass(frozen=True, slots=True)
class Record:
    """One record: its header's fields, and where its data lies in what was walked."""

    fields: dict[str, bytes]
    kind: int
    place: int
    data_place: int
    data_size: int


@dataclass(slots=True)
class FoundInBag:
    """What a walk over a bag found.

    Attributes:
        chunks: with as many bytes as are there.
        connections: the record of each, with its data.
        messages: (receive time [ns], chunk, offset) by connection.
        kept_bytes: up to where the file could be understood.
    """

    chunks: list[Chunk] = field(default_factory=list)
    connections: dict[int, tuple[dict[str, bytes], bytes]] = field(default_factory=dict)
    messages: dict[int, list[tuple[int, int, int]]] = field(default_factory=dict)
    kept_bytes: int = 0


def fields_of(raw: bytes) -> dict[str, bytes] | None:
    """Split a record header into its name=value fields; None where it is not one."""
    fields: dict[str, bytes] = {}
    place = 0
    while place + 4 <= len(raw):
        length = _U32.unpack_from(raw, place)[0]
        name, equals, value = raw[place + 4 : place + 4 + length].partition(b"=")
        if not equals or place + 4 + length > len(raw):
            return None
        fields[name.decode("ascii", "replace")] = value
        place += 4 + length
    return fields if place == len(raw) else None


def _record(read: Callable[[int, int], bytes], place: int, end: int) -> Record | None:
    """Read the record at a place; None where there is none, or where it does not end in time."""
    head = read(place, 512)
    if len(head) < 8:
        return None
    length = _U32.unpack_from(head)[0]
    if length > min(_MAX_HEADER_BYTES, end - place - 8):
        return None
    if length + 8 > len(head):
        head = read(place, length + 8)
    fields = fields_of(head[4 : 4 + length]) if len(head) >= length + 8 else None
    if not fields or len(fields.get("op", b"")) != 1:
        return None
    return Record(fields, fields["op"][0], place, place + 8 + length, _U32.unpack_from(head, 4 + length)[0])


def scan_bag(file: FileBytes, start: int) -> FoundInBag:
    """Walk over a bag from the first record after its header.

    Args:
        file: the bag.
        start: where that record is.
    """
    found = FoundInBag()
    place = start
    while (record := _record(file.up_to, place, file.size_bytes)) is not None:
        whole = record.data_place + record.data_size <= file.size_bytes
        if record.kind == _CHUNK:
            _scan_chunk(file, record, found)
        elif record.kind == _CONNECTION and whole:
            _note_connection(record, file.at(record.data_place, record.data_size), found)
        found.kept_bytes = min(record.data_place + record.data_size, file.size_bytes)
        if not whole:
            break
        place = record.data_place + record.data_size
    return found


def _scan_chunk(file: FileBytes, record: Record, found: FoundInBag) -> None:
    """Note all whole messages of a chunk; a chunk whose compression is damaged gives what comes before the damage."""
    stored = min(record.data_size, file.size_bytes - record.data_place)
    compression = record.fields.get("compression", b"").decode("utf-8", "replace")
    size = int.from_bytes(record.fields.get("size", b""), "little")
    if stored > MAX_CHUNK_BYTES or size > MAX_CHUNK_BYTES:
        raise RecordingError(
            f"{file.path}: the chunk at byte {record.place} declares over 1 GiB; it is refused as damaged"
        )
    data = unpack_what_is_there(file.at(record.data_place, stored), compression, size)
    number = len(found.chunks)
    found.chunks.append(Chunk(record.data_place, stored, len(data), compression))
    for inner in _walk(data):
        if inner.kind == _CONNECTION:
            _note_connection(inner, data[inner.data_place : inner.data_place + inner.data_size], found)
        elif inner.kind == _MESSAGE and {"conn", "time"} <= inner.fields.keys() and len(inner.fields["time"]) == 8:
            sec, nanosec = struct.unpack("<II", inner.fields["time"])
            connection = int.from_bytes(inner.fields["conn"], "little")
            found.messages.setdefault(connection, []).append((sec * 1_000_000_000 + nanosec, number, inner.place))


def _walk(data: bytes) -> Iterator[Record]:
    place = 0
    while (record := _record(lambda at, size: data[at : at + size], place, len(data))) is not None:
        if record.data_place + record.data_size > len(data):
            return
        yield record
        place = record.data_place + record.data_size


def _note_connection(record: Record, data: bytes, found: FoundInBag) -> None:
    if len(record.fields.get("conn", b"")) == 4:
        found.connections.setdefault(int.from_bytes(record.fields["conn"], "little"), (record.fields, data))
