"""Flags of what a recording is searched for: clicks, boxes, and how moving targets are found."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import tyro

from calib_core.errors import InputError, NoAnswerError
from calib_core.input_files import read_text
from cocalib.cli.flags import INPUT, MORE, File, called
from cocalib.cli.output import progress_bar, told_clicks_at_frames
from cocalib.cli.recording_flags import Recorded, RecordedFlags, TopicFlags
from cocalib.cli.tree_flags import FrameFlags, Frames
from cocalib.platform.files import keep

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.interchange.format import ImportedCalibration
    from calib_core.measurements import Boxes, ReflectorClick, ReturnLabels
    from calib_core.recordings import Recording
    from cocalib.evaluation.evaluating import EvidenceOptions


@dataclass(frozen=True, slots=True)
class EvidenceFlags:
    """What speaks for or against a calibration in a recording."""

    clicks: File = None
    """Clicks in this recording (cocalib/clicks-1 JSON); by default those of its session, or those kept in the calibration."""
    boxes: Annotated[str | None, called("FILE_OR_TOPIC"), INPUT] = None
    """Boxes around moving objects, from a file or a topic of the recording: returns in them give Acc."""
    labels: File = None
    """With --boxes: the true origin of each return (cocalib/labels-1 JSON of a simulation), which then decides."""
    classes: Annotated[str | None, called("NAME,...")] = None
    """Count only targets whose boxes are of these classes, such as person,car."""
    class_map: Annotated[tuple[str, ...], called("FROM=TO"), tyro.conf.UseAppendAction, MORE] = ()
    """Rename a class of the boxes, such as pedestrian=person; may be given several times."""
    max_time_gap_s: Annotated[float | None, called("SECONDS"), MORE] = None
    """Longest time between an annotated frame and its scan; by default half the period of the scans."""
    min_speed_mps: Annotated[float, tyro.conf.arg(metavar="SPEED"), MORE] = 0.3
    """Least Doppler speed over ground of a moving target's return [m/s]."""
    sensors: Annotated[Literal["auto", "still", "moving"], MORE] = "auto"
    """Whether the sensors stood still or moved; auto finds out from the returns' Doppler speeds."""

    def options(self) -> "EvidenceOptions":
        """Return the options of the search.

        Raises:
            InputError: one is out of range.
        """
        from calib_core.evaluation.moving_returns import TargetOptions
        from cocalib.evaluation.evaluating import EvidenceOptions

        if not 0.0 < self.min_speed_mps <= 100.0:
            raise InputError(f"--min-speed-mps: is {self.min_speed_mps:g}; give a speed from 0.01 to 100 m/s")
        if self.max_time_gap_s is not None and not 0.0 <= self.max_time_gap_s <= 60.0:
            raise InputError(f"--max-time-gap-s: is {self.max_time_gap_s:g}; give 0 to 60 s")
        names = tuple(name.strip() for name in (self.classes or "").split(",") if name.strip())
        targets = TargetOptions(min_speed_mps=self.min_speed_mps, sensors=self.sensors)
        return EvidenceOptions(classes=names, max_gap_s=self.max_time_gap_s, targets=targets)

    def found_in(
        self, recording: "Recording", paths: Sequence[Path], calibrations: "Sequence[ImportedCalibration]", judged: str
    ) -> "tuple[tuple[ReflectorClick, ...], Boxes | None, ReturnLabels | None]":
        """Return the clicks, boxes and labels to judge calibrations by.

        Args:
            recording: that they are in.
            paths: of it.
            calibrations: that are judged.
            judged: what they are called.

        Raises:
            InputError: they cannot be read.
            NoAnswerError: there are neither clicks nor boxes.
        """
        clicks = self.clicks_in(recording, paths, calibrations)
        boxes, labels = self.boxes_in(recording)
        if not clicks and boxes is None:
            raise NoAnswerError(
                f"{paths[0]}: no clicks or boxes to evaluate {judged} against: give clicks (--clicks CLICKS.json; click "
                "reflectors with cocalib open RECORDING --calibration FILE) or boxes (--boxes FILE_OR_TOPIC)"
            )
        return clicks, boxes, labels

    def boxes_in(self, recording: "Recording") -> "tuple[Boxes | None, ReturnLabels | None]":
        """Return the boxes and labels that were asked for.

        Raises:
            InputError: they cannot be read, no class matches, or options of boxes are given without any.
        """
        if self.boxes is None:
            for name, given in (
                ("--labels", self.labels),
                ("--classes", self.classes),
                ("--class-map", self.class_map),
            ):
                if given:
                    raise InputError(f"{name} applies to boxes; give them with --boxes FILE_OR_TOPIC")
            return None, None
        from calib_core.evaluation.counted_returns import renamed_classes
        from cocalib.evaluation.boxes import find_boxes, find_labels

        with progress_bar("reading boxes") as progress:
            boxes = find_boxes(self.boxes, recording, progress=progress)
        if self.class_map:
            boxes = renamed_classes(boxes, dict(map(_renaming, self.class_map)))
        return boxes, None if self.labels is None else find_labels(self.labels)

    def clicks_in(
        self, recording: "Recording", paths: Sequence[Path], calibrations: "Sequence[ImportedCalibration]"
    ) -> "tuple[ReflectorClick, ...]":
        """Return the clicks: of the file given, else of the recording's session, else those kept in a calibration.

        Args:
            recording: that they are in.
            paths: of it.
            calibrations: that are judged; the first that keeps clicks within the recording gives them.

        Raises:
            InputError: they cannot be read.
        """
        from calib_core.interchange.own.clicks_json import read_clicks
        from cocalib.evaluation.recording_check import clicks_in
        from cocalib.session.file.contents import inspect_session
        from cocalib.session.file.finding import recording_session_folder

        if self.clicks is not None:
            clicks = read_clicks(read_text(self.clicks), source=str(self.clicks))
            return told_clicks_at_frames(clicks, recording, source=str(self.clicks))
        folder = recording_session_folder(paths)
        if folder.is_dir():
            keep((folder,))
            return tuple(inspect_session(folder).clicks)
        times = recording.image_times if len(recording.image_times) else recording.radar_times
        if not len(times):
            return ()
        kept = (clicks_in(imported, int(times[0]), int(times[-1])) for imported in calibrations)
        return next((clicks for clicks in kept if clicks), ())


