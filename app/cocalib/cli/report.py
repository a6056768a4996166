"""`cocalib report`: one HTML file that says how good a calibration is, where, and how one knows."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from cocalib.cli.exit_codes import DONE, IN_DOUBT
from cocalib.cli.flags import File, Switch, called
from cocalib.cli.judging_flags import Judging, JudgingFlags
from cocalib.cli.output import progress_bar, write_whole

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.interchange import ImportedCalibration
    from calib_core.recordings import Recording
    from calib_core.results import Calibration
    from cocalib.report import ReportSubject


@dataclass(frozen=True, slots=True)
class Report:
    """Write a report on a calibration: one HTML file, and a PDF if wanted: how good, where, and how one knows."""

    calibration: Annotated[Path | None, tyro.conf.Positional, called("CALIBRATION")] = None
    """A calibration in any format that import reads."""
    out: File = None
    """Output file (.html)."""
    pdf: Switch = False
    """Also print it to a PDF beside the HTML, with the same name, by Chrome, Chromium, Edge or Brave."""
    against: File = None
    """Compare it with this other calibration of the same sensors."""
    require: Annotated[tuple[str, ...], called("NAME=LIMIT...")] = ()
    """Your limits on the stated 95 % error, such as max-deg=1 max-cm=10 max-px=15: pass or fail, with exit code 3."""
    judging: Judging = field(default_factory=JudgingFlags)

    def run(self) -> int:
        """Write the report; return the exit code."""
        from cocalib.report import limits_met, print_pdf, report_html

        out = self._required_out()
        subject = replace(self._subject(), required=self.require)
        limits = limits_met(self.require, subject.calibration)
        html = report_html(subject)
        write_whole(out, html)
        print(f"written to {out}")
        if self.pdf:
            printed = out.with_suffix(".pdf")
            write_whole(printed, print_pdf(html))
            print(f"printed to {printed}")
        for one in limits:
            print(f"{one.name}={one.limit:g}: {'pass' if one.met else 'FAIL'}, stated {one.stated:g}")
        return DONE if all(one.met for one in limits) else IN_DOUBT

    def _required_out(self) -> Path:
        """Return the output file.

        Raises:
            InputError: a file is missing or has another suffix, or an option says nothing without another one.
        """
        if self.calibration is None:
            raise InputError("CALIBRATION is missing; see cocalib report --help")
        if self.out is None:
            raise InputError("report writes a file: give its name with --out FILE.html")
        if self.out.suffix.lower() not in (".html", ".htm"):  # such as that of the calibration itself
            raise InputError(f"{self.out}: the report is an .html file; name it NAME.html")
        if not self.judging.recording and self.judging.of_recording:
            raise InputError(
                "clicks, boxes, and the options of a recording apply with a RECORDING only; give it after the calibration"
            )
        return self.out

    def _subject(self) -> "ReportSubject":
        from cocalib.report import against_of, known_calibration, subject_of

        assert self.calibration is not None
        name = self.calibration.name
        found, inputs = self.judging.frames.read([self.calibration])
        camera = self.judging.read_camera()
        other, others = self.judging.frames.read([self.against]) if self.against is not None else (None, ())
        if self.judging.recording:
            subject, better = self._on_recording(found, other, camera)
        else:
            subject, better = subject_of(found, known_calibration(found, name, camera=camera), name), ()
        subject = replace(subject, inputs=inputs)
        if other is None or self.against is None:
            return subject
        lens = subject.calibration.camera if subject.calibration is not None else camera
        return replace(subject, against=against_of(self.against.name, others, other, found, camera=lens, judged=better))

    def _on_recording(
        self, found: "ImportedCalibration", other: "ImportedCalibration | None", camera: "Camera | None"
    ) -> "tuple[ReportSubject, tuple[str, ...]]":
        """Return what is reported with what the recording says of it, and which of two calibrations is better on it."""
        from cocalib.evaluation.recording_check import other_camera, require_size
        from cocalib.report import known_calibration, subject_of, watched

        assert self.calibration is not None
        name = self.calibration.name
        with self.judging.recorded.open(require=("radar",)) as recording:
            recorded = recording.camera()
            calibration = known_calibration(found, name, camera=camera or recorded)
            if calibration is not None:
                require_size(calibration.camera, recording, self.calibration)
            with progress_bar("hashing") as progress:
                hashes = recording.fingerprint(progress)
            seen = watched(recording, calibration, hashes, other_camera(found, recorded))
            subject = replace(subject_of(found, calibration, name), recording=seen)
            if calibration is None:
                return subject, ()
            return self._judged(subject, calibration, other, recording)

    def _judged(
        self,
        subject: "ReportSubject",
        calibration: "Calibration",
        other: "ImportedCalibration | None",
        recording: "Recording",
    ) -> "tuple[ReportSubject, tuple[str, ...]]":
        """Judge the calibration by clicks and boxes, if there are any, and compare it with the other one by them."""
        from cocalib.evaluation.comparing import compare_on_recording, comparison_lines
        from cocalib.evaluation.evaluating import evaluate_recording
        from cocalib.report import Judged, known_calibration

        options = self.judging.evidence.options()
        clicks = self.judging.evidence.clicks_in(recording, self.judging.recording, [subject.found])
        boxes, labels = self.judging.evidence.boxes_in(recording)
        if not clicks and boxes is None:
            return subject, ()
        with progress_bar("evaluating") as progress:
            evaluation = evaluate_recording(
                calibration, recording, clicks=clicks, boxes=boxes, labels=labels, progress=progress, options=options
            )
        subject = replace(subject, judged=Judged(evaluation, clicks))
        if other is None or self.against is None:
            return subject, ()
        rival = known_calibration(other, self.against.name, camera=calibration.camera)
        assert rival is not None  # a camera is given
        names = self.against.name, subject.name
        compared = compare_on_recording(
            (rival, calibration), recording, names=names, clicks=clicks, boxes=boxes, labels=labels, options=options
        )
        lines = comparison_lines(compared)
        return subject, tuple(line for line in lines if not line.startswith("warning:"))
