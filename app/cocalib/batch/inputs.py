"""The files that the result of a session depends on, and their state, which tells whether one changed."""

import errno
import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from calib_core.input_files import special_kind
from cocalib.batch.manifest import ManifestRow

_LEVELS = 4
"""As far above a folder of pictures as data sets keep their calibration."""
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
        found = list(_within(path)) if path.is_dir() else [path]
        if self.role == "recording":
            found += [side for side in _side_files(path) if side not in found and side.is_file()]
        for file in found:
            if (kind := special_kind(file)) is not None:
                raise OSError(errno.EINVAL, f"is {kind}, not a file", str(file))  # reading it may never end
        named = {os.path.relpath(file, path.parent).replace(os.sep, "/"): file for file in found}
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
        return all(os.access(file.path, os.R_OK) for one in inputs for file in one.files())
    except OSError:
        return False


def state_of(inputs: tuple[InputPath, ...]) -> str:
    """Return a digest of the sizes and times of inputs; content that changes changes it. What is missing counts, too."""
    listed: list[object] = []
    for one in inputs:
        try:
            stats = [(file.name, file.path.stat()) for file in one.files()]
            listed.append([one.role, [(name, stat.st_size, stat.st_mtime_ns) for name, stat in stats]])
        except OSError:
            listed.append([one.role, None])
    return hashlib.sha256(json.dumps(listed).encode()).hexdigest()


def _within(folder: Path) -> Iterator[Path]:
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
    stem = path.name if path.is_dir() else path.stem
    yield from (path.parent / f"{stem}{suffix}" for suffix in (".csv", ".txt"))
    if not path.is_dir():
        yield path.parent / "metadata.yaml"
        return
    yield path.with_suffix(".csv")
    yield path.with_suffix(".txt")
    yield path.parent / "timestamps.txt"
    yield path.parent / "calib.txt"
    yield from (path.parent / "calib").glob("*.txt")
    for above in list(path.absolute().parents)[:_LEVELS]:
        yield above / "calib_cam_to_cam.txt"
        for tables in above.glob("v1.0-*"):
            yield from (tables / f"{name}.json" for name in ("calibrated_sensor", "sensor", "sample_data"))
