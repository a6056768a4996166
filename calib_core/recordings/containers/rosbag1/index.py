"""Read the index of a ROS 1 bag: connections and chunk infos in its tail, and the index block after each chunk."""

import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.containers.chunks import FIRST_CHUNKS, ChannelFilter, Chunk
from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch, Stretch
from calib_core.recordings.containers.sources import Channel, MessageIndex

_INDEX, _CHUNK, _CHUNK_INFO, CONNECTION = 4, 5, 6, 7
_INFO_NAMES = (b"\x12\0\0\0chunk_pos=", b"\x13\0\0\0start_time=", b"\x11\0\0\0end_time=")
_U32 = struct.Struct("<I")
_ENTRY = np.dtype([("sec", "<u4"), ("nanosec", "<u4"), ("offset", "<u4")])
_MAX_HEADER_BYTES = 1 << 24
_MAX_INDEX_BYTES = 1 << 26
_HEAD_BYTES = 256
_BLOCK_BYTES = 128  # longer than the header of an index record
_AHEAD = 256
_GAP_BYTES = 64


@dataclass(frozen=True, slots=True)
class ChunkInfo:
    """The tail's entry for one chunk.

    Attributes:
        position: of its record in the file.
        start_ns: when its first message was received.
        end_ns: when its last message was received.
        counts: number of messages by connection.
    """

    position: int
    start_ns: int
    end_ns: int
    counts: Mapping[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class BagIndex:
    """Chunks, and the locations of each connection's messages in them."""

    chunks: list[Chunk]
    indexes: Mapping[int, MessageIndex]


def read_tail(
    file: FileBytes, position: int, first_of: ChannelFilter | None = None
) -> tuple[tuple[Channel, ...], list[ChunkInfo]]:
    """Read connections and chunk infos, which extend to the end of the file.

    Args:
        file: the bag.
        position: of the first of them.
        first_of: stop when chunks with messages of all these channels are found; None reads everything.

    Raises:
        RecordingError: one of them is damaged.
    """
    stretch = FileStretch(file, position, file.size_bytes - position)
    tail = _Tail({}, [])
    place = 0
    while place < stretch.size:
        header, size = record_head(stretch, place, file, position)
        data = place + 8 + len(header)
        if data + size > stretch.size or not tail.note(header, stretch.up_to(data, size)):
            raise damaged(file, position + place)
        place = data + size
        if first_of is not None and tail.shows(first_of):
            break
    return tuple(tail.channels.values()), tail.infos


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


@dataclass(slots=True)
class _Tail:
    """The contents of the tail read so far."""

    channels: dict[int, Channel]
    infos: list[ChunkInfo]
    shape: "_InfoShape | None" = None

    def shows(self, first_of: ChannelFilter) -> bool:
        """Return whether the wanted channels are known, and all of them occur in the chunks seen so far."""
        count = len(self.infos)
        if count < FIRST_CHUNKS or count & (count - 1):  # checked again each time their number doubles
            return False
        wanted = {channel.id for channel in self.channels.values() if first_of(channel)}
        return bool(wanted) and wanted <= counts_of(self.infos).keys()

    def note(self, header: bytes, data: bytes) -> bool:
        """Record an entry; False if it is damaged."""
        if self.shape is not None and self.shape.fits(header):
            self.infos.append(self.shape.info(header, data))
            return True
        fields = fields_of(header)
        kind = fields.get("op") if fields is not None else None
        if kind == bytes([_CHUNK_INFO]):
            self.shape = _InfoShape.of(header)
            if self.shape is not None:
                self.infos.append(self.shape.info(header, data))
            return self.shape is not None
        if fields is not None and kind == bytes([CONNECTION]):
            channel = channel_of(fields, data)
            if channel is not None:
                self.channels[channel.id] = channel
            return channel is not None
        return fields is not None


@dataclass(frozen=True, slots=True)
class _InfoShape:
    """The field offsets in a chunk info's header: recorders write all of them with the same layout."""

    length: int
    kind: int
    position: int
    start: int
    end: int

    @classmethod
    def of(cls, header: bytes) -> "_InfoShape | None":
        fields = fields_of(header) or {}
        if any(len(fields.get(name, b"")) != 8 for name in ("chunk_pos", "start_time", "end_time")):
            return None
        places = [header.find(name) for name in (b"\x04\0\0\0op=", *_INFO_NAMES)]
        return None if min(places) < 0 else cls(len(header), *places)

    def fits(self, header: bytes) -> bool:
        return (
            len(header) == self.length
            and header.startswith(b"\x04\0\0\0op=\x06", self.kind)
            and all(
                header.startswith(name, place)
                for name, place in zip(_INFO_NAMES, (self.position, self.start, self.end), strict=True)
            )
        )

    def info(self, header: bytes, data: bytes) -> ChunkInfo:
        sec, nanosec = struct.unpack_from("<II", header, self.start + 15)
        last_sec, last_nanosec = struct.unpack_from("<II", header, self.end + 13)
        numbers = struct.unpack_from(f"<{len(data) // 8 * 2}I", data)
        counts = dict(zip(numbers[::2], numbers[1::2], strict=True))
        position = int.from_bytes(header[self.position + 14 : self.position + 22], "little")
        return ChunkInfo(position, sec * 1_000_000_000 + nanosec, last_sec * 1_000_000_000 + last_nanosec, counts)


def channel_of(header: Mapping[str, bytes], data: bytes) -> Channel | None:
    """Read a connection record; None if it is damaged."""
    fields = fields_of(data)
    if fields is None or "conn" not in header:
        return None
    return Channel(
        id=int.from_bytes(header["conn"], "little") if len(header["conn"]) == 4 else -1,
        topic=_text(header.get("topic", b"")),
        type=_text(fields.get("type", b"")),
        encoding="ros1",
        definition=_text(fields.get("message_definition", b"")),
        definition_format="msg" if fields.get("message_definition") else "",
    )


def counts_of(infos: Iterable[ChunkInfo]) -> Mapping[int, int]:
    """Add up the messages of each connection."""
    total: dict[int, int] = {}
    for info in infos:
        for connection, count in info.counts.items():
            total[connection] = total.get(connection, 0) + count
    return total


def damaged(file: FileBytes, position: int) -> RecordingError:
    """Return the error for a damaged record."""
    return RecordingError(
        f"{file.path}: the record at byte {position} is damaged, or the bag was not closed properly; "
        f"repair it first: rosbag reindex {file.path.name}"
    )


def record_head(stretch: Stretch, index: int, file: FileBytes, origin: int) -> tuple[bytes, int]:
    """Return a record's header and the size of its data."""
    head = stretch.up_to(index, _HEAD_BYTES)
    length = _U32.unpack_from(head)[0] if len(head) >= 4 else _MAX_HEADER_BYTES
    if length + 8 > len(head) and length < _MAX_HEADER_BYTES:
        head = stretch.up_to(index, length + 8)
    if length + 8 > len(head):
        raise damaged(file, origin + index)
    return head[4 : 4 + length], _U32.unpack_from(head, 4 + length)[0]


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


def first_chunks(infos: Iterable[ChunkInfo], connections: Iterable[int]) -> list[ChunkInfo]:
    """Return the first chunk of each of these connections, without duplicates, in file order."""
    earliest = sorted(infos, key=lambda info: (info.start_ns, info.position))
    found = [next((info for info in earliest if info.counts.get(number)), None) for number in connections]
    return sorted({info.position: info for info in found if info is not None}.values(), key=lambda info: info.position)


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
        if kind != bytes([CONNECTION]) and not (kind == bytes([_INDEX]) and size == 0):
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


def _text(value: bytes) -> str:
    return value.decode("utf-8", "replace")