def _renaming(text: str) -> tuple[str, str]:
    """Return the two classes of FROM=TO.

    Raises:
        InputError: it is not of this form.
    """
    old, equals, new = (part.strip() for part in text.partition("="))
    if not (old and equals and new):
        raise InputError(f"--class-map {text}: expected FROM=TO, such as pedestrian=person")
    return old, new


@dataclass(frozen=True, slots=True)
class JudgingFlags:
    """What calibrations are judged on, and how they are read."""

    evidence: Annotated[EvidenceFlags, tyro.conf.arg(name="")] = field(default_factory=EvidenceFlags)
    camera: File = None
    """Intrinsics to use if a calibration has none: camera_info YAML, OpenCV YAML/XML, Kalibr, JSON."""
    recorded: Recorded = field(default_factory=RecordedFlags)
    frames: Frames = field(default_factory=FrameFlags)

    @property
    def recording(self) -> tuple[Path, ...]:
        """The files of the recording; none if there is none."""
        return self.recorded.recording

    @property
    def of_recording(self) -> bool:
        """Whether options are given that say nothing without a recording."""
        return self.evidence != EvidenceFlags() or self.recorded.topics != TopicFlags()

    def read_camera(self) -> "Camera | None":
        """Read the intrinsics, if any are given.

        Raises:
            InputError: they cannot be read.
        """
        from calib_core.interchange.cameras.files import read_camera_file

        return None if self.camera is None else read_camera_file(self.camera)


Judging: TypeAlias = Annotated[JudgingFlags, tyro.conf.arg(name="")]
