"""The recordings that were opened last: a small private file in the user's state folder."""

import hashlib
import logging
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.parsing import json_form
from cocalib.platform.files import replace_file
from cocalib.platform.resources import state_folder
from cocalib.web.messages.opening_messages import RecentRecording

_MOST = 20
_MOST_BYTES = 1 << 20
_log = logging.getLogger(__name__)


class _Entry(msgspec.Struct, frozen=True):
    paths: Annotated[tuple[str, ...], Meta(min_length=1)]
    name: str
    opened_s: int
    clicks: int = 0

    @property
    def id(self) -> str:
        """Identifies the entry by its paths."""
        return hashlib.sha256("\0".join(self.paths).encode("utf-8", "surrogateescape")).hexdigest()[:16]

    @property
    def found(self) -> tuple[Path, ...]:
        """The files, if all of them still exist and can be reached."""
        paths = tuple(Path(os.fsdecode(path)) for path in self.paths)
        return paths if all(map(_exists, paths)) else ()


class RecentRecordings:
    """The list on disk. Two programs that write at the same time may lose an entry, nothing else.

    A file that cannot be read counts as empty: it is a convenience and is written anew.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._path = (folder or state_folder()) / "recent.json"

    def rows(self) -> tuple[RecentRecording, ...]:
        """Return the recordings that still exist, the newest first."""
        return tuple(
            RecentRecording(
                entry.id, name_text(entry.name), name_text(entry.found[0].parent), entry.opened_s, entry.clicks
            )
            for entry in self._entries()
            if entry.found
        )

    def paths_of(self, entry_id: str) -> tuple[Path, ...]:
        """Return the files of a recording in the list; none if it is not there any more."""
        return next((entry.found for entry in self._entries() if entry.id == entry_id), ())

    def add(self, paths: Sequence[Path], name: str, clicks: int) -> None:
        """Put a recording first. That the list cannot be written is logged, since nothing else depends on it."""
        new = _Entry(tuple(str(path.absolute()) for path in paths), name, int(time.time()), clicks)
        self._write([new, *(entry for entry in self._entries() if entry.id != new.id)][:_MOST])

    def forget(self) -> None:
        """Empty the list.

        Raises:
            OSError: the file cannot be removed.
        """
        self._path.unlink(missing_ok=True)

    def _entries(self) -> list[_Entry]:
        try:
            with self._path.open("rb") as file:
                return json_form(file.read(_MOST_BYTES), list[_Entry])[:_MOST]
        except FileNotFoundError:
            return []
        except (OSError, InputError) as error:
            _log.warning("%s: the list of recent recordings cannot be read: %s", self._path, error)
            return []

    def _write(self, entries: list[_Entry]) -> None:
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            replace_file(self._path, msgspec.json.encode(entries))
            self._path.chmod(0o600)
        except (OSError, UnicodeEncodeError) as error:
            _log.warning("%s: the list of recent recordings cannot be written: %s", self._path, error)


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # such as a folder that may not be looked into
        return False
