"""Shared by `video --overlay`, `record-rrd` and `rerun`: open a recording with what is to be drawn over it."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app.cli.output import progress_bar, read_text, told_clicks_at_frames
from app.cli.recording_flags import TopicFlags
from calib_core.errors import InputError

if TYPE_CHECKING:
    from app.recorded_view import RecordedView
    from calib_core.interchange import CameraFile
    from calib_core.recordings import Recording
    from calib_core.results import Calibration

__all__ = ["ShownFiles", "shown_recording"]


@dataclass(frozen=True, slots=True)
class ShownFiles:
    """What the user names.

    Attributes:
        recording: its files.
        topics: of the recording.
        calibration: the file to project with.
        camera: intrinsics, if the calibration's file has none.
        clicks: a file of clicks in this recording.
        boxes: a file of boxes, or the topic of the recording that has them.
        against: a file with another calibration.
        colour: what the colours of returns show.
    """

    recording: Sequence[Path]
    topics: TopicFlags
    calibration: Path | None
    camera: Path | None
    clicks: Path | None
    boxes: str | None
    against: Path | None
    colour: Literal["range", "speed"]


@contextmanager
def shown_recording(files: ShownFiles) -> "Iterator[RecordedView]":
    """Open the recording and read everything that is to be drawn over it.

    Raises:
        InputError: a file cannot be read, or is not of this recording.
        RecordingError: the recording cannot be opened.
    """
    from app.boxes import find_boxes
    from app.recorded_view import recorded_view
    from calib_core.interchange import CameraFile, read_clicks
    from calib_core.recordings import open_recording

    if not files.recording:
        raise InputError("RECORDING is missing; name one or more files or folders")
    if files.calibration is None:
        raise InputError("--calibration FILE is missing: the calibration that the returns are projected with")
    camera_file = None if files.camera is None else CameraFile.read(files.camera)
    with open_recording(tuple(files.recording), files.topics) as recording:
        calibration = _calibration(files.calibration, recording, camera_file)
        against = None if files.against is None else _calibration(files.against, recording, camera_file)
        clicks = () if files.clicks is None else read_clicks(read_text(files.clicks), source=str(files.clicks))
        if clicks:
            clicks = told_clicks_at_frames(clicks, recording, source=str(files.clicks))
        boxes = None if files.boxes is None else find_boxes(files.boxes, recording)
        with progress_bar("evaluating") as progress:
            view = recorded_view(
                recording, calibration, files.colour, clicks=clicks, boxes=boxes, against=against, progress=progress
            )
        yield view


def _calibration(path: Path, recording: "Recording", camera_file: "CameraFile | None") -> "Calibration":
    """Read a calibration of any format, with its own intrinsics, or those given, or the recording's.

    Raises:
        InputError: it cannot be read, or nothing states intrinsics.
    """
    from app.solving import camera_for
    from calib_core.interchange import adopted_calibration, read_any_file

    found = read_any_file(path)
    if found.file is not None:
        return found.file.calibration
    camera = found.camera or camera_for(recording, camera_file)
    if camera is None:
        raise InputError(
            f"{path}: neither the file nor the recording has intrinsics to project with; give --camera FILE"
        )
    return adopted_calibration(found, str(path), camera=camera)
