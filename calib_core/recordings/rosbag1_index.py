"""The index of a ROS 1 bag: connections and chunks from the file's tail, messages from the block behind each chunk."""

import struct
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.chunks import FIRST_CHUNKS, ChannelFilter, Chunk
from calib_core.recordings.files import FileBytes, FileStretch, Stretch
from calib_core.recordings.rosbag1_recovery import fields_of
from calib_core.recordings.sources import Channel, MessageIndex

__all__ = [
    "CONNECTION",
    "MESSAGE",
    "BagIndex",
    "ChunkInfo",
    "channel_of",
    "counts_of",
    "damaged",
    "first_chunks",
    "read_indexes",
    "read_tail",
]

MESSAGE, _CHUNK, _CHUNK_INFO, CONNECTION = 2, 5, 6, 7
_U32 = struct.Struct("<I")
_ENTRY = np.dtype([("sec", "<u4"), ("nanosec", "<u4"), ("offset", "<u4")])
_MAX_HEADER_BYTES = 1 << 24
_MAX_INDEX_BYTES = 1 << 26
_HEAD_BYTES = 256
_BLOCK_BYTES = 128  # more than the head of an index record
_AHEAD = 256


@dataclass(frozen=True, slots=True)
class ChunkInfo:
    """What the tail says about one chunk.

    Attributes:
        position: of its record in the file.
        start_ns: when its first message was received.
        counts: of messages, by connection.
    """

    position: int
    start_ns: int
    counts: Mapping[int, int]


@dataclass(frozen=True, slots=True, eq=False)
class BagIndex:
    """Chunks, and where the messages of each connection lie in them."""

    chunks: list[Chunk]
    indexes: Mapping[int, MessageIndex]


def damaged(file: FileBytes, position: int) -> RecordingError:
    """Say that a record is damaged."""
    return RecordingError(
        f"{file.path}: the record at byte {position} is damaged, or the bag was not closed properly; "
        f"repair it first: rosbag reindex {file.path.name}"
    )


# -- the tail


def read_tail(
    file: FileBytes, position: int, first_of: ChannelFilter | None = None
) -> tuple[tuple[Channel, ...], list[ChunkInfo]]:
    """Read connections and chunk infos, which follow one another to the end of the file.

    Args:
        file: the bag.
        position: where they begin.
        first_of: stop when chunks with messages of all these channels are found; None reads everything.

    Raises:
        RecordingError: one of them is damaged.
    """
    stretch = FileStretch(file, position, file.size_bytes - position)
    tail = _Tail({}, [])
    place = 0
    while place < stretch.size:
        header, size = _head(stretch, place, file, position)
        data = place + 8 + len(header)
        if data + size > stretch.size or not tail.note(header, stretch.up_to(data, size)):
            raise damaged(file, position + place)
        place = data + size
        if first_of is not None and tail.shows(first_of):
            break
    return tuple(tail.channels.values()), tail.infos


@dataclass(slots=True)
class _Tail:
    """What is found in the tail."""

    channels: dict[int, Channel]
    infos: list[ChunkInfo]
    shape: "_InfoShape | None" = None

    def shows(self, first_of: ChannelFilter) -> bool:
        """Tell whether some chunks are known, and the channels are in them."""
        if not self.infos or len(self.infos) % FIRST_CHUNKS:
            return False
        wanted = {channel.id for channel in self.channels.values() if first_of(channel)}
        return bool(wanted) and wanted <= counts_of(self.infos).keys()

    def note(self, header: bytes, data: bytes) -> bool:
        """Note a record; False where it is damaged."""
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


def _head(stretch: Stretch, place: int, file: FileBytes, origin: int) -> tuple[bytes, int]:
    """Return a record's header and the size of its data."""
    head = stretch.up_to(place, _HEAD_BYTES)
    length = _U32.unpack_from(head)[0] if len(head) >= 4 else _MAX_HEADER_BYTES
    if length + 8 > len(head) and length < _MAX_HEADER_BYTES:
        head = stretch.up_to(place, length + 8)
    if length + 8 > len(head):
        raise damaged(file, origin + place)
    return head[4 : 4 + length], _U32.unpack_from(head, 4 + length)[0]


