"""`cocalib show`: a recording with its calibration, in Rerun's window, a file for it, or a video."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from calib_core.errors import InputError
from calib_core.input_files import read_text
from cocalib.cli.flags import INPUT, File, OutFile, Output, OutputFlags, called
from cocalib.cli.output import progress_bar, told_clicks_at_frames
from cocalib.cli.recording_flags import CameraFlags, GivenCamera, Recorded, RecordedFlags
from cocalib.platform.files import whole_path

if TYPE_CHECKING:
    from cocalib.recorded_view import RecordedView

_TRAIL_SCANS, _MOST_TRAIL_SCANS = 5, 100


@dataclass(frozen=True, slots=True)
class Show:
    """Show a recording with its calibration in Rerun, or write it to a file: .rrd, or a video.

    Without --calibration, the video has the camera's frames only, each at its recorded time; recorded JPEG is not re-encoded.
    """

    out: OutFile = None
    """Output file instead of a window: .rrd for Rerun, or a video, .mp4, .mov or .mkv."""
    calibration: File = None
    """Calibration to project the returns with, in any format that export writes."""
    camera: GivenCamera = field(default_factory=CameraFlags)
    clicks: File = None
    """Clicks in this recording (cocalib/clicks-1 JSON); by default those in the calibration, if they are of this recording."""
    boxes: Annotated[str | None, called("FILE_OR_TOPIC"), INPUT] = None
    """Boxes around objects, drawn with their classes and evaluated (Acc): a file of a labeling tool, or a topic."""
    against: File = None
    """Another calibration, whose returns are shown too."""
    colour: Literal["range", "speed"] = "range"
    """What the colors of returns show."""
    trail: int = _TRAIL_SCANS
    """In a video: number of earlier scans whose returns stay, smaller the older they are; 0 for none."""
    recorded: Recorded = field(default_factory=RecordedFlags)
    output: Output = field(default_factory=OutputFlags)

    def run(self) -> int:
        """Show or write it; return the exit code."""
        if self.out is None:
            return self._show()
        if self.out.suffix.lower() == ".rrd":
            return self._write_rrd(self.out)
        return self._write_frames(self.out) if self.calibration is None else self._write_overlay(self.out)

    def _show(self) -> int:
        """Show it until the window is closed or Ctrl+C."""
        from cocalib.rerun import open_window, require_display, require_sdk, write_view

        require_sdk()
        require_display(os.environ)
        with tempfile.TemporaryDirectory(prefix="cocalib-") as folder:
            path = Path(folder) / "view.rrd"
            with self._view() as view, progress_bar("writing frames") as progress:
                write_view(view, path, progress=progress)
            return open_window(path)

    def _write_rrd(self, out: Path) -> int:
        from cocalib.rerun import require_sdk, write_view

        require_sdk()
        with self._view() as view, progress_bar("writing frames") as progress:
            written = write_view(view, out, progress=progress)
        print(f"{out}: {written.frames} frames, {written.scans} scans, {len(view.pairs)} clicks")
        for note in written.skipped.notes():
            print(note)
        print(f"open it with: rerun {out}")
        return 0

    def _write_frames(self, out: Path) -> int:
        if Show(out=out, recorded=self.recorded, output=self.output) != self:
            raise InputError("--calibration FILE is missing: the calibration that the returns are projected with")
        from calib_core.recordings import video_format, write_video
        from calib_core.words.warnings import warning_remark
        from cocalib.session.applying import seconds

        video_format(out)
        with (
            self.recorded.open(require=("image",)) as recording,
            whole_path(out) as part,
            progress_bar("writing frames") as progress,
        ):
            written = write_video(recording, part, progress=progress)
        print(f"{out}: {written.frames} frames, {written.duration_s:.3f} s, from {seconds(written.start)}")
        for warning in recording.warnings:
            if warning.code in ("picture-sizes", "unreadable-pictures"):
                print(warning_remark(warning).message)
        for note in written.skipped.notes():
            print(note)
        return 0

    def _write_overlay(self, out: Path) -> int:
        from calib_core.input_files import name_text
        from calib_core.recordings import video_format
        from cocalib.overlay_video import OverlayOptions, write_overlay

        if not 0 <= self.trail <= _MOST_TRAIL_SCANS:
            raise InputError(f"--trail {self.trail}: give a number of scans from 0 to {_MOST_TRAIL_SCANS}")
        video_format(out)
        titles = tuple(name_text(path.name) for path in (self.calibration, self.against) if path is not None)
        with self._view() as view, progress_bar("drawing frames") as progress:
            written = write_overlay(view, out, OverlayOptions(titles, self.trail), progress=progress)
        video, (width, height) = written.video, written.size_px
        print(
            f"{out}: {video.frames} frames, {video.duration_s:.3f} s, {width} x {height} px, encoded as {written.codec}"
        )
        for note in video.skipped.notes():
            print(note)
        return 0

    @contextmanager
    def _view(self) -> "Iterator[RecordedView]":
        """Open the recording and read everything that is to be drawn over it.

        Raises:
            InputError: a file cannot be read, or is not of this recording.
            RecordingError: the recording cannot be opened.
        """
        from calib_core.interchange.importing import read_any_file
        from calib_core.interchange.own.clicks_json import read_clicks
        from cocalib.evaluation.boxes import find_boxes
        from cocalib.evaluation.recording_check import calibration_of
        from cocalib.recorded_view import recorded_view
        from cocalib.solving.solving import camera_for

        if not self.recorded.recording:
            raise InputError("RECORDING is missing; name one or more files or folders")
        if self.calibration is None:
            raise InputError("--calibration FILE is missing: the calibration that the returns are projected with")
        camera_file = self.camera.read()
        with self.recorded.open() as recording:
            camera = camera_for(recording, camera_file)
            calibration = calibration_of(read_any_file(self.calibration), str(self.calibration), camera)
            against = None
            if self.against is not None:
                against = calibration_of(read_any_file(self.against), str(self.against), camera)
            clicks = () if self.clicks is None else read_clicks(read_text(self.clicks), source=str(self.clicks))
            if clicks:
                clicks = told_clicks_at_frames(clicks, recording, source=str(self.clicks))
            boxes = None
            if self.boxes is not None:
                with progress_bar("reading boxes") as progress:
                    boxes = find_boxes(self.boxes, recording, progress=progress)
            with progress_bar("evaluating") as progress:
                view = recorded_view(
                    recording, calibration, self.colour, clicks=clicks, boxes=boxes, against=against, progress=progress
                )
            yield view
