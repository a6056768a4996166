"""Follow the files of a recording that is being written: they grow, are renamed when closed, and further ones appear.

Chunked files only grow, and what has been read of them does not change. A database is read without holding the recorder up: with
a write-ahead log readers and the writer never wait for each other. Without one, a reader's lock can make the recorder's next
write fail, so such a file is refused. The database is open only while it is read: the recorder merges its log when it closes
the file, and cannot if somebody else has it open at that moment.
"""

import contextlib
import re
import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from calib_core.errors import RecordingError
from calib_core.measurements import DataWarning
from calib_core.recordings.containers.chunks import ChannelFilter, Chunk, ChunkedSource, Scanned
from calib_core.recordings.containers.compression import packing_of
from calib_core.recordings.containers.mcap.reader import McapSource
from calib_core.recordings.containers.mcap.records import MAGIC
from calib_core.recordings.containers.mcap.recovery import FoundInMcap, scan_mcap_further
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.rosbag1.reader import Rosbag1Source, channels_of
from calib_core.recordings.containers.rosbag1.recovery import FoundInBag, scan_bag_further
from calib_core.recordings.containers.sources import GrowingSource, Heads, MessageIndex, Source
from calib_core.recordings.containers.sqlite import MAGIC as SQLITE_MAGIC
from calib_core.recordings.containers.sqlite import SqliteSource, open_database, rows_after

_SUFFIXES = (".bag", ".mcap", ".db3", ".active")
_METADATA = "metadata.yaml"
_ACTIVE = ".active"
_BEGINNING_BYTES = 1 << 14
"""A longer file that cannot be opened is damaged; a shorter one may only have begun."""
_Identity: TypeAlias = tuple[int, int]
_REMEMBERED_BYTES = 64
_OFFSET_BITS = 40  # a file of a terabyte
_INDEX_POSITION = re.compile(rb"index_pos=([\x00-\xff]{8})")
_HEADER_BYTES = 4096
_LOOKS_AFTER_A_CHANGE = 5
_NOT_SEEN = (-1, -1)
_VERSIONS = slice(18, 20)
_LOGGED = b"\x02\x02"


@dataclass(slots=True)
class _Followed:
    """A file, and the identity by which it is known after it has been renamed."""

    path: Path
    source: GrowingSource


class FollowedFiles:
    """The files of the given paths, opened as they appear. Not thread-safe; reading the sources is.

    Args:
        paths: of files and folders; files need not exist yet.

    Raises:
        RecordingError: one of them is no recording that can be followed.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = tuple(paths)
        self._files: dict[_Identity, _Followed] = {}
        for path in paths:
            if not path.is_dir() and path.suffix not in _SUFFIXES:
                raise RecordingError(
                    f"{path}: cannot be followed; --follow takes .bag, .mcap and .db3 files and folders of them"
                )

    @property
    def sources(self) -> tuple[Source, ...]:
        """The files opened so far, in the order of their appearance."""
        return tuple(followed.source for followed in self._files.values())

    @property
    def is_complete(self) -> bool:
        """Whether all files have been closed by their writer; a folder of ROS 2 then has its metadata."""
        if not self._files or len({self._given_path(value.path) for value in self._files.values()}) < len(self._paths):
            return False
        closed = [followed.source.is_complete or _has_metadata(followed) for followed in self._files.values()]
        return all(closed) and not any(_is_unfinished_folder(path) for path in self._paths)

    def grow(self) -> int:
        """Take in new files and what has been written to the known ones; return the number of new messages.

        Raises:
            RecordingError: a file was replaced, removed, truncated or overwritten, or what follows in it cannot be read.
        """
        there = self._look()
        if not self._files.keys() <= there.keys():  # a file may have been renamed while the folder was being listed
            there = self._look()
        for identity, path in there.items():
            known = self._files.get(identity)
            if known is None:
                self._open(identity, path)
            elif known.path != path:
                known.path = path
                known.source.renamed(path)
        for identity, followed in self._files.items():
            if identity not in there:
                raise RecordingError(_gone(followed.path))
        return sum(followed.source.grow() for followed in self._files.values())

    def close(self) -> None:
        """Close all files."""
        for followed in self._files.values():
            followed.source.close()

    def _look(self) -> Mapping[_Identity, Path]:
        """Return the files that are there now."""
        there = {}
        for path in (path for given in self._paths for path in _present(given)):
            with contextlib.suppress(FileNotFoundError):
                there[_identity(path)] = path
        return there

    def _given_path(self, path: Path) -> Path:
        """Return the path of the user's to which a file belongs."""
        return next(given for given in self._paths if path in _names(given) or given in path.parents)

    def _open(self, identity: _Identity, path: Path) -> None:
        """Open a file; leave one that has only begun for the next time."""
        if any(followed.path == path for followed in self._files.values()):
            raise RecordingError(_gone(path))
        file = FileBytes(path)
        try:
            kind = _kind(file)
            source = None if kind is None else _begun(kind, file)
        except RecordingError:
            file.close()
            raise
        if source is None:
            file.close()
        else:
            self._files[identity] = _Followed(path, source)


