"""A source outside ROS containers: a list of times, with ROS 1 messages built on demand, and the options for reading it."""

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, DataWarning, TimeNs
from calib_core.recordings.containers.sources import Assumption, Channel, Heads, MessageIndex
from calib_core.recordings.field_words import MappedColumn
from calib_core.recordings.plain_files.folder_cameras import FolderCamera

_HEADER_BYTES = 16
_CODES = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}


@dataclass(frozen=True, slots=True, eq=False)
class PlainSource:
    """One folder or file with one topic; implements Source.

    Attributes:
        path: the folder or file.
        size_bytes: total size.
        container: description of the format.
        channel: its topic.
        times_ns: (n,) ascending.
        message: builds the message of a row.
        warnings: problems found on opening it.
        closed: called on closing.
        assumptions: what it does not state and reading it takes for granted.
        zoneless: whether its times come from dates without a time zone.
        counted: whether its times come from the numbers of files or scans.
        mapped: whether --map was applied to it.
        names: (n,) of the files of its rows, without suffix; empty if a row is no file.
        times_from: where its times come from, as a clause; "" if they stand in its messages.
        camera: the intrinsics that its data set publishes; None if there are none.
        unreadable: files of the folder that were skipped on opening, and why.
        computed: what the fields of its messages were computed from, where they are not the file's own; "" if they are.
    """

    path: Path
    size_bytes: int
    container: str
    channel: Channel
    times_ns: TimesNs
    message: Callable[[int], bytes]
    warnings: tuple[DataWarning, ...] = ()
    closed: Callable[[], None] | None = None
    assumptions: tuple[Assumption, ...] = ()
    zoneless: bool = False
    counted: bool = False
    mapped: bool = False
    names: tuple[str, ...] = ()
    times_from: str = ""
    camera: FolderCamera | None = None
    unreadable: Mapping[Path, str] = field(default_factory=dict)
    computed: str = ""

    def __post_init__(self) -> None:
        """Refuse times that a message cannot represent.

        Raises:
            RecordingError: one is before 1970 or after 2106.
        """
        low, high = int(self.times_ns.min(initial=0)), int(self.times_ns.max(initial=0))
        if low < 0 or high >= NS_PER_S << 32:
            raise RecordingError(
                f"{self.path}: a time is {(low if low < 0 else high) / NS_PER_S:.6g} s, outside the years 1970 to 2106; "
                "check its unit"
            )

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The topic."""
        return (self.channel,)

    @property
    def counts(self) -> Mapping[int, int]:
        """How many messages there are."""
        return {self.channel.id: len(self.times_ns)}

    @property
    def later_warnings(self) -> tuple[DataWarning, ...]:
        """None: unreadable files are reported message by message."""
        return ()

    def index(self, channel_id: int) -> MessageIndex:
        """Return the index of the messages: one row each."""
        rows = np.arange(len(self.times_ns) if channel_id == self.channel.id else 0, dtype=np.int64)
        return MessageIndex(self.times_ns[rows], rows, np.zeros_like(rows))

    def read(self, chunk: int, offset: int) -> bytes:
        """Build one message."""
        return self.message(chunk)

    def heads(self, index: MessageIndex, size: int, *, keep: bool = False) -> Heads:
        """Return the first bytes of many messages; no file is read if only the stamps are needed."""
        rows = np.zeros((len(index), size), dtype=np.uint8)
        lengths = np.full(len(index), max(size, _HEADER_BYTES), dtype=np.int64)
        fault = ""
        for place, row in enumerate(index.chunk.tolist()):
            head = header_bytes(TimeNs(int(self.times_ns[row])), "")
            if size > _HEADER_BYTES:
                try:
                    head = self.message(row)
                    lengths[place] = len(head)
                except RecordingError as error:
                    lengths[place] = -1
                    fault = fault or str(error)
            rows[place, : min(len(head), size)] = np.frombuffer(head[:size], dtype=np.uint8)
        return Heads(rows, lengths, fault)

    def close(self) -> None:
        """Close the source."""
        if self.closed is not None:
            self.closed()


def topic_of(path: Path, word: str) -> str:
    """Name a topic after a folder or file; after the folder above if its own name is "data" (raw KITTI)."""
    path = path.parent if path.name == "data" and path.parent.name else path
    name = "".join(letter if letter.isalnum() else "_" for letter in path.stem).strip("_")
    return f"/{name or word}/{word}"


@dataclass(frozen=True, slots=True)
class PlainOptions:
    """Options of plain files.

    Attributes:
        video_start: the time of a video's first frame.
        mapped: --map, parsed.
        axes_given: whether the user gave the directions of --radar-axes.
        angle_unit: the angle unit of --radar-axes, "deg" or "rad"; "" if not given.
        zone_s: offset from UTC of dates without a zone [s]; None if not given.
        taken: files that are read as something else already.
    """

    video_start: str | None = None
    mapped: tuple[MappedColumn, ...] = ()
    axes_given: bool = False
    angle_unit: str = ""
    zone_s: int | None = None
    taken: frozenset[Path] = frozenset()


def image_channel(topic: str) -> Channel:
    """Return the channel of an image topic."""
    return Channel(0, topic, "sensor_msgs/CompressedImage", "ros1", "", "")


def cloud_channel(topic: str) -> Channel:
    """Return the channel of a point-cloud topic."""
    return Channel(0, topic, "sensor_msgs/PointCloud2", "ros1", "", "")


def header_bytes(time: TimeNs, frame: str) -> bytes:
    """Return a serialised header."""
    sec, nanosec = divmod(int(time), NS_PER_S)
    return struct.pack("<III", 0, sec, nanosec) + _string(frame)


def image_message(time: TimeNs, frame: str, data: bytes) -> bytes:
    """Return a CompressedImage; its format is recognized from the first bytes of the data."""
    return header_bytes(time, frame) + _string("") + struct.pack("<I", len(data)) + data


def cloud_message(time: TimeNs, frame: str, points: np.ndarray) -> bytes:
    """Return a PointCloud2.

    Args:
        time: its stamp.
        frame: its frame_id.
        points: (n,) structured, little endian; fields of types that PointCloud2 does not support are not described.
    """
    described = [
        _string(name) + struct.pack("<IBI", place[1], _CODES[place[0].str[1:]], 1)
        for name, place in (points.dtype.fields or {}).items()
        if place[0].str[1:] in _CODES
    ]
    data, step = points.tobytes(), points.dtype.itemsize
    parts = [
        header_bytes(time, frame), struct.pack("<III", 1, len(points), len(described)), *described,
        struct.pack("<BIII", 0, step, step * len(points), len(data)), data, b"\1",
    ]  # fmt: skip
    return b"".join(parts)


def _string(text: str) -> bytes:
    raw = text.encode()
    return struct.pack("<I", len(raw)) + raw
