"""Read whole recordings for copying: every message as stored, in the order of the files, merged by receive time."""

import heapq
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.containers.chunks import Chunk
from calib_core.recordings.containers.mcap import records
from calib_core.recordings.containers.mcap.reader import McapSource
from calib_core.recordings.containers.mcap.recovery import FoundInMcap, Part, parts_of_mcap
from calib_core.recordings.containers.mcap.writing import AttachmentHead, McapWriter
from calib_core.recordings.containers.positioned_reads import FileBytes, FileStretch
from calib_core.recordings.containers.rosbag1.index import CONNECTION, fields_of, record_head
from calib_core.recordings.containers.rosbag1.reader import Rosbag1Source
from calib_core.recordings.containers.rosbag1.recovery import scan_bag
from calib_core.recordings.containers.sources import MessageIndex, Source, StoredChannel
from calib_core.recordings.containers.sqlite import SqliteSource

_PIECE_BYTES = 1 << 20


_HEAD_BYTES = 1 << 16


_TAIL_BYTES = 37


_ROWS_TOGETHER = 4096


_MAGIC_BYTES = len(b"#ROSBAG V2.0\n")


_OWN_FIELDS = ("topic", "type", "message_definition")


@dataclass(frozen=True, slots=True)
class StoredMessage:
    """One message as stored.

    Attributes:
        channel: of the message.
        data: its bytes.
        log_time: when it was received [ns].
        publish_time: when it was sent [ns]; the log time in files that do not store it.
        sequence: its number; 0 in files that do not store it.
    """

    channel: StoredChannel
    data: bytes
    log_time: int
    publish_time: int
    sequence: int


@dataclass(slots=True)
class Losses:
    """The messages that could not be read.

    Attributes:
        by_topic: their number.
        fault: why the first of them could not.
    """

    by_topic: dict[str, int] = field(default_factory=dict)
    fault: str = ""

    def note(self, topic: str, fault: str) -> None:
        """Count one message."""
        self.by_topic[topic] = self.by_topic.get(topic, 0) + 1
        self.fault = self.fault or fault


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


@dataclass(frozen=True, slots=True, eq=False)
class CopiedFile:
    """One file to copy.

    Attributes:
        source: the open file.
        channels: as stored, by number.
        profile: what an MCAP file states of its contents; else "".
        besides: attachments and metadata of an MCAP file; else None.
    """

    source: McapSource | Rosbag1Source | SqliteSource
    channels: Mapping[int, StoredChannel]
    profile: str = ""
    besides: BesidesMessages | None = None

    def copy_besides(self, writer: McapWriter) -> int:
        """Copy attachments and metadata; return how many were damaged and left out."""
        if self.besides is None or not isinstance(self.source, McapSource):
            return 0
        return copy_besides(self.source, self.besides, writer)

    def messages(self, rows: Mapping[int, MessageIndex], losses: Losses) -> Iterator[StoredMessage]:
        """Read messages in the order of the file, so that each chunk is decompressed once.

        Args:
            rows: which messages, by channel number.
            losses: takes the unreadable ones.
        """
        places = _Places.of(rows)
        for first in range(0, len(places.order), _ROWS_TOGETHER):
            some = places.order[first : first + _ROWS_TOGETHER]
            columns = (places.channel[some], places.receive_ns[some], *np.divmod(places.place[some], places.span))
            for number, receive_ns, chunk, offset in zip(*(column.tolist() for column in columns), strict=True):
                channel = self.channels[number]
                if receive_ns < 0:
                    losses.note(
                        channel.topic,
                        f"{self.source.path}: a message was received before 1970, which MCAP cannot store",
                    )
                    continue
                try:
                    data = self.source.read(chunk, offset)
                    sequence, publish_time = self._sent(chunk, offset, receive_ns)
                except RecordingError as error:
                    losses.note(channel.topic, str(error))
                    continue
                yield StoredMessage(channel, data, receive_ns, publish_time, sequence)

    def _sent(self, chunk: int, offset: int, receive_ns: int) -> tuple[int, int]:
        return sent(self.source, chunk, offset) if isinstance(self.source, McapSource) else (0, receive_ns)


