"""`cocalib evaluate`: judge a calibration on a recording, and write a report on it."""

import re
import sys
import typing
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from calib_core.words.outcomes import said_of
from cocalib.cli.exit_codes import DONE, IN_DOUBT, NO_ANSWER, Required, exit_code
from cocalib.cli.flags import OUTPUT, Output, OutputFlags, Switch, called
from cocalib.cli.judging_flags import Judging, JudgingFlags
from cocalib.cli.output import progress_bar, tell_choices
from cocalib.platform.files import write_whole
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.evaluation.figures import Evaluation
    from calib_core.interchange.format import ImportedCalibration
    from calib_core.measurements import Boxes, ReflectorClick, ReturnLabels
    from calib_core.recordings import Recording
    from calib_core.results import Calibration
    from cocalib.evaluation.evaluating import EvidenceOptions
    from cocalib.report.subject import ReportSubject

_LEVELS = typing.get_args(Required)
_HTML, _PDF = (".html", ".htm"), (".pdf",)


@dataclass(frozen=True, slots=True)
class Evaluate:
    """Evaluate a calibration on a recording: mean reprojection error (AED), share of returns in boxes (Acc); or a report.

    A report needs no recording: it states the accuracy of the calibration, where in the image, and the evidence.
    """

    calibration: Annotated[Path | None, tyro.conf.Positional, called("CALIBRATION")] = None
    """A calibration in any format that import reads."""
    report: Annotated[tuple[Path, ...], called("FILE"), OUTPUT, tyro.conf.UseAppendAction] = ()
    """Write a report, .html, or .pdf (printed by Chrome, Chromium, Edge or Brave); may be repeated."""
    require: Annotated[tuple[str, ...], called("LIMIT...")] = ()
    """Exit code 3 for a verdict below good or usable, or a stated 95 % error above max-deg=1 max-cm=10 max-px=15."""
    no_held_out: Switch = False
    """Skip the leave-one-out figures, which take a solve per placement."""
    json: Switch = False
    """Print one JSON object instead of text."""
    judging: Judging = field(default_factory=JudgingFlags)
    output: Output = field(default_factory=OutputFlags)

    def run(self) -> int:
        """Print the figures, write the reports; return the exit code."""
        self = self._with_places()
        if self.calibration is None:
            raise InputError("CALIBRATION is missing; see cocalib evaluate --help")
        if not self.judging.recording and self.judging.of_recording:
            raise InputError(
                "clicks, boxes, and the options of a recording apply with a RECORDING only; give it after the calibration"
            )
        if self.report:
            return self._report()
        if not self.judging.recording:
            raise InputError("evaluate needs a recording, or --report FILE.html; see cocalib evaluate --help")
        return self._print_report(*self._evaluation(self.calibration))

    def _with_places(self) -> "Evaluate":
        """Take what follows --require and is no limit as files of the recording."""
        if alone := next((one for one in self.require if re.match(r"max[-_]\w+$|[\d.]+\w*$", one)), None):
            raise InputError(f"--require {alone}: give a limit with its number, such as max-deg=1")
        limits = tuple(one for one in self.require if one in _LEVELS or "=" in one)
        places = tuple(Path(one) for one in self.require if one not in limits)
        recorded = replace(self.judging.recorded, recording=(*self.judging.recorded.recording, *places))
        return replace(self, require=limits, judging=replace(self.judging, recorded=recorded))

    def _limits(self) -> tuple[str, ...]:
        """Return the limits on the stated error."""
        return tuple(one for one in self.require if one not in _LEVELS)

    def _print_report(
        self, imported: "ImportedCalibration", calibration: "Calibration | None", evaluation: "Evaluation | None"
    ) -> int:
        """Print the figures and what is required; return the exit code."""
        from calib_core.evaluation.evaluation_json import evaluation_json
        from calib_core.evaluation.sentences import evaluation_lines
        from cocalib.evaluation.evaluating import evaluation_exit_code
        from cocalib.report.sections.acceptance import limits_met

        assert self.calibration is not None
        limits = limits_met(self._limits(), calibration)
        file = imported.file
        verdict, warnings = (None, ()) if file is None else (file.verdict, file.calibration.warnings)
        level = next((level for level in reversed(_LEVELS) if level in self.require), None)
        code = NO_ANSWER if self.judging.recording and evaluation is None else DONE
        code = code if evaluation is None else evaluation_exit_code(evaluation)
        code = code or exit_code(verdict.level if verdict else None, imported.evidence, level, warnings)
        code = code or (DONE if all(limit.met for limit in limits) else IN_DOUBT)
        if evaluation is not None and self.json:
            names = [path.name for path in self.judging.recording]
            print_exactly(
                evaluation_json(evaluation, calibration=self.calibration.name, recording=names, exit_code=code)
            )
            stated = [] if verdict is None else [f"stored verdict: {verdict.line}"]
            for line in [*stated, *(f"warning: {said_of(warning)}" for warning in evaluation.warnings)]:
                print(line, file=sys.stderr)
            return code
        if evaluation is not None:
            print("\n".join(evaluation_lines(evaluation)))
            if verdict is not None:
                print(f"stored verdict: {verdict.line}")
        for one in limits:
            print(f"{one.name}={one.limit:g}: {'pass' if one.met else 'FAIL'}, stated {one.stated:g}")
        return code

    def _evaluation(self, path: Path) -> "tuple[ImportedCalibration, Calibration, Evaluation]":
        from cocalib.evaluation.recording_check import judged_calibration
        from cocalib.solving.solving import camera_turned_warnings

        options = self.judging.evidence.options()
        camera = self.judging.read_camera()
        with self.judging.recorded.open(require=("radar",)) as recording:
            judged = judged_calibration(self.judging.frames.read([path])[0], path, recording, camera=camera)
            clicks, boxes, labels = self.judging.evidence.found_in(
                recording, self.judging.recording, [judged.found], path.name
            )
            evaluation = self._evaluate(judged.calibration, recording, clicks, boxes, labels, options)
            tell_choices(recording)
            turned = camera_turned_warnings(recording, clicks, judged.calibration.camera, options.solving)
            found = replace(evaluation, warnings=(*judged.warnings, *evaluation.warnings, *turned))
            return judged.found, judged.calibration, found

    def _evaluate(
        self,
        calibration: "Calibration",
        recording: "Recording",
        clicks: "Sequence[ReflectorClick]",
        boxes: "Boxes | None",
        labels: "ReturnLabels | None",
        options: "EvidenceOptions",
    ) -> "Evaluation":
        """Judge a calibration by clicks and boxes, and show how far it is."""
        from cocalib.evaluation.evaluating import evidence_in, judged

        camera = calibration.camera
        with progress_bar("evaluating") as progress:
            evidence = evidence_in(
                recording, camera, clicks=clicks, boxes=boxes, labels=labels, progress=progress, options=options
            )
            return judged(calibration, evidence, held_out=not self.no_held_out, progress=progress)

    def _report(self) -> int:
        """Write the report; return the exit code."""
        from cocalib.report.page import report_html
        from cocalib.report.printing import print_pdf
        from cocalib.report.sections.acceptance import limits_met

        for path in self.report:
            if path.suffix.lower() not in (*_HTML, *_PDF):  # such as that of the calibration itself
                raise InputError(f"{path}: the report is an .html or .pdf file; name it NAME.html")
        subject = self._subject()
        limits_met(subject.required, subject.calibration)  # refuses what is no limit, before anything is written
        html = report_html(subject)
        for path in sorted(self.report, key=lambda path: path.suffix.lower() in _PDF):
            write_whole(path, print_pdf(html) if path.suffix.lower() in _PDF else html)
            print(f"written to {path}", file=sys.stderr if self.json else sys.stdout)
        evaluation = None if subject.judged is None else subject.judged.evaluation
        return self._print_report(subject.found, subject.calibration, evaluation)

    def _subject(self) -> "ReportSubject":
        from cocalib.report.making import known_calibration, subject_of

        assert self.calibration is not None
        name = self.calibration.name
        found, inputs = self.judging.frames.read([self.calibration])
        camera = self.judging.read_camera()
        if self.judging.recording:
            subject = self._on_recording(found, camera)
        else:
            subject = subject_of(found, known_calibration(found, name, camera=camera), name)
        return replace(subject, inputs=inputs, required=self._limits())

    def _on_recording(self, imported: "ImportedCalibration", camera: "Camera | None") -> "ReportSubject":
        """Return what is reported, with what the recording says of it by clicks and boxes, if there are any."""
        from cocalib.evaluation.recording_check import other_camera, require_size
        from cocalib.report.making import known_calibration, subject_of, watched
        from cocalib.report.subject import RecordingEvidence

        assert self.calibration is not None
        name = self.calibration.name
        options = self.judging.evidence.options()
        with self.judging.recorded.open(require=("radar",)) as recording:
            recorded = recording.camera()
            calibration = known_calibration(imported, name, camera=camera or recorded)
            if calibration is not None:
                require_size(calibration.camera, recording, self.calibration)
            with progress_bar("hashing") as progress:
                hashes = recording.fingerprint(progress)
            seen = watched(recording, calibration, hashes, other_camera(imported, recorded))
            subject = replace(subject_of(imported, calibration, name), recording=seen)
            if calibration is None:
                return subject
            clicks = self.judging.evidence.clicks_in(recording, self.judging.recording, [imported])
            boxes, labels = self.judging.evidence.boxes_in(recording)
            if not clicks and boxes is None:
                return subject
            evaluation = self._evaluate(calibration, recording, clicks, boxes, labels, options)
            return replace(subject, judged=RecordingEvidence(evaluation, clicks))
