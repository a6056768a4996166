"""`cocalib export` and `cocalib check`: a calibration in the words of another stack, and the proof that it was read right."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.flags import File, Switch, called
from app.cli.output import write_whole
from calib_core.errors import InputError

if TYPE_CHECKING:
    from calib_core.interchange import CalibrationFile

__all__ = ["Check", "Export"]


@dataclass(frozen=True, slots=True)
class Export:
    """Write a calibration as another stack reads it; `--to list` names the formats."""

    calibration: Annotated[tuple[Path, ...], tyro.conf.Positional, called("CALIBRATION.json")] = ()
    """A calibration that cocalib wrote (cocalib/calibration-1 JSON)."""
    to: Annotated[str, tyro.conf.arg(metavar="FORMAT")] = "list"
    """The format: tf2, urdf, ...; "list" names them all."""
    out: File = None
    """Where it goes, a file or a folder; without it, text goes to stdout."""
    parent_from_radar: Annotated[
        tuple[float, float, float, float, float, float, float] | None,
        called("X Y Z QX QY QZ QW"),
    ] = None
    """Pose of the radar in the third frame of autoware (kit), driveworks (rig), nuscenes (ego): metres, quaternion, w last."""

    rectified: Switch = False
    """Your pictures are rectified: undistorted with this same camera matrix. kitti and nuscenes take a distorted lens only so."""

    def run(self) -> int:
        """Write the export; return the exit code."""
        from calib_core.interchange import export, format_named, parent_pose, written_formats

        if self.to == "list":
            formats = written_formats()
            width = max(len(known.name) for known in formats)
            print("\n".join(f"{known.name:<{width}}  {known.title}" for known in formats))
            return 0
        format_named(self.to)
        if len(self.calibration) != 1:
            raise InputError("export takes one calibration: cocalib export CALIBRATION.json --to FORMAT [--out FILE]")
        path = self.calibration[0]
        parent = parent_pose(self.parent_from_radar) if self.parent_from_radar else None
        written = export(_own_calibration(path), self.to, parent_from_radar=parent, rectified=self.rectified)
        for note in written.notes:
            print(f"note: {note}", file=sys.stderr)
        if self.out is not None:
            target = self.out / written.file_name if self.out.is_dir() else self.out
            write_whole(target, written.data)
            print(f"written to {target}")
        elif isinstance(written.content, bytes):
            raise InputError(f"{self.to} is a binary format; say where it goes: --out {written.file_name}")
        else:
            print(written.content, end="")
        return 0


def _own_calibration(path: Path) -> "CalibrationFile":
    from calib_core.interchange import calibration_bytes, read_any, read_calibration

    data = calibration_bytes(path)
    found = read_any(data, str(path))
    if found.file is None:
        raise InputError(
            f"{path}: is {found.format}, and export takes calibration-1; make one of it first: "
            f"cocalib import {path.name} --out calibration.json"
        )
    return read_calibration(data, str(path))


@dataclass(frozen=True, slots=True)
class Check:
    """Read a calibration back, say what is wrong with it, or compare two. Exit code 1: wrong; 3: looks wrong, not proven."""

    calibration: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="CALIBRATION")]
    """A calibration in any format that export writes."""
    against: File = None
    """Another one to compare with: in degrees, centimetres, and pixels at 5, 20 and 60 m."""
    camera: File = None
    """Intrinsics, where the file has none: camera_info YAML, OpenCV YAML/XML, Kalibr, JSON."""
    pairs: File = None
    """Pairs to hold it against: pairs-1, or a calibration-1 file whose pairs are taken."""

    def run(self) -> int:
        """Print the results; return 0 when nothing is wrong, 1 when something is, 3 when it looks wrong and cannot be told."""
        from calib_core.interchange import check, read_any_file, read_camera_file, read_check_pairs_file

        other = read_any_file(self.against) if self.against else None
        camera = read_camera_file(self.camera) if self.camera else None
        pairs = read_check_pairs_file(self.pairs) if self.pairs else None
        report = check(read_any_file(self.calibration), against=other, camera=camera, pairs=pairs)
        print("\n".join(report.lines()))
        return {"wrong": 1, "doubtful": 3}.get(report.verdict, 0)
