"""`cocalib import`."""

import hashlib
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.flags import File, called
from app.cli.meanings import MeaningFlags
from app.cli.output import write_whole
from calib_core.errors import InputError
from calib_core.input_files import name_text

if TYPE_CHECKING:
    from calib_core.camera import Camera
    from calib_core.interchange import ImportedCalibration

__all__ = ["Import"]


@dataclass(frozen=True, slots=True)
class Import:
    """Convert a calibration from any known format to cocalib/calibration-1 JSON."""

    calibration: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")]
    """A calibration in any format that `cocalib check` reads, or any file with a pose, from any program."""
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
    meaning: Annotated[MeaningFlags, tyro.conf.arg(name="")] = field(default_factory=MeaningFlags)

    def run(self) -> int:
        """Write the calibration; return the exit code: 3 if its numbers may mean several things, and nothing is written."""
        from calib_core.interchange import (
            Provenance,
            adopt,
            calibration_bytes,
            check,
            read_any_file,
            read_camera_file,
            read_check_pairs_file,
        )
        from calib_core.interchange import write_calibration as write
        from calib_core.results import InputFile

        data = calibration_bytes(self.calibration)
        given = read_camera_file(self.camera) if self.camera else None
        against = read_any_file(self.against) if self.against else None
        pairs = read_check_pairs_file(self.pairs) if self.pairs else None
        found = self.meaning.calibration(data, self.calibration, camera=given, pairs=pairs, against=against)
        if found is None:
            return 3
        if self.out is None:
            raise InputError(f"{self.calibration}: give the output file with --out FILE")
        camera = given or _sized_camera(found, self.calibration, self.image_size)
        origin = InputFile(name_text(self.calibration.name), len(data), hashlib.sha256(data).hexdigest())
        file = adopt(found, str(self.calibration), camera=camera, provenance=Provenance(inputs=(origin,)))
        report = check(found, camera=camera, against=against, pairs=pairs)
        for result in report.results:
            if result.level == "error":
                raise InputError(f"{self.calibration}: {result.message}; {result.hint}")
        if found.file is None:
            proven = report.verdict == "right"
            file = replace(file, evidence="imported_proven" if proven else "imported_assumed")
        for note in found.notes:
            print(f"note: {note}", file=sys.stderr)
        write_whole(self.out, write(file))
        print(f"{self.calibration.name} read as {found.format}; written to {self.out}")
        return 0


def _sized_camera(found: "ImportedCalibration", path: Path, image_size_px: tuple[int, int] | None) -> "Camera | None":
    """Return the camera of a file that states its matrix but no size, if the size is given or pictures are beside it.

    Raises:
        InputError: the matrix is not a camera's.
    """
    from app.opening.reference import camera_of
    from calib_core.recordings import size_of_pictures_beside

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
