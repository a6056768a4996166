"""Write MCAP files: chunks with message indexes, attachments, metadata, and a summary. Memory is bounded by one chunk."""

import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import BinaryIO, Literal

from calib_core.recordings.containers.compression import zstandard
from calib_core.recordings.containers.mcap import records
from calib_core.recordings.containers.sources import StoredChannel

ChunkCompression = Literal["", "lz4", "zstd"]

_CHUNK_BYTES = 1 << 22
_MESSAGE_RECORD = struct.Struct("<BQHIQQ")


@dataclass(frozen=True, slots=True)
class AttachmentHead:
    """What the index of a file says of an attachment.

    Attributes:
        name: of the attached file.
        media_type: such as "application/json".
        log_time: when it was recorded [ns].
        create_time: when it was made [ns].
        size_bytes: of its content.
    """

    name: str
    media_type: str
    log_time: int
    create_time: int
    size_bytes: int


@dataclass(slots=True)
class _Chunk:
    """The chunk being filled."""

    records: bytearray = field(default_factory=bytearray)
    entries: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    first_ns: int = 0
    last_ns: int = 0

    def span(self, log_time: int) -> None:
        """Extend the span of log times."""
        first = not self.entries
        self.first_ns = log_time if first else min(self.first_ns, log_time)
        self.last_ns = log_time if first else max(self.last_ns, log_time)


@dataclass(slots=True)
class _Summary:
    """What the summary will say, and how many messages there are."""

    groups: dict[int, list[bytes]] = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)
    first_ns: int | None = None
    last_ns: int = 0

    def add(self, kind: int, record: bytes) -> None:
        """Add a record to its group."""
        self.groups.setdefault(kind, []).append(record)

    def count(self, kind: int) -> int:
        """Return how many records a group has."""
        return len(self.groups.get(kind, ()))


