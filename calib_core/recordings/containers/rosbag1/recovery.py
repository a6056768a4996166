"""Recover bags without an index, left by a killed recorder, a full disk or an incomplete copy.

The file is scanned from its beginning. Every complete message is found, including those in a truncated chunk or after
a damaged stretch; losses are counted.
"""

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from calib_core.errors import RecordingError
from calib_core.recordings.containers.chunks import Chunk, Scanned
from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch, MemoryStretch, Stretch
from calib_core.recordings.containers.rosbag1.index import fields_of

_MESSAGE, _CHUNK, _CONNECTION = 2, 5, 7
_OTHER_KINDS = frozenset({3, 4, 6})  # the bag's header, and its index
_U32 = struct.Struct("<I")
_MAX_HEADER_BYTES = 1 << 24
_MARK = re.compile(rb"op=[\x02\x05\x07]")
_MAX_CANDIDATES = 2000
_BACK_BYTES = 96


@dataclass(frozen=True, slots=True)
class Record:
    """One record: its header's fields, and the location of its data."""

    fields: dict[str, bytes]
    kind: int
    place: int
    data_place: int
    data_size: int

    @property
    def end(self) -> int:
        """The offset of the next record."""
        return self.data_place + self.data_size


@dataclass(slots=True)
class FoundInBag(Scanned):
    """The result of scanning a bag.

    Attributes:
        connections: the record of each, with its data.
    """

    connections: dict[int, tuple[dict[str, bytes], bytes]] = field(default_factory=dict)


def _record(stretch: Stretch, index: int) -> Record | None:
    """Read the record at a place; None if there is none."""
    head = stretch.up_to(index, 512)
    if len(head) < 8:
        return None
    length = _U32.unpack_from(head)[0]
    if length > min(_MAX_HEADER_BYTES, stretch.size - index - 8):
        return None
    if length + 8 > len(head):
        head = stretch.up_to(index, length + 8)
    fields = fields_of(head[4 : 4 + length]) if len(head) >= length + 8 else None
    if not fields or len(fields.get("op", b"")) != 1:
        return None
    return Record(fields, fields["op"][0], index, index + 8 + length, _U32.unpack_from(head, 4 + length)[0])


class BagWalk:
    """Iterate over records; after a damaged stretch, continue at the next plausible record.

    Args:
        stretch: the bytes to scan.
        found: counts the skipped bytes and the attempts.
        inside: whether this is inside a chunk, which cannot contain chunks.
    """

    def __init__(self, stretch: Stretch, bag: FoundInBag, *, inside: bool) -> None:
        self._stretch = stretch
        self._found = bag
        self._kinds = (_MESSAGE, _CONNECTION) if inside else (_MESSAGE, _CONNECTION, _CHUNK)

    def records(self, place: int) -> Iterator[Record]:
        """Yield the records from an offset on; a chunk that extends past the end, or has a wrong size, is truncated."""
        while place < self._stretch.size:
            record = _record(self._stretch, place)
            if record is not None and record.end <= self._stretch.size:
                yield record
                place = record.end
                continue
            following = self._next(place + 1)
            after = following.place if following is not None else self._stretch.size
            if record is not None and record.kind == _CHUNK:
                yield replace(record, data_size=max(0, after - record.data_place))
            else:
                self._found.lost_bytes += after - place
            place = after

    def _next(self, start: int) -> Record | None:
        """Find the next plausible record."""
        while self._found.tried < _MAX_CANDIDATES:
            mark = self._stretch.find(_MARK, start)
            if mark < 0:
                return None
            self._found.tried += 1
            for index in range(mark - 8, max(start - 1, mark - _BACK_BYTES), -1):
                record = _record(self._stretch, index)
                if record is not None and record.kind in self._kinds:
                    return record
            start = mark + 1
        return None


