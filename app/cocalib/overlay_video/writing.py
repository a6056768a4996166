"""Write the overlay video with the best codec that PyAV has, each frame at its recorded time."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from calib_core.errors import InputError, MessageError, RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings import SkippedFrames, WrittenVideo, video_format
from cocalib.overlay_video.panels import Panels
from cocalib.platform.files import whole_path
from cocalib.recorded_view import RecordedView, frame_blocks

_LONGEST_SCAN_S = 0.25
_CODECS = {
    "libx264": ("H.264", {"preset": "veryfast", "crf": "21"}),
    "libopenh264": ("H.264", {}),
    "mpeg4": ("MPEG-4", {"qscale": "3"}),
    "mjpeg": ("Motion JPEG", {"qscale": "3"}),
}
"""In order of preference; the first that this build of PyAV can write is used."""
_TICKS_PER_S = 60_000
"""MPEG-4 allows at most 65535."""
_BT709, _LIMITED_RANGE = 1, 1


@dataclass(frozen=True, slots=True)
class OverlayOptions:
    """How the video looks.

    Attributes:
        titles: of the panels: the calibration's name, and that of the other one, if there is one.
        trail_scans: number of earlier scans whose returns stay, smaller the older they are.
    """

    titles: tuple[str, ...]
    trail_scans: int = 5


@dataclass(frozen=True, slots=True)
class WrittenOverlay:
    """A summary of what was written.

    Attributes:
        video: its frames.
        codec: what they are encoded with.
        size_px: width and height of the video.
    """

    video: WrittenVideo
    codec: str
    size_px: tuple[int, int]


def write_overlay(
    view: RecordedView,
    path: Path,
    options: OverlayOptions,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> WrittenOverlay:
    """Write the camera's frames with the overlay, each at its recorded time; the file takes its name once it is complete.

    Args:
        view: what to draw.
        path: of the video: .mp4, .mov or .mkv.
        options: how it looks.
        progress: called with the frames done and their total.

    Raises:
        InputError: PyAV is missing, the suffix is not supported, or the file cannot be written.
        RecordingError: no frame can be read.
    """
    video_format(path)
    try:
        with whole_path(path) as part:
            return _write(view, part, options, progress)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error


def _write(
    view: RecordedView, path: Path, options: OverlayOptions, progress: Callable[[int, int], None] | None
) -> WrittenOverlay:
    camera, times = view.calibration.camera, view.recording.image_times
    size_px = (camera.width_px, camera.height_px)
    panels = Panels(view, options.titles, trail_scans=options.trail_scans, size_px=size_px)
    duration_s = float(times[-1] - times[0]) / NS_PER_S
    rate = (len(times) - 1) / duration_s if duration_s > 0 else 1.0
    skipped, count, last = SkippedFrames(), 0, TimeNs(int(times[0]))
    with encoding(path, panels.video_size_px, rate) as encoder:
        for time, picture in _pictures(view, panels, skipped, size_px, options, progress):
            encoder.add(panels.compose(picture, time), time)
            count, last = count + 1, time
        if encoder.start is None:
            raise RecordingError(
                f"{view.recording.name}: none of its {len(times)} frames can be read: {skipped.fault or 'other sizes'}"
            )
        encoder.finish()
        video = WrittenVideo(count, encoder.start, (last - encoder.start) / NS_PER_S, skipped)
        codec = encoder.codec
    return WrittenOverlay(video, codec, panels.video_size_px)


def _pictures(
    view: RecordedView,
    panels: Panels,
    skipped: SkippedFrames,
    size_px: tuple[int, int],
    options: OverlayOptions,
    progress: Callable[[int, int], None] | None,
) -> Iterator[tuple[TimeNs, np.ndarray]]:
    """Yield the frames that can be read and have the calibration's size; the panels know the scans around each."""
    recording, total = view.recording, len(view.recording.image_times)
    for block in frame_blocks(recording, trail_s=_LONGEST_SCAN_S * options.trail_scans):
        panels.enter(block)
        for place, time in enumerate(block.times_ns.tolist()):
            if progress:
                progress(block.first + place, total)
            try:
                picture = recording.image(block.first + place)
            except MessageError as error:
                skipped.add_unreadable(error)
                continue
            if (picture.shape[1], picture.shape[0]) != size_px:
                skipped.other_size += 1
                continue
            yield TimeNs(time), picture


@dataclass(slots=True)
class Encoder:
    """A video that is being written.

    Attributes:
        codec: what it is encoded with, for the user.
    """

    codec: str
    container: Any
    stream: Any
    start: TimeNs | None = None
    ticks: int = -1

    def add(self, picture: np.ndarray, time: TimeNs) -> None:
        """Append a frame.

        Args:
            picture: uint8 (h, w, 3), blue first, of the size given.
            time: its stamp.
        """
        import av

        self.start = time if self.start is None else self.start
        self.ticks = max(self.ticks + 1, round((time - self.start) * _TICKS_PER_S / NS_PER_S))
        frame = av.VideoFrame.from_ndarray(picture, format="bgr24")
        frame = frame.reformat(format=self.stream.pix_fmt, dst_colorspace="ITU709")
        frame.pts, frame.time_base = self.ticks, Fraction(1, _TICKS_PER_S)
        self.container.mux(self.stream.encode(frame))

    def finish(self) -> None:
        """Write what the codec still holds back."""
        self.container.mux(self.stream.encode(None))


@contextmanager
def encoding(path: Path, size_px: tuple[int, int], frames_per_s: float) -> Iterator[Encoder]:
    """Yield an encoder that writes a file; the caller finishes it.

    Args:
        path: of the video.
        size_px: width and height, both even.
        frames_per_s: on average.

    Raises:
        InputError: PyAV is missing or has no codec, or the suffix is not supported.
    """
    form = video_format(path)
    import av

    name = next((name for name in _CODECS if _can_write(name)), None)
    if name is None:
        raise InputError(
            f"PyAV has none of the codecs {', '.join(_CODECS)}; install the wheel: pip install 'cocalib[video]'"
        )
    label, options = _CODECS[name]
    with av.open(str(path), "w", format=form) as container:
        stream: Any = container.add_stream(name, rate=max(1, round(frames_per_s)), options=options)
        stream.width, stream.height = size_px
        stream.pix_fmt = "yuvj420p" if name == "mjpeg" else "yuv420p"
        stream.codec_context.time_base = Fraction(1, _TICKS_PER_S)
        stream.codec_context.colorspace = stream.codec_context.color_primaries = stream.codec_context.color_trc = _BT709
        if name != "mjpeg":
            stream.codec_context.color_range = _LIMITED_RANGE
        yield Encoder(label, container, stream)


def _can_write(name: str) -> bool:
    from av.codec import Codec
    from av.codec.codec import UnknownCodecError

    try:
        return bool(Codec(name, "w").name)
    except UnknownCodecError:
        return False
