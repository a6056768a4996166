"""A source outside ROS containers: a list of times, with messages built on demand."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.containers.sources import Channel, Heads, MessageIndex
from calib_core.recordings.plain_files.folder_cameras import FolderCamera
from calib_core.recordings.plain_files.messages import header_bytes
from calib_core.results import DataWarning

_HEADER_BYTES = 16


def _no_faults() -> dict[Path, str]:
    return {}


def _no_numbers() -> dict[int, TimeNs]:
    return {}


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
        numbers: times of its files by their numbers, for files of other folders that are only numbered.
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
    numbers: Mapping[int, TimeNs] = field(default_factory=_no_numbers)
    camera: FolderCamera | None = None
    unreadable: Mapping[Path, str] = field(default_factory=_no_faults)
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
