"""Read camera frames from a video file. Frame times count from its beginning, so the user gives the start time."""

import threading
from pathlib import Path

import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import DataWarning, TimeNs
from calib_core.recordings.camera.images import encoded_pixels
from calib_core.recordings.plain_files.source import PlainSource, image_channel, image_message, topic_of
from calib_core.recordings.time.written_times import read_time

VIDEO_SUFFIXES = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".mjpeg", ".ts")
_FRAME = "camera"
_STEP_BACK = 60


def open_video(path: Path, start: str | None) -> PlainSource:
    """Open a video file as a camera; every frame is decoded once to find its time.

    Args:
        path: the file.
        start: the time of its first frame, as given by --video-start.

    Raises:
        RecordingError: no start was given, or the file is not a video.
    """
    if start is None:
        raise RecordingError(
            f"{path}: a video has no start time; give the time of its first frame with --video-start, as seconds "
            "since 1970 (1714557600.25) or a date (2024-05-01T12:00:00.25+02:00)"
        )
    try:
        begin = read_time(start)
    except RecordingError as error:
        raise RecordingError(f"--video-start: {error}") from error
    video = _Video(path)
    times = begin + video.offsets_ns
    warnings = () if video.steady else (_uneven(path),)

    def message(row: int) -> bytes:
        return image_message(TimeNs(int(times[row])), _FRAME, video.jpeg(row))

    return PlainSource(
        path, path.stat().st_size, f"video, {len(times)} frames", image_channel(topic_of(path, "image")), times, message,
        warnings, video.close,
    )  # fmt: skip


def _uneven(path: Path) -> DataWarning:
    return DataWarning.reported(
        "video-times",
        f"{path.name}: several frames have the same time; all frames are spaced evenly over the length of the video",
        "use the recording the video was made from, if there is one: a video does not keep the frames' stamps",
    )


class _Video:
    """A video read frame by frame, sequentially where possible; thread-safe."""

    def __init__(self, path: Path) -> None:
        import cv2

        self.path = path
        self._lock = threading.Lock()
        self._capture: cv2.VideoCapture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
        self._capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        self._next = 0
        offsets = self._all_offsets()
        self.steady = bool(np.all(np.diff(offsets) > 0))
        if not self.steady:
            rate = self._capture.get(cv2.CAP_PROP_FPS) or 30.0
            offsets = np.round(np.arange(len(offsets)) * 1e9 / rate)
        self.offsets_ns = (offsets - offsets[0]).astype(np.int64)

    def _all_offsets(self) -> np.ndarray:
        import cv2

        offsets = []
        while self._capture.grab():
            offsets.append(round(self._capture.get(cv2.CAP_PROP_POS_MSEC) * 1e6))
        if not offsets:
            self._capture.release()
            raise RecordingError(f"{self.path}: not a readable video (OpenCV finds no frame in it); convert it to mp4")
        self._rewind(0)
        return np.array(offsets, dtype=np.float64)

    def _rewind(self, row: int) -> None:
        import cv2

        self._capture.set(cv2.CAP_PROP_POS_FRAMES, row)
        self._next = row

    def jpeg(self, row: int) -> bytes:
        """Decode a frame and encode it as JPEG.

        Raises:
            MessageError: it cannot be decoded.
        """

        with self._lock:
            if not 0 <= row - self._next <= _STEP_BACK:
                self._rewind(row)
            while self._next < row and self._capture.grab():
                self._next += 1
            found, pixels = self._capture.read()
            self._next += 1
        if not found or self._next != row + 1:
            raise MessageError(
                f"{self.path.name}: frame {row} cannot be decoded; the file is damaged from that frame on"
            )
        return encoded_pixels(pixels).data

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._capture.release()
