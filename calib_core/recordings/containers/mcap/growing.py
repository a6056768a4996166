"""Read MCAP files that are still being written, record by record."""

from pathlib import Path

from calib_core.recordings.containers.appending import AppendedFile, damaged_chunks, with_messages
from calib_core.recordings.containers.chunks import Chunk
from calib_core.recordings.containers.kept_heads import KeptHeads
from calib_core.recordings.containers.mcap.reader import McapSource
from calib_core.recordings.containers.mcap.records import MAGIC, Declarations
from calib_core.recordings.containers.mcap.recovery import FoundInMcap, scan_further
from calib_core.recordings.containers.sources import Heads, MessageIndex
from calib_core.results import DataWarning


class GrowingMcap(McapSource):
    """An MCAP file that is still being written: its complete records are indexed as they come."""

    def _open(self) -> None:
        self._kept = None
        self.recovered = True
        self._heads = KeptHeads()
        self._scanned = FoundInMcap(Declarations(), [Chunk(0, self.size_bytes, self.size_bytes, "")])
        self.chunks = self._scanned.chunks
        self._read = AppendedFile(self.file, len(MAGIC))

    def restore(self) -> bool:
        """Return False: the index of a growing file is not cached."""
        return False

    @property
    def is_complete(self) -> bool:
        """Whether the data section has ended and the file ends as a closed one does."""
        end = self.file.size_bytes - len(MAGIC)
        return self._scanned.ended and end > self._read.place and self.file.up_to(end, len(MAGIC)) == MAGIC

    @property
    def later_warnings(self) -> tuple[DataWarning, ...]:
        """Chunks that could not be decompressed, or have the wrong checksum."""
        return damaged_chunks(self.path, self._scanned.damaged_chunks, self._scanned.fault)

    def grow(self) -> int:
        """Index the messages that have been written completely since; return how many there are."""
        if not self._read.look_again() or self._scanned.ended:
            return 0
        place = scan_further(self.file, self._read.place, self._scanned)
        self._read.move_to(place)
        found, self._scanned.messages = self._scanned.messages, {}
        for channel, entries in found.items():
            self.indexes[channel] = with_messages(self.index(channel), entries)
        self.channels = self._scanned.declarations.channels
        return sum(map(len, found.values()))

    def heads(self, index: MessageIndex, size: int, *, keep: bool = False) -> Heads:
        """Read the first bytes of messages; those to be kept are read once while the file grows."""
        return self._heads.read(index, size, super().heads) if keep else super().heads(index, size)

    def renamed(self, path: Path) -> None:
        """Take note that the writer has renamed the file."""
        self.file.path = path