def _begun(kind: Callable[[FileBytes], GrowingSource], file: FileBytes) -> GrowingSource | None:
    """Open a file; None if only a part of its beginning is there."""
    try:
        return kind(file)
    except RecordingError:
        if file.size_bytes >= _BEGINNING_BYTES:
            raise
        return None


def _kind(file: FileBytes) -> Callable[[FileBytes], GrowingSource] | None:
    """Tell the kind of a file by its first bytes; None if they have not been written yet.

    Raises:
        RecordingError: it is of another kind.
    """
    head = file.up_to(0, 16)
    if head.startswith(b"#ROSBAG V"):
        return GrowingBag
    if head.startswith(MAGIC):
        return GrowingMcap
    if head == SQLITE_MAGIC:
        return GrowingDatabase
    if len(head) < 16 or not any(head):
        return None
    raise RecordingError(f"{file.path}: cannot be followed: it begins as neither .bag nor .mcap nor .db3 files do")


def _names(given: Path) -> tuple[Path, ...]:
    """Return the names that a file of this name has: a ROS 1 recorder adds .active until the bag is closed."""
    if given.suffix == _ACTIVE:
        return given, given.with_suffix("")
    return given, given.parent / f"{given.name}{_ACTIVE}"


def _present(given: Path) -> Iterator[Path]:
    """Yield the files of a path that are there now."""
    if not given.is_dir():
        found = next((path for path in _names(given) if path.is_file()), None)
        if found is not None:
            yield found
        return
    for path in sorted(given.iterdir()):
        if path.is_file() and path.suffix in _SUFFIXES:
            yield path


def _identity(path: Path) -> _Identity:
    stat = path.stat()
    return stat.st_dev, stat.st_ino


def _has_metadata(followed: _Followed) -> bool:
    """Return whether a database is complete although its log is there, because somebody else had it open at the end."""
    return followed.path.suffix == ".db3" and (followed.path.parent / _METADATA).is_file()


def _is_unfinished_folder(path: Path) -> bool:
    """Return whether a folder of ROS 2 files lacks the metadata that the recorder writes at the end."""
    if not path.is_dir() or (path / _METADATA).is_file():
        return False
    return any(file.suffix in (".mcap", ".db3") for file in path.iterdir())


def _gone(path: Path) -> str:
    there = "was replaced by another file" if path.exists() else "is no longer there"
    return f"{path}: {there} while it was being followed; what had been read is still shown; open the recording again"


class AppendedFile:
    """The part of a file that has been read, up to a position that only moves forward.

    Args:
        file: the file.
        place: the end of what has been read.
    """

    def __init__(self, file: FileBytes, index: int) -> None:
        self._file = file
        self.move_to(index)

    def look_again(self) -> bool:
        """Return whether the file has grown beyond what has been read.

        Raises:
            RecordingError: it has been truncated or overwritten.
        """
        self._file.look_again()
        if self._file.size_bytes < self.place:
            raise RecordingError(
                f"{self._file.path}: was truncated to {self._file.size_bytes} bytes after {self.place} bytes had been read; "
                "open the recording again"
            )
        if self._last_bytes() != self._before:
            raise RecordingError(
                f"{self._file.path}: was overwritten after {self.place} bytes had been read; open the recording again"
            )
        return self._file.size_bytes > self.place

    def move_to(self, index: int) -> None:
        """Move forward to the end of what has been read now."""
        self.place = index
        self._before = self._last_bytes()

    def _last_bytes(self) -> bytes:
        count = min(_REMEMBERED_BYTES, self.place)
        return self._file.up_to(self.place - count, count)


def with_messages(index: MessageIndex, found: Sequence[tuple[int, int, int]]) -> MessageIndex:
    """Return an index with further messages, as (receive time [ns], chunk, offset)."""
    new = np.array(found, dtype=np.int64)
    return index.followed_by(MessageIndex.sorted_from(new[:, 0], new[:, 1], new[:, 2]))


def damaged_chunks(path: Path, count: int, fault: str) -> tuple[DataWarning, ...]:
    """Warn about chunks that could not be read in full; empty if there are none.

    Args:
        path: of the file.
        count: number of these chunks.
        fault: what is wrong with the first of them.
    """
    if not count:
        return ()
    message = f"{path.name}: {count} of the chunks read so far {'are' if count > 1 else 'is'} damaged ({fault})"
    return (
        DataWarning.reported("damaged-file", message, "check the disk of the recorder; what was read of them is used"),
    )


