"""Chunked containers: what ROS 1 bags and MCAP files share.

Messages lie one after another in chunks, packed or not. Unpacked chunks are kept in a cache bounded in bytes; of
chunks stored as they are, only the bytes asked for are read.
"""

import threading
from collections import OrderedDict
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.compression import unpack
from calib_core.recordings.files import FileBytes
from calib_core.recordings.sources import Channel, Heads, MessageIndex
from calib_core.results import Caution

__all__ = ["CACHE_BYTES", "Chunk", "ChunkedSource", "MessageIndex"]

CACHE_BYTES = 64 * 2**20
_COALESCE_BYTES = 4096
_THREADS = 4


@dataclass(frozen=True, slots=True)
class Chunk:
    """Where one chunk's bytes lie.

    Attributes:
        position: of its first byte in the file.
        stored_bytes: its size in the file.
        size_bytes: its size unpacked.
        compression: "none", "bz2", "lz4" or "zstd".
    """

    position: int
    stored_bytes: int
    size_bytes: int
    compression: str

    @property
    def packed(self) -> bool:
        """Tell whether it has to be unpacked."""
        return self.compression not in ("", "none")


class ChunkedSource:
    """Read messages out of chunks. A subclass opens the file and knows how a message record begins."""

    format_name = "chunked file"
    lead_bytes = 0
    """How many bytes of a record come before the message, in the usual case."""

    def __init__(self, file: FileBytes) -> None:
        self.file = file
        self.chunks: list[Chunk] = []
        self.channels: tuple[Channel, ...] = ()
        self.cautions: tuple[Caution, ...] = ()
        self.indexes: dict[int, MessageIndex] = {}
        self._cache: OrderedDict[int, bytes] = OrderedDict()
        self._cache_bytes = 0
        self._lock = threading.Lock()

    @property
    def path(self) -> Path:
        """Where the file lies."""
        return self.file.path

    @property
    def size_bytes(self) -> int:
        """How large the file is."""
        return self.file.size_bytes

    @property
    def container(self) -> str:
        """Name the format and its compression."""
        kinds = sorted({chunk.compression for chunk in self.chunks if chunk.packed})
        return f"{self.format_name}, {' and '.join(kinds)}" if kinds else self.format_name

    def index(self, channel_id: int) -> MessageIndex:
        """Tell where the messages of a channel lie."""
        empty = np.zeros(0, dtype=np.int64)
        return self.indexes.get(channel_id, MessageIndex(empty, empty, empty))

    def note_index(self, channel_id: int, index: MessageIndex) -> None:
        """Keep the index of a channel.

        Raises:
            RecordingError: it points out of the chunks.
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

    def read(self, chunk: int, offset: int) -> bytes:
        """Read one message whole."""
        start, length = self.locate(chunk, offset)
        data = self.piece(chunk, start, length)
        if len(data) != length:
            raise RecordingError(
                f"{self.path}: a message of {length} bytes at byte {start} of chunk {chunk} runs past the chunk's end; "
                "the file is damaged: copy it again"
            )
        return data

    def locate(self, chunk: int, offset: int) -> tuple[int, int]:
        """Return where in the chunk the message itself begins, and its length."""
        raise NotImplementedError

    def usual(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tell which records (n, lead_bytes) have their message at lead_bytes, and how long the messages are."""
        raise NotImplementedError

    def piece(self, chunk: int, offset: int, size: int) -> bytes:
        """Return at most size bytes from offset of the unpacked chunk."""
        where = self.chunks[chunk]
        if not where.packed:
            return self.file.up_to(where.position + offset, min(size, where.size_bytes - offset))
        return self.unpacked(chunk)[offset : offset + size]

    def unpacked(self, chunk: int) -> bytes:
        """Return a whole chunk, from the cache where it is still there."""
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
        where = self.chunks[chunk]
        data = self.file.at(where.position, where.stored_bytes)
        place = f"{self.path}: chunk {chunk} at byte {where.position}"
        return unpack(data, where.compression, where.size_bytes, where=place)

    def heads(self, index: MessageIndex, size: int) -> Heads:
        """Read the first bytes of many messages.

        Of chunks stored as they are only the records' heads are read, neighbours in one go; packed chunks are each
        unpacked once, in several threads, without passing through the cache.
        """
        rows = np.zeros((len(index), size), dtype=np.uint8)
        lengths = np.zeros(len(index), dtype=np.int64)
        groups = list(_groups(index.chunk))
        with ThreadPoolExecutor(_THREADS) as pool:
            jobs = [
                pool.submit(self._fill, int(index.chunk[group[0]]), index, group, rows, lengths) for group in groups
            ]
            for job in jobs:
                job.result()
        return Heads(rows, lengths)

    def _fill(self, chunk: int, index: MessageIndex, group: np.ndarray, rows: np.ndarray, lengths: np.ndarray) -> None:
        """Fill the rows of the messages that lie in one chunk."""
        order = group[np.argsort(index.offset[group], kind="stable")]
        offsets = index.offset[order]
        span = self.lead_bytes + rows.shape[1]
        if self.chunks[chunk].packed:
            whole = self._cache.get(chunk) or self._unpack(chunk)
            runs: Iterable[tuple[int, int, bytes]] = [(0, len(order), whole)]
            bases = np.zeros(len(order), dtype=np.int64)
        else:
            cuts = np.flatnonzero(np.diff(offsets) > span + _COALESCE_BYTES) + 1
            edges = [0, *cuts.tolist(), len(order)]
            bases = np.repeat(offsets[edges[:-1]], np.diff(edges))
            runs = (
                (a, b, self.piece(chunk, int(offsets[a]), int(offsets[b - 1] - offsets[a]) + span))
                for a, b in pairwise(edges)
            )
        for first, last, data in runs:
            self._fill_run(chunk, order[first:last], offsets[first:last], data, int(bases[first]), rows, lengths)

    def _fill_run(
        self,
        chunk: int,
        order: np.ndarray,
        offsets: np.ndarray,
        data: bytes,
        base: int,
        rows: np.ndarray,
        lengths: np.ndarray,
    ) -> None:
        size = rows.shape[1]
        buffer = np.frombuffer(data, dtype=np.uint8)
        if not len(buffer):
            raise RecordingError(f"{self.path}: chunk {chunk} is shorter than its index says; the file is damaged")
        reach = (offsets - base)[:, None] + np.arange(self.lead_bytes + size)
        gathered = buffer[np.minimum(reach, len(buffer) - 1)]
        usual, found = self.usual(gathered[:, : self.lead_bytes])
        rows[order] = gathered[:, self.lead_bytes :]
        lengths[order] = found
        for place in np.flatnonzero(~usual):
            start, length = self.locate(chunk, int(offsets[place]))
            head = self.piece(chunk, start, min(size, length))
            rows[order[place], : len(head)] = np.frombuffer(head, dtype=np.uint8)
            lengths[order[place]] = length


def _groups(chunk: np.ndarray) -> Iterable[np.ndarray]:
    """Return, chunk by chunk, the rows of the index that lie in it."""
    if not len(chunk):
        return []
    order = np.argsort(chunk, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(chunk[order])) + 1)
