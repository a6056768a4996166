"""`cocalib export`: write a calibration in another tool's format, into a frame tree, or into a recording."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from calib_core.errors import InputError, RecordingError
from calib_core.words.outcomes import said_of
from cocalib.cli.exit_codes import IN_DOUBT
from cocalib.cli.flags import OUTPUT_FOLDER, Output, OutputFlags, Switch, called
from cocalib.cli.output import progress_bar
from cocalib.cli.recording_flags import TopicFlags, Topics
from cocalib.cli.tree_flags import FrameFlags, Frames, TreeFlags, Trees
from cocalib.platform.files import keep, require_room, writable, write_all, write_whole, writing_whole
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from calib_core.deployment import RecordingWritten
    from calib_core.geometry import RigidTransform
    from calib_core.interchange.calibration_file import CalibrationFile
    from calib_core.interchange.exporting import Export as Written
    from calib_core.recordings import Recording

MCAP = "mcap"
_LAYOUT_ENDING = ".foxglove-layout.json"


@dataclass(frozen=True, slots=True)
class Export:
    """Write a calibration in the format of another tool; `--to list` lists the formats."""

    calibration: Annotated[tuple[Path, ...], tyro.conf.Positional, called("CALIBRATION.json")] = ()
    """A calibration written by cocalib (cocalib/calibration-1 JSON)."""
    to: Annotated[str, tyro.conf.arg(metavar="FORMAT")] = "list"
    """Output format, such as tf2; "list" lists them, "all" writes every one that can hold the calibration into a folder."""
    out: Annotated[Path | None, called("FILE"), OUTPUT_FOLDER] = None
    """Output file or folder; without it, text formats go to stdout."""
    parent_from_radar: Annotated[
        tuple[float, float, float, float, float, float, float] | None,
        called("X Y Z QX QY QZ QW"),
    ] = None
    """Pose of the radar in the parent frame of autoware (kit), driveworks (rig) or nuscenes (ego): meters, quaternion, w last."""

    rectified: Switch = False
    """Your images are rectified already, with the same camera matrix; else kitti and nuscenes get maps and a matrix of ours."""
    for_: Annotated[Literal["raw", "corrected"] | None, tyro.conf.arg(name="for", help_behavior_hint="")] = None
    """Pose for radar data as reported (raw), or corrected; without it, raw in formats that serve to project returns."""
    despite_verdict: Switch = False
    """Write a calibration that is contradictory, too; the file says so where it can."""
    trees: Trees = field(default_factory=TreeFlags)
    frames: Frames = field(default_factory=FrameFlags)

    recording: Annotated[tuple[Path, ...], called("RECORDING...")] = ()
    """For `--to mcap`: write this ROS recording again with the calibration in it, so that viewers draw returns on images."""
    topics: Topics = field(default_factory=TopicFlags)
    output: Output = field(default_factory=OutputFlags)

    def run(self) -> int:
        """Write the export; return the exit code."""
        from calib_core.interchange.exporting import parent_pose
        from calib_core.interchange.formats.registry import format_named

        if self.to == MCAP or self.recording or self.topics != TopicFlags():
            return self._export_recording()
        if self.to == "list" and not self.trees.into:
            return self._print_list()
        if self.to not in ("list", "all"):
            format_named(self.to)
        if len(self.calibration) != 1:
            raise InputError("export takes one calibration: cocalib export CALIBRATION.json --to FORMAT [--out FILE]")
        file = _own_calibration(self.calibration[0])
        if self._is_refused(file):
            return IN_DOUBT
        if self.trees.into:
            code = self.trees.patch(file, self.frames, to=self.to, out=self.out, returns=self.for_)
            _print_warnings(file)
            return code
        parent = parent_pose(self.parent_from_radar) if self.parent_from_radar else None
        if self.to == "all":
            return self._write_all(self.frames.renamed(file), parent)
        return self._write_one(file, parent)

    def _print_list(self) -> int:
        from calib_core.interchange.formats.registry import written_formats

        if len(self.calibration) > 1:
            raise InputError(f"export takes one calibration; did you mean --to {self.calibration[1]}?")
        formats = written_formats()
        width = max(len(known.name) for known in formats)
        print("\n".join(f"{known.name:<{width}}  {known.title}" for known in formats))
        print(f"{MCAP:<{width}}  a ROS recording with the calibration in it (--recording), for Foxglove and RViz")
        return 0

    def _write_one(self, file: "CalibrationFile", parent_from_radar: "RigidTransform | None") -> int:
        renamed = self.frames.renamed(file)
        written = self.trees.export(
            renamed, self.to, parent_from_radar=parent_from_radar, rectified=self.rectified, returns=self.for_
        )
        if self.out is not None:
            told = _write_files(self.out, written)
        elif isinstance(written.content, bytes):
            raise InputError(f"{self.to} is a binary format and needs a file: --out {written.file_name}")
        elif written.extra_files:
            beside = ", ".join(extra.file_name for extra in written.extra_files)
            raise InputError(f"{self.to} comes with {beside} and needs a file or folder: --out {written.file_name}")
        _print_warnings(file)
        for note in written.notes:
            print(f"note: {note}", file=sys.stderr)
        if self.out is not None:
            print("\n".join(told))
        else:
            print_exactly(str(written.content))
        return 0

    def _write_all(self, file: "CalibrationFile", parent_from_radar: "RigidTransform | None") -> int:
        """Write every format that can hold the calibration into a folder, and print why the others cannot."""
        from calib_core.interchange.exporting import export_all

        folder = self.out
        if folder is None or (folder.exists() and not folder.is_dir()):
            raise InputError("--to all needs a folder: --out FOLDER")
        written, refused = export_all(
            file, parent_from_radar=parent_from_radar, rectified=self.rectified, returns=self.for_
        )
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{folder}: cannot be made: {error.strerror or error}") from error
        extra = {folder / each.file_name: each.data for made in written.values() for each in made.extra_files}
        write_all({folder / made.file_name: made.data for made in written.values()} | extra)
        for name, made in written.items():
            print(f"{name}: written to {folder / made.file_name}")
        for exported in refused:
            print(f"{exported.name}: not written: {exported.reason}")
        _print_warnings(file)
        for note in dict.fromkeys(note for made in written.values() for note in made.notes):
            names = ", ".join(name for name, made in written.items() if note in made.notes)
            print(f"note: {names}: {note}", file=sys.stderr)
        return 0

    def _is_refused(self, file: "CalibrationFile") -> bool:
        """Say that a contradictory calibration is not written, unless the user wants it."""
        if not file.is_contradictory or self.despite_verdict:
            return False
        _print_warnings(file)
        print("cocalib: nothing is written; --despite-verdict writes it nevertheless", file=sys.stderr)
        return True

    def _export_recording(self) -> int:
        """Write the recording again with the calibration in it; return the exit code."""
        if self.to != MCAP:
            raise InputError(f"--recording and the options of a recording are for --to {MCAP}")
        if self.parent_from_radar is not None or self.rectified:
            raise InputError(f"--parent-from-radar and --rectified do not apply to --to {MCAP}")
        if len(self.calibration) != 1 or not self.recording or self.out is None:
            raise InputError(
                f"export into a recording: cocalib export CALIBRATION.json --to {MCAP} --recording RECORDING... --out NEW.mcap"
            )
        if self.for_ is not None:
            raise InputError(f"--for does not apply to --to {MCAP}: it writes the corrections, too")
        file = _own_calibration(self.calibration[0])
        if self._is_refused(file):
            return IN_DOUBT
        code = _into_recording(file, self.recording, self.out, topics=self.topics)
        _print_warnings(file)
        return code


def _write_files(out: Path, written: "Written") -> list[str]:
    """Write the files of an export; return what to say of them."""
    target = out / written.file_name if out.is_dir() else out
    files = {target: written.data} | {target.parent / extra.file_name: extra.data for extra in written.extra_files}
    write_all(files)
    return [f"written to {path}" for path in files]


def _print_warnings(file: "CalibrationFile") -> None:
    if file.verdict is not None:
        print(f"verdict: {file.verdict.line}", file=sys.stderr)
    if file.rests_on == "imported_assumed":
        print(
            "warning: what this calibration's numbers mean was assumed when it was imported (imported_assumed); "
            "prove it: cocalib import FILE --pairs PAIRS or --against FILE",
            file=sys.stderr,
        )
    for warning in file.calibration.warnings:
        print(f"warning of the calibration: {said_of(warning)}", file=sys.stderr)


def _own_calibration(path: Path) -> "CalibrationFile":
    from calib_core.interchange.importing import read_any_file
    from calib_core.interchange.own.calibration_json import consistent_file

    return consistent_file(read_any_file(path), str(path))


def _into_recording(file: "CalibrationFile", paths: Sequence[Path], out: Path, *, topics: TopicFlags) -> int:
    """Write the new recording and a layout for Foxglove beside it; return the exit code.

    Args:
        file: the calibration.
        paths: of the recording.
        out: the new recording.
        topics: of the recording; those of the calibration where the user names none.

    Raises:
        InputError: a file cannot be written, or the calibration is not of this recording.
        RecordingError: the recording cannot be read.
    """
    from calib_core.deployment import write_into_recording
    from cocalib.platform.resources import version

    if out.is_dir():
        out = out / f"{paths[0].stem}-calibrated.mcap"
    if out.suffix.lower() != ".mcap":
        raise InputError(f"{out}: the new recording is an MCAP file; name it NAME.mcap")
    layout = out.with_name(out.stem + _LAYOUT_ENDING)
    with _open_recording(paths, topics, file) as recording:
        writable(layout)
        require_room(out, sum(source.size_bytes for source in recording.sources))
        with writing_whole(out) as stream, progress_bar("writing messages") as progress:
            written = write_into_recording(recording, file, stream, version=version(), progress=progress)
        write_whole(layout, written.layout)
        _report(recording, written, out, layout)
    return 0


def _open_recording(paths: Sequence[Path], topics: TopicFlags, file: "CalibrationFile") -> "Recording":
    """Open the recording with the topics, columns and radar's mount of the calibration, unless the user names others."""
    from calib_core.recordings import open_recording

    if topics == TopicFlags():
        provenance, mount = file.provenance, file.vehicle.radar_mount
        like_before = replace(
            topics,
            radar_topic=",".join(provenance.radar_topics) or provenance.radar_topic,
            image_topic=provenance.image_topic,
            radar_axes=provenance.radar_axes,
            map=provenance.column_map,
            radar_frame=None if mount is None else "body",
            radar_mount=mount,
        )
        try:
            recording = open_recording(tuple(paths), like_before, require=("image",))
            keep(recording.files)
            return recording
        except RecordingError:
            pass  # another recording of the same sensors may have other topics
    return topics.open(tuple(paths), ("image",))


def _report(recording: "Recording", written: "RecordingWritten", out: Path, layout: Path) -> None:
    """Print what was written, what was added, and what was lost."""
    from calib_core.recordings import assumption_warnings

    for note in written.notes:
        print(f"note: {note}", file=sys.stderr)
    for warning in assumption_warnings(recording.assumptions):
        print(f"note: {said_of(warning)}", file=sys.stderr)
    lost = sum(written.lost.values())
    if lost:
        where = ", ".join(f"{count} of {topic}" for topic, count in sorted(written.lost.items()))
        print(f"note: {lost} messages cannot be read and are left out ({where}): {written.fault}", file=sys.stderr)
    added = ", ".join(f"{count} on {topic}" for topic, count in sorted(written.added.items())) or "none"
    print(f"written to {out}: {written.copied} messages of the recording, unchanged; added: {added}")
    print(f"Foxglove layout: {layout} (in Foxglove: layout menu, Import from file)")
