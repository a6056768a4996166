"""Cache the indexes of large files in the user's cache folder, so that opening them again is fast.

An entry is valid for one state of one file: its path, size, modification time, and a hash of its beginning and end. An
entry that does not match or is damaged is ignored, and a cache that cannot be written is not an error. COCALIB_CACHE=off
disables the cache, COCALIB_CACHE=FOLDER moves it.
"""

import hashlib
import json
import os
import sys
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import IO

import numpy as np

from calib_core.errors import InputError
from calib_core.parsing import json_value
from calib_core.recordings.containers.positioned_reads import FileBytes
from calib_core.recordings.containers.sources import Channel, Heads, MessageIndex

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
_FEWEST_HEADS = 500


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


@dataclass(frozen=True, slots=True, eq=False)
class KeptIndex:
    """The result of opening a chunked file.

    Attributes:
        channels: the topics it declares.
        chunks: (n, 3) position, stored bytes, uncompressed bytes.
        compressions: (n,) compression names.
        indexes: by channel.
    """

    channels: tuple[Channel, ...]
    chunks: np.ndarray
    compressions: tuple[str, ...]
    indexes: Mapping[int, MessageIndex]


def keep_index(cache: FileCache, kept: KeptIndex) -> None:
    """Store an index in the cache."""
    names = sorted(set(kept.compressions))
    words = {"channels": [asdict(channel) for channel in kept.channels], "compressions": names}
    ids = list(kept.indexes)
    columns = [np.stack([i.receive_ns, i.chunk, i.offset]) for i in kept.indexes.values()]
    cache.put(
        "index",
        {
            "words": np.frombuffer(json.dumps(words).encode(), dtype=np.uint8),
            "chunks": kept.chunks,
            "compression": np.array([names.index(name) for name in kept.compressions], dtype=np.int64),
            "ids": np.array(ids, dtype=np.int64),
            "counts": np.array([len(index) for index in kept.indexes.values()], dtype=np.int64),
            "columns": np.concatenate(columns, axis=1) if columns else np.zeros((3, 0), dtype=np.int64),
        },
    )


def index_from(cache: FileCache) -> KeptIndex | None:
    """Return the index from the cache; None if there is no valid one."""
    arrays = cache.get("index")
    if arrays is None:
        return None
    try:
        words = json_value(arrays["words"].tobytes().decode(), source="")
        channels = tuple(Channel(**fields) for fields in words["channels"])
        names = tuple(words["compressions"][number] for number in arrays["compression"].tolist())
        edges = np.concatenate([[0], np.cumsum(arrays["counts"])])
        receive_ns, chunk, offset = arrays["columns"].astype(np.int64)
        chunks = arrays["chunks"].astype(np.int64).reshape(-1, 3)
        if edges[-1] != len(chunk) or len(names) != len(chunks):
            return None
        if len(chunk) and not 0 <= int(chunk.min()) <= int(chunk.max()) < len(chunks):
            return None
        indexes = {
            int(number): MessageIndex(receive_ns[first:last], chunk[first:last], offset[first:last])
            for number, first, last in zip(arrays["ids"], edges[:-1], edges[1:], strict=True)
        }
    except (KeyError, ValueError, TypeError, IndexError, InputError):
        return None
    return KeptIndex(channels, chunks, names, indexes)


def keep_heads(cache: FileCache | None, index: MessageIndex, size: int, heads: Heads) -> None:
    """Store heads in the cache if they are many and all were read."""
    if cache is not None and len(index) >= _FEWEST_HEADS and not heads.fault:
        cache.put(_heads_name(index, size), {"rows": heads.rows, "lengths": heads.lengths})


def heads_from(cache: FileCache | None, index: MessageIndex, size: int) -> Heads | None:
    """Return the heads of exactly these messages from the cache; None if they are not cached."""
    if cache is None or len(index) < _FEWEST_HEADS:
        return None
    arrays = cache.get(_heads_name(index, size))
    if arrays is None or not {"rows", "lengths"} <= arrays.keys():
        return None
    rows, lengths = arrays["rows"], arrays["lengths"]
    fits = rows.shape == (len(index), size) and rows.dtype == np.uint8 and lengths.shape == (len(index),)
    return Heads(rows, lengths.astype(np.int64)) if fits and lengths.dtype.kind == "i" else None


def _heads_name(index: MessageIndex, size: int) -> str:
    digest = hashlib.sha1(str(size).encode(), usedforsecurity=False)
    for column in (index.chunk, index.offset):
        digest.update(np.ascontiguousarray(column).tobytes())
    return f"heads-{digest.hexdigest()[:20]}"
