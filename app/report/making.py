"""From what was read to what is reported: the calibration with a camera, and another one to compare with."""

from app.report.subject import Against, Judged, ReportSubject, Watched
from app.resources import version
from calib_core.camera import Camera
from calib_core.input_files import name_text
from calib_core.interchange import ImportedCalibration, adoption, compare
from calib_core.results import Calibration, InputFile

__all__ = ["against_of", "calibration_of", "subject_of"]


def subject_of(
    name: str,
    inputs: tuple[InputFile, ...],
    found: ImportedCalibration,
    *,
    calibration: Calibration | None,
    recording: Watched | None = None,
    judged: Judged | None = None,
    against: Against | None = None,
) -> ReportSubject:
    """Return what is reported.

    Args:
        name: of the calibration's file, without its folder.
        inputs: the files that it was read from.
        found: what was read.
        calibration: the same with a camera, as `calibration_of` returns it.
        recording: that it is judged on.
        judged: what the recording says of it.
        against: another calibration.
    """
    return ReportSubject(name_text(name), inputs, found, calibration, version(), recording, judged, against)


def calibration_of(found: ImportedCalibration, name: str, *, camera: Camera | None) -> Calibration | None:
    """Return a calibration with the camera that it states, else with the given one; None if there is neither.

    Args:
        found: what was read.
        name: of the file, without its folder.
        camera: the user's intrinsics, or those of the recording.

    Raises:
        InputError: the file contradicts itself, fails its own check point, or states another camera.
    """
    if found.file is None and found.camera is None and camera is None:
        return None
    return adoption(found, name_text(name), camera=camera).file.calibration


def against_of(
    name: str,
    inputs: tuple[InputFile, ...],
    other: ImportedCalibration,
    found: ImportedCalibration,
    *,
    camera: Camera | None = None,
) -> Against:
    """Compare with another calibration.

    Args:
        name: of the other's file.
        inputs: the files that the other was read from.
        other: what was read.
        found: the calibration that is reported.
        camera: the intrinsics, if neither has any.
    """
    return Against(name_text(name), inputs, compare(other, found, camera=camera))
