"""Shared by `video --overlay`, `record-rrd` and `rerun`: open a recording with what is to be drawn over it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import tyro

from calib_core.errors import InputError
from cocalib.cli.flags import File, called
from cocalib.cli.output import progress_bar, told_clicks_at_frames
from cocalib.cli.recording_flags import CameraFlags, GivenCamera, RecordedFlags
from cocalib.platform.files import read_text

if TYPE_CHECKING:
    from cocalib.recorded_view import RecordedView


@dataclass(frozen=True, slots=True)
class ShownFlags:
    """What is drawn over a recording."""

    calibration: File = None
    """Calibration to project the returns with, in any format that export writes."""
    camera: GivenCamera = field(default_factory=CameraFlags)
    clicks: File = None
    """Clicks in this recording (cocalib/clicks-1 JSON); by default those in the calibration, if they are of this recording."""
    boxes: Annotated[str | None, called("FILE_OR_TOPIC")] = None
    """Boxes around objects, drawn with their classes and evaluated (Acc): a file of a labelling tool, or a topic."""
    against: File = None
    """Another calibration, whose returns are shown too."""
    colour: Literal["range", "speed"] = "range"
    """What the colours of returns show."""


Shown: TypeAlias = Annotated[ShownFlags, tyro.conf.arg(name="")]


@contextmanager
def shown_recording(recorded: RecordedFlags, files: ShownFlags) -> "Iterator[RecordedView]":
    """Open the recording and read everything that is to be drawn over it.

    Args:
        recorded: the recording.
        files: what is drawn.

    Raises:
        InputError: a file cannot be read, or is not of this recording.
        RecordingError: the recording cannot be opened.
    """
    from calib_core.interchange import read_any_file, read_clicks
    from cocalib.evaluation.boxes import find_boxes
    from cocalib.evaluation.recording_check import calibration_of
    from cocalib.recorded_view import recorded_view
    from cocalib.solving.solving import camera_for

    if not recorded.recording:
        raise InputError("RECORDING is missing; name one or more files or folders")
    if files.calibration is None:
        raise InputError("--calibration FILE is missing: the calibration that the returns are projected with")
    camera_file = files.camera.read()
    with recorded.open() as recording:
        camera = camera_for(recording, camera_file)
        calibration = calibration_of(read_any_file(files.calibration), str(files.calibration), camera)
        against = None
        if files.against is not None:
            against = calibration_of(read_any_file(files.against), str(files.against), camera)
        clicks = () if files.clicks is None else read_clicks(read_text(files.clicks), source=str(files.clicks))
        if clicks:
            clicks = told_clicks_at_frames(clicks, recording, source=str(files.clicks))
        boxes = None
        if files.boxes is not None:
            with progress_bar("reading boxes") as progress:
                boxes = find_boxes(files.boxes, recording, progress=progress)
        with progress_bar("evaluating") as progress:
            view = recorded_view(
                recording, calibration, files.colour, clicks=clicks, boxes=boxes, against=against, progress=progress
            )
        yield view