class KeptHeads:
    """Heads by message, for one number of bytes at a time. Not thread-safe.

    Args:
        by_row: messages are told apart by their chunk alone, as the rows of a database are.
    """

    def __init__(self, *, by_row: bool = False) -> None:
        self._shift = 0 if by_row else _OFFSET_BITS
        self._forget(0)

    def _forget(self, size: int) -> None:
        self._size = size
        self._keys = np.zeros(0, dtype=np.int64)
        self._rows = np.zeros((0, size), dtype=np.uint8)
        self._lengths = np.zeros(0, dtype=np.int64)

    def read(self, index: MessageIndex, size: int, read: Callable[[MessageIndex, int], Heads]) -> Heads:
        """Return the heads of messages in the order of the index; read those that are not kept yet.

        Args:
            index: the messages.
            size: number of bytes of each.
            read: reads the heads of messages.
        """
        if size != self._size:
            self._forget(size)
        keys = (index.chunk << self._shift) | index.offset
        new = np.flatnonzero(~self._kept(keys))
        fault = ""
        if len(new):
            heads = read(index.take(new), size)
            fault = heads.fault
            self._keep(keys[new], heads)
        places = np.searchsorted(self._keys, keys)
        return Heads(self._rows[places], self._lengths[places], fault)

    def _kept(self, keys: np.ndarray) -> np.ndarray:
        if not len(self._keys):
            return np.zeros(len(keys), dtype=bool)
        places = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        return np.asarray(self._keys[places] == keys)

    def _keep(self, keys: np.ndarray, heads: Heads) -> None:
        all_keys = np.concatenate([self._keys, keys])
        order = np.argsort(all_keys, kind="stable")
        self._keys = all_keys[order]
        self._rows = np.concatenate([self._rows, heads.rows])[order]
        self._lengths = np.concatenate([self._lengths, heads.lengths])[order]


class _Growing(ChunkedSource):
    """A file of chunks that is still being written: its complete records are indexed as they come."""

    def _begin(self, scanned: Scanned, start: int) -> None:
        self._kept = None
        self.recovered = True
        self._heads = KeptHeads()
        self._so_far = scanned
        self.chunks = scanned.chunks
        self._read = AppendedFile(self.file, start)

    @property
    def later_warnings(self) -> tuple[DataWarning, ...]:
        """Chunks that could not be decompressed, or have the wrong checksum."""
        return damaged_chunks(self.path, self._so_far.damaged_chunks, self._so_far.fault)

    def _indexed(self, index: int) -> int:
        """Index the messages that were found up to a place; return how many there are."""
        self._read.move_to(index)
        found, self._so_far.messages = self._so_far.messages, {}
        for channel, entries in found.items():
            self.indexes[channel] = with_messages(self.index(channel), entries)
        return sum(map(len, found.values()))

    def heads(self, index: MessageIndex, size: int, *, keep: bool = False) -> Heads:
        """Read the first bytes of messages; those to be kept are read once while the file grows."""
        return self._heads.read(index, size, super().heads) if keep else super().heads(index, size)

    def renamed(self, path: Path) -> None:
        """Take note that the writer has renamed the file, as a bag's recorder does when it closes it."""
        self.file.path = path


class GrowingMcap(_Growing, McapSource):
    """An MCAP file that is still being written: its complete records are indexed as they come."""

    def _open(self) -> None:
        self._scanned = FoundInMcap([Chunk(0, self.size_bytes, self.size_bytes, "")])
        self._begin(self._scanned, len(MAGIC))

    def restore(self) -> bool:
        """Return False: the index of a growing file is not cached."""
        return False

    @property
    def is_complete(self) -> bool:
        """Whether the data section has ended and the file ends as a closed one does."""
        end = self.file.size_bytes - len(MAGIC)
        return self._scanned.ended and end > self._read.place and self.file.up_to(end, len(MAGIC)) == MAGIC

    def grow(self) -> int:
        """Index the messages that have been written completely since; return how many there are."""
        if not self._read.look_again() or self._scanned.ended:
            return 0
        count = self._indexed(scan_mcap_further(self.file, self._read.place, self._scanned))
        self.channels = self._scanned.declarations.channels
        return count


