"""What every container offers: channels, an index of messages, and their bytes."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from calib_core.arrays import Indices, TimesNs
from calib_core.results import DataWarning

__all__ = ["Channel", "Encoding", "Heads", "MessageIndex", "Source"]

Encoding = Literal["ros1", "cdr"]


@dataclass(frozen=True, slots=True)
class Channel:
    """One topic as one file declares it.

    Attributes:
        id: the file's own number for it.
        topic: its name.
        type: the message type as the file spells it.
        encoding: how messages are laid out: "ros1" or "cdr"; another word (such as "protobuf") cannot be read.
        definition: the embedded definition; empty where the file has none.
        definition_format: "msg", "idl" or "" for none.
    """

    id: int
    topic: str
    type: str
    encoding: str
    definition: str
    definition_format: str


@dataclass(frozen=True, slots=True, eq=False)
class MessageIndex:
    """Where the messages of one channel lie, in order of receive time.

    Attributes:
        receive_ns: (n,) when the recorder got them.
        chunk: (n,) which chunk (or, in a database, row) holds them.
        offset: (n,) where they begin in the unpacked chunk; 0 in a database.
    """

    receive_ns: TimesNs
    chunk: Indices
    offset: Indices

    def __len__(self) -> int:
        return len(self.receive_ns)

    @classmethod
    def sorted_from(cls, receive_ns: TimesNs, chunk: Indices, offset: Indices) -> "MessageIndex":
        """Sort by receive time; messages of one instant keep the order of the file."""
        order = np.lexsort((offset, chunk, receive_ns))
        return cls(receive_ns[order], chunk[order], offset[order])

    def take(self, rows: np.ndarray) -> "MessageIndex":
        """Keep the given rows, in the given order."""
        return MessageIndex(self.receive_ns[rows], self.chunk[rows], self.offset[rows])


@dataclass(frozen=True, slots=True, eq=False)
class Heads:
    """The first bytes of many messages.

    Attributes:
        rows: (n, size) uint8; bytes past a message's end mean nothing.
        lengths: (n,) how long each message is; -1 for one that cannot be read.
        fault: why the first of those cannot be read; "" without any.
    """

    rows: np.ndarray
    lengths: Indices
    fault: str = ""


class Source(Protocol):
    """One file of a recording."""

    @property
    def path(self) -> Path:
        """Where it lies."""
        ...

    @property
    def size_bytes(self) -> int:
        """How large it is."""
        ...

    @property
    def container(self) -> str:
        """Name the format for people, with its compression, such as "ROS 1 bag, lz4"."""
        ...

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The topics it declares."""
        ...

    @property
    def counts(self) -> Mapping[int, int]:
        """How many messages each channel has, as far as the file says so by itself."""
        ...

    @property
    def warnings(self) -> tuple[DataWarning, ...]:
        """What opening it brought to light."""
        ...

    @property
    def later_warnings(self) -> tuple[DataWarning, ...]:
        """What reading it has brought to light since."""
        ...

    def index(self, channel_id: int) -> MessageIndex:
        """Tell where the messages of a channel lie."""
        ...

    def read(self, chunk: int, offset: int) -> bytes:
        """Read one message whole."""
        ...

    def heads(self, index: MessageIndex, size: int, *, keep: bool = False) -> Heads:
        """Read the first bytes of many messages, in the order of the index, reading as little as the format allows.

        Args:
            index: the messages.
            size: how many bytes of each.
            keep: opening the file again will ask for the same; keep them in the user's cache.
        """
        ...

    def close(self) -> None:
        """Close the file."""
        ...
