"""Read ROS 1 bags, version 2.0: index from the file's tail, messages by position."""

import re
import struct
from collections.abc import Mapping

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.containers.chunks import ChannelFilter, ChunkedSource
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.rosbag1.index import (
    CONNECTION,
    ChunkInfo,
    channel_of,
    counts_of,
    damaged,
    fields_of,
    first_chunks,
    read_indexes,
    read_tail,
)
from calib_core.recordings.containers.rosbag1.recovery import FoundInBag, scan_bag
from calib_core.recordings.containers.sources import Channel

_MAGIC = re.compile(rb"#ROSBAG V(\d+)\.(\d+)\n")
_MESSAGE, _BAG_HEADER = 2, 3
_U32 = struct.Struct("<I")
_MESSAGE_HEADER_BYTES = 38  # conn, op and time fields, in any order
_MAX_HEADER_BYTES = 1 << 24


class Rosbag1Source(ChunkedSource):
    """One ROS 1 bag. Opening reads its tail and one index block per chunk.

    Args:
        file: the bag.
        first_of: read only the first chunks of these channels, and refuse a damaged bag; None reads all.
    """

    format_name = "ROS 1 bag"
    lead_bytes = 4 + _MESSAGE_HEADER_BYTES + 4

    def __init__(self, file: FileBytes, *, first_of: ChannelFilter | None = None) -> None:
        super().__init__(file, whole=first_of is None)
        head = file.up_to(0, 4096)
        magic = _MAGIC.match(head)
        if not magic or magic.groups() != (b"2", b"0"):
            version = ".".join(part.decode() for part in magic.groups()) if magic else "?"
            raise RecordingError(
                f"{file.path}: a ROS 1 bag of version {version}; only 2.0 is supported: rosbag migrate"
            )
        header, after = self._record(magic.end(), _BAG_HEADER)
        if header.get("encryptor"):
            raise RecordingError(f"{file.path}: the bag is encrypted; decrypt it first: rosbag decrypt")
        self._open(header, after[0] + after[1], first_of)

    def _open(self, header: Mapping[str, bytes], start: int, first_of: ChannelFilter | None) -> None:
        """Read the index, or build one by scanning from the first record after the header."""
        if self.restore():
            return
        try:
            infos, end = self._read_tail(header, first_of)
            self._read_indexes(infos, (start, end), first_of)
        except RecordingError as fault:
            if first_of is not None:
                raise
            self._recover(start, fault)
        self.keep()

    def _read_tail(self, header: Mapping[str, bytes], first_of: ChannelFilter | None) -> tuple[list[ChunkInfo], int]:
        """Read connections and chunk infos; return the latter, and the end of the last chunk."""
        position = _number(header.get("index_pos", b""), 8)
        if not 0 < position <= self.size_bytes:
            raise RecordingError(
                f"{self.path}: the bag was not closed properly and has no index (recorder killed, or copy truncated); "
                f"repair it first: rosbag reindex {self.path.name}"
            )
        self.channels, infos = read_tail(self.file, position, first_of)
        count = _number(header.get("chunk_count", b""), 4)
        if first_of is not None and len(infos) < count:
            last = max(infos, key=lambda info: info.position, default=None)
            return [info for info in infos if info is not last], last.position if last else position
        if len(infos) != count:
            raise damaged(self.file, position)
        return infos, position

    def _read_indexes(self, infos: list[ChunkInfo], span: tuple[int, int], first_of: ChannelFilter | None) -> None:
        """Read the locations of the messages."""
        self.counts = counts_of(infos)
        picked = None if first_of is None else first_chunks(infos, [c.id for c in self.channels if first_of(c)])
        found = read_indexes(self.file, infos, span, picked)
        if first_of is None and not found.indexes.keys() <= {channel.id for channel in self.channels}:
            raise damaged(self.file, span[1])
        self.chunks = found.chunks
        for connection, index in found.indexes.items():
            self.note_index(connection, index)
        if sum(map(len, self.indexes.values())) < sum(counts_of(infos if picked is None else picked).values()):
            raise damaged(self.file, span[1])

    def _recover(self, start: int, fault: RecordingError) -> None:
        """Index a bag with a missing or damaged index by scanning all of it."""
        bag = scan_bag(self.file, start)
        if not self.take(bag, channels_of(bag).values(), tool="rosbag reindex"):
            raise RecordingError(
                f"{fault}; all of its {self.size_bytes} bytes were searched without finding a complete message"
            )

    # -- opening

    def _record(self, position: int, expected: int | None = None) -> tuple[dict[str, bytes], tuple[int, int]]:
        """Read a record's header; return its fields, and the position and size of its data."""
        length = _U32.unpack(self.file.at(position, 4))[0]
        if length > _MAX_HEADER_BYTES:
            raise damaged(self.file, position)
        raw = self.file.at(position + 4, length + 4)
        fields = fields_of(raw[:length])
        if fields is None or (expected is not None and _number(fields.get("op", b""), 1) != expected):
            raise damaged(self.file, position)
        return fields, (position + 8 + length, _U32.unpack_from(raw, length)[0])

    # -- reading

    def locate(self, chunk: int, offset: int) -> tuple[int, int]:
        """Return the offset of the message and its length, skipping connection records before it."""
        for _ in range(1000):
            head = self.piece(chunk, offset, 256)
            length = _U32.unpack_from(head)[0] if len(head) >= 4 else _MAX_HEADER_BYTES
            if length < _MAX_HEADER_BYTES and length + 8 > len(head):
                head = self.piece(chunk, offset, length + 8)
            if length + 8 > len(head):
                break
            fields = fields_of(head[4 : 4 + length])
            size = _U32.unpack_from(head, 4 + length)[0]
            kind = _number(fields.get("op", b""), 1) if fields else 0
            if kind == _MESSAGE:
                return offset + 8 + length, size
            if kind != CONNECTION:
                break
            offset += 8 + length + size
        raise RecordingError(
            f"{self.path}: no message at the indexed position (chunk {chunk}, byte {offset}); the bag is damaged: "
            f"rosbag reindex {self.path.name}"
        )

    def usual(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Recognize plain message records: a header of 38 bytes, with op=2 at the same offset as in the first record."""
        words = np.ascontiguousarray(rows[:, [0, 1, 2, 3, 42, 43, 44, 45]]).view("<u4")
        mark = rows[0].tobytes().find(b"op=\x02")
        usual = words[:, 0] == _MESSAGE_HEADER_BYTES
        if mark < 0:
            return np.zeros(len(rows), dtype=bool), words[:, 1].astype(np.int64)
        usual &= (rows[:, mark : mark + 4] == np.frombuffer(b"op=\x02", dtype=np.uint8)).all(axis=1)
        return usual, words[:, 1].astype(np.int64)


def channels_of(bag: FoundInBag) -> dict[int, Channel]:
    """Return the channels that a scan has found, by number."""
    channels = (channel_of(fields, data) for fields, data in bag.connections.values())
    return {channel.id: channel for channel in channels if channel is not None}


def _number(value: bytes, size: int) -> int:
    return int.from_bytes(value, "little") if len(value) == size else -1
