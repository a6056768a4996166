"""Digests of the contents of inputs, kept in the folder of results, so that a large recording is read only once for them."""

import hashlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
from msgspec import Struct, field

from calib_core.errors import CalibrationError
from cocalib.batch.inputs import InputFile, InputPath
from cocalib.batch.results_folder import ResultsFolder

_FILE = "inputs.json"
_PIECE_BYTES = 1 << 22
_SETTLED_NS = 2_000_000_000
"""A file may change again within one tick of its time; one that is younger is read again the next time."""


class _Kept(Struct, frozen=True, forbid_unknown_fields=True):
    state: str
    digest: str


class _Document(Struct, frozen=True, forbid_unknown_fields=True):
    schema: str
    inputs: dict[str, _Kept] = field(default_factory=dict)


_SCHEMA = "cocalib/input-digests-1"


class InputDigests:
    """Knows the digests of inputs that have not changed since they were read, by path, sizes, times and inodes.

    One process, the driver, uses the file. Drivers that share it write it one after the other, and lose at most time.
    """

    def __init__(self, results: Path, progress: Callable[[int, int], None] | None = None) -> None:
        """Read what is kept; a file that cannot be read is as good as none.

        Args:
            results: the folder of results.
            progress: called with the bytes done and their number.
        """
        self._results = ResultsFolder(results)
        self._kept = self._read()
        self._new: dict[str, _Kept] = {}
        self._progress = progress
        self._done = self._total = 0

    def expect(self, inputs: Sequence[InputPath]) -> None:
        """Count the bytes that will have to be read, for the progress."""
        for path, one in {f"{one.role} {one.path}": one for one in inputs}.items():
            try:
                files = one.files()
                if self._known(path, files)[1] is None:
                    self._total += sum(file.path.stat().st_size for file in files)
            except OSError:
                continue

    def digest(self, given: InputPath) -> str:
        """Return the sha256 of the names and contents of an input's files.

        Raises:
            OSError: it cannot be read, or changes while it is read.
        """
        key = f"{given.role} {given.path}"
        files = given.files()
        state, known = self._known(key, files)
        if known is not None:
            return known
        digest = hashlib.sha256()
        for file in files:
            content = self._sha256(file.path)
            digest.update(f"{len(file.name.encode(errors='surrogateescape'))} ".encode())
            digest.update(file.name.encode(errors="surrogateescape"))
            digest.update(content)
        if _state(files)[0] != state:
            raise OSError(f"{given.path}: changes while it is read")
        newest_ns = _state(files)[1]
        if newest_ns < time.time_ns() - _SETTLED_NS:
            self._new[key] = _Kept(state, digest.hexdigest())
        return digest.hexdigest()

    def save(self) -> None:
        """Keep what is new, with what other drivers have kept meanwhile.

        Raises:
            CalibrationError: what has the file's name is not a regular file.
            OSError: it cannot be written.
        """
        if not self._new:
            return
        document = _Document(_SCHEMA, {**self._read(), **self._new})
        self._results.write(_FILE, data=msgspec.json.format(msgspec.json.encode(document), indent=1) + b"\n")

    def _known(self, key: str, files: Sequence[InputFile]) -> tuple[str, str | None]:
        state = _state(files)[0]
        kept = self._new.get(key) or self._kept.get(key)
        return state, kept.digest if kept is not None and kept.state == state else None

    def _read(self) -> dict[str, _Kept]:
        try:
            document = msgspec.json.decode(self._results.read(_FILE) or b"", type=_Document)
        except (OSError, msgspec.DecodeError, CalibrationError):
            return {}
        return document.inputs if document.schema == _SCHEMA else {}

    def _sha256(self, path: Path) -> bytes:
        digest = hashlib.sha256()
        with path.open("rb") as file:
            while piece := file.read(_PIECE_BYTES):
                digest.update(piece)
                self._done += len(piece)
                if self._progress is not None:
                    self._progress(min(self._done, self._total), self._total)
        return digest.digest()


def _state(files: Sequence[InputFile]) -> tuple[str, int]:
    """Return a digest of the sizes, times and inodes of files, and the newest time [ns].

    Raises:
        OSError: one is missing.
    """
    digest, newest_ns = hashlib.sha256(), 0
    for file in files:
        stat = file.path.stat()
        digest.update(repr((file.name, stat.st_size, stat.st_mtime_ns, stat.st_ino, stat.st_ctime_ns)).encode())
        newest_ns = max(newest_ns, stat.st_mtime_ns, stat.st_ctime_ns)
    return digest.hexdigest(), newest_ns
