"""What an MCAP file holds besides its messages: channels as stored, the profile, attachments and metadata."""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from calib_core.errors import RecordingError
from calib_core.recordings.containers.chunks import Chunk
from calib_core.recordings.containers.mcap.reader import McapSource
from calib_core.recordings.containers.mcap.records import (
    ATTACHMENT,
    CHANNEL,
    DATA_END,
    FOOTER,
    HEADER,
    MAGIC,
    MAX_RECORD_BYTES,
    MESSAGE_HEAD,
    METADATA,
    RECORD,
    SCHEMA,
    Declarations,
    string_at,
    walk,
)
from calib_core.recordings.containers.mcap.recovery import FoundInMcap, Part, parts_of_mcap
from calib_core.recordings.containers.mcap.writing import AttachmentHead, McapWriter
from calib_core.recordings.containers.positioned_reads import FileStretch
from calib_core.recordings.containers.stored_channels import StoredChannel

_PIECE_BYTES = 1 << 20
_HEAD_BYTES = 1 << 16
_TAIL_BYTES = 37


@dataclass(frozen=True, slots=True)
class BesidesMessages:
    """The parts of a file that are no messages.

    Attributes:
        profile: "ros1", "ros2" or what else its header states.
        channels: as stored, by number.
        parts: its attachments and metadata records, in order.
    """

    profile: str
    channels: Mapping[int, StoredChannel]
    parts: tuple[Part, ...] = field(default=())


def besides_messages(source: McapSource) -> BesidesMessages:
    """Read what a file holds besides messages; a file without an index is walked through once more."""
    if source.recovered:
        found = FoundInMcap(Declarations(), [Chunk(0, source.size_bytes, source.size_bytes, "")])
        parts = []
        for part in parts_of_mcap(source.file, found):
            found.messages.clear()
            parts.append(part)
        declared = found.declarations
    else:
        declared = Declarations()
        parts = list(_parts(source))
        for part in (*parts, *_summary(source)):
            if part.kind in (SCHEMA, CHANNEL) and part.end - part.start <= MAX_RECORD_BYTES:
                declared.note(part.kind, source.file.up_to(part.start, part.end - part.start))
    header = next((part for part in parts if part.kind == HEADER), None)
    kept = tuple(part for part in parts if part.kind in (ATTACHMENT, METADATA))
    return BesidesMessages(_profile(source, header), declared.stored, kept)


def _parts(source: McapSource) -> Iterator[Part]:
    """Yield the records outside chunks, reading only the heads of all records."""
    place = len(MAGIC)
    while place + RECORD.size <= source.size_bytes:
        kind, size = RECORD.unpack(source.file.at(place, RECORD.size))
        start = place + RECORD.size
        if kind in (DATA_END, FOOTER) or size > source.size_bytes - start:
            return
        if kind in (HEADER, SCHEMA, CHANNEL, ATTACHMENT, METADATA):
            yield Part(kind, place, start, start + size)
        place = start + size


def _summary(source: McapSource) -> Iterator[Part]:
    """Yield the schemas and channels that the summary repeats."""
    begin = int.from_bytes(source.file.up_to(source.size_bytes - _TAIL_BYTES + RECORD.size, 8), "little")
    stretch = FileStretch(source.file, begin, source.size_bytes - _TAIL_BYTES - begin)
    for kind, start, size in walk(stretch):
        if kind in (SCHEMA, CHANNEL):
            yield Part(kind, begin + start - RECORD.size, begin + start, begin + start + size)


def _profile(source: McapSource, header: Part | None) -> str:
    if header is None:
        return ""
    try:
        return string_at(source.file.up_to(header.start, min(header.end - header.start, _HEAD_BYTES)), 0)[0]
    except struct.error:
        return ""


def copy_besides(source: McapSource, besides: BesidesMessages, writer: McapWriter) -> int:
    """Copy a file's attachments and metadata, byte for byte; return how many were damaged and left out."""
    damaged = 0
    for part in besides.parts:
        try:
            if part.kind == METADATA:
                body = source.file.at(part.start, part.end - part.start)
                writer.metadata_record(string_at(body, 0)[0], body)
            else:
                head = _attachment_head(source.file.up_to(part.start, min(_HEAD_BYTES, part.end - part.start)))
                writer.attachment_record(head, part.end - part.start, _pieces(source, part))
        except (struct.error, RecordingError):
            damaged += 1
    return damaged


def _attachment_head(body: bytes) -> AttachmentHead:
    log_time, create_time = struct.unpack_from("<QQ", body)
    name, place = string_at(body, 16)
    media_type, place = string_at(body, place)
    return AttachmentHead(name, media_type, log_time, create_time, struct.unpack_from("<Q", body, place)[0])


def _pieces(source: McapSource, part: Part) -> Iterator[bytes]:
    for place in range(part.start, part.end, _PIECE_BYTES):
        yield source.file.up_to(place, min(_PIECE_BYTES, part.end - place))


def sent(source: McapSource, chunk: int, offset: int) -> tuple[int, int]:
    """Return the sequence number and the publish time [ns] of a message.

    Raises:
        RecordingError: there is no message at this place.
    """
    head = source.piece(chunk, offset + RECORD.size, MESSAGE_HEAD.size)
    if len(head) < MESSAGE_HEAD.size:
        raise RecordingError(f"{source.path}: no message at the indexed position (chunk {chunk}, byte {offset})")
    _, sequence, _, publish_time = MESSAGE_HEAD.unpack(head)
    return sequence, publish_time
