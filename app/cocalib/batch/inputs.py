"""The files that the result of a session depends on, and their state, which tells whether one changed."""

import errno
import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from calib_core.input_files import special_kind
from calib_core.recordings.recording_file import recording_file_of
from cocalib.batch.manifest import ManifestRow

_LEVELS = 4
"""As far above a folder of images as data sets keep their calibration."""
_SESSION = ".cocalib-session"
_SMALL_BYTES = 1 << 20
"""Larger files are taken as unchanged while size and time are: reading all recordings anew would take minutes."""


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
    """Return a digest of inputs: of small files by their content, of others by size and time. What is missing counts, too."""
    listed: list[object] = []
    for path in inputs:
        try:
            listed.append([path.role, path.path.name, [(file.name, *_file_state(file.path)) for file in path.files()]])
        except OSError:
            listed.append([path.role, path.path.name, None])
    return hashlib.sha256(json.dumps(listed).encode()).hexdigest()


def _file_state(path: Path) -> tuple[int, int | str]:
    stat = path.stat()
    if stat.st_size > _SMALL_BYTES:
        return stat.st_size, stat.st_mtime_ns
    return stat.st_size, hashlib.sha256(path.read_bytes()).hexdigest()


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