@dataclass(frozen=True, slots=True)
class _InfoShape:
    """Where a chunk info's header has its fields: recorders write all of them alike."""

    length: int
    kind: int
    position: int
    start: int

    @classmethod
    def of(cls, header: bytes) -> "_InfoShape | None":
        fields = fields_of(header) or {}
        if len(fields.get("chunk_pos", b"")) != 8 or len(fields.get("start_time", b"")) != 8:
            return None
        places = [header.find(name) for name in (b"\x04\0\0\0op=", b"\x12\0\0\0chunk_pos=", b"\x13\0\0\0start_time=")]
        return None if min(places) < 0 else cls(len(header), *places)

    def fits(self, header: bytes) -> bool:
        return (
            len(header) == self.length
            and header.startswith(b"\x04\0\0\0op=\x06", self.kind)
            and header.startswith(b"\x12\0\0\0chunk_pos=", self.position)
            and header.startswith(b"\x13\0\0\0start_time=", self.start)
        )

    def info(self, header: bytes, data: bytes) -> ChunkInfo:
        sec, nanosec = struct.unpack_from("<II", header, self.start + 15)
        numbers = struct.unpack_from(f"<{len(data) // 8 * 2}I", data)
        counts = dict(zip(numbers[::2], numbers[1::2], strict=True))
        position = int.from_bytes(header[self.position + 14 : self.position + 22], "little")
        return ChunkInfo(position, sec * 1_000_000_000 + nanosec, counts)


def channel_of(header: Mapping[str, bytes], data: bytes) -> Channel | None:
    """Read a connection record; None where it is damaged."""
    fields = fields_of(data)
    if fields is None or "conn" not in header:
        return None
    return Channel(
        id=_number(header["conn"], 4),
        topic=_text(header.get("topic", b"")),
        type=_text(fields.get("type", b"")),
        encoding="ros1",
        definition=_text(fields.get("message_definition", b"")),
        definition_format="msg" if fields.get("message_definition") else "",
    )


# -- the blocks behind the chunks


def counts_of(infos: Iterable[ChunkInfo]) -> Mapping[int, int]:
    """Add up the messages of each connection."""
    total: Counter[int] = Counter()
    for info in infos:
        total.update(info.counts)
    return total


def first_chunks(infos: Iterable[ChunkInfo], connections: Iterable[int]) -> list[ChunkInfo]:
    """Return the chunks with which these connections begin, each once, in order of their places."""
    earliest = sorted(infos, key=lambda info: (info.start_ns, info.position))
    found = [next((info for info in earliest if info.counts.get(number)), None) for number in connections]
    return sorted({info.position: info for info in found if info is not None}.values(), key=lambda info: info.position)


def read_indexes(file: FileBytes, infos: Sequence[ChunkInfo], end: int, picked: Sequence[ChunkInfo]) -> BagIndex:
    """Read the index blocks that follow each chunk.

    One read gets the block of a chunk and the head of the next one.

    Args:
        file: the bag.
        infos: of all chunks.
        end: where the last block ends.
        picked: those to read.

    Raises:
        RecordingError: a chunk or a block is damaged.
    """
    ordered = sorted(infos, key=lambda info: info.position)
    following = [info.position for info in ordered[1:]] + [end] * bool(ordered)
    wanted = {info.position for info in picked}
    places = [(info, after) for info, after in zip(ordered, following, strict=True) if info.position in wanted]
    chunks: list[Chunk] = []
    found: dict[int, list[tuple[int, bytes]]] = {}
    windows = _Windows(file, [_window(info, after) for info, after in places])
    for number, (info, after) in enumerate(places):
        chunk = _chunk(file, info.position, windows.before(number, info.position))
        chunks.append(chunk)
        begin = chunk.position + chunk.stored_bytes
        if after - begin > _MAX_INDEX_BYTES:
            raise damaged(file, begin)
        block = windows.block(number, begin, after) if after > begin else b""
        for connection, entries in _index_records(file, block, begin):
            found.setdefault(connection, []).append((number, entries))
    return BagIndex(chunks, {connection: _merged(parts) for connection, parts in found.items()})