@dataclass(frozen=True, slots=True, eq=False)
class _Places:
    """The places of all messages of a file: number and order in the file, in few bytes per message."""

    channel: np.ndarray
    receive_ns: np.ndarray
    place: np.ndarray
    span: int
    order: np.ndarray

    @classmethod
    def of(cls, rows: Mapping[int, MessageIndex]) -> "_Places":
        indexes = list(rows.values())
        nothing = np.zeros(0, dtype=np.int64)
        span = 1 + max((int(index.offset.max()) for index in indexes if len(index)), default=0)
        place = np.concatenate([nothing, *(index.chunk * span + index.offset for index in indexes)])
        channel = np.repeat(np.array(list(rows), dtype=np.int32), [len(index) for index in indexes])
        receive_ns = np.concatenate([nothing, *(index.receive_ns for index in indexes)])
        order = np.argsort(place, kind="stable").astype(np.uint32)
        return cls(channel, receive_ns, place, span, order)


def copied_file(source: Source) -> CopiedFile | None:
    """Return a file to copy; None if it is no ROS recording."""
    if isinstance(source, McapSource):
        besides = besides_messages(source)
        return CopiedFile(source, _complete(source, besides.channels), besides.profile, besides)
    if isinstance(source, Rosbag1Source):
        return CopiedFile(source, _complete(source, stored_connections(source)))
    return CopiedFile(source, source.stored_channels()) if isinstance(source, SqliteSource) else None


def _complete(source: Source, stored: Mapping[int, StoredChannel]) -> Mapping[int, StoredChannel]:
    """Add the channels whose records could not be found again as the reader understood them."""
    languages = {"msg": "ros1msg" if isinstance(source, Rosbag1Source) else "ros2msg", "idl": "ros2idl"}
    read = {
        channel.id: StoredChannel(
            channel.topic,
            channel.encoding,
            channel.type,
            languages.get(channel.definition_format, ""),
            channel.definition.encode(),
        )
        for channel in source.channels
    }
    return {**read, **stored}


def merged_messages(
    files: Sequence[CopiedFile], rows: Sequence[Mapping[int, MessageIndex]], losses: Losses
) -> Iterator[StoredMessage]:
    """Merge the messages of several files by receive time; those of one file keep their order.

    Args:
        files: what to read.
        rows: of each file, which messages.
        losses: takes the unreadable ones.
    """
    streams = [file.messages(wanted, losses) for file, wanted in zip(files, rows, strict=True)]
    return heapq.merge(*streams, key=lambda message: message.log_time)


def besides_messages(source: McapSource) -> BesidesMessages:
    """Read what a file holds besides messages; a file without an index is walked through once more."""
    if source.recovered:
        mcap = FoundInMcap([Chunk(0, source.size_bytes, source.size_bytes, "")])
        parts = []
        for part in parts_of_mcap(source.file, mcap):
            mcap.messages.clear()
            parts.append(part)
        declared = mcap.declarations
    else:
        declared = records.Declarations()
        parts = list(_parts(source))
        for part in (*parts, *_summary(source)):
            if part.kind in (records.SCHEMA, records.CHANNEL) and part.end - part.start <= records.MAX_RECORD_BYTES:
                declared.note(part.kind, source.file.up_to(part.start, part.end - part.start))
    header = next((part for part in parts if part.kind == records.HEADER), None)
    kept = tuple(part for part in parts if part.kind in (records.ATTACHMENT, records.METADATA))
    return BesidesMessages(_profile(source, header), declared.stored, kept)


def _parts(source: McapSource) -> Iterator[Part]:
    """Yield the records outside chunks, reading only the heads of all records."""
    place = len(records.MAGIC)
    while place + records.RECORD.size <= source.size_bytes:
        kind, size = records.RECORD.unpack(source.file.at(place, records.RECORD.size))
        start = place + records.RECORD.size
        if kind in (records.DATA_END, records.FOOTER) or size > source.size_bytes - start:
            return
        if kind in (records.HEADER, records.SCHEMA, records.CHANNEL, records.ATTACHMENT, records.METADATA):
            yield Part(kind, place, start, start + size)
        place = start + size


