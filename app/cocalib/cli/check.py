"""`cocalib check`: check calibration files, compare them, and hold them against a recording."""

import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import CalibrationError, InputError
from cocalib.cli.flags import MORE, File, OutFile, Output, OutputFlags, Switch, called
from cocalib.cli.judging_flags import EvidenceFlags
from cocalib.cli.output import progress_bar
from cocalib.cli.recording_flags import TopicFlags, Topics
from cocalib.cli.tree_flags import FrameFlags, Frames
from cocalib.platform.files import write_whole
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.interchange.check.pair_residuals import CheckPairs
    from calib_core.interchange.check.report import CheckedFile, CheckReport
    from calib_core.interchange.format import ImportedCalibration
    from cocalib.evaluation.comparing import ComparedOnRecording


@dataclass(frozen=True, slots=True)
class Check:
    """Check calibration files for errors, or compare them."""

    calibration: Annotated[tuple[Path, ...], tyro.conf.Positional, called("CALIBRATION...")] = ()
    """Calibrations in any format that export writes; of several, each gets one line."""
    of: File = None
    """Verify that the file was exported from that calibration: same pose up to the digits written, same lens and frames."""
    against: File = None
    """Does it agree with this other calibration? Judged by the covariances, or by the limits below."""
    max_deg: Annotated[float | None, called("DEG")] = None
    """Accept rotations up to this angle apart."""
    max_cm: Annotated[float | None, called("CM")] = None
    """Accept camera positions up to this distance apart."""
    max_px: Annotated[float | None, called("PX")] = None
    """Accept points up to this far apart in the image: rms at each of 5, 20 and 60 m, and by the lens alone."""
    max_sigma: Annotated[float | None, called("SIGMA")] = None
    """Accept differences up to this many standard deviations (p = 5 % is 1.96)."""
    same_sensors: Switch = False
    """With --against: radar and camera are the same, although serials, topics or intrinsics are not."""
    same_person: Switch = False
    """With --against: the same person clicked the same reflector in both, so their common errors cancel."""
    camera: File = None
    """Intrinsics to use if the file has none: camera_info YAML, OpenCV YAML/XML, Kalibr, JSON."""
    pairs: File = None
    """Pairs to test it with: a pairs-1 file, or a calibration-1 file with pairs."""
    recording: Annotated[tuple[Path, ...], called("RECORDING...")] = ()
    """Does it still hold on this recording, by its clicks; with --against, which of the two is better there?"""
    json: Switch = False
    """Print one JSON object instead of text."""
    junit: OutFile = None
    """Also write the results as JUnit XML: one test case per question, the same whatever the answers."""
    evidence: Annotated[EvidenceFlags, tyro.conf.arg(name=""), MORE] = field(default_factory=EvidenceFlags)
    topics: Topics = field(default_factory=TopicFlags)
    frames: Frames = field(default_factory=FrameFlags)
    output: Output = field(default_factory=OutputFlags)

    def run(self) -> int:
        """Print the results; return the exit code."""
        from calib_core.interchange.check.report import check_json, check_junit, exit_code
        from cocalib.evaluation.comparing import comparison_document, comparison_lines

        self._require_fitting()
        evidence = self._evidence()
        compared = None
        if self.recording and evidence.against is not None:
            compared, lens = self._compare_on_recording(evidence)
            evidence = replace(evidence, camera=evidence.camera or lens)
        checked = [self._checked(path, evidence) for path in self.calibration]
        if self.junit is not None:
            write_whole(self.junit, check_junit(checked))
        if self.json:
            print_exactly(check_json(checked, None if compared is None else comparison_document(compared)))
        else:
            if compared is not None:
                print("\n".join(comparison_lines(compared)))
            _tell(checked)
        return exit_code(checked)

    def _require_fitting(self) -> None:
        """Refuse options that say nothing without another one.

        Raises:
            InputError: one is given alone, or no file is.
        """
        if not self.calibration:
            raise InputError("CALIBRATION is missing; see cocalib check --help")
        if self.against and {self.against.resolve()} == {one.resolve() for one in self.calibration}:
            raise InputError(
                f"--against {self.against}: is the checked file itself, which proves nothing; give another"
            )
        limited = any(limit is not None for limit in (self.max_deg, self.max_cm, self.max_px, self.max_sigma))
        if limited and self.against is None:
            raise InputError("--max-deg, --max-cm, --max-px and --max-sigma are limits for --against FILE; give it too")
        if (self.same_sensors or self.same_person) and self.against is None:
            raise InputError("--same-sensors and --same-person are about --against FILE; give it too")
        if self.evidence != EvidenceFlags() and not self.recording:
            raise InputError("--clicks and --boxes are those of a recording; give it with --recording RECORDING")
        if self.recording and self.against is not None and len(self.calibration) != 1:
            raise InputError("--recording judges two calibrations: one CALIBRATION, and the one of --against")
        if self.topics != TopicFlags() and not self.recording:
            raise InputError(
                "the options of a recording apply with --recording RECORDING only; see cocalib check --help"
            )

    def _evidence(self) -> "_Evidence":
        """Read what all files are checked with, once."""
        from calib_core.interchange.cameras.files import read_camera_file
        from calib_core.interchange.check.pair_residuals import read_check_pairs_file
        from calib_core.interchange.importing import read_any_file

        return _Evidence(
            of=read_any_file(self.of) if self.of else None,
            against=read_any_file(self.against) if self.against else None,
            camera=read_camera_file(self.camera) if self.camera else None,
            pairs=read_check_pairs_file(self.pairs) if self.pairs else None,
        )

    def _checked(self, path: Path, evidence: "_Evidence") -> "CheckedFile":
        """Check one file; if it cannot be read, say so instead."""
        from calib_core.interchange.check.agreement import AgreementLimits
        from calib_core.interchange.check.report import CheckedFile, check

        try:
            report = check(
                self._read(path, evidence),
                of=evidence.of,
                against=evidence.against,
                limits=AgreementLimits(self.max_deg, self.max_cm, self.max_px, self.max_sigma),
                camera=evidence.camera,
                pairs=evidence.pairs,
                same_sensors=self.same_sensors,
                same_person=self.same_person,
            )
            if self.recording and evidence.against is None:
                report = self._on_recording(report, path, evidence.camera)
            return CheckedFile(str(path), report)
        except CalibrationError as error:
            return CheckedFile(str(path), unreadable=str(error))

    def _read(self, path: Path, evidence: "_Evidence") -> "ImportedCalibration":
        """Read one file; numbers that do not say what they mean are taken as `cocalib import` takes them."""
        from calib_core.interchange.hypotheses.reading import clear_meaning

        files = self.frames.files([path])
        if files is not None and len(files) == 1:
            known = evidence.against or evidence.of
            clear = clear_meaning(files[0].data, files[0].source, pairs=evidence.pairs, against=known)
            if clear is not None:
                return clear
        return self.frames.read([path], files)[0]

    def _on_recording(self, report: "CheckReport", path: Path, camera: "Camera | None") -> "CheckReport":
        from cocalib.evaluation.recording_check import other_camera, stale_inputs, with_recording

        with self.topics.open(self.recording) as recording:
            clicks = self.evidence.clicks_in(recording, self.recording, [report.imported])
            if not clicks:
                raise InputError(
                    f"{self.recording[0]}: no clicks in this recording: the calibration keeps none within it, and it has no "
                    "session; click reflectors with cocalib open RECORDING --calibration FILE, or give --clicks CLICKS.json"
                )
            stale = stale_inputs(report.imported, recording.fingerprint())
            lens = other_camera(report.imported, recording.camera())
            known = replace(report, results=(*report.results, *stale, *lens))
            return with_recording(known, str(path), recording, clicks, camera=camera or recording.camera())

    def _compare_on_recording(self, evidence: "_Evidence") -> "tuple[ComparedOnRecording, Camera]":
        """Judge both calibrations by the same clicks and boxes of the recording, that of --against as A; also return its lens."""
        from cocalib.evaluation.comparing import compare_on_recording
        from cocalib.evaluation.recording_check import judged_calibration

        assert self.against is not None
        paths = (self.against, self.calibration[0])
        options = self.evidence.options()
        with self.topics.open(self.recording, ("radar",)) as recording:
            a, b = (
                judged_calibration(self.frames.read([path])[0], path, recording, camera=evidence.camera)
                for path in paths
            )
            clicks, boxes, labels = self.evidence.found_in(recording, self.recording, [a.found, b.found], "the two")
            with progress_bar("comparing") as progress:
                compared = compare_on_recording(
                    (a.calibration, b.calibration),
                    recording,
                    names=(paths[0].name, paths[1].name),
                    clicks=clicks,
                    boxes=boxes,
                    labels=labels,
                    progress=progress,
                    options=options,
                )
            return compared, a.calibration.camera


@dataclass(frozen=True, slots=True)
class _Evidence:
    """What files are checked with, besides what they say themselves."""

    of: "ImportedCalibration | None"
    against: "ImportedCalibration | None"
    camera: "Camera | None"
    pairs: "CheckPairs | None"


def _tell(checked: "list[CheckedFile]") -> None:
    """Print the report of one file, or one line for each of several."""
    if len(checked) == 1 and checked[0].report is not None:
        print("\n".join(checked[0].report.lines()))
        return
    for file in checked:
        if file.report is None:
            print(f"cocalib: {' '.join(file.unreadable.split())}", file=sys.stderr)
        else:
            print(file.line)
