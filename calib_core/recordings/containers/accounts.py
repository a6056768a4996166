"""What every byte of a file belongs to, and which of its messages the index misses or damage has hit."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from calib_core.recordings.containers.positioned_reads import Stretch

ByteKind: TypeAlias = Literal["messages", "records", "index", "padding", "damaged", "unknown"]
"""Messages and the chunks that hold them; other records, such as definitions; the index; empty space; bytes that do not parse
or fail their checksum; bytes that no record of the format claims."""

Progress: TypeAlias = Callable[[int, int], None]
"""Called with the number of bytes done and their total."""

_PIECE_BYTES = 1 << 16
_MAX_FAULTS = 5


@dataclass(frozen=True, slots=True)
class FileAccount:
    """The account of one file.

    Attributes:
        bytes_by: number of bytes of each kind; their sum is the file's size.
        unindexed: number of messages by channel that the file contains but its index does not name.
        damaged: number of messages by channel whose bytes are damaged or fail their checksum.
        faults: the first faults found, each with its position.
        skipped: number of messages by channel that are damaged and were skipped on opening, so that no index names them.
    """

    bytes_by: Mapping[ByteKind, int]
    unindexed: Mapping[int, int] = field(default_factory=dict[int, int])
    damaged: Mapping[int, int] = field(default_factory=dict[int, int])
    faults: tuple[str, ...] = ()
    skipped: Mapping[int, int] = field(default_factory=dict[int, int])


class AccountBuilder:
    """Build the account of a file from front to back; every byte is claimed once.

    Args:
        stretch: the whole file.
        progress: told how far the account is.
    """

    def __init__(self, stretch: Stretch, progress: Progress | None = None) -> None:
        self._stretch = stretch
        self._progress = progress
        self._bytes: dict[ByteKind, int] = {}
        self.place = 0
        self.unindexed: dict[int, int] = {}
        self.damaged: dict[int, int] = {}
        self._faults: list[str] = []

    def claim(self, end: int, kind: ByteKind) -> None:
        """Claim the bytes up to a position."""
        if end > self.place:
            self._bytes[kind] = self._bytes.get(kind, 0) + end - self.place
            self.place = end
            if self._progress is not None:
                self._progress(end, self._stretch.size)

    def skip(self, end: int, kind: ByteKind = "damaged") -> None:
        """Claim bytes that no record claims: padding if all of them are zero."""
        begin = self.place
        empty = all(
            not any(self._stretch.up_to(place, min(_PIECE_BYTES, end - place)))
            for place in range(begin, end, _PIECE_BYTES)
        )
        if not empty and end > begin:
            self.fault(f"{end - begin} bytes from byte {begin} on cannot be parsed")
        self.claim(end, "padding" if empty else kind)

    def fault(self, text: str) -> None:
        """Note a fault."""
        if len(self._faults) < _MAX_FAULTS:
            self._faults.append(text)

    def done(self) -> FileAccount:
        """Return the account, after claiming what remains."""
        self.skip(self._stretch.size)
        return FileAccount(dict(self._bytes), self.unindexed, self.damaged, tuple(self._faults))
