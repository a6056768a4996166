"""What opening a large file found out, kept in the user's cache folder, so that opening it again is fast.

An entry belongs to one file as it was: its path, size, time of change, and a hash of its beginning and end. An entry
that does not fit, or is damaged, is passed over; a cache that cannot be written is no error. COCALIB_CACHE=off
switches it off, COCALIB_CACHE=FOLDER puts it elsewhere.
"""

import hashlib
import os
import sys
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import IO

import numpy as np

from calib_core.recordings.containers.positioned_reads import FileBytes

__all__ = ["SMALLEST_FILE_BYTES", "FileCache", "cache_folder", "cache_of"]

_VERSION = "1"
_ENDS_BYTES = 1 << 16
_MAX_ENTRY_BYTES = 128_000_000
_MAX_TOTAL_BYTES = 512_000_000
_SUFFIX = ".index.npz"

_DAMAGED = (
    *(OSError, ValueError, KeyError, EOFError, AttributeError, TypeError, zipfile.BadZipFile, zlib.error),
    *(SyntaxError, tokenize.TokenError),  # some versions of NumPy let these pass from a damaged header
)

SMALLEST_FILE_BYTES = 16_000_000
"""Smaller files open fast anyway."""


def cache_folder() -> Path | None:
    """Return the folder of the cache; None where it is switched off."""
    wish = os.environ.get("COCALIB_CACHE", "")
    if wish.lower() in ("off", "0", "no"):
        return None
    if wish:
        return Path(wish)
    if sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    elif sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "cocalib" / "indexes"


def cache_of(file: FileBytes) -> "FileCache | None":
    """Return the cache's part for a file; None for files that open fast anyway, and where the cache is off.

    Args:
        file: an open file; a copy that was unpacked for this opening has none.
    """
    folder = cache_folder()
    if folder is None or file.size_bytes < SMALLEST_FILE_BYTES or file.stored != file.path:
        return None
    try:
        changed_ns = file.path.stat().st_mtime_ns
    except OSError:
        return None
    digest = hashlib.sha256()
    digest.update(f"{_VERSION} {file.path.resolve()} {file.size_bytes} {changed_ns} ".encode())
    digest.update(file.up_to(0, _ENDS_BYTES))
    digest.update(file.up_to(max(0, file.size_bytes - _ENDS_BYTES), _ENDS_BYTES))
    return FileCache(folder, digest.hexdigest()[:40])


@dataclass(frozen=True, slots=True)
class FileCache:
    """The entries of one file.

    Attributes:
        folder: where all entries are.
        key: of this file.
    """

    folder: Path
    key: str

    def get(self, name: str) -> Mapping[str, np.ndarray] | None:
        """Return the arrays kept under a name; None where there are none that can be used."""
        path = self._path(name)
        try:
            if path.stat().st_size > _MAX_ENTRY_BYTES:
                return None
            with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
                arrays = {key: kept[key] for key in kept.files}
            os.utime(path)
        except _DAMAGED:
            return None
        return arrays

    def put(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Keep arrays under a name, and make room for them; nothing happens where the folder cannot be written."""
        if sum(array.nbytes for array in arrays.values()) > _MAX_ENTRY_BYTES - 10_000:
            return
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with NamedTemporaryFile(dir=self.folder, suffix=".part", delete=False) as file:
                _write_arrays(file, arrays)
            Path(file.name).replace(self._path(name))
            self._make_room()
        except OSError:
            return

    def _path(self, name: str) -> Path:
        return self.folder / f"{self.key}-{name}{_SUFFIX}"

    def _make_room(self) -> None:
        """Remove what was not used for longest until the rest is small enough."""
        entries = [(path.stat().st_mtime_ns, path.stat().st_size, path) for path in self.folder.glob(f"*{_SUFFIX}")]
        total = sum(size for _, size, _ in entries)
        for _, size, path in sorted(entries):
            if total <= _MAX_TOTAL_BYTES:
                return
            path.unlink(missing_ok=True)
            total -= size


def _write_arrays(file: IO[bytes], arrays: Mapping[str, np.ndarray]) -> None:
    """Write what np.savez writes, and never an object: NumPy before 2.1 cannot be asked for that."""
    with zipfile.ZipFile(file, "w") as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, array, allow_pickle=False)
