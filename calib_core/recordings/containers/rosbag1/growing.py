"""Read ROS 1 bags that are still being written, record by record."""

import re
from collections.abc import Mapping
from pathlib import Path

from calib_core.recordings.containers.appending import AppendedFile, damaged_chunks, with_messages
from calib_core.recordings.containers.chunks import ChannelFilter, Chunk
from calib_core.recordings.containers.kept_heads import KeptHeads
from calib_core.recordings.containers.rosbag1.reader import Rosbag1Source, channels_of
from calib_core.recordings.containers.rosbag1.recovery import FoundInBag, scan_further
from calib_core.recordings.containers.sources import Heads, MessageIndex
from calib_core.results import DataWarning

_INDEX_POSITION = re.compile(rb"index_pos=([\x00-\xff]{8})")
_HEADER_BYTES = 4096


class GrowingBag(Rosbag1Source):
    """A bag that is still being written: its complete records are indexed as they come."""

    def _open(self, header: Mapping[str, bytes], start: int, first_of: ChannelFilter | None) -> None:
        self.file.at(0, start)  # the whole header
        self._kept = None
        self.recovered = True
        self._heads = KeptHeads()
        self._scanned = FoundInBag([Chunk(0, self.size_bytes, self.size_bytes, "none")])
        self.chunks = self._scanned.chunks
        self._read = AppendedFile(self.file, start)

    @property
    def is_complete(self) -> bool:
        """Whether the recorder has written the position of the index into the header, which it does last."""
        found = _INDEX_POSITION.search(self.file.up_to(0, _HEADER_BYTES))
        position = int.from_bytes(found[1], "little") if found else 0
        return 0 < position <= self._read.place

    @property
    def later_warnings(self) -> tuple[DataWarning, ...]:
        """Chunks that could not be decompressed."""
        return damaged_chunks(self.path, self._scanned.damaged_chunks, self._scanned.fault)

    def grow(self) -> int:
        """Index the messages that have been written completely since; return how many there are."""
        if not self._read.look_again():
            return 0
        place = scan_further(self.file, self._read.place, self._scanned)
        self._read.move_to(place)
        found, self._scanned.messages = self._scanned.messages, {}
        for connection, entries in found.items():
            self.indexes[connection] = with_messages(self.index(connection), entries)
        self.channels = tuple(channels_of(self._scanned).values())
        return sum(map(len, found.values()))

    def heads(self, index: MessageIndex, size: int, *, keep: bool = False) -> Heads:
        """Read the first bytes of messages; those to be kept are read once while the file grows."""
        return self._heads.read(index, size, super().heads) if keep else super().heads(index, size)

    def renamed(self, path: Path) -> None:
        """Take note that the recorder has renamed the file, as it does when it closes a bag."""
        self.file.path = path
