"""Write a recording with its calibration as an .rrd file."""

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from calib_core.recordings import SkippedFrames
from cocalib.platform.files import writing_whole
from cocalib.recorded_view import RecordedView
from cocalib.rerun.viewer import require_sdk

if TYPE_CHECKING:
    import rerun as rr

_APPLICATION = "cocalib"
"""Tells our files from others, too."""
_PIECE_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class WrittenView:
    """What was written.

    Attributes:
        frames: number of images.
        scans: number of radar scans.
        skipped: frames that are left out.
    """

    frames: int
    scans: int
    skipped: SkippedFrames


def write_view(view: RecordedView, path: Path, *, progress: Callable[[int, int], None] | None = None) -> WrittenView:
    """Write an .rrd file; it takes its name once it is complete. Memory use is bounded whatever the recording's length.

    Args:
        view: what to show.
        path: of the file.
        progress: called with the frames done and their total.

    Raises:
        InputError: rerun-sdk is missing, or the file cannot be written.
        RecordingError: the recording cannot be read.
    """
    require_sdk()
    faults: list[OSError] = []
    with writing_whole(path) as file:
        with _stream_to(file, view, faults) as stream:
            written = _write(stream, view, faults, progress)
        _require_written(faults)
    return written


@contextmanager
def _stream_to(file: BinaryIO, view: RecordedView, faults: list[OSError]) -> "Iterator[rr.RecordingStream]":
    """Yield a stream whose bytes go to a file, through a pipe: Rerun's own writer waits for ever once the disk is full."""
    import rerun as rr

    from cocalib.rerun.moving import layout

    stream = rr.RecordingStream(_APPLICATION, send_properties=False)
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    end, start = os.pipe()
    copying = threading.Thread(target=_copy, args=(end, file, faults))
    copying.start()
    try:
        try:
            stream.save(f"/dev/fd/{start}", layout(view))
        finally:
            os.close(start)
        yield stream
    finally:
        stream.disconnect()
        copying.join()


def _copy(end: int, file: BinaryIO, faults: list[OSError]) -> None:
    """Copy a pipe to a file until it is closed; after a fault only empty it, so that its writer goes on."""
    with os.fdopen(end, "rb", buffering=0) as pipe:
        while piece := pipe.read(_PIECE_BYTES):
            try:
                if not faults:
                    file.write(piece)
            except OSError as error:
                faults.append(error)


def _require_written(faults: list[OSError]) -> None:
    """Raise the fault that copying had, if any."""
    if faults:
        raise faults[0]


def _write(
    stream: "rr.RecordingStream",
    view: RecordedView,
    faults: list[OSError],
    progress: Callable[[int, int], None] | None,
) -> WrittenView:
    from cocalib.rerun.moving import Streamed, stream_cloud, stream_figures, stream_frames
    from cocalib.rerun.unmoving import log_unmoving

    stream.send_recording_name(view.recording.name)
    log_unmoving(stream, view)
    stream_figures(stream, view)
    scans = 0
    for times_ns in stream_cloud(stream, view):
        _require_written(faults)
        scans += len(times_ns)
    streamed, total = Streamed(), len(view.recording.image_times)
    for done in stream_frames(stream, view, streamed):
        _require_written(faults)
        if progress:
            progress(done, total)
    return WrittenView(streamed.frames, scans, streamed.skipped)
