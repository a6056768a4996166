"""Open what images of a board are given in: a recording, a video, a folder of images or several image files."""

import glob
import hashlib
import re
import threading
from collections import Counter, OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from calib_core.errors import InputError, MessageError
from calib_core.input_files import name_text
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings import Recording, RecordingOptions, holds_recording, open_recording, require_files
from cocalib.platform.files import keep

IMAGE_SUFFIXES = (".jpg", ".jpeg", ".png", ".bmp", ".ppm", ".pgm", ".tif", ".tiff", ".webp")
_IMAGE_HEAD_BYTES = 1 << 16
_LEAST_OF_A_SERIES = 3
_NUMBER = re.compile(r"\d+")
VIDEO_SUFFIXES = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".mjpeg", ".ts")
_KEPT = 8
_FARTHEST = 240
_VIDEO_HEAD_BYTES = 1 << 20


class FileImages:
    """Image files, by number."""

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

    def image(self, index: int, /) -> np.ndarray:
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
            raise InputError(f"{path}: not an image that can be decoded; leave it out or copy it again")
        return np.asarray(found)

    def digest(self) -> str:
        """Return a hash of the names and sizes of the files and of how they begin: whether they are the same as earlier."""
        digest = hashlib.sha256()
        for path in self.paths:
            with path.open("rb") as file:
                head = file.read(_IMAGE_HEAD_BYTES)
            digest.update(f"{name_text(path.name)}\0{path.stat().st_size}\0".encode())
            digest.update(head)
        return digest.hexdigest()


def images_in(folder: Path) -> tuple[Path, ...]:
    """Return the image files directly in a folder, numbered ones in the order of their numbers."""
    paths = [path for path in folder.iterdir() if path.suffix.lower() in IMAGE_SUFFIXES and path.is_file()]
    return tuple(sorted(paths, key=_natural))


def series_of(paths: Sequence[Path]) -> dict[str, tuple[Path, ...]]:
    """Return files whose names differ by one number only, such as left*.jpg, if there are at least three."""
    series: dict[str, list[Path]] = {}
    for path in paths:
        if _NUMBER.search(path.stem):
            head, tail = _NUMBER.split(path.stem)[0], _NUMBER.split(path.stem)[-1]
            series.setdefault(f"{head}*{tail}{path.suffix}", []).append(path)
    return {name: tuple(found) for name, found in series.items() if len(found) >= _LEAST_OF_A_SERIES}


def refuse_two_series(folder: Path, paths: Sequence[Path]) -> None:
    """Refuse a folder in which images of several cameras seem to be.

    Raises:
        InputError: the names form several series.
    """
    series = series_of(paths)
    if len(series) > 1:
        named = ", ".join(f"{name} ({len(found)})" for name, found in series.items())
        raise InputError(
            f"{folder}: its images form {len(series)} series, perhaps of {len(series)} cameras: {named}; a calibration is of "
            f"one camera: give its images, such as {folder / next(iter(series))}, or all of them by name if they are of one"
        )


def _natural(path: Path) -> tuple[tuple[int, str, int], ...]:
    """Return what sorts frame2 before frame10."""
    parts = re.split(r"(\d+)", path.name)
    return tuple((1, "", int(part)) if part.isdecimal() else (0, part, 0) for part in parts)


class RecordedImages:
    """The frames of a recording's camera, by number."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording

    def __len__(self) -> int:
        return len(self._recording.image_times)

    def name(self, index: int, /) -> str:
        """Return a frame's number and its time since the first one."""
        times = self._recording.image_times
        return f"frame {index + 1} ({(int(times[index]) - int(times[0])) / NS_PER_S:.2f} s)"

    def time_ns(self, index: int, /) -> TimeNs | None:
        """Return a frame's stamp."""
        return TimeNs(int(self._recording.image_times[index]))

    def image(self, index: int, /) -> np.ndarray:
        """Return a frame's pixels: uint8 (h, w, 3), blue first.

        Raises:
            CalibrationError: it cannot be read.
        """
        return self._recording.image(index)

    def digest(self) -> str:
        """Return a hash of the names and sizes of the files, the topic and the stamps: whether they are the same as earlier."""
        recording = self._recording
        digest = hashlib.sha256(f"{recording.image_topic}\0".encode())
        for source in recording.sources:
            digest.update(f"{name_text(source.path.name)}\0{source.size_bytes}\0".encode())
        digest.update(np.ascontiguousarray(recording.image_times).tobytes())
        return digest.hexdigest()


