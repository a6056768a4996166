"""Account for every byte of an MCAP file."""

import zlib

from calib_core.recordings.containers.accounts import AccountBuilder, ByteKind, FileAccount, Progress
from calib_core.recordings.containers.chunks import Chunk
from calib_core.recordings.containers.indexed_places import IndexedPlaces
from calib_core.recordings.containers.mcap.records import (
    CHUNK,
    FOOTER,
    MAGIC,
    MESSAGE,
    MESSAGE_INDEX,
    PRIVATE,
    SUMMARY_KINDS,
    Declarations,
    crc_position,
    walk,
)
from calib_core.recordings.containers.mcap.recovery import FoundInMcap, Part, parts_of_mcap
from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch

_PIECE_BYTES = 1 << 20
_KINDS: dict[int, ByteKind] = {MESSAGE: "messages", MESSAGE_INDEX: "index"}


def account_for_mcap(file: FileBytes, indexed: IndexedPlaces, progress: Progress | None) -> FileAccount:
    """Walk through a file from its first byte to its last, and check every checksum of a chunk.

    Args:
        file: the file.
        indexed: the messages that its index names.
        progress: told how far the walk is.
    """
    stretch = FileStretch(file, 0, file.size_bytes)
    builder = AccountBuilder(stretch, progress)
    found = FoundInMcap(Declarations(), [Chunk(0, file.size_bytes, file.size_bytes, "")])
    outside: dict[int, list[int]] = {}
    builder.claim(len(MAGIC), "records")
    for part in parts_of_mcap(file, found):
        if part.kind == CHUNK:
            _claim_chunk(file, part, found, builder, indexed)
            continue
        _move(found, outside)
        if not part.kind:
            builder.skip(part.end)
        elif part.kind >= PRIVATE:
            builder.claim(part.end, "unknown")
        else:
            builder.claim(part.end, _KINDS.get(part.kind, "records"))
    indexed.compare(builder, 0, outside, damaged=False)
    _claim_summary(stretch, builder)
    return builder.done()


def _claim_chunk(
    file: FileBytes, part: Part, found: FoundInMcap, builder: AccountBuilder, indexed: IndexedPlaces
) -> None:
    """Claim a chunk whose messages are in found."""
    chunk = found.chunks[-1]
    stored = part.end - part.start
    fault = found.fault
    if not chunk.packed and not fault and _wrong_checksum(file, chunk):
        fault = f"chunk at byte {part.place}: wrong checksum"
    bad = stored if fault else min(found.lost_bytes, stored)
    if fault or found.lost_bytes:
        builder.fault(
            fault or f"{found.lost_bytes} bytes of the chunk at byte {part.place} cannot be parsed as records"
        )
    builder.claim(part.start, "records")
    builder.claim(part.end - bad, "messages")
    builder.claim(part.end, "damaged")
    inside: dict[int, list[int]] = {}
    _move(found, inside)
    indexed.compare(builder, chunk.position, inside, damaged="wrong checksum" in fault)
    found.lost_bytes, found.fault = 0, ""


def _wrong_checksum(file: FileBytes, chunk: Chunk) -> bool:
    """Return whether an uncompressed chunk fails its checksum."""
    wanted = int.from_bytes(file.up_to(crc_position(chunk.position, chunk.compression), 4), "little")
    found = 0
    for place in range(0, chunk.stored_bytes if wanted else 0, _PIECE_BYTES):
        found = zlib.crc32(file.up_to(chunk.position + place, min(_PIECE_BYTES, chunk.stored_bytes - place)), found)
    return wanted != found


def _claim_summary(stretch: FileStretch, builder: AccountBuilder) -> None:
    """Claim the summary, the footer and the closing bytes of a file that was closed."""
    for kind, start, size in walk(stretch, builder.place):
        if kind not in SUMMARY_KINDS and kind < PRIVATE:
            return
        builder.claim(start + size, "index")
        if kind == FOOTER:
            if stretch.up_to(builder.place, len(MAGIC)) == MAGIC:
                builder.claim(builder.place + len(MAGIC), "records")
            return


def _move(found: FoundInMcap, offsets: dict[int, list[int]]) -> None:
    """Move the offsets of the messages found, so that a long file needs little memory."""
    for channel, entries in found.messages.items():
        offsets.setdefault(channel, []).extend(offset for _, _, offset in entries)
    found.messages.clear()
