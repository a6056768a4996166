"""Pictures given as files: a folder of them, or several by name. They need no times."""

import hashlib
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calib_core.errors import InputError
from calib_core.input_files import name_text

PICTURE_SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".ppm", ".pgm", ".tif", ".tiff", ".webp")
_HEAD_BYTES = 1 << 16
_LEAST_OF_A_SERIES = 3
_NUMBER = re.compile(r"\d+")


class FilePictures:
    """Picture files, by number."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self.paths = tuple(paths)
        several = Counter(path.name for path in self.paths)
        self._names = [
            name_text(path.name if several[path.name] == 1 else f"{path.parent.name}/{path.name}")
            for path in self.paths
        ]

    def __len__(self) -> int:
        return len(self.paths)

    def name(self, index: int, /) -> str:
        """Return a file's name, with its folder if others have the same."""
        return self._names[index]

    def time_ns(self, index: int, /) -> None:
        """Return None: files say nothing about time that can be relied on."""
        del index

    def picture(self, index: int, /) -> np.ndarray:
        """Return a file's pixels: uint8 (h, w, 3), blue first, as stored and not turned.

        Raises:
            InputError: it cannot be read.
        """
        import cv2

        path = self.paths[index]
        try:
            data = np.frombuffer(path.read_bytes(), dtype=np.uint8)
            found = cv2.imdecode(data, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION) if len(data) else None
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
        except cv2.error as error:
            raise InputError(f"{path}: cannot be decoded; it is damaged or too large") from error
        if found is None:
            raise InputError(f"{path}: not a picture that can be decoded; leave it out or copy it again")
        return np.asarray(found)

    def digest(self) -> str:
        """Return a hash of the names and sizes of the files and of how they begin: whether they are the same as earlier."""
        digest = hashlib.sha256()
        for path in self.paths:
            with path.open("rb") as file:
                head = file.read(_HEAD_BYTES)
            digest.update(f"{name_text(path.name)}\0{path.stat().st_size}\0".encode())
            digest.update(head)
        return digest.hexdigest()


def pictures_in(folder: Path) -> tuple[Path, ...]:
    """Return the picture files directly in a folder, numbered ones in the order of their numbers."""
    found = [path for path in folder.iterdir() if path.suffix.lower() in PICTURE_SUFFIXES and path.is_file()]
    return tuple(sorted(found, key=_natural))


def series_of(paths: Sequence[Path]) -> dict[str, tuple[Path, ...]]:
    """Return files whose names differ by one number only, such as left*.jpg, if there are at least three."""
    series: dict[str, list[Path]] = {}
    for path in paths:
        if _NUMBER.search(path.stem):
            head, tail = _NUMBER.split(path.stem)[0], _NUMBER.split(path.stem)[-1]
            series.setdefault(f"{head}*{tail}{path.suffix}", []).append(path)
    return {name: tuple(found) for name, found in series.items() if len(found) >= _LEAST_OF_A_SERIES}


def refuse_two_series(folder: Path, paths: Sequence[Path]) -> None:
    """Refuse a folder in which pictures of several cameras seem to be.

    Raises:
        InputError: the names form several series.
    """
    series = series_of(paths)
    if len(series) > 1:
        named = ", ".join(f"{name} ({len(found)})" for name, found in series.items())
        raise InputError(
            f"{folder}: its pictures form {len(series)} series, perhaps of {len(series)} cameras: {named}; a calibration is of "
            f"one camera: give its pictures, such as {folder / next(iter(series))}, or all of them by name if they are of one"
        )


def _natural(path: Path) -> tuple[tuple[int, str, int], ...]:
    """Return what sorts frame2 before frame10."""
    parts = re.split(r"(\d+)", path.name)
    return tuple((1, "", int(part)) if part.isdecimal() else (0, part, 0) for part in parts)
