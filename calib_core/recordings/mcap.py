"""MCAP files: the index from the summary; scanned where there is none."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.chunks import Chunk, ChunkedSource
from calib_core.recordings.sources import Channel, MessageIndex
from calib_core.results import Caution

if TYPE_CHECKING:
    from calib_core.recordings.files import FileBytes

__all__ = ["MAGIC", "McapSource"]

MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _CHUNK_INDEX = 1, 2, 3, 4, 5, 6, 7, 8
_DATA_END = 15
_RECORD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])
_FORMATS = {"ros1msg": "msg", "ros2msg": "msg", "ros2idl": "idl", "omgidl": "idl"}
_MAX_RECORD_BYTES = 1 << 30


@dataclass(slots=True)
class _Schema:
    name: str
    format: str
    text: str


class McapSource(ChunkedSource):
    """One MCAP file. Opening reads its summary and one block of message indexes per chunk."""

    format_name = "MCAP"
    lead_bytes = _RECORD.size + _MESSAGE_HEAD.size

    def __init__(self, file: "FileBytes") -> None:
        super().__init__(file)
        self._schemas: dict[int, _Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._found: dict[int, list[np.ndarray]] = {}
        summary = self._summary_start()
        indexed = self._read_summary(summary) if summary else False
        if not indexed:
            self._scan(whole=summary is not None)
        self.channels = tuple(self._channels.values())
        for channel, parts in self._found.items():
            columns = np.concatenate(parts)
            self.note_index(channel, MessageIndex.sorted_from(columns[:, 0], columns[:, 1], columns[:, 2]))
        self._found.clear()

    # -- opening

    def _summary_start(self) -> int | None:
        """Return where the summary begins, 0 for a file without one, None for a file that was not closed."""
        tail = self.file.up_to(max(0, self.size_bytes - 37), 37)
        if len(tail) < 37 or tail[-8:] != MAGIC or tail[0] != _FOOTER:
            return None
        start = int.from_bytes(tail[9:17], "little")
        if start > self.size_bytes:
            raise self._damaged(self.size_bytes - 37)
        return start

    def _damaged(self, position: int) -> RecordingError:
        return RecordingError(
            f"{self.path}: the record at byte {position} is damaged or cut short; repair it first: "
            f"mcap recover {self.path.name}"
        )

    def _records(self, data: bytes, position: int, *, strict: bool = True) -> Iterator[tuple[int, int, bytes]]:
        """Walk over records: kind, place of the body in data, body."""
        place = 0
        while place + _RECORD.size <= len(data):
            kind, size = _RECORD.unpack_from(data, place)
            start = place + _RECORD.size
            if size > len(data) - start:
                if strict:
                    raise self._damaged(position + place)
                return
            yield kind, start, data[start : start + size]
            place = start + size

    def _read_summary(self, start: int) -> bool:
        """Read the summary and the message indexes; False where it lacks chunk indexes or channels."""
        infos: list[bytes] = []
        for kind, _, body in self._records(self.file.at(start, self.size_bytes - 37 - start), start):
            if kind == _CHUNK_INDEX:
                infos.append(body)
            else:
                self._declare(kind, body, start)
        if not infos or not self._channels:
            return False
        for body in infos:
            self._read_chunk_index(body)
        return True

    def _declare(self, kind: int, body: bytes, position: int) -> None:
        """Note a schema or a channel."""
        try:
            if kind == _SCHEMA:
                number = int.from_bytes(body[:2], "little")
                name, place = _string(body, 2)
                encoding, place = _string(body, place)
                text, _ = _string(body, place)
                self._schemas[number] = _Schema(name, _FORMATS.get(encoding, ""), text)
            elif kind == _CHANNEL:
                number, schema_number = struct.unpack_from("<HH", body)
                topic, place = _string(body, 4)
                encoding, _ = _string(body, place)
                schema = self._schemas.get(schema_number, _Schema("", "", ""))
                has_text = bool(schema.text.strip())
                self._channels[number] = Channel(
                    number, topic, schema.name, encoding, schema.text, schema.format if has_text else ""
                )
        except struct.error:
            raise self._damaged(position) from None

    def _read_chunk_index(self, body: bytes) -> None:
        """Read one chunk's place and the message indexes that follow the chunk."""
        try:
            _, _, start, length, map_bytes = struct.unpack_from("<QQQQI", body)
            index_bytes = struct.unpack_from("<Q", body, 36 + map_bytes)[0]
            compression, place = _string(body, 44 + map_bytes)
            stored, size = struct.unpack_from("<QQ", body, place)
        except struct.error:
            raise self._damaged(self.size_bytes - 37) from None
        number = len(self.chunks)
        position = start + _RECORD.size + 32 + len(compression) + 8
        self.chunks.append(Chunk(position, stored, size, compression))
        if not index_bytes:
            self._scan_chunk(number)
            return
        for kind, _, record in self._records(self.file.at(start + length, index_bytes), start + length):
            if kind == _MESSAGE_INDEX:
                channel, size = struct.unpack_from("<HI", record.ljust(6, b"\xff"))
                if len(record) < 6 + size:
                    raise self._damaged(start + length)
                entries = np.frombuffer(record, dtype=_INDEX_ENTRY, count=size // _INDEX_ENTRY.itemsize, offset=6)
                self._note(channel, number, entries["time"].astype(np.int64), entries["offset"].astype(np.int64))

    def _note(self, channel: int, chunk: int, time_ns: np.ndarray, offset: np.ndarray) -> None:
        self._found.setdefault(channel, []).append(np.stack([time_ns, np.full_like(time_ns, chunk), offset], axis=1))

    def _scan_chunk(self, number: int) -> None:
        """Index a chunk by reading it, where the file has no index of it."""
        places: dict[int, list[tuple[int, int]]] = {}
        for kind, start, body in self._records(self.unpacked_any(number), self.chunks[number].position, strict=False):
            if kind == _MESSAGE and len(body) >= _MESSAGE_HEAD.size:
                channel, _, log_time, _ = _MESSAGE_HEAD.unpack_from(body)
                places.setdefault(channel, []).append((log_time, start - _RECORD.size))
            else:
                self._declare(kind, body, self.chunks[number].position)
        for channel, entries in places.items():
            columns = np.array(entries, dtype=np.int64)
            self._note(channel, number, columns[:, 0], columns[:, 1])

    def unpacked_any(self, number: int) -> bytes:
        """Return a whole chunk, stored as it is or packed."""
        chunk = self.chunks[number]
        return self.unpacked(number) if chunk.packed else self.file.at(chunk.position, chunk.stored_bytes)

    def _scan(self, *, whole: bool) -> None:
        """Walk over the file from its beginning; needed where it has no index, or was not closed.

        Args:
            whole: the file is complete; otherwise the part that can be read is kept, with a caution.
        """
        self._found.clear()
        self.chunks = [Chunk(0, self.size_bytes, self.size_bytes, "")]  # messages outside chunks
        loose: dict[int, list[tuple[int, int]]] = {}
        place, complete = len(MAGIC), False
        while place + _RECORD.size <= self.size_bytes:
            kind, size = _RECORD.unpack(self.file.at(place, _RECORD.size))
            start = place + _RECORD.size
            if size > self.size_bytes - start or kind == 0:
                break
            if kind in (_DATA_END, _FOOTER):
                complete = True
                break
            self._scan_record(kind, start, size, loose)
            place = start + size
        for channel, entries in loose.items():
            columns = np.array(entries, dtype=np.int64)
            self._note(channel, 0, columns[:, 0], columns[:, 1])
        if not (complete and whole):
            self._say_cut_short(place)

    def _scan_record(self, kind: int, start: int, size: int, loose: dict[int, list[tuple[int, int]]]) -> None:
        if kind == _MESSAGE and size >= _MESSAGE_HEAD.size:
            channel, _, log_time, _ = _MESSAGE_HEAD.unpack(self.file.at(start, _MESSAGE_HEAD.size))
            loose.setdefault(channel, []).append((log_time, start - _RECORD.size))
        elif kind == _CHUNK:
            head = self.file.at(start, min(size, 64))
            try:
                compression, place = _string(head, 28)
                stored = struct.unpack_from("<Q", head, place)[0]
            except struct.error:
                raise self._damaged(start) from None
            unpacked = int.from_bytes(head[16:24], "little")
            self.chunks.append(Chunk(start + place + 8, stored, unpacked, compression))
            self._scan_chunk(len(self.chunks) - 1)
        elif kind in (_SCHEMA, _CHANNEL) and size < _MAX_RECORD_BYTES:
            self._declare(kind, self.file.at(start, size), start)

    def _say_cut_short(self, kept: int) -> None:
        count = sum(len(part) for parts in self._found.values() for part in parts)
        if not count:
            raise self._damaged(kept)
        self.cautions = (
            Caution(
                "not-closed",
                f"{self.path.name} was not closed properly: {count} messages of its first {kept} bytes could be read, "
                f"the last {self.size_bytes - kept} bytes are lost",
                f"check that what you need is there, or repair it first: mcap recover {self.path.name}",
            ),
        )

    # -- reading

    def locate(self, chunk: int, offset: int) -> tuple[int, int]:
        """Return where the message itself begins, and its length."""
        head = self.piece(chunk, offset, _RECORD.size)
        kind, size = _RECORD.unpack(head) if len(head) == _RECORD.size else (0, 0)
        if kind != _MESSAGE or not _MESSAGE_HEAD.size <= size <= _MAX_RECORD_BYTES:
            raise RecordingError(
                f"{self.path}: no message where the index says (chunk {chunk}, byte {offset}); the file is damaged: "
                f"mcap recover {self.path.name}"
            )
        return offset + self.lead_bytes, size - _MESSAGE_HEAD.size

    def usual(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Recognise message records; all of them are alike."""
        sizes = np.ascontiguousarray(rows[:, 1:9]).view("<i8")[:, 0] - _MESSAGE_HEAD.size
        return (rows[:, 0] == _MESSAGE) & (sizes >= 0) & (sizes <= _MAX_RECORD_BYTES), sizes


def _string(data: bytes, place: int) -> tuple[str, int]:
    """Read a length-prefixed string; return it and the place after it."""
    length = struct.unpack_from("<I", data, place)[0]
    if place + 4 + length > len(data):
        raise struct.error("string runs past its record")
    return data[place + 4 : place + 4 + length].decode("utf-8", "replace"), place + 4 + length
