"""The files of a recording that is still being written: they grow, are renamed when they are closed, and further ones appear."""

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

from calib_core.errors import RecordingError
from calib_core.recordings.containers.mcap import records as mcap_records
from calib_core.recordings.containers.mcap.growing import GrowingMcap
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.rosbag1.growing import GrowingBag
from calib_core.recordings.containers.sources import GrowingSource, Source
from calib_core.recordings.containers.sqlite import reader as sqlite_bag
from calib_core.recordings.containers.sqlite.growing import GrowingDatabase

_SUFFIXES = (".bag", ".mcap", ".db3", ".active")
_METADATA = "metadata.yaml"
_ACTIVE = ".active"
_BEGINNING_BYTES = 1 << 14
"""A longer file that cannot be opened is damaged; a shorter one may only have begun."""

_Identity: TypeAlias = tuple[int, int]


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
        if not self._files or len({self._given(one.path) for one in self._files.values()}) < len(self._paths):
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

    def _given(self, path: Path) -> Path:
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
    if head.startswith(mcap_records.MAGIC):
        return GrowingMcap
    if head == sqlite_bag.MAGIC:
        return GrowingDatabase
    if len(head) < 16 or not any(head):
        return None
    raise RecordingError(f"{file.path}: cannot be followed: it begins as neither .bag nor .mcap nor .db3 files do")


def _names(given: Path) -> tuple[Path, ...]:
    """Return the names that a file of this name has: a ROS 1 recorder adds .active until the bag is closed."""
    if given.suffix == _ACTIVE:
        return given, given.with_suffix("")
    return given, given.with_name(given.name + _ACTIVE)


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
