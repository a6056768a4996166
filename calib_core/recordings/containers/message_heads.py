"""Read the first bytes of many messages at once: for stamps, and for drivers that send one return per message."""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Protocol

import numpy as np

from calib_core.arrays import Indices
from calib_core.errors import RecordingError
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.sources import Heads, MessageIndex

_NEAR_BYTES = 4096
_RUN_MESSAGES = 4096
_THREADS = 4
_FEW_CHUNKS = 32
_AHEAD = 256


class ChunkAccess(Protocol):
    """The part of a chunked file that gathering heads needs."""

    lead_bytes: int

    def in_memory(self, chunk: int, *, keep: bool) -> bytes | None:
        """Return a compressed chunk decompressed, cached if keep is set; None for an uncompressed chunk."""
        ...

    def piece(self, chunk: int, offset: int, size: int) -> bytes:
        """Return at most size bytes from offset of the uncompressed chunk."""
        ...

    def locate(self, chunk: int, offset: int) -> tuple[int, int]:
        """Return the offset of the message itself in the chunk, and its length."""
        ...

    def room(self, chunk: int) -> int:
        """Return the uncompressed size of a chunk."""
        ...

    def fault_of(self, chunk: int) -> str:
        """Return what is wrong with a decompressed chunk; "" if nothing."""
        ...

    def usual(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return which records (n, lead_bytes) have their message at lead_bytes, and how long the messages are."""
        ...


def gather_heads(source: ChunkAccess, index: MessageIndex, size: int) -> Heads:
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


def gather_far(source: ChunkAccess, file: FileBytes, index: MessageIndex, places: Indices, size: int) -> Heads:
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


def _taken(data: bytes, places: np.ndarray, width: int) -> np.ndarray:
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

    def __init__(self, source: ChunkAccess, index: MessageIndex, size: int, *, keep: bool) -> None:
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
        usual, lengths = self.source.usual(_taken(data, offsets - base, lead).view(np.uint8).reshape(-1, lead))
        past = offsets + lead + lengths > room
        lengths[past] = -1
        self.lengths[order] = lengths
        self.rows.view(f"V{self.size}")[_as_slice(order), 0] = _taken(data, offsets - base + lead, self.size)
        fault = f"chunk {chunk} ends before its messages do" if (past & usual).any() else ""
        for place in np.flatnonzero(~usual).tolist():
            fault = self.single(chunk, int(offsets[place]), int(order[place])) or fault
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