def _summary(source: McapSource) -> Iterator[Part]:
    """Yield the schemas and channels that the summary repeats."""
    begin = int.from_bytes(source.file.up_to(source.size_bytes - _TAIL_BYTES + records.RECORD.size, 8), "little")
    stretch = FileStretch(source.file, begin, source.size_bytes - _TAIL_BYTES - begin)
    for kind, start, size in records.walk(stretch):
        if kind in (records.SCHEMA, records.CHANNEL):
            yield Part(kind, begin + start - records.RECORD.size, begin + start, begin + start + size)


def _profile(source: McapSource, header: Part | None) -> str:
    if header is None:
        return ""
    try:
        return records.string_at(source.file.up_to(header.start, min(header.end - header.start, _HEAD_BYTES)), 0)[0]
    except struct.error:
        return ""


def copy_besides(source: McapSource, besides: BesidesMessages, writer: McapWriter) -> int:
    """Copy a file's attachments and metadata, byte for byte; return how many were damaged and left out."""
    damaged = 0
    for part in besides.parts:
        try:
            if part.kind == records.METADATA:
                body = source.file.at(part.start, part.end - part.start)
                writer.metadata_record(records.string_at(body, 0)[0], body)
            else:
                head = _attachment_head(source.file.up_to(part.start, min(_HEAD_BYTES, part.end - part.start)))
                places = range(part.start, part.end, _PIECE_BYTES)
                pieces = (source.file.up_to(place, min(_PIECE_BYTES, part.end - place)) for place in places)
                writer.attachment_record(head, part.end - part.start, pieces)
        except (struct.error, RecordingError):
            damaged += 1
    return damaged


def _attachment_head(body: bytes) -> AttachmentHead:
    log_time, create_time = struct.unpack_from("<QQ", body)
    name, place = records.string_at(body, 16)
    media_type, place = records.string_at(body, place)
    return AttachmentHead(name, media_type, log_time, create_time, struct.unpack_from("<Q", body, place)[0])


def sent(source: McapSource, chunk: int, offset: int) -> tuple[int, int]:
    """Return the sequence number and the publish time [ns] of a message.

    Raises:
        RecordingError: there is no message at this place.
    """
    head = source.piece(chunk, offset + records.RECORD.size, records.MESSAGE_HEAD.size)
    if len(head) < records.MESSAGE_HEAD.size:
        raise RecordingError(f"{source.path}: no message at the indexed position (chunk {chunk}, byte {offset})")
    _, sequence, _, publish_time = records.MESSAGE_HEAD.unpack(head)
    return sequence, publish_time


def stored_connections(source: Rosbag1Source) -> Mapping[int, StoredChannel]:
    """Return the connections by number; a bag without an index is walked through once more."""
    found = {}
    for header, data in _records(source.file, recovered=source.recovered):
        fields = fields_of(data)
        if fields is not None and len(header.get("conn", b"")) == 4:
            found[int.from_bytes(header["conn"], "little")] = _channel(header, fields)
    return found


def _records(file: FileBytes, *, recovered: bool) -> Iterator[tuple[Mapping[str, bytes], bytes]]:
    """Yield header and data of the connection records."""
    head = record_head(FileStretch(file, 0, file.size_bytes), _MAGIC_BYTES, file, 0)
    after = _MAGIC_BYTES + 8 + len(head[0]) + head[1]
    if recovered:
        yield from scan_bag(file, after).connections.values()
        return
    position = int.from_bytes((fields_of(head[0]) or {}).get("index_pos", b""), "little")
    stretch = FileStretch(file, position, file.size_bytes - position)
    place = 0
    while place < stretch.size:
        raw, size = record_head(stretch, place, file, position)
        place += 8 + len(raw)
        header = fields_of(raw) or {}
        if header.get("op") == bytes([CONNECTION]):
            yield header, stretch.up_to(place, size)
        place += size


def _channel(header: Mapping[str, bytes], fields: Mapping[str, bytes]) -> StoredChannel:
    definition = fields.get("message_definition", b"")
    notes = tuple((name, _text(value)) for name, value in fields.items() if name not in _OWN_FIELDS)
    topic, kind = _text(header.get("topic", b"")), _text(fields.get("type", b""))
    return StoredChannel(topic, "ros1", kind, "ros1msg", definition, notes)


def _text(value: bytes) -> str:
    return value.decode("utf-8", "replace")
