"""`cocalib export`: write a calibration in another tool's format."""

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from cocalib.cli.export_recording import MCAP, export_recording
from cocalib.cli.flags import File, Switch, called
from cocalib.cli.output import write_whole
from cocalib.cli.recording_flags import TopicFlags, Topics
from cocalib.cli.tree_flags import FrameFlags, Frames, TreeFlags, Trees
from cocalib.cli.unpacking import is_meant_as_folder, write_unpacked
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from calib_core.geometry import RigidTransform
    from calib_core.interchange import CalibrationFile


@dataclass(frozen=True, slots=True)
class Export:
    """Write a calibration in the format of another tool; `--to list` lists the formats."""

    calibration: Annotated[tuple[Path, ...], tyro.conf.Positional, called("CALIBRATION.json")] = ()
    """A calibration written by cocalib (cocalib/calibration-1 JSON)."""
    to: Annotated[str, tyro.conf.arg(metavar="FORMAT")] = "list"
    """Output format: tf2, urdf, ...; "list" lists them, "all" writes every one that can hold the calibration into a folder."""
    out: File = None
    """Output file or folder; without it, text formats go to stdout. pack: NAME.zip, or a folder for its files."""
    parent_from_radar: Annotated[
        tuple[float, float, float, float, float, float, float] | None,
        called("X Y Z QX QY QZ QW"),
    ] = None
    """Pose of the radar in the parent frame of autoware (kit), driveworks (rig) or nuscenes (ego): metres, quaternion, w last."""

    rectified: Switch = False
    """Your pictures are rectified already, with the same camera matrix; else kitti and nuscenes get maps and a matrix of ours."""
    trees: Trees = field(default_factory=TreeFlags)
    frames: Frames = field(default_factory=FrameFlags)

    recording: Annotated[tuple[Path, ...], called("RECORDING...")] = ()
    """For `--to mcap`: write this ROS recording again with the calibration in it, so that viewers draw returns on pictures."""
    force: Switch = False
    """For `--to mcap`: overwrite existing files, but never the recording itself."""
    topics: Topics = field(default_factory=TopicFlags)

    def run(self) -> int:
        """Write the export; return the exit code."""
        from calib_core.interchange import format_named, parent_pose, written_formats

        if self.to == MCAP or self.recording or self.force or self.topics != TopicFlags():
            return self._export_recording()
        if self.trees.into:
            file = self._calibration()
            code = self.trees.patch(file, self.frames, to=self.to, out=self.out)
            _print_warnings(file)
            return code
        if self.to == "list":
            formats = written_formats()
            width = max(len(known.name) for known in formats)
            print("\n".join(f"{known.name:<{width}}  {known.title}" for known in formats))
            print(f"{MCAP:<{width}}  a ROS recording with the calibration in it (--recording), for Foxglove and RViz")
            return 0
        if self.to != "all":
            format_named(self.to)
        file = self._calibration()
        parent = parent_pose(self.parent_from_radar) if self.parent_from_radar else None
        if self.to == "all":
            return _write_all(self.frames.renamed(file), self.out, parent_from_radar=parent, rectified=self.rectified)
        return self._write_one(file, parent)

    def _write_one(self, file: "CalibrationFile", parent_from_radar: "RigidTransform | None") -> int:
        from calib_core.interchange import format_named

        renamed = self.frames.renamed(file)
        written = self.trees.export(renamed, self.to, parent_from_radar=parent_from_radar, rectified=self.rectified)
        _print_warnings(file)
        for note in written.notes:
            print(f"note: {note}", file=sys.stderr)
        if self.out is not None and format_named(self.to).is_unpacked and is_meant_as_folder(self.out):
            names = write_unpacked(self.out, written.data)
            print(f"written to {self.out}: {', '.join(names)}")
        elif self.out is not None:
            target = self.out / written.file_name if self.out.is_dir() else self.out
            write_whole(target, written.data)
            print(f"written to {target}")
            for extra in written.extra_files:
                write_whole(target.parent / extra.file_name, extra.data)
                print(f"written to {target.parent / extra.file_name}")
        elif isinstance(written.content, bytes):
            raise InputError(f"{self.to} is a binary format and needs a file: --out {written.file_name}")
        elif written.extra_files:
            beside = ", ".join(extra.file_name for extra in written.extra_files)
            raise InputError(f"{self.to} comes with {beside} and needs a file or folder: --out {written.file_name}")
        else:
            print_exactly(written.content)
        return 0

    def _calibration(self) -> "CalibrationFile":
        if len(self.calibration) != 1:
            raise InputError("export takes one calibration: cocalib export CALIBRATION.json --to FORMAT [--out FILE]")
        return _own_calibration(self.calibration[0])

    def _export_recording(self) -> int:
        """Write the recording again with the calibration in it; return the exit code."""
        if self.to != MCAP:
            raise InputError(f"--recording, --force and the options of a recording are for --to {MCAP}")
        if self.parent_from_radar is not None or self.rectified:
            raise InputError(f"--parent-from-radar and --rectified do not apply to --to {MCAP}")
        if len(self.calibration) != 1 or not self.recording or self.out is None:
            raise InputError(
                f"export into a recording: cocalib export CALIBRATION.json --to {MCAP} --recording RECORDING... --out NEW.mcap"
            )
        file = _own_calibration(self.calibration[0])
        code = export_recording(file, self.recording, self.out, topics=self.topics, force=self.force)
        _print_warnings(file)
        return code


def _write_all(
    file: "CalibrationFile", folder: Path | None, *, parent_from_radar: "RigidTransform | None", rectified: bool
) -> int:
    """Write every format that can hold the calibration into a folder, and print why the others cannot."""
    from calib_core.interchange import export_all

    if folder is None or (folder.exists() and not folder.is_dir()):
        raise InputError("--to all needs a folder: --out FOLDER")
    written, refused = export_all(file, parent_from_radar=parent_from_radar, rectified=rectified)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made: {error.strerror or error}") from error
    for name, made in written.items():
        write_whole(folder / made.file_name, made.data)
        print(f"{name}: written to {folder / made.file_name}")
        for extra in made.extra_files:
            write_whole(folder / extra.file_name, extra.data)
    for one in refused:
        print(f"{one.name}: not written: {one.reason}")
    _print_warnings(file)
    for note in dict.fromkeys(note for made in written.values() for note in made.notes):
        names = ", ".join(name for name, made in written.items() if note in made.notes)
        print(f"note: {names}: {note}", file=sys.stderr)
    return 0


def _print_warnings(file: "CalibrationFile") -> None:
    if file.rests_on == "imported_assumed":
        print(
            "warning: what this calibration's numbers mean was assumed when it was imported (imported_assumed); "
            "prove it: cocalib import FILE --pairs PAIRS or --against FILE",
            file=sys.stderr,
        )
    for warning in file.calibration.warnings:
        print(f"warning of the calibration: {warning.message}; {warning.hint}", file=sys.stderr)


def _own_calibration(path: Path) -> "CalibrationFile":
    from calib_core.interchange import consistent_file, read_any_file

    return consistent_file(read_any_file(path), str(path))