class McapWriter:
    """Write one file from its first byte to its last; `finish` makes it whole.

    Args:
        file: to write to; it need not be seekable.
        profile: "ros1", "ros2" or "".
        library: the program that writes.
        compression: of the chunks.
    """

    def __init__(
        self, file: BinaryIO, *, profile: str, library: str, compression: ChunkCompression = "", version: str = ""
    ) -> None:
        self._file = file
        self._compression: ChunkCompression = compression
        self._place = 0
        self._chunk = _Chunk()
        self._summary = _Summary()
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[StoredChannel, int] = {}
        self._put(records.MAGIC)
        self._put(_record(records.HEADER, _text(profile) + _text(f"{library} {version}".strip())))

    @property
    def message_count(self) -> int:
        """Number of messages written so far."""
        return sum(self._summary.counts.values())

    def channel(self, channel: StoredChannel) -> int:
        """Declare a channel, once, and return its number."""
        number = self._channels.get(channel)
        if number is None:
            number = self._channels[channel] = len(self._channels)
            head = struct.pack("<HH", number, self._schema(channel))
            self._declare(
                records.CHANNEL, head + _text(channel.topic) + _text(channel.encoding) + _mapping(channel.notes)
            )
        return number

    def _schema(self, channel: StoredChannel) -> int:
        """Declare a channel's schema, once, and return its number; 0 for none."""
        key = (channel.schema_name, channel.schema_encoding, channel.schema_data)
        if not any(key):
            return 0
        number = self._schemas.get(key)
        if number is None:
            number = self._schemas[key] = len(self._schemas) + 1
            name, encoding, data = key
            self._declare(records.SCHEMA, struct.pack("<H", number) + _text(name) + _text(encoding) + _sized(data))
        return number

    def _declare(self, kind: int, body: bytes) -> None:
        record = _record(kind, body)
        self._chunk.records += record
        self._summary.add(kind, record)

    def message(self, channel: int, data: bytes, *, log_time: int, publish_time: int, sequence: int = 0) -> None:
        """Write a message of a declared channel; times in ns."""
        chunk = self._chunk
        chunk.span(log_time)
        chunk.entries.setdefault(channel, []).append((log_time, len(chunk.records)))
        size = records.MESSAGE_HEAD.size + len(data)
        chunk.records += _MESSAGE_RECORD.pack(records.MESSAGE, size, channel, sequence, log_time, publish_time)
        chunk.records += data
        summary = self._summary
        summary.counts[channel] = summary.counts.get(channel, 0) + 1
        summary.first_ns = log_time if summary.first_ns is None else min(summary.first_ns, log_time)
        summary.last_ns = max(summary.last_ns, log_time)
        if len(chunk.records) >= _CHUNK_BYTES:
            self._end_chunk()

    def _end_chunk(self) -> None:
        """Write the chunk, its message indexes, and remember both for the summary."""
        chunk, self._chunk = self._chunk, _Chunk()
        if not chunk.records:
            return
        stored = _compressed(chunk.records, self._compression)
        times = struct.pack("<QQ", chunk.first_ns, chunk.last_ns)
        head = struct.pack("<QI", len(chunk.records), zlib.crc32(chunk.records)) + _text(self._compression)
        start = self._place
        self._put(records.RECORD.pack(records.CHUNK, len(times) + len(head) + 8 + len(stored)) + times + head)
        self._put(struct.pack("<Q", len(stored)))
        self._put(stored)
        length, places = self._place - start, b""
        indexes = self._place
        for channel, entries in chunk.entries.items():
            places += struct.pack("<HQ", channel, self._place)
            array = b"".join(struct.pack("<QQ", *entry) for entry in entries)
            self._put(_record(records.MESSAGE_INDEX, struct.pack("<H", channel) + _sized(array)))
        body = times + struct.pack("<QQ", start, length) + _sized(places) + struct.pack("<Q", self._place - indexes)
        body += _text(self._compression) + struct.pack("<QQ", len(stored), len(chunk.records))
        self._summary.add(records.CHUNK_INDEX, _record(records.CHUNK_INDEX, body))

    def attachment(self, name: str, data: bytes, *, media_type: str, time: int) -> None:
        """Attach a file; time in ns."""
        head = AttachmentHead(name, media_type, time, time, len(data))
        body = struct.pack("<QQ", time, time) + _text(name) + _text(media_type) + struct.pack("<Q", len(data)) + data
        self.attachment_record(head, len(body) + 4, (body, struct.pack("<I", zlib.crc32(body))))

    def attachment_record(self, head: AttachmentHead, size: int, pieces: Iterable[bytes]) -> None:
        """Write an attachment record, as it is, from pieces of its body; size is their total length."""
        self._end_chunk()
        start = self._place
        self._put(records.RECORD.pack(records.ATTACHMENT, size))
        for piece in pieces:
            self._put(piece)
        body = struct.pack("<QQQQQ", start, self._place - start, head.log_time, head.create_time, head.size_bytes)
        self._summary.add(
            records.ATTACHMENT_INDEX,
            _record(records.ATTACHMENT_INDEX, body + _text(head.name) + _text(head.media_type)),
        )

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record."""
        self.metadata_record(name, _text(name) + _mapping(tuple(values.items())))

    def metadata_record(self, name: str, body: bytes) -> None:
        """Write a metadata record from its body."""
        self._end_chunk()
        start = self._place
        self._put(_record(records.METADATA, body))
        place = struct.pack("<QQ", start, self._place - start)
        self._summary.add(records.METADATA_INDEX, _record(records.METADATA_INDEX, place + _text(name)))

    def finish(self) -> None:
        """Write the last chunk, the summary and the footer."""
        self._end_chunk()
        self._put(_record(records.DATA_END, struct.pack("<I", 0)))
        self._summary.add(records.STATISTICS, _record(records.STATISTICS, self._statistics()))
        start, checksum, offsets = self._place, 0, b""
        for kind, group in self._summary.groups.items():
            begin = self._place
            for record in group:
                checksum = zlib.crc32(record, checksum)
                self._put(record)
            offsets += _record(records.SUMMARY_OFFSET, struct.pack("<BQQ", kind, begin, self._place - begin))
        footer = records.RECORD.pack(records.FOOTER, 20) + struct.pack("<QQ", start, self._place)
        checksum = zlib.crc32(footer, zlib.crc32(offsets, checksum))
        self._put(offsets + footer + struct.pack("<I", checksum) + records.MAGIC)

    def _statistics(self) -> bytes:
        summary = self._summary
        counts = b"".join(struct.pack("<HQ", channel, count) for channel, count in sorted(summary.counts.items()))
        numbers = (
            records.SCHEMA,
            records.CHANNEL,
            records.ATTACHMENT_INDEX,
            records.METADATA_INDEX,
            records.CHUNK_INDEX,
        )
        head = struct.pack("<QHIIII", self.message_count, *(summary.count(kind) for kind in numbers))
        return head + struct.pack("<QQ", summary.first_ns or 0, summary.last_ns) + _sized(counts)

    def _put(self, data: bytes | bytearray) -> None:
        self._file.write(data)
        self._place += len(data)


def _compressed(data: bytearray, compression: ChunkCompression) -> bytes | bytearray:
    if compression == "lz4":
        import lz4.frame

        return bytes(lz4.frame.compress(bytes(data)))
    if compression == "zstd":
        return bytes(zstandard().compress(bytes(data), level=1))
    return data


def _record(kind: int, body: bytes) -> bytes:
    return records.RECORD.pack(kind, len(body)) + body


def _sized(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data


def _text(value: str) -> bytes:
    return _sized(value.encode("utf-8", "replace"))


def _mapping(entries: tuple[tuple[str, str], ...]) -> bytes:
    return _sized(b"".join(_text(key) + _text(value) for key, value in entries))
