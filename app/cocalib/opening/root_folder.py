"""The folder that a page may look into to choose a recording: nothing outside it is ever named, listed or opened."""

import os
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path

from calib_core.errors import InputError
from calib_core.input_files import name_text, special_kind
from cocalib.web.messages.opening_messages import FolderEntry, FolderListing

_MOST_ENTRIES = 2000
_MOST_INSIDE = 500
_BAG_SUFFIXES = (".bag", ".mcap", ".db3")
_SUFFIXES = (
    *(*_BAG_SUFFIXES, ".active", ".zst", ".zstd", ".gz", ".bz2", ".lz4"),
    *(".csv", ".tsv", ".jsonl", ".ndjson"),
    *(".mp4", ".avi", ".mkv", ".mov", ".webm"),
)
"""Files that may be recordings, or parts of one."""


class RootFolder:
    """A folder given with --root. Links are resolved before anything is compared with it."""

    def __init__(self, path: Path) -> None:
        """Take the folder.

        Raises:
            InputError: it is no folder, or cannot be reached.
        """
        try:
            self.path = path.resolve(strict=True)
        except (OSError, RuntimeError) as error:
            raise InputError(f"--root {path}: no such folder; check the path") from error
        if not self.path.is_dir():
            raise InputError(f"--root {path}: is not a folder; give the folder that contains your recordings")

    def resolve(self, inside: str) -> Path:
        """Return the real path of something below the root.

        Args:
            inside: its path from the root, with forward slashes.

        Raises:
            InputError: it leads outside, is absolute, does not exist or cannot be reached.
        """
        parts = inside.split("/") if inside else []
        if inside.startswith(("/", "~")) or "\\" in inside or "\0" in inside or ".." in parts:
            raise InputError(
                f"{_entry_name(inside)}: only folders below {self.path} can be opened in the page; choose one from its list"
            )
        try:
            path = self.path.joinpath(*parts).resolve(strict=True)
        except (OSError, RuntimeError) as error:
            raise InputError(f"{_entry_name(inside)}: {_why(error)}; choose another one, or reload the list") from error
        self.require_inside(path, inside)
        return path

    def require_inside(self, path: Path, inside: str) -> None:
        """Refuse a real path that is not below the root.

        Raises:
            InputError: a link leads outside.
        """
        if path != self.path and self.path not in path.parents:
            raise InputError(
                f"{_entry_name(inside)}: is a link that leads out of {self.path}; start cocalib open with its own path instead"
            )

    def recordings(self, inside: Sequence[str]) -> tuple[Path, ...]:
        """Return the real paths of the files and folders of a recording.

        Raises:
            InputError: one of them cannot be used.
        """
        paths = tuple(self.resolve(path) for path in inside)
        for path, given in zip(paths, inside, strict=True):
            if (kind := special_kind(path)) is not None:
                raise InputError(f"{_entry_name(given)}: is {kind}, not a recording; choose a file or a folder")
        return paths

    def listing(self, inside: str) -> FolderListing:
        """List the folders and recordings in a folder.

        Raises:
            InputError: it is not below the root, is no folder, or cannot be read.
        """
        folder = self.resolve(inside)
        here = "" if folder == self.path else folder.relative_to(self.path).as_posix()
        try:
            with os.scandir(folder) as entries:
                inside_it = list(islice(entries, _MOST_ENTRIES + 1))
        except NotADirectoryError:
            raise InputError(f"{_entry_name(inside)}: is not a folder; choose it as a recording instead") from None
        except OSError as error:
            raise InputError(f"{_entry_name(inside) or self.path}: {_why(error)}; choose another folder") from error
        visible = [entry for entry in inside_it[:_MOST_ENTRIES] if not entry.name.startswith(".")]
        reachable = [entry for entry in visible if self._leads_inside(entry)]
        found = [listed for entry in reachable if (listed := self._entry(entry, here)) is not None]
        notes = []
        if len(inside_it) > _MOST_ENTRIES:
            notes.append(f"Only the first {_MOST_ENTRIES} entries are listed.")
        if len(visible) > len(reachable):
            notes.append(f"{len(visible) - len(reachable)} links lead elsewhere or nowhere and are not listed.")
        if not found:
            notes.append("No recording and no folder here.")
        found.sort(key=lambda entry: (entry.kind == "recording", entry.name.lower()))
        parent = None if not here else here.rpartition("/")[0]
        return FolderListing(name_text(here), parent, tuple(found), " ".join(notes))

    def _leads_inside(self, entry: "os.DirEntry[str]") -> bool:
        if not entry.is_symlink():
            return True
        try:
            path = Path(entry.path).resolve(strict=True)
        except (OSError, RuntimeError):
            return False
        return path == self.path or self.path in path.parents

    def _entry(self, entry: "os.DirEntry[str]", here: str) -> FolderEntry | None:
        """Describe an entry; None if it is neither a folder nor a file that may be a recording."""
        path = f"{here}/{entry.name}" if here else entry.name
        try:
            path.encode()
        except UnicodeEncodeError:  # a name that a page cannot send back
            return None
        try:
            if entry.is_dir():
                if entry.name.endswith(".cocalib-session"):
                    return None
                sizes = list(_recording_sizes(Path(entry.path)))
                return FolderEntry(entry.name, path, "recording folder" if sizes else "folder", sum(sizes))
            if not entry.is_file() or Path(entry.name).suffix.lower() not in _SUFFIXES:
                return None
            return FolderEntry(entry.name, path, "recording", entry.stat().st_size)
        except OSError:  # it has vanished, or may not be examined
            return None


def _recording_sizes(folder: Path) -> Iterator[int]:
    """Return the sizes of the bags directly in a folder, which is then a recording itself."""
    try:
        with os.scandir(folder) as entries:
            for entry in islice(entries, _MOST_INSIDE):
                if entry.name.endswith(_BAG_SUFFIXES) and entry.is_file():
                    yield entry.stat().st_size
    except OSError:  # looking into it says why
        return


def _why(error: OSError | RuntimeError) -> str:
    if isinstance(error, FileNotFoundError):
        return "is not there any more"
    if isinstance(error, PermissionError):
        return "you may not look into it (permission denied)"
    return error.strerror or str(error) if isinstance(error, OSError) else "its links lead in a circle"


def _entry_name(inside: str) -> str:
    return inside[:200]