def scan_bag(file: FileBytes, start: int) -> FoundInBag:
    """Scan a bag from the first record after its header.

    Args:
        file: the bag.
        start: position of that record.
    """
    bag = FoundInBag([Chunk(0, file.size_bytes, file.size_bytes, "none")])
    stretch = FileStretch(file, 0, file.size_bytes)
    for record in BagWalk(stretch, bag, inside=False).records(start):
        if record.kind == _CHUNK:
            scan_chunk(file, record, bag)
        elif record.kind not in _OTHER_KINDS and not note_record(stretch, record, 0, bag):
            bag.lost_bytes += record.end - record.place
    return bag


def scan_bag_further(file: FileBytes, place: int, bag: FoundInBag) -> int:
    """Scan the complete records of a bag that is being written; return the position of the first incomplete one.

    A recorder writes the header of a chunk with a size of 0 and replaces it once the chunk is complete.

    Args:
        file: the bag.
        place: position of the first record to read.
        bag: receives what is found.

    Raises:
        RecordingError: there is no record at a position.
    """
    bag.chunks[0] = Chunk(0, file.size_bytes, file.size_bytes, "none")
    stretch = FileStretch(file, 0, file.size_bytes)
    while place + 8 <= stretch.size:
        record = _record(stretch, place)
        if record is None:
            if _may_be_incomplete(stretch, place):
                break
            raise RecordingError(f"{file.path}: no record at byte {place}, where the next one should begin")
        if record.end > stretch.size or (record.kind == _CHUNK and not record.data_size):
            break
        if record.kind == _CHUNK:
            scan_chunk(file, record, bag)
        elif record.kind not in _OTHER_KINDS:
            note_record(stretch, record, 0, bag)
        place = record.end
    return place


def _may_be_incomplete(stretch: Stretch, index: int) -> bool:
    """Return whether the header of a record ends beyond the file, or is space that has not been filled yet."""
    length = _U32.unpack(stretch.up_to(index, 4))[0]
    return length == 0 or stretch.size - index - 8 < length <= _MAX_HEADER_BYTES


def scan_chunk(file: FileBytes, record: Record, bag: FoundInBag) -> None:
    """Record all complete messages of a chunk; in a damaged compressed chunk, those before the damage."""
    stored = min(record.data_size, file.size_bytes - record.data_place)
    compression = record.fields.get("compression", b"").decode("utf-8", "replace")
    size = int.from_bytes(record.fields.get("size", b""), "little")
    number = len(bag.chunks)
    if compression in ("none", ""):
        stretch: Stretch = FileStretch(file, record.data_place, stored)
        size = stored
    else:
        packed = Chunk(record.data_place, stored, size, compression)
        data = bag.unpacked(file, packed, where=f"chunk at byte {record.place}")
        stretch, size = MemoryStretch(data), len(data)
    bag.chunks.append(Chunk(record.data_place, stored, size, compression))
    for inner in BagWalk(stretch, bag, inside=True).records(0):
        if not note_record(stretch, inner, number, bag):
            bag.lost_bytes += inner.end - inner.place


def note_record(stretch: Stretch, record: Record, chunk: int, bag: FoundInBag) -> bool:
    """Record a message or a connection; False if it is neither, or damaged."""
    if record.kind == _CONNECTION:
        return _note_connection(record, stretch.up_to(record.data_place, record.data_size), bag)
    fields = record.fields
    if record.kind != _MESSAGE or len(fields.get("time", b"")) != 8 or len(fields.get("conn", b"")) != 4:
        return False
    sec, nanosec = struct.unpack("<II", fields["time"])
    connection = int.from_bytes(fields["conn"], "little")
    bag.messages.setdefault(connection, []).append((sec * 1_000_000_000 + nanosec, chunk, record.place))
    return True


def _note_connection(record: Record, data: bytes, bag: FoundInBag) -> bool:
    if len(record.fields.get("conn", b"")) != 4:
        return False
    bag.connections.setdefault(int.from_bytes(record.fields["conn"], "little"), (record.fields, data))
    return True
