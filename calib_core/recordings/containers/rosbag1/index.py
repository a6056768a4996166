"""Locate the messages of a ROS 1 bag from the index block after each chunk."""

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.recordings.containers.chunks import Chunk
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.rosbag1.records import fields_of
from calib_core.recordings.containers.rosbag1.tail import ChunkInfo, damaged
from calib_core.recordings.containers.sources import MessageIndex

_CHUNK = 5
_INDEX, _CONNECTION = b"\x04", b"\x07"
_U32 = struct.Struct("<I")
_ENTRY = np.dtype([("sec", "<u4"), ("nanosec", "<u4"), ("offset", "<u4")])
_MAX_HEADER_BYTES = 1 << 24
_MAX_INDEX_BYTES = 1 << 26
_HEAD_BYTES = 256
_BLOCK_BYTES = 128  # longer than the header of an index record
_AHEAD = 256
_GAP_BYTES = 64


@dataclass(frozen=True, slots=True, eq=False)
class BagIndex:
    """Chunks, and the locations of each connection's messages in them."""

    chunks: list[Chunk]
    indexes: Mapping[int, MessageIndex]


def read_indexes(
    file: FileBytes, infos: Sequence[ChunkInfo], span: tuple[int, int], picked: Sequence[ChunkInfo] | None
) -> BagIndex:
    """Read the index blocks that follow each chunk.

    One read covers the block of a chunk and the header of the next chunk.

    Args:
        file: the bag.
        infos: of all chunks.
        span: end of the bag's header, and end of the last block.
        picked: the chunks to read; None for all, which must then account for all bytes in between.

    Raises:
        RecordingError: a chunk or a block is damaged, or the file contains chunks or messages that are not indexed.
    """
    begin, end = span
    whole, picked = picked is None, infos if picked is None else picked
    ordered = sorted(infos, key=lambda info: info.position)
    following = [info.position for info in ordered[1:]] + [end] * bool(ordered)
    wanted = {info.position for info in picked}
    places = [(info, after) for info, after in zip(ordered, following, strict=True) if info.position in wanted]
    chunks: list[Chunk] = []
    found: dict[int, list[tuple[int, bytes]]] = {}
    windows = _Windows(file, [_window(info, after) for info, after in places])
    if whole:
        _require_nothing_unindexed(file, begin, ordered[0].position if ordered else end)
    for number, (info, after) in enumerate(places):
        chunk = _chunk(file, info.position, windows.before(number, info.position))
        chunks.append(chunk)
        block = chunk.position + chunk.stored_bytes
        records = _records_of(windows, number, (block, after), info)
        if records is None or not _plausible(records.entries, info):
            raise damaged(file, block)
        if whole:
            _require_nothing_unindexed(file, block + records.size, after)
        for connection, entries in records.entries:
            found.setdefault(connection, []).append((number, entries))
    return BagIndex(chunks, {connection: _merged(parts) for connection, parts in found.items()})


def _plausible(records: Sequence[tuple[int, bytes]], info: ChunkInfo) -> bool:
    """Return whether the entries of a chunk are all different and within the chunk's time."""
    entries = np.frombuffer(b"".join(data for _, data in records), dtype=_ENTRY)
    if not len(entries):
        return True
    times = entries["sec"].astype(np.int64) * 1_000_000_000 + entries["nanosec"]
    if int(times.min()) < info.start_ns or int(times.max()) > info.end_ns:
        return False
    return len(np.unique(entries["offset"])) == len(entries)


def _require_nothing_unindexed(file: FileBytes, begin: int, end: int) -> None:
    """Refuse chunks, messages, index entries and unknown bytes between the chunks that the index names.

    Raises:
        RecordingError: there are some.
    """
    place = begin
    while place != end:
        if place < end and not any(file.up_to(place, min(_GAP_BYTES, end - place))):
            return  # an empty gap, as some recorders leave it
        head = file.up_to(place, 4)
        length = _U32.unpack(head)[0] if len(head) == 4 else _MAX_HEADER_BYTES
        if place > end or length >= _MAX_HEADER_BYTES:
            raise damaged(file, begin)
        record = file.up_to(place + 4, length + 4)
        fields = fields_of(record[:length]) if len(record) == length + 4 else None
        kind = fields.get("op", b"") if fields is not None else b""
        size = _U32.unpack_from(record, length)[0] if fields is not None else 0
        if kind != _CONNECTION and not (kind == _INDEX and size == 0):
            raise damaged(file, begin)
        place += 8 + length + size


@dataclass(frozen=True, slots=True)
class _Block:
    """The index of one chunk: the entries of each connection, and its size in the file."""

    entries: list[tuple[int, bytes]]
    size: int


def _block_bytes(info: ChunkInfo) -> int:
    """Return an upper bound of the size of a chunk's index block."""
    return min(sum(_BLOCK_BYTES + count * _ENTRY.itemsize for count in info.counts.values()), _MAX_INDEX_BYTES)


