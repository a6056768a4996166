"""`cocalib import`."""

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from cocalib.cli.flags import File, Switch, called
from cocalib.cli.meanings import MeaningFlags
from cocalib.cli.output import write_whole
from cocalib.cli.tree_flags import FrameFlags, Frames, input_file

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.interchange import ImportedCalibration


@dataclass(frozen=True, slots=True)
class Import:
    """Convert a calibration from any known format to cocalib/calibration-1 JSON."""

    calibration: Annotated[tuple[Path, ...], tyro.conf.Positional, called("FILE...")] = ()
    """A calibration in any format, or any file with a pose, from any program; or files, a folder or a recording with a tree."""
    out: File = None
    """Output file (calibration-1 JSON)."""
    camera: File = None
    """Intrinsics to use if the file has none: camera_info YAML, OpenCV YAML/XML, Kalibr, JSON."""
    image_size: Annotated[tuple[int, int] | None, called("WIDTH HEIGHT")] = None
    """Size of the pictures [px], if the file has a camera matrix but no size; by default that of the pictures beside it."""
    pairs: File = None
    """Pairs that prove what the file means: a pairs-1 file, or a calibration-1 file with pairs."""
    against: File = None
    """A calibration of the same sensors that proves what the file means."""
    replace_camera: Switch = False
    """Take --camera although the file states another camera."""
    frames: Frames = field(default_factory=FrameFlags)
    meaning: Annotated[MeaningFlags, tyro.conf.arg(name="")] = field(default_factory=MeaningFlags)

    def run(self) -> int:
        """Write the calibration; return the exit code.

        It is 3 if it was converted but looks wrong, and nothing proves it; or if its numbers may mean several things, and
        nothing was written.
        """
        from calib_core.interchange import (
            Provenance,
            adoption,
            read_any_file,
            read_camera_file,
            read_check_pairs_file,
        )
        from calib_core.interchange import write_calibration as write

        if not self.calibration:
            raise InputError(
                "import takes a calibration, or the files of one: cocalib import FILE... --out calibration.json"
            )
        path, source = self.calibration[0], ", ".join(map(str, self.calibration))
        given = read_camera_file(self.camera) if self.camera else None
        against = read_any_file(self.against) if self.against else None
        pairs = read_check_pairs_file(self.pairs) if self.pairs else None
        files = self.frames.files(self.calibration)
        unstated = self.meaning.unstated(files, source)
        if unstated is None or files is None:
            found, inputs = self.frames.read(self.calibration, files)
        else:
            chosen = self.meaning.chosen(unstated, camera=given, pairs=pairs, against=against)
            if chosen is None:
                return 3
            found, inputs = chosen, (input_file(files[0]),)
        if self.out is None:
            raise InputError(f"{source}: give the output file with --out FILE")
        camera = given or _sized_camera(found, path, self.image_size)
        adopted = adoption(
            found,
            source,
            camera=camera,
            provenance=Provenance(inputs=inputs),
            against=against,
            pairs=pairs,
            replace_camera=self.replace_camera,
        )
        names = ", ".join(one.name for one in self.calibration)
        file, report = adopted.file, adopted.report
        write_whole(self.out, write(file))
        print("\n".join(line for line in report.lines()[1:] if not line.startswith("ok: ")), file=sys.stderr)
        print(f"{names} read as {found.format}, {_RESTS_ON[file.rests_on]}; written to {self.out}")
        return 3 if report.verdict == "doubtful" else 0


_RESTS_ON = {
    "clicked": "solved from clicks",
    "imported_proven": "its meaning proven",
    "imported_assumed": "its meaning assumed, not proven",
}


def _sized_camera(found: "ImportedCalibration", path: Path, image_size_px: tuple[int, int] | None) -> "Camera | None":
    """Return the camera of a file that states its matrix but no size, if the size is given or pictures are beside it.

    Raises:
        InputError: the matrix is not a camera's.
    """
    from calib_core.recordings import size_of_pictures_beside
    from cocalib.opening.opened import camera_of

    if found.matrix_px is None:
        if image_size_px is not None:
            raise InputError(f"{path}: --image-size is for files with a camera matrix and no size; remove it")
        return None
    size_px = image_size_px or size_of_pictures_beside(path)
    if size_px is None:
        return None
    if image_size_px is None:
        print(f"note: image size {size_px[0]} x {size_px[1]} px from the pictures beside the file", file=sys.stderr)
    return camera_of(found, path, size_px)
