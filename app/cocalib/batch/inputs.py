"""The files that the result of a session depends on, and their state, which tells whether one changed."""

import errno
import hashlib
import json
import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
from msgspec import Struct, field

from calib_core.errors import CalibrationError
from calib_core.input_files import special_kind
from calib_core.parsing import json_form
from calib_core.recordings.recording_file import recording_file_of
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.results_folder import ResultsFolder

_LEVELS = 4
"""As far above a folder of images as data sets keep their calibration."""
_SESSION = ".cocalib-session"


@dataclass(frozen=True, slots=True)
class InputFile:
    """A file.

    Attributes:
        name: relative to what the manifest names.
        path: of it.
    """

    name: str
    path: Path


@dataclass(frozen=True, slots=True)
class InputPath:
    """A file or folder that a row names.

    Attributes:
        role: recording, clicks, camera, or boxes.
        path: as the row has it.
    """

    role: str
    path: Path

    @property
    def name(self) -> str:
        """Its name without the folder; results name it."""
        return self.path.name

    def files(self) -> tuple[InputFile, ...]:
        """Return the files that are read, in order of their names.

        Raises:
            OSError: it is missing, a pipe or a device, or a folder cannot be read.
        """
        path = self.path
        if self.role == "camera" and "#" in str(path) and not path.exists():  # FILE#CAMERA
            path = Path(str(path).rpartition("#")[0])
        path.stat()
        paths = list(_files_below(path)) if path.is_dir() else [path]
        if self.role == "recording":
            paths += [side for side in _side_files(path) if side not in paths and side.is_file()]
        for file in paths:
            if (kind := special_kind(file)) is not None:
                raise OSError(errno.EINVAL, f"is {kind}, not a file", str(file))  # reading it may never end
        named = {os.path.relpath(file, path.parent).replace(os.sep, "/"): file for file in paths}
        return tuple(InputFile(name, named[name]) for name in sorted(named))


def inputs_of(row: ManifestRow) -> tuple[InputPath, ...]:
    """Return what a row names, in the order in which it is read."""
    single = {"clicks": row.clicks, "camera": row.camera, "boxes": row.boxes}
    return (
        *(InputPath("recording", path) for path in row.recording),
        *(InputPath(role, path) for role, path in single.items() if path is not None),
    )


def all_reached(inputs: tuple[InputPath, ...]) -> bool:
    """Return whether all inputs are there, as far as one can tell without reading them."""
    try:
        return all(os.access(file.path, os.R_OK) for path in inputs for file in path.files())
    except OSError:
        return False


def state_of(inputs: tuple[InputPath, ...]) -> str:
    """Return a digest of the sizes and times of inputs; content that changes changes it. What is missing counts, too."""
    listed: list[object] = []
    for path in inputs:
        try:
            stats = [(file.name, file.path.stat()) for file in path.files()]
            listed.append([path.role, [(name, stat.st_size, stat.st_mtime_ns) for name, stat in stats]])
        except OSError:
            listed.append([path.role, None])
    return hashlib.sha256(json.dumps(listed).encode()).hexdigest()


def _files_below(folder: Path) -> Iterator[Path]:
    """Yield the files of a folder and the folders below, without hidden ones and without sessions of the page.

    Raises:
        OSError: a folder cannot be read.
    """

    def refuse(error: OSError) -> None:
        raise error

    seen = set()
    for place, folders, names in os.walk(folder, onerror=refuse, followlinks=True):
        real = os.path.realpath(place)
        if real in seen:  # a link to a folder around it
            folders.clear()
            continue
        seen.add(real)
        folders[:] = sorted(name for name in folders if not name.startswith(".") and not name.endswith(_SESSION))
        yield from (Path(place, name) for name in sorted(names) if not name.startswith("."))


def _side_files(path: Path) -> Iterator[Path]:
    """Yield where `open_recording` looks for more than it was given: bag metadata, tables of times, published intrinsics."""
    yield recording_file_of(path)
    for stem in {path.name, path.stem} if path.is_dir() else {path.stem}:
        yield from (path.parent / f"{stem}{suffix}" for suffix in (".csv", ".txt"))
    if not path.is_dir():
        yield path.parent / "metadata.yaml"
        return
    yield path.parent / "timestamps.txt"
    yield path.parent / "calib.txt"
    yield from (path.parent / "calib").glob("*.txt")
    for above in list(path.absolute().parents)[:_LEVELS]:
        yield above / "calib_cam_to_cam.txt"
        for tables in above.glob("v1.0-*"):
            yield from (tables / f"{name}.json" for name in ("calibrated_sensor", "sensor", "sample_data"))


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
                if self._cached_digest(path, files)[1] is None:
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
        state, known = self._cached_digest(key, files)
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

    def _cached_digest(self, key: str, files: Sequence[InputFile]) -> tuple[str, str | None]:
        state = _state(files)[0]
        kept = self._new.get(key) or self._kept.get(key)
        return state, kept.digest if kept is not None and kept.state == state else None

    def _read(self) -> dict[str, _Kept]:
        try:
            document = json_form(self._results.read(_FILE) or b"", _Document)
        except (OSError, CalibrationError):
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
