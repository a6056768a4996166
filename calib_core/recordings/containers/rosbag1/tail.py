"""Read the tail of a ROS 1 bag: its connections and chunk infos."""

import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from calib_core.errors import RecordingError
from calib_core.recordings.containers.chunks import FIRST_CHUNKS, ChannelFilter
from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch, Stretch
from calib_core.recordings.containers.rosbag1.records import fields_of
from calib_core.recordings.containers.sources import Channel

_CHUNK_INFO, CONNECTION = 6, 7
_U32 = struct.Struct("<I")
_MAX_HEADER_BYTES = 1 << 24
_HEAD_BYTES = 256
_INFO_NAMES = (b"\x12\0\0\0chunk_pos=", b"\x13\0\0\0start_time=", b"\x11\0\0\0end_time=")


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


def damaged(file: FileBytes, position: int) -> RecordingError:
    """Return the error for a damaged record."""
    return RecordingError(
        f"{file.path}: the record at byte {position} is damaged, or the bag was not closed properly; "
        f"repair it first: rosbag reindex {file.path.name}"
    )


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


def record_head(stretch: Stretch, place: int, file: FileBytes, origin: int) -> tuple[bytes, int]:
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
        id=_number(header["conn"], 4),
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


def first_chunks(infos: Iterable[ChunkInfo], connections: Iterable[int]) -> list[ChunkInfo]:
    """Return the first chunk of each of these connections, without duplicates, in file order."""
    earliest = sorted(infos, key=lambda info: (info.start_ns, info.position))
    found = [next((info for info in earliest if info.counts.get(number)), None) for number in connections]
    return sorted({info.position: info for info in found if info is not None}.values(), key=lambda info: info.position)


def _number(value: bytes, size: int) -> int:
    return int.from_bytes(value, "little") if len(value) == size else -1


def _text(value: bytes) -> str:
    return value.decode("utf-8", "replace")