class GrowingBag(_Growing, Rosbag1Source):
    """A bag that is still being written: its complete records are indexed as they come."""

    def _open(self, header: Mapping[str, bytes], start: int, first_of: ChannelFilter | None) -> None:
        self.file.at(0, start)  # the whole header
        self._scanned = FoundInBag([Chunk(0, self.size_bytes, self.size_bytes, "none")])
        self._begin(self._scanned, start)

    @property
    def is_complete(self) -> bool:
        """Whether the recorder has written the position of the index into the header, which it does last."""
        found = _INDEX_POSITION.search(self.file.up_to(0, _HEADER_BYTES))
        position = int.from_bytes(found[1], "little") if found else 0
        return 0 < position <= self._read.place

    def grow(self) -> int:
        """Index the messages that have been written completely since; return how many there are."""
        if not self._read.look_again():
            return 0
        count = self._indexed(scan_bag_further(self.file, self._read.place, self._scanned))
        self.channels = tuple(channels_of(self._scanned).values())
        return count


class GrowingDatabase(SqliteSource):
    """A .db3 file that is still being written: the rows of finished transactions are indexed as they come."""

    def _connect(self) -> None:
        if self._file.up_to(0, 20)[_VERSIONS] != _LOGGED:
            raise RecordingError(
                f"{self.path}: is written without a write-ahead log, so reading it now could make the recorder lose messages; "
                "open it without --follow once it is complete, or record with the storage preset resilient, or as MCAP"
            )
        self._kept = None
        self._indexes = {}
        self._heads = KeptHeads(by_row=True)
        self._last_row, self._strange = 0, 0
        self._seen, self._looks = (_NOT_SEEN, _NOT_SEEN), _LOOKS_AFTER_A_CHANGE

    @contextmanager
    def _database(self) -> Iterator[sqlite3.Connection]:
        """Open the database, for one thread at a time, until it has been read; a file without a log does not change."""
        with self._lock:
            mode = "mode=ro" if self._log.exists() else "mode=ro&immutable=1"
            connection = open_database(self.path, self._file.stored, mode)
            try:
                yield connection
            finally:
                connection.close()

    @property
    def _log(self) -> Path:
        return Path(f"{self._file.stored}-wal")

    @property
    def is_complete(self) -> bool:
        """Whether the recorder has closed the database: it then removes the log."""
        return not self._log.exists()

    @property
    def later_warnings(self) -> tuple[DataWarning, ...]:
        """Rows that are not messages."""
        if not self._strange:
            return ()
        message = f"{self.path.name}: {self._strange} rows without a time or a topic are skipped"
        return (DataWarning.reported("damaged-file", message, "check the disk of the recorder"),)

    def grow(self) -> int:
        """Index the messages that have been committed since; return how many there are."""
        self._file.look_again()
        self.size_bytes = self._file.size_bytes
        seen = (_state(self._file.stored), _state(self._log))
        self._looks = _LOOKS_AFTER_A_CHANGE if seen != self._seen else self._looks - 1
        self._seen = seen
        if self._looks < 0:
            return 0
        try:
            with self._database() as database:
                rows = rows_after(database, self._last_row)
                last = database.execute("SELECT max(id) FROM messages").fetchone()[0] or 0
        except sqlite3.Error as error:
            raise self._damaged(error) from error
        if last < self._last_row:
            raise RecordingError(f"{self.path}: rows that had been read are gone; open the recording again")
        if not len(rows.columns):
            return 0
        self._strange += rows.strange
        self._add(rows.columns)
        return len(rows.columns)

    def _add(self, columns: np.ndarray) -> None:
        if not self._last_row:
            self._packed = self._packed or packing_of(self._first_message(int(columns[0, 2]))) is not None
        if not {channel.id for channel in self.channels} >= set(np.unique(columns[:, 0]).tolist()):
            self.channels = self._read_channels()
        assert self._indexes is not None
        for number, new in self._sorted(columns).items():
            self._indexes[number] = self.index(number).followed_by(new)
        self._last_row = int(columns[-1, 2])

    def _first_message(self, row: int) -> bytes:
        rows = self._rows("SELECT data FROM messages WHERE id = ?", row)
        return rows[0][0] if rows and isinstance(rows[0][0], bytes) else b""

    def heads(self, index: MessageIndex, size: int, *, keep: bool = False) -> Heads:
        """Read the first bytes of messages; those to be kept are read once while the file grows."""
        return self._heads.read(index, size, super().heads) if keep else super().heads(index, size)

    def renamed(self, path: Path) -> None:
        """Take note that the recorder has renamed the file."""
        self.path = self._file.path = self._file.stored = path


def _state(path: Path) -> tuple[int, int]:
    """Return size and modification time of a file; zeros if there is none."""
    try:
        stat = path.stat()
    except OSError:
        return 0, 0
    return stat.st_size, stat.st_mtime_ns
