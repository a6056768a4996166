"""`cocalib import`, and reading the calibration that `cocalib open --calibration` shows."""

import hashlib
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.cli.flags import File, NewFile
from app.cli.output import write_whole
from calib_core.errors import InputError
from calib_core.input_files import name_text

if TYPE_CHECKING:
    from app.view import Reference
    from calib_core.camera import Camera

__all__ = ["Import", "camera_in", "reference_from"]


@dataclass(frozen=True, slots=True)
class Import:
    """Convert a calibration from any known format to cocalib/calibration-1 JSON."""

    calibration: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="FILE")]
    """A calibration in any format that export writes, from any program."""
    out: NewFile
    """Output file (calibration-1 JSON)."""
    camera: File = None
    """Intrinsics to use if the file has none: camera_info YAML, OpenCV YAML/XML, Kalibr, JSON."""

    def run(self) -> int:
        """Write the calibration; return the exit code."""
        from calib_core.interchange import Provenance, adopt, calibration_bytes, read_any, read_camera_file
        from calib_core.interchange import write_calibration as write
        from calib_core.results import InputFile

        data = calibration_bytes(self.calibration)
        found = read_any(data, str(self.calibration))
        camera = read_camera_file(self.camera) if self.camera else None
        origin = InputFile(name_text(self.calibration.name), len(data), hashlib.sha256(data).hexdigest())
        file = adopt(found, str(self.calibration), camera=camera, provenance=Provenance(inputs=(origin,)))
        for note in found.notes:
            print(f"note: {note}", file=sys.stderr)
        write_whole(self.out, write(file))
        print(f"{self.calibration.name} read as {found.format}; written to {self.out}")
        return 0


def camera_in(path: Path, width_px: int, height_px: int) -> "Camera | None":
    """Return the camera in a calibration file if it has this image size, else None.

    Raises:
        InputError: the file contains no calibration.
    """
    from calib_core.interchange import read_any_file

    camera = read_any_file(path).camera
    fits = camera is not None and (camera.width_px, camera.height_px) == (width_px, height_px)
    return camera if fits else None


def reference_from(path: Path, camera: "Camera | None") -> "Reference":
    """Return the calibration in a file, to be shown with the recording's camera.

    Raises:
        InputError: it contains no calibration, contradicts itself or fails its own check point.
    """
    from app.view import Reference
    from calib_core.interchange import adopted_calibration, read_any_file

    if camera is None:
        raise InputError(f"{path}: showing this calibration needs intrinsics; give --camera FILE")
    return Reference(name_text(path.name), adopted_calibration(read_any_file(path), str(path), camera=camera))
