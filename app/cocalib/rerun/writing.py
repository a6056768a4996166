"""Write a recording with its calibration as an .rrd file."""

import shutil
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from calib_core.errors import InputError
from calib_core.recordings import SkippedFrames
from cocalib.platform.files import whole_path
from cocalib.recorded_view import RecordedView
from cocalib.rerun.sdk import require_sdk

if TYPE_CHECKING:
    import rerun as rr

_APPLICATION = "cocalib"
_RESERVE_BYTES = 64 << 20
"""More than is written between two looks at the free space."""


@dataclass(frozen=True, slots=True)
class WrittenView:
    """What was written.

    Attributes:
        frames: number of pictures.
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
    try:
        with whole_path(path) as part, _stream_to(part, view) as stream:
            written = _write(stream, view, part, progress)
            stream.disconnect()
            _require_complete(part, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from error
    return written


@contextmanager
def _stream_to(part: Path, view: RecordedView) -> "Iterator[rr.RecordingStream]":
    """Yield a stream that writes to a file; it is closed in any case."""
    import rerun as rr

    from cocalib.rerun.moving import layout

    stream = rr.RecordingStream(_APPLICATION, send_properties=False)
    try:
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        stream.save(part, layout(view))
        yield stream
    finally:
        stream.disconnect()


def _require_space(part: Path) -> None:
    """Refuse to go on when the disk is nearly full: once Rerun's writer fails, closing its stream can wait for ever.

    Raises:
        InputError: too little is free for what is written before the next look.
    """
    free_bytes = shutil.disk_usage(part.parent).free
    if free_bytes < _RESERVE_BYTES:
        raise InputError(
            f"{part.parent}: the disk is nearly full ({free_bytes / 1e6:.0f} MB are free); nothing was left behind. Free some "
            "space, or write to another disk"
        )


def _require_complete(part: Path, path: Path) -> None:
    """Refuse a file without its last part: where the SDK cannot write, it only logs that.

    Raises:
        InputError: the file is not complete.
    """
    from rerun.chunk import RrdReader
    from rerun.error_utils import RerunWarning

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RerunWarning)
            complete = len(RrdReader(part).recordings()) == 1
    except (RuntimeError, RerunWarning):
        complete = False
    if not complete:
        free_mb = shutil.disk_usage(path.resolve().parent).free / 1e6
        raise InputError(
            f"{path}: could not be written completely, and was removed; {free_mb:.0f} MB are free there. Free some space, or "
            "write to another disk"
        )


def _write(
    stream: "rr.RecordingStream", view: RecordedView, part: Path, progress: Callable[[int, int], None] | None
) -> WrittenView:
    from cocalib.rerun.moving import Streamed, stream_cloud, stream_figures, stream_frames
    from cocalib.rerun.unmoving import log_unmoving

    _require_space(part)
    stream.send_recording_name(view.recording.name)
    log_unmoving(stream, view)
    stream_figures(stream, view)
    scans = 0
    for times_ns in stream_cloud(stream, view):
        _require_space(part)
        scans += len(times_ns)
    streamed, total = Streamed(), len(view.recording.image_times)
    for done in stream_frames(stream, view, streamed):
        _require_space(part)
        if progress:
            progress(done, total)
    return WrittenView(streamed.frames, scans, streamed.skipped)
