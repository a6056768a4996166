"""Account for every byte of a ROS 1 bag."""

from calib_core.recordings.containers.accounts import AccountBuilder, FileAccount, Progress
from calib_core.recordings.containers.chunks import Chunk
from calib_core.recordings.containers.indexed_places import IndexedPlaces
from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch
from calib_core.recordings.containers.rosbag1.recovery import BagWalk, FoundInBag, Record, note_record, scan_chunk

_MAGIC_BYTES = 13
_BAG_HEADER, _INDEX, _CHUNK, _CHUNK_INFO = 3, 4, 5, 6


def account_for_bag(file: FileBytes, indexed: IndexedPlaces, progress: Progress | None) -> FileAccount:
    """Walk through a bag from its first byte to its last.

    Args:
        file: the bag.
        indexed: the messages that its index names.
        progress: told how far the walk is.
    """
    stretch = FileStretch(file, 0, file.size_bytes)
    builder = AccountBuilder(stretch, progress)
    found = FoundInBag([Chunk(0, file.size_bytes, file.size_bytes, "none")])
    outside: dict[int, list[int]] = {}
    builder.claim(_MAGIC_BYTES, "records")
    for record in BagWalk(stretch, found, inside=False).records(_MAGIC_BYTES):
        builder.skip(record.place)
        if record.kind == _CHUNK:
            _claim_chunk(file, record, found, builder, indexed)
        elif record.kind == _BAG_HEADER:
            builder.claim(record.data_place, "records")
            builder.claim(record.end, "padding")
        elif record.kind in (_INDEX, _CHUNK_INFO):
            builder.claim(record.end, "index")
        elif note_record(stretch, record, 0, found):
            builder.claim(record.end, "messages" if found.messages else "records")
            _move(found, outside)
        else:
            builder.fault(f"the record at byte {record.place} is of an unknown kind")
            builder.claim(record.end, "unknown")
    indexed.compare(builder, 0, outside, damaged=False)
    return builder.done()


def _claim_chunk(
    file: FileBytes, record: Record, found: FoundInBag, builder: AccountBuilder, indexed: IndexedPlaces
) -> None:
    """Claim a chunk: the bytes of an uncompressed one that do not parse are damaged, and all of a compressed one."""
    lost, broken = found.lost_bytes, found.damaged_chunks
    scan_chunk(file, record, found)
    lost, failed = found.lost_bytes - lost, found.damaged_chunks > broken
    end = min(record.end, file.size_bytes)
    stored = end - record.data_place
    builder.claim(record.data_place, "records")
    packed = found.chunks[-1].packed
    bad = stored if failed or (packed and lost) else min(lost, stored)
    if failed or lost:
        builder.fault(
            found.fault if failed else f"{lost} bytes of the chunk at byte {record.place} cannot be parsed as records"
        )
    builder.claim(end - bad, "messages")
    builder.claim(end, "damaged")
    inside: dict[int, list[int]] = {}
    _move(found, inside)
    indexed.compare(builder, record.data_place, inside, damaged=False)


def _move(found: FoundInBag, offsets: dict[int, list[int]]) -> None:
    """Move the offsets of the messages found, so that a long file needs little memory."""
    for channel, entries in found.messages.items():
        offsets.setdefault(channel, []).extend(offset for _, _, offset in entries)
    found.messages.clear()
