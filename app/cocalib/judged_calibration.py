"""A calibration that is to be judged on a recording: with a lens that fits the recording."""

from dataclasses import dataclass
from pathlib import Path

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange import ImportedCalibration
from calib_core.recordings import Recording
from calib_core.results import Calibration, DataWarning
from cocalib.recording_check import calibration_of, other_camera


@dataclass(frozen=True, slots=True, eq=False)
class JudgedCalibration:
    """A calibration and what the recording says of its lens.

    Attributes:
        found: what was read.
        calibration: with a lens.
        warnings: about the lens, and about the recording if the calibration names another.
    """

    found: ImportedCalibration
    calibration: Calibration
    warnings: tuple[DataWarning, ...]


def judged_calibration(
    found: ImportedCalibration, path: Path, recording: Recording, *, camera: Camera | None = None
) -> JudgedCalibration:
    """Return what was read as a calibration that can be judged on a recording.

    Args:
        found: what was read.
        path: of its file, for messages.
        recording: that it is judged on.
        camera: the intrinsics, if the file has none.

    Raises:
        InputError: there are no intrinsics, or they are of pictures of another size.
    """
    recorded = recording.camera()
    calibration = calibration_of(found, str(path), camera or recorded)
    require_size(calibration.camera, recording, path)
    lens = other_camera(found, recorded)
    return JudgedCalibration(
        found, calibration, tuple(DataWarning(one.code, f"{path.name}: {one.message}", one.hint) for one in lens)
    )


def require_size(camera: Camera, recording: Recording, path: Path) -> None:
    """Refuse a calibration for pictures of another size.

    Raises:
        InputError: the recording's camera has another size.
    """
    recorded = recording.camera()
    if recorded is None:
        return
    size, wanted = (camera.width_px, camera.height_px), (recorded.width_px, recorded.height_px)
    if size != wanted:
        raise InputError(
            f"{path}: calibrated for pictures of {size[0]} x {size[1]} px, but the recording's camera has {wanted[0]} x "
            f"{wanted[1]} px; give the calibration of this camera"
        )