class VideoImages:
    """The frames of a video, decoded one after the other; several threads may ask for neighbours."""

    def __init__(self, path: Path) -> None:
        """Open a video; every frame is decoded once to count them.

        Raises:
            InputError: it is not a readable video.
        """
        import cv2

        self.path = path
        self._lock = threading.Lock()
        self._capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
        self._capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        self._times_ms: list[float] = []
        while self._capture.grab():
            self._times_ms.append(self._capture.get(cv2.CAP_PROP_POS_MSEC))
        if not self._times_ms:
            self._capture.release()
            raise InputError(f"{path}: not a readable video (OpenCV finds no frame in it); convert it to mp4")
        self._kept: OrderedDict[int, np.ndarray] = OrderedDict()
        self._next = len(self._times_ms)

    def __len__(self) -> int:
        return len(self._times_ms)

    def name(self, index: int, /) -> str:
        """Return a frame's number and its time since the first one."""
        return f"frame {index + 1} ({(self._times_ms[index] - self._times_ms[0]) / 1e3:.2f} s)"

    def time_ns(self, index: int, /) -> TimeNs | None:
        """Return the time since the beginning of the video."""
        return TimeNs(round(self._times_ms[index] * 1e6))

    def image(self, index: int, /) -> np.ndarray:
        """Return a frame's pixels: uint8 (h, w, 3), blue first.

        Raises:
            MessageError: it cannot be decoded.
        """
        with self._lock:
            if index not in self._kept:
                self._decode(index)
            return self._kept[index]

    def _decode(self, index: int) -> None:
        """Decode up to a frame, and keep those on the way that another thread may be about to ask for."""
        import cv2

        if not 0 <= index - self._next <= _FARTHEST:
            begin = max(index - _KEPT // 2, 0)
            self._capture.set(cv2.CAP_PROP_POS_FRAMES, begin)
            self._next = begin
        while self._next <= index:
            if not self._capture.grab():
                raise MessageError(f"{self.path.name}: frame {index + 1} cannot be decoded; the file is damaged there")
            if index - self._next < _KEPT:
                self._kept[self._next] = np.asarray(self._capture.retrieve()[1])
            self._next += 1
        while len(self._kept) > _KEPT:
            self._kept.popitem(last=False)

    def digest(self) -> str:
        """Return a hash of the file's size and beginning: whether it is the same as earlier."""
        with self.path.open("rb") as file:
            head = file.read(_VIDEO_HEAD_BYTES)
        size = self.path.stat().st_size
        return hashlib.sha256(f"{name_text(self.path.name)}\0{size}\0".encode() + head).hexdigest()

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._capture.release()


OpenImages = RecordedImages | VideoImages | FileImages


@contextmanager
def open_images(paths: Sequence[Path], options: RecordingOptions | None = None) -> Iterator[OpenImages]:
    """Open a source of images of one camera; one image at a time is read.

    Args:
        paths: a recording's files, one video, one folder of images, or several images; "*" in a name is spelled out.
        options: topics and clock of a recording.

    Raises:
        CalibrationError: there are no images, or those of several sources or cameras.
    """
    found = require_files(spelled_out(paths))
    kinds = {_kind(path) for path in found}
    if len(kinds) > 1:
        other = next(path for path in found if _kind(path) != _kind(found[0]))
        named = f"{found[0].name}: {_kind(found[0])}, {other.name}: {_kind(other)}"
        raise InputError(
            f"{len(found)} sources of different kinds ({named}); give either a recording, one video, one folder of images, or "
            "image files"
        )
    (kind,) = kinds
    if kind == "a recording":
        with open_recording(found, options, require=("image",)) as recording:
            keep(recording.files)
            yield RecordedImages(recording)
        return
    if options is not None and options.image_topic is not None:
        raise InputError(f"{found[0].name} is {kind}; --image-topic {options.image_topic} applies to a recording")
    if kind == "a video":
        if len(found) > 1:
            raise InputError(f"{len(found)} videos; a calibration is of one camera in one video: give one of them")
        video = VideoImages(found[0])
        try:
            yield video
        finally:
            video.close()
        return
    files = _files(found, kind)
    keep(files)
    yield FileImages(files)


def spelled_out(paths: Sequence[Path]) -> tuple[Path, ...]:
    """Return the paths with those of a pattern such as left*.jpg in place of it.

    Raises:
        InputError: nothing has such a name.
    """
    found: list[Path] = []
    for path in paths:
        if path.exists() or not glob.has_magic(str(path)):
            found.append(path)
            continue
        named = sorted(Path(name) for name in glob.glob(str(path)))  # noqa: PTH207 - the pattern may be absolute
        if not named:
            raise InputError(f"{path}: nothing has such a name; check the folder and the pattern")
        found += named
    return tuple(found)


def _files(paths: Sequence[Path], kind: str) -> tuple[Path, ...]:
    """Return the image files that are meant.

    Raises:
        InputError: there are several folders, or images of several cameras in one.
    """
    if kind == "an image":
        return tuple(dict.fromkeys(paths))
    if len(paths) > 1:
        raise InputError(f"{len(paths)} folders of images; a calibration is of one camera: give one folder")
    files = images_in(paths[0])
    refuse_two_series(paths[0], files)
    return files


def _kind(path: Path) -> str:
    suffix = path.suffix.lower()
    if path.is_dir():
        return "a folder of images" if images_in(path) and not holds_recording(path) else "a recording"
    if suffix in IMAGE_SUFFIXES:
        return "an image"
    return "a video" if suffix in VIDEO_SUFFIXES else "a recording"
