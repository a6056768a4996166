"""Read the calibration that the page shows until the clicks give a new one, and the camera in it."""

from pathlib import Path
from typing import TYPE_CHECKING

from app.view import Reference
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.interchange import adopted_calibration, read_any_file

if TYPE_CHECKING:
    from calib_core.interchange import ImportedCalibration

__all__ = ["camera_in", "camera_of", "reference_from"]


def camera_of(found: "ImportedCalibration", path: Path, size_px: tuple[int, int]) -> Camera | None:
    """Return the camera of a calibration for pictures of a size; None if it has none.

    Raises:
        InputError: its matrix is not a camera's.
    """
    try:
        return found.camera_for(size_px)
    except ValueError as error:
        raise InputError(f"{path}: {error}; give the intrinsics with --camera FILE") from None


def camera_in(path: Path, width_px: int, height_px: int) -> Camera | None:
    """Return the camera in a calibration file if it has this image size, else None.

    Raises:
        InputError: the file contains no calibration.
    """
    camera = camera_of(read_any_file(path), path, (width_px, height_px))
    fits = camera is not None and (camera.width_px, camera.height_px) == (width_px, height_px)
    return camera if fits else None


def reference_from(path: Path, camera: Camera | None) -> Reference:
    """Return the calibration in a file, to be shown with the recording's camera.

    Raises:
        InputError: it contains no calibration, contradicts itself or fails its own check point.
    """
    if camera is None:
        raise InputError(f"{path}: showing this calibration needs intrinsics; give --camera FILE")
    return Reference(name_text(path.name), adopted_calibration(read_any_file(path), str(path), camera=camera))
