"""Write the overlay video."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib_core.errors import InputError, MessageError, RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings import LeftOut, video_format
from cocalib.overlay_video.encoding import encoding
from cocalib.overlay_video.panels import Panels
from cocalib.platform.files import whole_path
from cocalib.recorded_view import RecordedView, frame_blocks

_LONGEST_SCAN_S = 0.25


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
        frames: number of frames in the video.
        codec: what they are encoded with.
        size_px: width and height of the video.
        duration_s: from the first frame to the last.
        other_size: number of frames skipped because their size differs from the first.
        unreadable: number of frames skipped because they cannot be read.
        fault: why the first of those cannot be read.
    """

    frames: int
    codec: str
    size_px: tuple[int, int]
    duration_s: float
    other_size: int = 0
    unreadable: int = 0
    fault: str = ""


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
    skipped, count, last = LeftOut(), 0, TimeNs(int(times[0]))
    with encoding(path, panels.video_size_px, rate) as encoder:
        for time, picture in _pictures(view, panels, skipped, size_px, options, progress):
            encoder.add(panels.compose(picture, time), time)
            count, last = count + 1, time
        if encoder.start is None:
            raise RecordingError(
                f"{view.recording.name}: none of its {len(times)} frames can be read: {skipped.fault or 'other sizes'}"
            )
        encoder.finish()
        written_s = (last - encoder.start) / NS_PER_S
        codec = encoder.codec
    return WrittenOverlay(
        count, codec, panels.video_size_px, written_s, skipped.other_size, skipped.unreadable, skipped.fault
    )


def _pictures(
    view: RecordedView,
    panels: Panels,
    skipped: LeftOut,
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
                skipped.unreadable, skipped.fault = skipped.unreadable + 1, skipped.fault or str(error)
                continue
            if (picture.shape[1], picture.shape[0]) != size_px:
                skipped.other_size += 1
                continue
            yield TimeNs(time), picture
