"""Read whole recordings for copying: every message as stored, in the order of the files, merged by receive time."""

import heapq
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from calib_core.errors import RecordingError
from calib_core.recordings.containers.mcap.besides import BesidesMessages, besides_messages, copy_besides, sent
from calib_core.recordings.containers.mcap.reader import McapSource
from calib_core.recordings.containers.mcap.writing import McapWriter
from calib_core.recordings.containers.rosbag1.connections import stored_connections
from calib_core.recordings.containers.rosbag1.reader import Rosbag1Source
from calib_core.recordings.containers.sources import MessageIndex, Source
from calib_core.recordings.containers.sqlite.reader import SqliteSource
from calib_core.recordings.containers.stored_channels import StoredChannel

_ROWS_TOGETHER = 4096


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
            for number, receive_ns, chunk, offset in zip(*(one.tolist() for one in columns), strict=True):
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
        one.id: StoredChannel(
            one.topic, one.encoding, one.type, languages.get(one.definition_format, ""), one.definition.encode()
        )
        for one in source.channels
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
    return heapq.merge(*streams, key=_log_time)


def _log_time(message: StoredMessage) -> int:
    return message.log_time
