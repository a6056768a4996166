"""ROS 1 bags, version 2.0: the index from the file's tail, messages by position."""

import re
import struct
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.chunks import Chunk, ChunkedSource
from calib_core.recordings.recovery import about_recovery
from calib_core.recordings.rosbag1_recovery import fields_of, scan_bag
from calib_core.recordings.sources import Channel, MessageIndex

if TYPE_CHECKING:
    from calib_core.recordings.files import FileBytes

__all__ = ["Rosbag1Source"]

_MAGIC = re.compile(rb"#ROSBAG V(\d+)\.(\d+)\n")
_MESSAGE, _BAG_HEADER, _INDEX, _CHUNK, _CHUNK_INFO, _CONNECTION = 2, 3, 4, 5, 6, 7
_U32 = struct.Struct("<I")
_ENTRY = np.dtype([("sec", "<u4"), ("nanosec", "<u4"), ("offset", "<u4")])
_MESSAGE_HEADER_BYTES = 38  # conn, op and time fields, in any order
_MAX_HEADER_BYTES = 1 << 24
_MAX_INDEX_BYTES = 1 << 26


class Rosbag1Source(ChunkedSource):
    """One ROS 1 bag. Opening reads its tail and one index block per chunk."""

    format_name = "ROS 1 bag"
    lead_bytes = 4 + _MESSAGE_HEADER_BYTES + 4

    def __init__(self, file: "FileBytes") -> None:
        super().__init__(file)
        head = file.up_to(0, 4096)
        magic = _MAGIC.match(head)
        if not magic or magic.groups() != (b"2", b"0"):
            version = ".".join(part.decode() for part in magic.groups()) if magic else "?"
            raise RecordingError(f"{file.path}: a ROS 1 bag of version {version}; only 2.0 can be read: rosbag migrate")
        header, after = self._record(magic.end(), _BAG_HEADER)
        if header.get("encryptor"):
            raise RecordingError(f"{file.path}: the bag is encrypted; decrypt it first: rosbag decrypt")
        if self.restore():
            return
        index_position = _number(header.get("index_pos", b""), 8)
        try:
            if not 0 < index_position <= file.size_bytes:
                raise RecordingError(
                    f"{file.path}: the bag was not closed properly and has no index (recorder killed, or copy cut short); "
                    f"repair it first: rosbag reindex {file.path.name}"
                )
            infos = self._read_tail(index_position)
            if len(infos) != _number(header.get("chunk_count", b""), 4):
                raise self._damaged(index_position)
            self._read_indexes(sorted(place for place, _ in infos), index_position)
            if sum(map(len, self.indexes.values())) < sum(count for _, count in infos):
                raise self._damaged(index_position)
        except RecordingError as fault:
            self._recover(after[0] + after[1], fault)
        self.keep()

    def _recover(self, start: int, fault: RecordingError) -> None:
        """Index a bag that has no index, or a damaged one, by walking over all of it."""
        found = scan_bag(self.file, start)
        self.recovered = True
        self.chunks = found.chunks
        channels: dict[int, Channel] = {}
        for fields, data in found.connections.values():
            if fields_of(data) is not None:
                channel = self._channel(fields, data, 0)
                channels[channel.id] = channel
        self.channels = tuple(channels.values())
        known = {number: entries for number, entries in found.messages.items() if number in channels}
        if not known:
            raise RecordingError(
                f"{fault}; all of its {self.size_bytes} bytes were searched, and there is no whole message in them"
            )
        self.indexes = {}
        for connection, entries in known.items():
            columns = np.array(entries, dtype=np.int64)
            self.note_index(connection, MessageIndex.sorted_from(columns[:, 0], columns[:, 1], columns[:, 2]))
        count = sum(map(len, found.messages.values()))
        caution = about_recovery(
            self.path,
            messages=count,
            lost_bytes=found.lost_bytes,
            tool="rosbag reindex",
            damaged_chunks=found.damaged_chunks,
            fault=found.fault,
            unknown=count - sum(map(len, known.values())),
        )
        self.cautions = (*self.file.cautions, caution)

    # -- opening

    def _record(self, position: int, expected: int | None = None) -> tuple[dict[str, bytes], tuple[int, int]]:
        """Read a record's header; return its fields, and the position and size of its data."""
        length = _U32.unpack(self.file.at(position, 4))[0]
        if length > _MAX_HEADER_BYTES:
            raise self._damaged(position)
        raw = self.file.at(position + 4, length + 4)
        fields = fields_of(raw[:length])
        if fields is None or (expected is not None and _number(fields.get("op", b""), 1) != expected):
            raise self._damaged(position)
        return fields, (position + 8 + length, _U32.unpack_from(raw, length)[0])

    def _damaged(self, position: int) -> RecordingError:
        return RecordingError(
            f"{self.path}: the record at byte {position} is damaged, or the bag was not closed properly; "
            f"repair it first: rosbag reindex {self.path.name}"
        )

    def _read_tail(self, position: int) -> list[tuple[int, int]]:
        """Read connections, and each chunk's place and count of messages, which follow one another to the end."""
        channels: dict[int, Channel] = {}
        infos: list[tuple[int, int]] = []
        while position < self.size_bytes:
            header, (data, size) = self._record(position)
            kind = _number(header.get("op", b""), 1)
            if kind == _CONNECTION:
                channel = self._channel(header, self.file.at(data, size), position)
                channels[channel.id] = channel
            elif kind == _CHUNK_INFO:
                counts = np.frombuffer(self.file.at(data, size // 8 * 8), dtype="<u4")[1::2]
                infos.append((_number(header.get("chunk_pos", b""), 8), int(counts.sum(dtype=np.int64))))
            position = data + size
        if position > self.size_bytes:
            raise self._damaged(position - size)
        self.channels = tuple(channels.values())
        return infos

    def _channel(self, header: dict[str, bytes], data: bytes, position: int) -> Channel:
        fields = fields_of(data)
        if fields is None or "conn" not in header:
            raise self._damaged(position)
        return Channel(
            id=_number(header["conn"], 4),
            topic=_text(header.get("topic", b"")),
            type=_text(fields.get("type", b"")),
            encoding="ros1",
            definition=_text(fields.get("message_definition", b"")),
            definition_format="msg" if fields.get("message_definition") else "",
        )

    def _read_indexes(self, positions: list[int], end: int) -> None:
        """Read the index blocks that follow each chunk."""
        found: dict[int, list[tuple[int, np.ndarray]]] = {}
        for number, (position, following) in enumerate(pairwise([*positions, end])):
            header, (data, size) = self._record(position, _CHUNK)
            compression = _text(header.get("compression", b""))
            self.chunks.append(Chunk(data, size, _number(header.get("size", b""), 4), compression))
            if following - data - size > _MAX_INDEX_BYTES:
                raise self._damaged(data + size)
            block = self.file.at(data + size, following - data - size) if following > data + size else b""
            for connection, entries in self._index_records(block, data + size):
                found.setdefault(connection, []).append((number, entries))
        for connection, parts in found.items():
            entries = np.concatenate([entries for _, entries in parts])
            receive_ns = entries["sec"].astype(np.int64) * 1_000_000_000 + entries["nanosec"]
            chunk = np.repeat([number for number, _ in parts], [len(entries) for _, entries in parts])
            offset = entries["offset"].astype(np.int64)
            self.note_index(connection, MessageIndex.sorted_from(receive_ns, chunk.astype(np.int64), offset))

    def _index_records(self, block: bytes, position: int) -> list[tuple[int, np.ndarray]]:
        records: list[tuple[int, np.ndarray]] = []
        place = 0
        while place + 8 <= len(block):
            length = _U32.unpack_from(block, place)[0]
            header = block[place + 4 : place + 4 + length]
            start = place + 8 + length
            if start > len(block):
                raise self._damaged(position + place)
            size = _U32.unpack_from(block, start - 4)[0]
            mark = header.find(b"conn=")
            if b"op=\x04" in header and mark >= 0:
                if start + size > len(block) or size % _ENTRY.itemsize:
                    raise self._damaged(position + place)
                entries = np.frombuffer(block, dtype=_ENTRY, count=size // _ENTRY.itemsize, offset=start)
                records.append((_U32.unpack_from(header, mark + 5)[0], entries))
            place = start + size
        return records

    # -- reading

    def locate(self, chunk: int, offset: int) -> tuple[int, int]:
        """Return where the message begins; connection records in front of it are passed over."""
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
            if kind != _CONNECTION:
                break
            offset += 8 + length + size
        raise RecordingError(
            f"{self.path}: no message where the index says (chunk {chunk}, byte {offset}); the bag is damaged: "
            f"rosbag reindex {self.path.name}"
        )

    def usual(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Recognise plain message records: a header of 38 bytes with op=2 where the first record has it."""
        words = np.ascontiguousarray(rows[:, [0, 1, 2, 3, 42, 43, 44, 45]]).view("<u4")
        mark = rows[0].tobytes().find(b"op=\x02")
        usual = words[:, 0] == _MESSAGE_HEADER_BYTES
        if mark < 0:
            return np.zeros(len(rows), dtype=bool), words[:, 1].astype(np.int64)
        usual &= (rows[:, mark : mark + 4] == np.frombuffer(b"op=\x02", dtype=np.uint8)).all(axis=1)
        return usual, words[:, 1].astype(np.int64)


def _number(value: bytes, size: int) -> int:
    return int.from_bytes(value, "little") if len(value) == size else -1


def _text(value: bytes) -> str:
    return value.decode("utf-8", "replace")
