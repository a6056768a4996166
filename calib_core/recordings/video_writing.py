"""Write the camera's frames as a video, each at its recorded time; recorded JPEG is copied unchanged."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path

from calib_core.errors import InputError, RecordingError
from calib_core.file_tag import TAG
from calib_core.measurements import TimeNs
from calib_core.recordings.camera.images import EncodedImage
from calib_core.recordings.recording import Recording

_FORMATS = {".mp4": "mp4", ".mov": "mov", ".mkv": "matroska"}
_TICK_NS = 1000
_JPEG_QUALITY = 95


@dataclass(slots=True)
class SkippedFrames:
    """The frames that are left out while a recording's images are written.

    Attributes:
        other_size: number of frames whose size differs from the first.
        unreadable: number of frames that cannot be read.
        fault: why the first of those cannot be read.
    """

    other_size: int = 0
    unreadable: int = 0
    fault: str = ""

    def add_unreadable(self, error: RecordingError) -> None:
        """Count a frame that cannot be read."""
        self.unreadable += 1
        self.fault = self.fault or str(error)

    def notes(self) -> Iterator[str]:
        """Say how many frames are left out, and why."""
        if self.other_size:
            yield f"{self.other_size} frames are left out: their size differs from the first frame's"
        if self.unreadable:
            yield f"{self.unreadable} frames are left out because they cannot be read: {self.fault}"


@dataclass(frozen=True, slots=True)
class WrittenVideo:
    """A summary of what was written.

    Attributes:
        frames: number of frames in the video.
        start: stamp of the first frame, which has time 0 in the video.
        duration_s: from the first frame to the last.
        skipped: frames that it lacks.
    """

    frames: int
    start: TimeNs
    duration_s: float
    skipped: SkippedFrames


def video_format(path: Path) -> str:
    """Return the name of the container format for a path, if it can be written.

    Raises:
        InputError: PyAV is missing, or the suffix is not supported.
    """
    form = _FORMATS.get(path.suffix.lower())
    if form is None:
        raise InputError(f"{path}: unsupported video format; use {', '.join(_FORMATS)}, or for Rerun .rrd")
    if find_spec("av") is None:
        raise InputError("writing a video needs PyAV, which is not installed: pip install 'cocalib[video]'")
    return form


def write_video(
    recording: Recording, path: Path, *, progress: Callable[[int, int], None] | None = None
) -> WrittenVideo:
    """Write the camera's frames to a video file; JPEG is not decoded, other images are encoded once.

    Args:
        recording: with a camera.
        path: of the video; .mp4 and .mov keep times to a microsecond, .mkv to a millisecond.
        progress: called with the frames done and the total frames.

    Raises:
        InputError: PyAV is missing, or the suffix is not supported.
        RecordingError: no frame can be read.
        OSError: the file cannot be written; a part of it may be there.
    """
    form = video_format(path)
    import av

    skipped = SkippedFrames()
    frames = _frames(recording, skipped, progress)
    first = next(frames, None)
    if first is None:
        raise RecordingError(
            f"{recording.name}: none of its {len(recording.image_times)} frames can be read: {skipped.fault}"
        )
    start, first_image = first
    options = {} if form == "matroska" else {"video_track_timescale": str(10**9 // _TICK_NS)}
    count, ticks = 0, -1
    with av.open(str(path), "w", format=form, options=options) as container:
        container.metadata["comment"] = TAG
        stream = container.add_stream("mjpeg")
        stream.width, stream.height, stream.pix_fmt = first_image.width_px, first_image.height_px, "yuvj420p"
        stream.time_base = Fraction(_TICK_NS, 10**9)
        while first is not None:
            time, image = first
            ticks = max(ticks + 1, round((time - start) / _TICK_NS))
            packet = av.Packet(image.data)
            packet.stream, packet.time_base = stream, Fraction(_TICK_NS, 10**9)
            packet.pts = packet.dts = ticks
            packet.is_keyframe = True
            container.mux(packet)
            count, last = count + 1, time
            first = next(frames, None)
    return WrittenVideo(count, start, (last - start) / 1e9, skipped)


def _frames(
    recording: Recording, skipped: SkippedFrames, progress: Callable[[int, int], None] | None
) -> Iterator[tuple[TimeNs, EncodedImage]]:
    """Yield the readable frames that have the size of the first one, as JPEG."""
    size: tuple[int, int] | None = None
    total = len(recording.image_times)
    for index in range(total):
        if progress:
            progress(index, total)
        try:
            image = _as_jpeg(recording, index)
        except RecordingError as error:
            skipped.add_unreadable(error)
            continue
        size = size or (image.width_px, image.height_px)
        if (image.width_px, image.height_px) == size:
            yield TimeNs(int(recording.image_times[index])), image
        else:
            skipped.other_size += 1


def _as_jpeg(recording: Recording, index: int) -> EncodedImage:
    image = recording.image_bytes(index)
    if image.format == "jpeg":
        return image
    import cv2

    _, data = cv2.imencode(".jpg", recording.image(index), [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    return EncodedImage(data.tobytes(), "jpeg", image.width_px, image.height_px)