def _window(info: ChunkInfo, following: int) -> tuple[int, int]:
    """Guess where the block of a chunk begins, and go on past the head of the next chunk."""
    guess = sum(_BLOCK_BYTES + count * _ENTRY.itemsize for count in info.counts.values())
    return max(info.position, following - min(guess, _MAX_INDEX_BYTES)), following + _HEAD_BYTES


class _Windows:
    """Stretches of a file that are read one after another, the disk told about those to come.

    Args:
        file: the file.
        places: where each begins and ends, ascending.
    """

    def __init__(self, file: FileBytes, places: Sequence[tuple[int, int]]) -> None:
        self._file = file
        self._places = places
        self._last = (-1, b"")

    def _read(self, number: int) -> bytes:
        if number % _AHEAD == 0:
            self._file.expect(self._places[number : number + _AHEAD])
        begin, end = self._places[number]
        self._last = (number, self._file.up_to(begin, end - begin))
        return self._last[1]

    def before(self, number: int, position: int) -> bytes:
        """Return what the window before this one has from a position on; nothing where that is not in it."""
        first, end = self._places[number - 1] if number and self._last[0] == number - 1 else (0, 0)
        return self._last[1][position - first :] if first <= position < end else b""

    def block(self, number: int, begin: int, end: int) -> bytes:
        """Return the bytes from begin to end, the end of a window less the head of what follows."""
        data = self._read(number)
        first = self._places[number][0]
        if begin < first:
            return self._file.at(begin, end - begin)
        block = data[begin - first : end - first]
        return block if len(block) == end - begin else self._file.at(begin, end - begin)


def _chunk(file: FileBytes, position: int, ahead: bytes) -> Chunk:
    """Read a chunk's header, from bytes that are there already if they are enough."""
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
        position + 8 + length, stored, _number(fields.get("size", b""), 4), _text(fields.get("compression", b""))
    )


def _index_records(file: FileBytes, block: bytes, position: int) -> list[tuple[int, bytes]]:
    """Return the entries of each connection."""
    records: list[tuple[int, bytes]] = []
    place = 0
    while place + 8 <= len(block):
        length = _U32.unpack_from(block, place)[0]
        header = block[place + 4 : place + 4 + length]
        start = place + 8 + length
        if start > len(block):
            raise damaged(file, position + place)
        size = _U32.unpack_from(block, start - 4)[0]
        mark = header.find(b"conn=")
        if b"op=\x04" in header and mark >= 0:
            if start + size > len(block) or size % _ENTRY.itemsize:
                raise damaged(file, position + place)
            records.append((_U32.unpack_from(header, mark + 5)[0], block[start : start + size]))
        place = start + size
    return records


def _merged(parts: Sequence[tuple[int, bytes]]) -> MessageIndex:
    entries = np.frombuffer(b"".join(data for _, data in parts), dtype=_ENTRY)
    receive_ns = entries["sec"].astype(np.int64) * 1_000_000_000 + entries["nanosec"]
    lengths = [len(data) // _ENTRY.itemsize for _, data in parts]
    chunk = np.repeat(np.array([number for number, _ in parts], dtype=np.int64), lengths)
    return MessageIndex.sorted_from(receive_ns, chunk, entries["offset"].astype(np.int64))


def _number(value: bytes, size: int) -> int:
    return int.from_bytes(value, "little") if len(value) == size else -1


def _text(value: bytes) -> str:
    return value.decode("utf-8", "replace")
