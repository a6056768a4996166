"""Read MCAP files: index from the summary, or by scanning the file if there is none."""

import struct
import zlib
from pathlib import Path

import numpy as np

from calib_core.errors import RecordingError
from calib_core.measurements import DataWarning
from calib_core.recordings.containers.chunks import FIRST_CHUNKS, ChannelFilter, Chunk, ChunkedSource
from calib_core.recordings.containers.mcap import records
from calib_core.recordings.containers.mcap.recovery import scan_mcap
from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch, MemoryStretch
from calib_core.recordings.containers.sources import MessageIndex

_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])
_TAIL_BYTES = 37
_PIECE_BYTES = 1 << 20


class McapSource(ChunkedSource):
    """One MCAP file. Opening reads its summary and one block of message indexes per chunk.

    Args:
        file: the file.
        first_of: read only the first chunks of these channels, and refuse a file without an index; None reads all.
    """

    format_name = "MCAP"
    lead_bytes = records.RECORD.size + records.MESSAGE_HEAD.size

    def __init__(self, file: FileBytes, *, first_of: ChannelFilter | None = None) -> None:
        super().__init__(file, whole=first_of is None)
        self._found: dict[int, list[np.ndarray]] = {}
        self._counted = self._private_bytes = 0
        if first_of is not None:
            self._read_beginning(first_of)
        elif not self.restore():
            self._open()
            self.keep()

    # -- opening

    def _open(self) -> None:
        """Read the index, or build one."""
        closed, indexed = True, False
        try:
            summary = self._summary_start()
            closed = summary is not None
            indexed = bool(summary) and self._read_summary(summary or 0)
            if indexed:
                self._note_indexes()
        except RecordingError:
            closed = indexed = False
        if not indexed:
            self._scan(closed=closed)
        self._found.clear()
        if self._private_bytes:
            self.warnings = (*self.warnings, _private_record_warning(self.path, self._private_bytes))

    def _summary_start(self) -> int | None:
        """Return the position of the summary; 0 for a file without one, None for a file that was not closed."""
        tail = self.file.up_to(max(0, self.size_bytes - _TAIL_BYTES), _TAIL_BYTES)
        if len(tail) < _TAIL_BYTES or tail[-8:] != records.MAGIC or tail[0] != records.FOOTER:
            return None
        start = int.from_bytes(tail[9:17], "little")
        return start if start <= self.size_bytes - _TAIL_BYTES else None

    def _damaged(self, position: int) -> RecordingError:
        return RecordingError(
            f"{self.path}: the record at byte {position} is damaged or truncated; repair it first: "
            f"mcap recover {self.path.name}"
        )

    def _read_summary(self, start: int) -> bool:
        """Read the summary and the message indexes; False if the file must be scanned to find its messages."""
        if not self._summary_is_sound(start):
            raise self._damaged(start)
        infos = self._read_chunk_infos(start)
        if not infos:
            return False
        self._require_nothing_unindexed(infos, start)
        self.file.expect([info.index_place for info in infos])
        for info in infos:
            self._read_chunk_index(info)
        known = {channel.id for channel in self.channels}
        found = {channel: sum(map(len, parts)) for channel, parts in self._found.items()}
        complete = all(info.index_bytes > 0 for info in infos) and sum(found.values()) >= self._counted
        complete = complete and all(found.get(channel, 0) >= count for channel, count in self.counts.items())
        return complete and known >= self._found.keys()

    def _require_nothing_unindexed(self, infos: list[records.ChunkInfo], end: int) -> None:
        """Refuse chunks, messages and unknown bytes between the chunks that the summary names.

        Raises:
            RecordingError: there are some, or chunks overlap.
        """
        place = len(records.MAGIC)
        for begin, after in sorted([(info.position, info.index_place[1]) for info in infos] + [(end, end)]):
            while place < begin:
                head = self.file.up_to(place, records.RECORD.size)
                kind, size = records.RECORD.unpack(head) if len(head) == records.RECORD.size else (0, 0)
                if kind not in records.BETWEEN_CHUNKS and kind < records.PRIVATE:
                    raise self._damaged(place)
                self._private_bytes += records.RECORD.size + size if kind >= records.PRIVATE else 0
                place += records.RECORD.size + size
            if place != begin:
                raise self._damaged(begin)
            place = after

    def _read_beginning(self, first_of: ChannelFilter) -> None:
        """Read the indexes of the first chunks of some channels.

        Raises:
            RecordingError: the file has no such index.
        """
        start = self._summary_start()
        if not start:
            raise self._damaged(self.size_bytes - _TAIL_BYTES)
        earliest = sorted(self._read_chunk_infos(start, first_of), key=lambda info: info.start_ns)
        wanted = [channel.id for channel in self.channels if first_of(channel)]
        firsts = [next((info for info in earliest if number in info.channels), None) for number in wanted]
        for info in {info.position: info for info in firsts if info is not None}.values():
            self._read_chunk_index(info)
        self._note_indexes()

    def _read_chunk_infos(self, start: int, first_of: ChannelFilter | None = None) -> list[records.ChunkInfo]:
        """Read the summary (channels, statistics, chunk indexes), in full or until some channels are found."""
        infos: list[records.ChunkInfo] = []
        declared = records.Declarations()
        stretch = FileStretch(self.file, start, self.size_bytes - _TAIL_BYTES - start)
        end = 0
        for kind, place, size in records.walk(stretch):
            end = place + size
            body = stretch.up_to(place, size) if size <= records.MAX_RECORD_BYTES else b""
            if kind == records.CHUNK_INDEX:
                info = records.chunk_info(body)
                if info is None or not info.inside(self.size_bytes):
                    raise self._damaged(start + place)
                infos.append(info)
                if first_of is not None and _shows(infos, declared, first_of):
                    break
            elif kind == records.STATISTICS:
                self._counted, self.counts = records.statistics(body)
            elif not declared.note(kind, body):
                raise self._damaged(start + place)
        else:
            if end != stretch.size:
                raise self._damaged(start + end)
        self.channels = declared.channels
        return infos

    def _summary_is_sound(self, start: int) -> bool:
        """Verify the summary section against the checksum in the footer; 0 means no checksum."""
        end = self.size_bytes - len(records.MAGIC) - 4
        wanted = int.from_bytes(self.file.up_to(end, 4), "little")
        found = 0
        for index in range(start, end if wanted else start, _PIECE_BYTES):
            found = zlib.crc32(self.file.up_to(index, min(_PIECE_BYTES, end - index)), found)
        return found == wanted

    def _read_chunk_index(self, info: records.ChunkInfo) -> None:
        """Record one chunk, and read the message indexes that follow it."""
        number = len(self.chunks)
        self.chunks.append(Chunk(info.data_position, info.stored_bytes, info.size_bytes, info.compression))
        first_byte, last_byte = info.index_place
        block = MemoryStretch(self.file.at(first_byte, last_byte - first_byte))
        end = 0
        indexed = set()
        for kind, first, length in records.walk(block):
            end = first + length
            if kind != records.MESSAGE_INDEX:
                raise self._damaged(first_byte + first)
            indexed.add(self._read_message_index(number, block.data[first:end], first_byte + first))
        if end != block.size or (block.size and not indexed >= set(info.channels)):
            raise self._damaged(first_byte + end)

    def _read_message_index(self, chunk: int, record: bytes, position: int) -> int:
        """Record the entries of one channel in a chunk; return its number."""
        channel, size = struct.unpack_from("<HI", record.ljust(6, b"\xff"))
        if len(record) != 6 + size or size % _INDEX_ENTRY.itemsize or not size:
            raise self._damaged(position)
        entries = np.frombuffer(record, dtype=_INDEX_ENTRY, count=size // _INDEX_ENTRY.itemsize, offset=6)
        times, offsets = entries["time"].astype(np.int64), entries["offset"].astype(np.int64)
        if len(np.unique(offsets)) < len(offsets):
            raise self._damaged(position)
        self._found.setdefault(channel, []).append(np.stack([times, np.full_like(times, chunk), offsets], axis=1))
        return int(channel)

    def _note_indexes(self) -> None:
        for channel, parts in self._found.items():
            columns = np.concatenate(parts)
            self.note_index(channel, MessageIndex.sorted_from(columns[:, 0], columns[:, 1], columns[:, 2]))

    def _scan(self, *, closed: bool) -> None:
        """Scan the file from its beginning.

        Args:
            closed: whether the file ends properly; a scan without losses then needs no warning.
        """
        mcap = scan_mcap(self.file)
        self._private_bytes = mcap.private_bytes
        sound = closed and mcap.ended and not (mcap.lost_bytes or mcap.damaged_chunks)
        if not self.take(mcap, mcap.declarations.channels, tool="mcap recover", sound=sound):
            raise self._damaged(len(records.MAGIC))
        if mcap.count < self._counted:
            self.warnings = (*self.warnings, self._too_few(mcap.count))

    def _too_few(self, count: int) -> DataWarning:
        return DataWarning.reported(
            "messages-missing",
            f"{self.path.name} declares {self._counted} messages, but contains {count}",
            "check that the data you need is there; the rest was lost before or while the file was written",
        )

    # -- reading

    def checksum(self, chunk: int) -> int:
        """Return the stored CRC-32 of a chunk's uncompressed records; 0 if the file has none, or the chunk is cut off."""
        where = self.chunks[chunk]
        if not where.position:
            return 0  # the whole file, for messages outside chunks
        head = self.file.up_to(records.crc_position(where.position, where.compression) - 8, 12)
        size, checksum = int.from_bytes(head[:8], "little"), int.from_bytes(head[8:], "little")
        return checksum if size == where.size_bytes else 0

    def locate(self, chunk: int, offset: int) -> tuple[int, int]:
        """Return the offset of the message itself, and its length."""
        head = self.piece(chunk, offset, records.RECORD.size)
        kind, size = records.RECORD.unpack(head) if len(head) == records.RECORD.size else (0, 0)
        if kind != records.MESSAGE or not records.MESSAGE_HEAD.size <= size <= records.MAX_RECORD_BYTES:
            raise RecordingError(
                f"{self.path}: no message at the indexed position (chunk {chunk}, byte {offset}); the file is damaged: "
                f"mcap recover {self.path.name}"
            )
        return offset + self.lead_bytes, size - records.MESSAGE_HEAD.size

    def usual(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Recognize message records, which all have the same layout."""
        sizes = np.ascontiguousarray(rows[:, 1:9]).view("<i8")[:, 0] - records.MESSAGE_HEAD.size
        return (rows[:, 0] == records.MESSAGE) & (sizes >= 0) & (sizes <= records.MAX_RECORD_BYTES), sizes


def _private_record_warning(path: Path, count: int) -> DataWarning:
    return DataWarning.reported(
        "unknown-records",
        f"{path.name} contains {count} bytes in records of kinds that the format leaves to other programs; they are skipped",
        "no action needed if the program that wrote the file adds such records; otherwise the file is damaged: copy it again",
    )


def _shows(infos: list[records.ChunkInfo], declared: records.Declarations, first_of: ChannelFilter) -> bool:
    """Return whether the wanted channels are known, and all of them occur in the chunks seen so far."""
    count = len(infos)
    if count < FIRST_CHUNKS or count & (count - 1):  # checked again each time their number doubles
        return False
    wanted = {channel.id for channel in declared.channels if first_of(channel)}
    return bool(wanted) and wanted <= {number for info in infos for number in info.channels}
