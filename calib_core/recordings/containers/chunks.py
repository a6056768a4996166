"""Chunked containers: the common part of ROS 1 bags and MCAP files.

Messages are stored consecutively in chunks, compressed or not. Decompressed chunks are kept in a cache of bounded size;
from uncompressed chunks, only the requested bytes are read.
"""

import threading
import zlib
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from calib_core.arrays import Indices
from calib_core.errors import RecordingError
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.containers.cached_indexes import KeptIndex, heads_from, index_from, keep_heads, keep_index
from calib_core.recordings.containers.compression import refuse_bomb, unpack, unpack_what_is_there
from calib_core.recordings.containers.index_cache import cache_of
from calib_core.recordings.containers.message_heads import gather_far, gather_heads
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.sources import Channel, Heads, MessageIndex, Progress
from calib_core.results import DataWarning

ChannelFilter: TypeAlias = Callable[[Channel], bool]
CACHE_BYTES = 24 * 2**20
FIRST_CHUNKS = 16
"""Number of chunks to read first if the beginning of a file is enough, and to add until everything wanted is found."""

_FEW_MESSAGES = 64
_FAR_BYTES = 4096
_MAX_CHECKED_BYTES = 1 << 24
_CHECKED_PIECE_BYTES = 1 << 20
MAX_MESSAGE_BYTES = 1 << 28
"""Larger than any sensor message; one that claims to exceed it is damaged or malicious."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """The location of a chunk's bytes.

    Attributes:
        position: of its first byte in the file.
        stored_bytes: its size in the file.
        size_bytes: its uncompressed size.
        compression: "none", "bz2", "lz4" or "zstd".
    """

    position: int
    stored_bytes: int
    size_bytes: int
    compression: str

    @property
    def packed(self) -> bool:
        """Return whether it is compressed."""
        return self.compression not in ("", "none")


class ChunkedSource:
    """Read messages from chunks. Subclasses open the file and parse the beginning of a message record.

    Args:
        file: the file.
        whole: whether all of it is read; the index of a part is not cached.
    """

    format_name = "chunked file"
    lead_bytes = 0
    """Number of bytes of a record before the message, in the usual case."""

    def __init__(self, file: FileBytes, *, whole: bool = True) -> None:
        self.file = file
        self.chunks: list[Chunk] = []
        self.channels: tuple[Channel, ...] = ()
        self.warnings: tuple[DataWarning, ...] = file.warnings
        self.indexes: dict[int, MessageIndex] = {}
        self.counts: Mapping[int, int] = {}
        """Number of messages of each channel, as far as the file states it."""
        self.recovered = False
        """Whether the file was not closed; its chunks may be truncated."""
        self._cache: OrderedDict[int, bytes] = OrderedDict()
        self._cache_bytes = 0
        self._damaged_chunks: dict[int, str] = {}
        self._checked: dict[int, bool] = {}
        self._lock = threading.Lock()
        self._kept = cache_of(file) if whole else None

    def restore(self) -> bool:
        """Restore the index from the cache; False if it is not cached."""
        kept = index_from(self._kept) if self._kept is not None else None
        if kept is None:
            return False
        self.channels = kept.channels
        places = zip(kept.chunks.tolist(), kept.compressions, strict=True)
        self.chunks = [Chunk(position, stored, size, name) for (position, stored, size), name in places]
        try:
            for channel, index in kept.indexes.items():
                self.note_index(channel, index)
        except RecordingError:
            self.channels, self.chunks, self.indexes = (), [], {}
            return False
        return True

    def keep(self) -> None:
        """Store the index in the cache, if the file is intact."""
        if self._kept is None or self.recovered or self.warnings:
            return
        places = [(chunk.position, chunk.stored_bytes, chunk.size_bytes) for chunk in self.chunks]
        names = tuple(chunk.compression for chunk in self.chunks)
        table = np.array(places, dtype=np.int64).reshape(-1, 3)
        keep_index(self._kept, KeptIndex(self.channels, table, names, self.indexes))

    @property
    def path(self) -> Path:
        """The path of the file."""
        return self.file.path

    @property
    def size_bytes(self) -> int:
        """The size of the file."""
        return self.file.size_bytes

    @property
    def container(self) -> str:
        """The format and its compression."""
        kinds = sorted({chunk.compression for chunk in self.chunks if chunk.packed})
        return f"{self.format_name}, {' and '.join(kinds)}" if kinds else self.format_name

    def index(self, channel_id: int) -> MessageIndex:
        """Return the locations of a channel's messages."""
        empty = np.zeros(0, dtype=np.int64)
        return self.indexes.get(channel_id, MessageIndex(empty, empty, empty))

    def note_index(self, channel_id: int, index: MessageIndex) -> None:
        """Store the index of a channel.

        Raises:
            RecordingError: it points outside the chunks.
        """
        sizes = np.array([chunk.size_bytes for chunk in self.chunks], dtype=np.float64)
        wrong = (index.offset < 0) | (index.offset >= sizes[index.chunk])
        if wrong.any():
            raise RecordingError(
                f"{self.path}: {np.count_nonzero(wrong)} of {len(index)} index entries point past the end of their chunk; "
                "the file is damaged: copy it again"
            )
        self.indexes[channel_id] = index

    def close(self) -> None:
        """Close the file and drop the cache."""
        self.file.close()
        with self._lock:
            self._cache.clear()
            self._cache_bytes = 0

    @property
    def assumptions(self) -> tuple[Assumption, ...]:
        """None: a ROS recording declares its fields."""
        return ()

    @property
    def later_warnings(self) -> tuple[DataWarning, ...]:
        """Checksum errors in the chunks read so far."""
        with self._lock:
            bad = sorted(chunk for chunk, sound in self._checked.items() if not sound)
        if not bad:
            return ()
        inside = sum(int(np.isin(index.chunk, bad).sum()) for index in self.indexes.values())
        return (
            DataWarning(
                "checksum",
                f"{self.path.name}: wrong checksum in {len(bad)} of the chunks read so far, with {inside} messages; "
                f"the first is at byte {self.chunks[bad[0]].position}. Their messages are used anyway, and may be wrong",
                "copy the file again from its source; until then do not trust clicks and scans of that time",
            ),
        )

    def checksum(self, chunk: int) -> int:
        """Return the stored CRC-32 of a chunk's uncompressed bytes; 0 if the file has none."""
        return 0

    def check_stored_chunks(self, progress: Progress | None = None) -> None:
        """Check every uncompressed chunk, whatever its size; compressed ones are checked as they are read."""
        for number, where in enumerate(self.chunks):
            if progress is not None:
                progress(where.position, self.size_bytes)
            wanted = 0 if where.packed else self.checksum(number)
            found = 0
            for place in range(0, where.stored_bytes if wanted else 0, _CHECKED_PIECE_BYTES):
                size = min(_CHECKED_PIECE_BYTES, where.stored_bytes - place)
                found = zlib.crc32(self.file.up_to(where.position + place, size), found)
            with self._lock:
                self._checked[number] = self._checked.get(number, True) and wanted == found

    def wrong_checksums(self, channel_id: int) -> int:
        """Return how many messages of a channel are in chunks that failed their checksum so far."""
        with self._lock:
            bad = [chunk for chunk, sound in self._checked.items() if not sound]
        return int(np.isin(self.index(channel_id).chunk, bad).sum())

    def _check(self, chunk: int, data: bytes) -> None:
        """Compare a whole decompressed chunk with its checksum, and record the result."""
        wanted = self.checksum(chunk)
        sound = wanted == 0 or zlib.crc32(data) == wanted
        with self._lock:
            self._checked[chunk] = sound

    def _check_stored(self, chunk: int) -> None:
        """Check an uncompressed chunk once; chunks too large to read along with a message are skipped."""
        where = self.chunks[chunk]
        if where.packed or self.recovered or chunk in self._checked:
            return
        if where.stored_bytes > _MAX_CHECKED_BYTES or self.checksum(chunk) == 0:
            with self._lock:
                self._checked[chunk] = True
            return
        self._check(chunk, self.file.up_to(where.position, where.stored_bytes))

    def read(self, chunk: int, offset: int) -> bytes:
        """Read one whole message."""
        self._check_stored(chunk)
        try:
            start, length = self.locate(chunk, offset)
        except RecordingError as error:
            raise RecordingError(self.fault_of(chunk) or str(error)) from error
        if length > MAX_MESSAGE_BYTES:
            raise RecordingError(f"{self.path}: a message that claims a size of {length} bytes is refused as damaged")
        data = self.piece(chunk, start, length)
        if len(data) != length:
            raise RecordingError(
                self.fault_of(chunk)
                or f"{self.path}: a message of {length} bytes at byte {start} of chunk {chunk} extends past the chunk's end; "
                "the file is damaged: copy it again"
            )
        return data

    def room(self, chunk: int) -> int:
        """Return the uncompressed size of a chunk, which bounds its messages."""
        return self.chunks[chunk].size_bytes

    def locate(self, chunk: int, offset: int) -> tuple[int, int]:
        """Return the offset of the message itself in the chunk, and its length."""
        raise NotImplementedError

    def usual(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return which records (n, lead_bytes) have their message at lead_bytes, and how long the messages are."""
        raise NotImplementedError

    def piece(self, chunk: int, offset: int, size: int) -> bytes:
        """Return at most size bytes from offset of the uncompressed chunk."""
        where = self.chunks[chunk]
        if not where.packed:
            return self.file.up_to(where.position + offset, min(size, where.size_bytes - offset))
        return self.unpacked(chunk)[offset : offset + size]

    def unpacked(self, chunk: int) -> bytes:
        """Return a whole decompressed chunk, from the cache if possible."""
        with self._lock:
            if chunk in self._cache:
                self._cache.move_to_end(chunk)
                return self._cache[chunk]
        data = self._unpack(chunk)
        with self._lock:
            if chunk not in self._cache:
                self._cache[chunk] = data
                self._cache_bytes += len(data)
            while self._cache_bytes > CACHE_BYTES and len(self._cache) > 1:
                _, dropped = self._cache.popitem(last=False)
                self._cache_bytes -= len(dropped)
        return data

    def _unpack(self, chunk: int) -> bytes:
        """Decompress a chunk; if it is damaged, return the bytes before the damage and record what is wrong."""
        where = self.chunks[chunk]
        place = f"{self.path}: chunk {chunk} at byte {where.position}"
        refuse_bomb(where.stored_bytes, where.size_bytes, where=place)
        data = self.file.at(where.position, where.stored_bytes)
        if self.recovered:
            return unpack_what_is_there(data, where.compression, where.size_bytes)
        try:
            whole = unpack(data, where.compression, where.size_bytes, where=place)
        except RecordingError as error:
            with self._lock:
                self._damaged_chunks[chunk] = str(error)
            return unpack_what_is_there(data, where.compression, where.size_bytes)
        self._check(chunk, whole)
        return whole

    def fault_of(self, chunk: int) -> str:
        """Return what is wrong with a decompressed chunk; "" if nothing."""
        with self._lock:
            return self._damaged_chunks.get(chunk, "")

    def in_memory(self, chunk: int, *, keep: bool) -> bytes | None:
        """Return a compressed chunk decompressed, cached if keep is set; None for an uncompressed chunk."""
        if not self.chunks[chunk].packed:
            return None
        if keep:
            return self.unpacked(chunk)
        with self._lock:
            cached = self._cache.get(chunk)
        return cached if cached is not None else self._unpack(chunk)

    def heads(self, index: MessageIndex, size: int, *, keep: bool = False) -> Heads:
        """Read the first bytes of many messages, in the order of the index."""
        cache = self._kept if keep else None
        found = heads_from(cache, index, size)
        if found is None:
            places = self._far_places(index, size)
            found = (
                gather_far(self, self.file, index, places, size)
                if places is not None
                else gather_heads(self, index, size)
            )
            keep_heads(cache, index, size, found)
        return found

    def _far_places(self, index: MessageIndex, size: int) -> Indices | None:
        """Return the file positions of uncompressed messages that are far apart; None otherwise."""
        if len(index) < _FEW_MESSAGES:
            return None
        used = np.unique(index.chunk)
        if any(self.chunks[number].packed for number in used.tolist()):
            return None
        starts = np.zeros(len(self.chunks), dtype=np.int64)
        starts[used] = [self.chunks[number].position for number in used.tolist()]
        places: Indices = starts[index.chunk] + index.offset
        far = np.diff(np.sort(places)) > self.lead_bytes + size + _FAR_BYTES
        return places if np.count_nonzero(far) > 0.5 * len(places) else None
