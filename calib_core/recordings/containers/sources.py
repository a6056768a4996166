"""The interface of every container: channels, an index of messages, and their bytes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol, TypeAlias

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.measurements import DataWarning

CONFIRM_ALL = "--confirm-assumptions"
"""The option that confirms every assumption, and the only one for some."""


@dataclass(frozen=True, slots=True)
class Assumption:
    """One unit, sign, order or meaning that the file does not state.

    Attributes:
        key: short and stable, such as "angle-unit", "azimuth-sign", "axes", "length-unit", "speed-unit", "time-unit" or
            "field-meaning".
        topic: the topic it is about.
        text: what is assumed and why, as a sentence without its final period.
        confirm: the options that state it, such as "--map x=posX:m" or "--radar-axes forward,left,up".
    """

    key: str
    topic: str
    text: str
    confirm: str

    @property
    def words(self) -> str:
        """The text with its topic."""
        return f"{self.topic}: {self.text}"


@dataclass(frozen=True, slots=True)
class StatedAssumption:
    """An assumption, and whether the user has confirmed it."""

    assumption: Assumption
    confirmed: bool


def assumption_warnings(assumptions: Sequence[Assumption]) -> list[DataWarning]:
    """Warn about each unconfirmed assumption."""
    return [
        DataWarning.reported("assumed", assumption.words, assumption_hint(assumption.confirm))
        for assumption in assumptions
    ]


def assumption_hint(confirm: str) -> str:
    """Return what to do about an assumption, given the options that state it."""
    options = " or ".join(dict.fromkeys((confirm, CONFIRM_ALL)))
    return f"if that is right, confirm it with {options}; otherwise state what is right"


Encoding = Literal["ros1", "cdr"]
Progress: TypeAlias = Callable[[int, int], None]
"""Called with the amount done and the total."""
ChannelNotes = tuple[tuple[str, str], ...]
"""What a recorder notes of a channel besides its type, by key: quality of service, latching, the publisher's name."""


@dataclass(frozen=True, slots=True)
class Channel:
    """One topic as one file declares it.

    Attributes:
        id: its number in the file.
        topic: its name.
        type: the message type as spelled in the file.
        encoding: serialisation of the messages: "ros1" or "cdr"; others (such as "protobuf") are not supported.
        definition: the embedded definition; empty if the file has none.
        definition_format: "msg", "idl" or "" for none.
    """

    id: int
    topic: str
    type: str
    encoding: str
    definition: str
    definition_format: str


@dataclass(frozen=True, slots=True)
class StoredChannel:
    """One topic of one publisher, in the words of MCAP.

    Attributes:
        topic: its name.
        encoding: serialisation of the messages, such as "ros1" or "cdr".
        schema_name: the message type; "" for messages without a schema.
        schema_encoding: the language of the definition, such as "ros2msg"; "" if there is none.
        schema_data: the definition, byte for byte.
        notes: the recorder's notes.
    """

    topic: str
    encoding: str
    schema_name: str = ""
    schema_encoding: str = ""
    schema_data: bytes = b""
    notes: ChannelNotes = ()


@dataclass(frozen=True, slots=True, eq=False)
class MessageIndex:
    """The locations of one channel's messages, in order of receive time.

    Attributes:
        receive_ns: (n,) when the recorder received them.
        chunk: (n,) the chunk (in a database, the row) that contains them.
        offset: (n,) their offsets in the uncompressed chunk; 0 in a database.
    """

    receive_ns: TimesNs
    chunk: Indices
    offset: Indices

    def __len__(self) -> int:
        return len(self.receive_ns)

    @classmethod
    def sorted_from(cls, receive_ns: TimesNs, chunk: Indices, offset: Indices) -> "MessageIndex":
        """Sort by receive time; messages with equal times keep the order of the file."""
        order = np.lexsort((offset, chunk, receive_ns))
        return cls(receive_ns[order], chunk[order], offset[order])

    def followed_by(self, later: "MessageIndex") -> "MessageIndex":
        """Add messages from later in the file, which usually, but not always, were received later."""
        columns = (
            np.concatenate([getattr(self, name), getattr(later, name)]) for name in ("receive_ns", "chunk", "offset")
        )
        if len(self) and len(later) and later.receive_ns[0] < self.receive_ns[-1]:
            return MessageIndex.sorted_from(*columns)
        return MessageIndex(*columns)

    def take(self, rows: np.ndarray) -> "MessageIndex":
        """Keep the given rows, in the given order."""
        return MessageIndex(self.receive_ns[rows], self.chunk[rows], self.offset[rows])


@dataclass(frozen=True, slots=True, eq=False)
class Heads:
    """The first bytes of many messages.

    Attributes:
        rows: (n, size) uint8; bytes past a message's end are undefined.
        lengths: (n,) length of each message; -1 for an unreadable one.
        fault: why the first of those cannot be read; "" if there are none.
    """

    rows: np.ndarray
    lengths: Indices
    fault: str = ""


class Source(Protocol):
    """One file of a recording."""

    @property
    def path(self) -> Path:
        """The path of the file."""

    @property
    def size_bytes(self) -> int:
        """The size of the file."""

    @property
    def container(self) -> str:
        """The format and its compression, such as "ROS 1 bag, lz4"."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The topics it declares."""

    @property
    def counts(self) -> Mapping[int, int]:
        """Number of messages of each channel, as far as the file states it."""

    @property
    def warnings(self) -> tuple[DataWarning, ...]:
        """Warnings found on opening the file."""

    @property
    def later_warnings(self) -> tuple[DataWarning, ...]:
        """Warnings found since, while reading it."""

    @property
    def assumptions(self) -> tuple[Assumption, ...]:
        """What the file does not state and reading it takes for granted."""

    def index(self, channel_id: int) -> MessageIndex:
        """Return the locations of a channel's messages."""

    def read(self, chunk: int, offset: int) -> bytes:
        """Read one whole message."""

    def heads(self, index: MessageIndex, size: int, *, keep: bool = False) -> Heads:
        """Read the first bytes of many messages, in the order of the index, reading as little as the format allows.

        Args:
            index: the messages.
            size: number of bytes of each message.
            keep: store them in the user's cache, because the next opening will need the same ones.
        """

    def close(self) -> None:
        """Close the file."""


class GrowingSource(Source, Protocol):
    """A file that is still being written."""

    @property
    def is_complete(self) -> bool:
        """Whether the writer has closed the file."""

    def grow(self) -> int:
        """Index the messages that have been written completely since; return how many there are.

        Raises:
            RecordingError: what had been read has changed, or what follows cannot be read.
        """

    def renamed(self, path: Path) -> None:
        """Take note that the writer has renamed the file."""
