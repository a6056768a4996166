"""Chunked containers: the common part of ROS 1 bags and MCAP files.

Messages are stored consecutively in chunks, compressed or not. Decompressed chunks are kept in a cache of bounded size;
from uncompressed chunks, only the requested bytes are read. The first bytes of many messages, for stamps and for drivers that
send one return per message, are read at once.
"""

import threading
import zlib
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

import numpy as np

from calib_core.arrays import Indices
from calib_core.errors import RecordingError
from calib_core.measurements import DataWarning
from calib_core.recordings.containers.compression import MAX_CHUNK_BYTES, refuse_bomb, unpack, unpack_what_is_there
from calib_core.recordings.containers.index_cache import (
    KeptIndex,
    cache_of,
    heads_from,
    index_from,
    keep_heads,
    keep_index,
)
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.sources import Assumption, Channel, Heads, MessageIndex, Progress

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
_NEAR_BYTES = 4096
_RUN_MESSAGES = 4096
_THREADS = 4
_FEW_CHUNKS = 32
_AHEAD = 256


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


@dataclass(slots=True)
class Scanned:
    """What a scan of a file from its beginning finds, without an index.

    Attributes:
        chunks: with the available bytes; the first represents the whole file, for messages outside chunks.
        messages: (receive time [ns], chunk, offset) by channel.
        lost_bytes: number of bytes that could not be parsed, in the file and in decompressed chunks.
        damaged_chunks: number of chunks that could not be fully decompressed.
        fault: why the first of those could not.
        tried: number of attempts to find a record after a damaged stretch; bounded.
    """

    chunks: list[Chunk]
    messages: dict[int, list[tuple[int, int, int]]] = field(default_factory=dict)
    lost_bytes: int = 0
    damaged_chunks: int = 0
    fault: str = ""
    tried: int = 0

    @property
    def count(self) -> int:
        """The number of messages."""
        return sum(map(len, self.messages.values()))

    def unpacked(self, file: FileBytes, chunk: Chunk, *, where: str, checksum: int = 0) -> bytes:
        """Decompress a chunk as far as possible; record what is wrong with it."""
        try:
            refuse_bomb(chunk.stored_bytes, chunk.size_bytes, where=where)
            if chunk.stored_bytes > MAX_CHUNK_BYTES:
                raise RecordingError(
                    f"{where}: {chunk.stored_bytes} compressed bytes in one chunk are refused as damaged"
                )
        except RecordingError as error:
            self._damaged(str(error))
            self.lost_bytes += chunk.stored_bytes
            return b""
        data = file.up_to(chunk.position, chunk.stored_bytes)
        try:
            whole = unpack(data, chunk.compression, chunk.size_bytes, where=where)
        except RecordingError as error:
            self._damaged(str(error))
            return unpack_what_is_there(data, chunk.compression, chunk.size_bytes)
        if checksum and zlib.crc32(whole) != checksum:
            self._damaged(f"{where}: wrong checksum")
        return whole

    def _damaged(self, fault: str) -> None:
        self.damaged_chunks, self.fault = self.damaged_chunks + 1, self.fault or fault


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

    def take(self, scan: Scanned, channels: Collection[Channel], *, tool: str, sound: bool = False) -> bool:
        """Take what a scan of the whole file has found, with a warning; return whether there is a message to read.

        Args:
            scan: of the file.
            channels: that it has found.
            tool: the command that repairs such a file.
            sound: whether the file just has no index; there is no warning then.
        """
        self.recovered, self.chunks, self.channels, self.indexes = True, scan.chunks, tuple(channels), {}
        for channel in self.channels:
            columns = np.array(scan.messages.get(channel.id, ()), dtype=np.int64).reshape(-1, 3)
            if len(columns):
                self.note_index(channel.id, MessageIndex.sorted_from(columns[:, 0], columns[:, 1], columns[:, 2]))
        unknown = scan.count - sum(map(len, self.indexes.values()))
        if not sound or unknown:
            self.warnings = (*self.warnings, _recovery_warning(self.path, scan, unknown=unknown, tool=tool))
        return bool(self.indexes) or (sound and not unknown)

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
            DataWarning.reported(
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
            for index in range(0, where.stored_bytes if wanted else 0, _CHECKED_PIECE_BYTES):
                size = min(_CHECKED_PIECE_BYTES, where.stored_bytes - index)
                found = zlib.crc32(self.file.up_to(where.position + index, size), found)
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
        heads = heads_from(cache, index, size)
        if heads is None:
            places = self._far_places(index, size)
            heads = (
                gather_far(self, self.file, index, places, size)
                if places is not None
                else gather_heads(self, index, size)
            )
            keep_heads(cache, index, size, heads)
        return heads

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


def gather_heads(source: ChunkedSource, index: MessageIndex, size: int) -> Heads:
    """Read the first bytes of many messages.

    From uncompressed chunks only the heads of records are read, adjacent ones together; each compressed chunk is
    decompressed once. Many chunks are distributed over a few threads, so that disk access and decompression overlap.
    Messages in an unreadable chunk get the length -1.
    """
    groups = _groups(index.chunk)
    gather = _Gather(source, index, size, keep=len(groups) <= _FEW_CHUNKS)
    if len(groups) <= _FEW_CHUNKS:
        return Heads(gather.rows, gather.lengths, gather.chunks(groups))
    batches = [groups[first : first + _FEW_CHUNKS] for first in range(0, len(groups), _FEW_CHUNKS)]
    with ThreadPoolExecutor(_THREADS) as pool:
        faults = [fault for fault in pool.map(gather.chunks, batches) if fault]
    return Heads(gather.rows, gather.lengths, faults[0] if faults else "")


def gather_far(source: ChunkedSource, file: FileBytes, index: MessageIndex, places: Indices, size: int) -> Heads:
    """Read the first bytes of uncompressed messages that are far apart: one small read each.

    Args:
        source: the chunked file.
        file: its bytes.
        index: the messages.
        places: (n,) positions of their records in the file.
        size: number of bytes of each message.
    """
    width = source.lead_bytes + size
    order = np.argsort(places)
    read: list[bytes] = []
    batches = [places[order[first : first + _AHEAD]].tolist() for first in range(0, len(order), _AHEAD)]
    announced = 0
    for number, batch in enumerate(batches):
        for ahead in batches[announced : number + 2]:  # prefetch the next batch while this one is read
            file.expect([(place, place + width) for place in ahead])
        announced = number + 2
        read.extend(file.up_to(place, width).ljust(width, b"\0") for place in batch)
    gathered = np.zeros((len(order), width), dtype=np.uint8)
    gathered[order] = np.frombuffer(b"".join(read), dtype=np.uint8).reshape(-1, width)
    usual, lengths = source.usual(gathered[:, : source.lead_bytes])
    gather = _Gather(source, index, size, keep=False)
    gather.rows, gather.lengths = gathered[:, source.lead_bytes :], lengths
    rooms = np.array([source.room(chunk) for chunk in range(int(index.chunk.max()) + 1)])[index.chunk]
    past = index.offset + source.lead_bytes + lengths > rooms
    lengths[past] = -1
    faults = ["a chunk ends before its messages do"] if (past & usual).any() else []
    for row in np.flatnonzero(~usual).tolist():
        faults.append(gather.single(int(index.chunk[row]), int(index.offset[row]), row))
    return Heads(gather.rows, gather.lengths, next((fault for fault in faults if fault), ""))


def _copy_items(data: bytes, places: np.ndarray, width: int) -> np.ndarray:
    """Copy width bytes from each place, as (n,) items of that size, which NumPy moves as units."""
    windows: np.ndarray = np.ndarray((len(data) - width + 1,), np.dtype(f"V{width}"), data, 0, (1,))
    return windows[places]


def _as_slice(rows: np.ndarray) -> "np.ndarray | slice":
    """Return consecutive rows as a slice, which is faster to write to; other rows unchanged."""
    first, last = int(rows[0]), int(rows[-1])
    together = last - first + 1 == len(rows) and bool((np.diff(rows) == 1).all())
    return slice(first, last + 1) if together else rows


def _groups(chunk: np.ndarray) -> list[np.ndarray]:
    """Return the rows of the index grouped by chunk."""
    if not len(chunk):
        return []
    order = np.argsort(chunk, kind="stable")
    edges = [0, *(np.flatnonzero(np.diff(chunk[order])) + 1).tolist(), len(chunk)]
    return [order[first:last] for first, last in pairwise(edges)]


class _Gather:
    """The table that the threads fill, each its own rows."""

    def __init__(self, source: ChunkedSource, index: MessageIndex, size: int, *, keep: bool) -> None:
        self.keep = keep
        self.source = source
        self.index = index
        self.size = size
        self.rows = np.zeros((len(index), size), dtype=np.uint8)
        self.lengths = np.zeros(len(index), dtype=np.int64)

    def chunks(self, groups: Iterable[np.ndarray]) -> str:
        """Fill the rows of several chunks; return the first error."""
        return next(iter([fault for group in groups if (fault := self.chunk(group))]), "")

    def chunk(self, group: np.ndarray) -> str:
        """Fill the rows of the messages in one chunk; return the error, if any."""
        chunk = int(self.index.chunk[group[0]])
        order = group[np.argsort(self.index.offset[group], kind="stable")]
        try:
            whole = self.source.in_memory(chunk, keep=self.keep)
            room = self.source.room(chunk) if whole is None else len(whole)
            faults = [self._run(chunk, order[a:b], whole, room) for a, b in pairwise(self._edges(order))]
        except RecordingError as error:
            self.lengths[group] = -1
            return str(error)
        fault = next((fault for fault in faults if fault), "")
        return fault and (self.source.fault_of(chunk) or fault)

    def _edges(self, order: np.ndarray) -> list[int]:
        """Split messages into runs of adjacent ones that are read together."""
        if len(order) == 1:
            return [0, 1]
        far = np.diff(self.index.offset[order]) > self.source.lead_bytes + self.size + _NEAR_BYTES
        cuts = {*(np.flatnonzero(far) + 1).tolist(), *range(_RUN_MESSAGES, len(order), _RUN_MESSAGES)}
        return [0, *sorted(cuts), len(order)]

    def _run(self, chunk: int, order: np.ndarray, whole: bytes | None, room: int) -> str:
        """Fill the rows of adjacent messages; return why one of them cannot be read."""
        lead = self.source.lead_bytes
        offsets = self.index.offset[order]
        base, end = int(offsets[0]), int(offsets[-1]) + lead + self.size
        data = self.source.piece(chunk, base, end - base) if whole is None else whole[base:end]
        data = data.ljust(end - base, b"\0")
        usual, lengths = self.source.usual(_copy_items(data, offsets - base, lead).view(np.uint8).reshape(-1, lead))
        past = offsets + lead + lengths > room
        lengths[past] = -1
        self.lengths[order] = lengths
        self.rows.view(f"V{self.size}")[_as_slice(order), 0] = _copy_items(data, offsets - base + lead, self.size)
        fault = f"chunk {chunk} ends before its messages do" if (past & usual).any() else ""
        for index in np.flatnonzero(~usual).tolist():
            fault = self.single(chunk, int(offsets[index]), int(order[index])) or fault
        return fault

    def single(self, chunk: int, offset: int, row: int) -> str:
        """Read the head of a message whose record has an unusual layout; return why it cannot be read."""
        try:
            start, length = self.source.locate(chunk, offset)
        except RecordingError as error:
            self.lengths[row] = -1
            return str(error)
        head = self.source.piece(chunk, start, min(self.size, length))
        self.rows[row, : len(head)] = np.frombuffer(head, dtype=np.uint8)
        self.lengths[row] = length if len(head) == min(self.size, length) else -1
        return "" if self.lengths[row] >= 0 else f"chunk {chunk} ends before its messages do"


def _recovery_warning(path: Path, scan: Scanned, *, unknown: int, tool: str) -> DataWarning:
    """Describe what was recovered by reading the whole file, and what was lost."""
    messages, damaged_chunks, lost_bytes = scan.count, scan.damaged_chunks, scan.lost_bytes
    parts = [
        f"{path.name} has no usable index (it was not closed properly, or is truncated or damaged): {messages} complete messages "
        "were recovered by reading the whole file"
    ]
    if damaged_chunks:
        parts.append(
            f"{damaged_chunks} chunk{'s are' if damaged_chunks > 1 else ' is'} damaged, and everything after the damage in "
            f"{'them' if damaged_chunks > 1 else 'it'} is lost ({scan.fault})"
        )
    if unknown:
        parts.append(f"{unknown} of the messages belong to topics that the file does not describe, and are skipped")
    if lost_bytes:
        parts.append(f"{lost_bytes} bytes could not be parsed and are lost")
    return DataWarning.reported(
        "not-closed",
        "; ".join(parts),
        f"check that the data you need is there; repair the file to open it quickly again: {tool} {path.name}",
    )
