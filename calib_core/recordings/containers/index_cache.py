"""Cache the indexes of large files in the user's cache folder, so that opening them again is fast.

An entry is valid for one state of one file: its path, size, modification time, and a hash of its beginning and end. An
entry that does not match or is damaged is ignored, and a cache that cannot be written is not an error. COCALIB_CACHE=off
disables the cache, COCALIB_CACHE=FOLDER moves it.
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
"""Smaller files open quickly without a cache."""


def cache_folder() -> Path | None:
    """Return the cache folder; None if the cache is disabled."""
    requested = os.environ.get("COCALIB_CACHE", "")
    if requested.lower() in ("off", "0", "no"):
        return None
    if requested:
        return Path(requested)
    if sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    elif sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "cocalib" / "indexes"


def cache_of(file: FileBytes) -> "FileCache | None":
    """Return the cache of a file; None for small files, and if the cache is disabled.

    Args:
        file: an open file; a copy in a temporary folder has no cache.
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
    """The cache entries of one file.

    Attributes:
        folder: the cache folder.
        key: identifies this file.
    """

    folder: Path
    key: str

    def get(self, name: str) -> Mapping[str, np.ndarray] | None:
        """Return the arrays stored under a name; None if there are no usable ones."""
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
        """Store arrays under a name, making room for them; does nothing if the folder is not writable."""
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
        """Remove the least recently used entries until the rest is small enough."""
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
