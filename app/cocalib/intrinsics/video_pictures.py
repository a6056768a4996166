"""The frames of a video file, as pictures in which a board may be. They need no start time."""

import hashlib
import threading
from collections import OrderedDict
from pathlib import Path

import numpy as np

from calib_core.errors import InputError, MessageError
from calib_core.input_files import name_text
from calib_core.measurements import TimeNs

VIDEO_SUFFIXES = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".mjpeg", ".ts")
_KEPT = 8
_FARTHEST = 240
_HEAD_BYTES = 1 << 20


class VideoPictures:
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

    def picture(self, index: int, /) -> np.ndarray:
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
            head = file.read(_HEAD_BYTES)
        size = self.path.stat().st_size
        return hashlib.sha256(f"{name_text(self.path.name)}\0{size}\0".encode() + head).hexdigest()

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._capture.release()
