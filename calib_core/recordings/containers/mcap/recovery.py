"""Recover MCAP files without a usable index: scan from the beginning, find every complete message, count the losses."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from calib_core.errors import RecordingError
from calib_core.recordings.containers.chunks import Chunk, Scanned
from calib_core.recordings.containers.mcap import records
from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch, MemoryStretch, Stretch

_CANDIDATE = re.compile(rb"[\x03-\x06][\x00-\xff]{4}\x00\x00\x00\x00")
_COMPRESSIONS = ("", "lz4", "zstd")
_MAX_TRIES = 20_000
_LAST_KIND = 15
_END_SIZES = {records.DATA_END: 4, records.FOOTER: 20}
_MOST_RECORD_BYTES = 1 << 36
_DATA_AND_ENDS = records.DATA_KINDS | {records.CHUNK, *_END_SIZES}


@dataclass(slots=True)
class FoundInMcap(Scanned):
    """The result of scanning a file.

    Attributes:
        declarations: schemas and channels.
        ended: whether the scan reached the end of the data without errors.
        private_bytes: number of bytes in records of kinds that the format leaves to other programs.
    """

    declarations: records.Declarations = field(default_factory=records.Declarations)
    ended: bool = False
    private_bytes: int = 0


@dataclass(frozen=True, slots=True)
class Part:
    """One record of the data section, or bytes between records that do not parse.

    Attributes:
        kind: of the record; 0 for bytes that do not parse.
        place: position of its first byte.
        start: position of its body.
        end: position after it.
    """

    kind: int
    place: int
    start: int
    end: int


def scan_mcap(file: FileBytes) -> FoundInMcap:
    """Scan a file from its first record.

    Args:
        file: the file.
    """
    mcap = FoundInMcap([Chunk(0, file.size_bytes, file.size_bytes, "")])
    for part in parts_of_mcap(file, mcap):
        if not part.kind:
            mcap.lost_bytes += part.end - part.place
    return mcap


def parts_of_mcap(file: FileBytes, mcap: FoundInMcap) -> Iterator[Part]:
    """Walk through the data section, and note what is in it; stop before the summary.

    Args:
        file: the file.
        mcap: takes messages, declarations and losses inside chunks.
    """
    stretch = FileStretch(file, 0, file.size_bytes)
    place = len(records.MAGIC)
    while place + records.RECORD.size <= stretch.size and not mcap.ended:
        kind, size = records.RECORD.unpack(stretch.up_to(place, records.RECORD.size))
        start = place + records.RECORD.size
        whole = size <= stretch.size - start
        part = Part(kind, place, start, start + size)
        if kind == records.CHUNK and (head := records.chunk_head(stretch.up_to(start, 64))) and _sound(head):
            room = min(head.stored_bytes, stretch.size - start - head.size)
            _scan_chunk(file, start + head.size, room, head, mcap)
            part = replace(part, start=start + head.size, end=start + head.size + room)
        elif whole and _END_SIZES.get(kind) == size and not _data_after(stretch, start + size, mcap):
            mcap.ended = True
            if kind == records.FOOTER:
                return
        elif not (
            whole
            and (kind in records.DATA_KINDS or kind >= records.PRIVATE)
            and _note(stretch, kind, start, size, mcap)
        ):
            part = Part(0, place, place, _following(stretch, place + 1, mcap))
        yield part
        place = part.end
    if not mcap.ended and place < stretch.size:
        yield Part(0, place, place, stretch.size)


def scan_mcap_further(file: FileBytes, place: int, mcap: FoundInMcap) -> int:
    """Scan the complete records of a file that is being written; return the position of the first incomplete one.

    Args:
        file: the file.
        place: position of the first record to read.
        mcap: receives what is found.

    Raises:
        RecordingError: there is no record at a position.
    """
    mcap.chunks[0] = Chunk(0, file.size_bytes, file.size_bytes, "")
    stretch = FileStretch(file, 0, file.size_bytes)
    while place + records.RECORD.size <= stretch.size and not mcap.ended:
        kind, size = records.RECORD.unpack(stretch.up_to(place, records.RECORD.size))
        start = place + records.RECORD.size
        if kind == size == 0:
            break  # space that the system has allocated but the writer has not filled yet
        if not (kind in _DATA_AND_ENDS or kind >= records.PRIVATE) or size > _MOST_RECORD_BYTES:
            raise RecordingError(f"{file.path}: no record at byte {place}, where the next one should begin")
        if size > stretch.size - start:
            break
        head = records.chunk_head(stretch.up_to(start, 64)) if kind == records.CHUNK else None
        if head is not None and _sound(head):
            _scan_chunk(file, start + head.size, min(head.stored_bytes, size - head.size), head, mcap)
        elif kind != records.CHUNK and not (kind == records.MESSAGE and size > records.MAX_RECORD_BYTES):
            mcap.ended = kind in _END_SIZES
            _note(stretch, kind, start, size, mcap)
        place = start + size
    return place


def _data_after(stretch: Stretch, place: int, mcap: FoundInMcap) -> bool:
    """Return whether messages follow a place where only the summary should, which may be damaged."""
    for kind, start, size in records.walk(stretch, place):
        if kind not in records.SUMMARY_KINDS:
            break
        place = start + size
    if place + len(records.MAGIC) >= stretch.size:
        return False
    after = _following(stretch, place, mcap)
    while after < stretch.size:
        if stretch.up_to(after, 1)[0] in (records.CHUNK, records.MESSAGE):
            return True
        after = _following(stretch, after + 1, mcap)
    return False


def _sound(head: records.ChunkHead) -> bool:
    return head.compression in _COMPRESSIONS and (bool(head.compression) or head.stored_bytes == head.unpacked_bytes)


def _note(stretch: Stretch, kind: int, start: int, size: int, mcap: FoundInMcap, chunk: int = 0) -> bool:
    """Record a message, a schema or a channel; False if it is damaged."""
    if kind == records.MESSAGE:
        if not records.MESSAGE_HEAD.size <= size <= records.MAX_RECORD_BYTES:
            return False
        channel, _, log_time, _ = records.MESSAGE_HEAD.unpack(stretch.up_to(start, records.MESSAGE_HEAD.size))
        if log_time >= 1 << 63:
            return False
        mcap.messages.setdefault(channel, []).append((log_time, chunk, start - records.RECORD.size))
    elif kind in (records.SCHEMA, records.CHANNEL):
        return size <= records.MAX_RECORD_BYTES and mcap.declarations.note(kind, stretch.up_to(start, size))
    elif kind >= records.PRIVATE:
        mcap.private_bytes += records.RECORD.size + size
    return True


def _following(stretch: Stretch, start: int, mcap: FoundInMcap) -> int:
    """Return the offset of the next plausible record that is followed by another; the end if there is none."""
    while mcap.tried < _MAX_TRIES:
        place = stretch.find(_CANDIDATE, start)
        if place < 0:
            break
        mcap.tried += 1
        kind, size = records.RECORD.unpack(stretch.up_to(place, records.RECORD.size))
        after = place + records.RECORD.size + size
        if kind == records.CHUNK:
            head = records.chunk_head(stretch.up_to(place + records.RECORD.size, 64))
            if head is not None and _sound(head) and head.size + head.stored_bytes == size:
                return place
        elif after == stretch.size or (after < stretch.size and stretch.up_to(after, 1)[0] in range(1, _LAST_KIND + 1)):
            return place
        start = place + 1
    return stretch.size


def _scan_chunk(file: FileBytes, position: int, stored: int, head: records.ChunkHead, mcap: FoundInMcap) -> None:
    """Record all complete messages of a chunk, even if it is truncated or damaged."""
    number = len(mcap.chunks)
    size = stored
    stretch: Stretch = FileStretch(file, position, stored)
    if head.compression:
        packed = Chunk(position, stored, head.unpacked_bytes, head.compression)
        stretch = MemoryStretch(mcap.unpacked(file, packed, where=f"chunk at byte {position}", checksum=head.checksum))
        size = stretch.size
    mcap.chunks.append(Chunk(position, stored, size, head.compression))
    end = 0
    while end + records.RECORD.size <= size:
        for kind, start, length in records.walk(stretch, end):
            if kind not in records.CHUNK_KINDS or not _note(stretch, kind, start, length, mcap, number):
                break
            end = start + length
        if end + records.RECORD.size > size:
            break
        after = _following(stretch, end + 1, mcap)
        mcap.lost_bytes += after - end
        end = after
    mcap.lost_bytes += max(0, size - end)