def _window(info: ChunkInfo, following: int) -> tuple[int, int]:
    """Return a window from the estimated beginning of a chunk's block to past the header of the next chunk."""
    return max(info.position, following - _block_bytes(info)), following + _HEAD_BYTES


def _records_of(windows: "_Windows", number: int, place: tuple[int, int], info: ChunkInfo) -> _Block | None:
    """Return the entries of each connection in a chunk; None if they are damaged.

    Args:
        windows: the bytes read.
        number: of the window.
        place: positions of the block and of the next chunk, which usually, but not always, follows the block.
        info: of the chunk.
    """
    room = max(0, min(place[1] - place[0], _MAX_INDEX_BYTES))
    usual = min(_block_bytes(info), room)
    records = _index_records(windows.piece(number, place[0], usual), _connections_in(info))
    if usual < room and (records is None or len(records.entries) < _connections_in(info)):
        records = _index_records(windows.piece(number, place[0], room), _connections_in(info))
    return records


def _connections_in(info: ChunkInfo) -> int:
    return sum(count > 0 for count in info.counts.values())


class _Windows:
    """Parts of a file that are read in order, with prefetching.

    Args:
        file: the file.
        places: begin and end of each, ascending.
    """

    def __init__(self, file: FileBytes, places: Sequence[tuple[int, int]]) -> None:
        self._file = file
        self._places = places
        self._last = (-1, b"")

    def _read(self, number: int) -> bytes:
        if number == 0:
            self._file.expect(self._places[:_AHEAD])
        if number % _AHEAD == 0:  # prefetch while these are read
            self._file.expect(self._places[number + _AHEAD : number + 2 * _AHEAD])
        begin, end = self._places[number]
        self._last = (number, self._file.up_to(begin, end - begin))
        return self._last[1]

    def before(self, number: int, position: int) -> bytes:
        """Return the bytes of the previous window from a position on; empty if the position is not in it."""
        first, end = self._places[number - 1] if number and self._last[0] == number - 1 else (0, 0)
        return self._last[1][position - first :] if first <= position < end else b""

    def piece(self, number: int, begin: int, size: int) -> bytes:
        """Return bytes that should be in a window; they are read separately if they are not."""
        if self._last[0] != number:
            self._read(number)
        start = begin - self._places[number][0]
        found = self._last[1][start : start + size] if start >= 0 else b""
        return found if len(found) == size else self._file.at(begin, size)


def _chunk(file: FileBytes, position: int, ahead: bytes) -> Chunk:
    """Read a chunk's header, from the bytes already read if they suffice."""
    length = _U32.unpack_from(ahead)[0] if len(ahead) >= 4 else _MAX_HEADER_BYTES
    if length + 8 > len(ahead):
        length = _U32.unpack(file.at(position, 4))[0]
        if length > _MAX_HEADER_BYTES:
            raise damaged(file, position)
        ahead = file.at(position, length + 8)
    fields = fields_of(ahead[4 : 4 + length])
    if fields is None or fields.get("op") != bytes([_CHUNK]):
        raise damaged(file, position)
    stored = _U32.unpack_from(ahead, 4 + length)[0]
    return Chunk(
        position + 8 + length,
        stored,
        int.from_bytes(fields.get("size", b""), "little"),
        fields.get("compression", b"").decode("utf-8", "replace"),
    )


def _index_records(block: bytes, wanted: int) -> _Block | None:
    """Return the entries of the wanted number of connections, or fewer if the block ends; None if damaged or truncated."""
    records: list[tuple[int, bytes]] = []
    place = 0
    while place + 8 <= len(block) and len(records) < wanted:
        length = _U32.unpack_from(block, place)[0]
        header = block[place + 4 : place + 4 + length]
        start = place + 8 + length
        if start > len(block):
            return None
        size = _U32.unpack_from(block, start - 4)[0]
        mark = header.find(b"conn=")
        if b"op=\x04" in header and mark >= 0:
            if start + size > len(block) or size % _ENTRY.itemsize:
                return None
            records.append((_U32.unpack_from(header, mark + 5)[0], block[start : start + size]))
        place = start + size
    return _Block(records, place)


def _merged(parts: Sequence[tuple[int, bytes]]) -> MessageIndex:
    entries = np.frombuffer(b"".join(data for _, data in parts), dtype=_ENTRY)
    receive_ns = entries["sec"].astype(np.int64) * 1_000_000_000 + entries["nanosec"]
    lengths = [len(data) // _ENTRY.itemsize for _, data in parts]
    chunk = np.repeat(np.array([number for number, _ in parts], dtype=np.int64), lengths)
    return MessageIndex.sorted_from(receive_ns, chunk, entries["offset"].astype(np.int64))
