"""`cocalib report`: one HTML file that says how good a calibration is, where, and how one knows."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.flags import File, called
from app.cli.output import progress_bar, read_text, told_clicks_at_frames, write_whole
from app.cli.recording_flags import TopicFlags, Topics
from app.cli.tree_flags import FrameFlags, Frames
from calib_core.errors import InputError

if TYPE_CHECKING:
    from app.report import Against, Judged, ReportSubject
    from calib_core.camera import Camera
    from calib_core.interchange import ImportedCalibration
    from calib_core.measurements import ReflectorClick
    from calib_core.recordings import Recording
    from calib_core.results import Calibration, InputFile

__all__ = ["Report"]


@dataclass(frozen=True, slots=True)
class Report:
    """Write a report on a calibration: one HTML file, and a PDF if wanted: how good, where, and how one knows."""

    files: Annotated[tuple[Path, ...], tyro.conf.Positional, called("CALIBRATION [RECORDING...]")] = ()
    """A calibration in any format that export writes; then, if there is one, a recording to judge it on."""
    out: File = None
    """Output file (.html)."""
    pdf: Annotated[Path | None, called("FILE.pdf")] = None
    """Also print it to this PDF, with Chrome, Chromium, Edge or Brave."""
    clicks: File = None
    """Clicks in the recording (cocalib/clicks-1 JSON); without them, those that the calibration keeps, if they are of it."""
    boxes: Annotated[str | None, called("FILE_OR_TOPIC")] = None
    """Boxes around people or cars in the recording's frames: adds Acc, the returns in boxes."""
    against: File = None
    """Another calibration of the same sensors to compare with."""
    camera: File = None
    """Intrinsics, if the calibration has none: camera_info YAML, OpenCV YAML/XML, Kalibr, JSON."""
    topics: Topics = field(default_factory=TopicFlags)
    frames: Frames = field(default_factory=FrameFlags)

    def run(self) -> int:
        """Write the report; return the exit code."""
        from app.report import print_pdf, report_html

        out = self._required_out()
        html = report_html(self._subject())
        printed = None if self.pdf is None else print_pdf(html)
        write_whole(out, html)
        print(f"written to {out}")
        if self.pdf is not None and printed is not None:
            write_whole(self.pdf, printed)
            print(f"printed to {self.pdf}")
        return 0

    def _required_out(self) -> Path:
        """Refuse what cannot be done.

        Raises:
            InputError: a file is missing, or an option says nothing without another one.
        """
        if not self.files:
            raise InputError("CALIBRATION is missing; see cocalib report --help")
        if self.out is None:
            raise InputError("report writes a file: give its name with --out FILE.html")
        given = (("--clicks", self.clicks), ("--boxes", self.boxes))
        for name, value in given:
            if value is not None and len(self.files) == 1:
                raise InputError(f"{name} are those of a recording; give it after the calibration")
        if self.topics != TopicFlags() and len(self.files) == 1:
            raise InputError("the options of a recording apply with a RECORDING only; see cocalib report --help")
        return self.out

    def _subject(self) -> "ReportSubject":
        from app.report import calibration_of, subject_of

        path, *recording = self.files
        read = self.frames.read([path])
        if recording:
            return self._on_recording(recording, read)
        found, inputs = read
        camera = self._camera()
        calibration = calibration_of(found, path.name, camera=camera)
        against = self._against(found, camera)
        return subject_of(path.name, inputs, found, calibration=calibration, against=against)

    def _on_recording(
        self, paths: list[Path], read: "tuple[ImportedCalibration, tuple[InputFile, ...]]"
    ) -> "ReportSubject":
        """Return the report's subject with what the recording says of the calibration."""
        from app.report import calibration_of, subject_of, watched
        from calib_core.recordings import open_recording

        found, inputs = read
        name = self.files[0].name
        with open_recording(paths, self.topics) as recording:
            camera = self._camera() or (recording.camera() if found.camera is None else None)
            calibration = calibration_of(found, name, camera=camera)
            with progress_bar("hashing") as progress:
                hashes = recording.fingerprint(progress)
            return subject_of(
                name,
                inputs,
                found,
                calibration=calibration,
                recording=watched(recording, calibration, hashes),
                judged=None if calibration is None else self._judged(calibration, found, recording),
                against=self._against(found, camera),
            )

    def _judged(
        self, calibration: "Calibration", found: "ImportedCalibration", recording: "Recording"
    ) -> "Judged | None":
        """Return what clicks and boxes say of the calibration; None without either."""
        from app.boxes import find_boxes
        from app.evaluating import evaluate_recording
        from app.report import Judged

        clicks = self._clicks(found, recording)
        boxes = find_boxes(self.boxes, recording) if self.boxes is not None else None
        if not clicks and boxes is None:
            return None
        with progress_bar("evaluating") as progress:
            evaluation = evaluate_recording(calibration, recording, clicks=clicks, boxes=boxes, progress=progress)
        return Judged(evaluation, clicks)

    def _clicks(self, found: "ImportedCalibration", recording: "Recording") -> "tuple[ReflectorClick, ...]":
        """Return the clicks of the file given, else those in the calibration if they are within the recording."""
        from app.recording_check import clicks_in
        from calib_core.interchange import read_clicks

        if self.clicks is not None:
            clicks = read_clicks(read_text(self.clicks), source=str(self.clicks))
            return told_clicks_at_frames(clicks, recording, source=str(self.clicks))
        return clicks_in(found, int(recording.image_times[0]), int(recording.image_times[-1]))

    def _against(self, found: "ImportedCalibration", camera: "Camera | None") -> "Against | None":
        from app.report import against_of

        if self.against is None:
            return None
        other, inputs = self.frames.read([self.against])
        return against_of(self.against.name, inputs, other, found, camera=camera)

    def _camera(self) -> "Camera | None":
        from calib_core.interchange import read_camera_file

        return read_camera_file(self.camera) if self.camera is not None else None
