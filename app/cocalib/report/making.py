"""From what was read to what is reported: the calibration with a camera, and another one to compare with."""

from collections.abc import Sequence

from calib_core.camera import Camera
from calib_core.input_files import name_text
from calib_core.interchange import ImportedCalibration, compare
from calib_core.results import Calibration, InputFile
from cocalib.evaluation.recording_check import calibration_of
from cocalib.platform.resources import version
from cocalib.report.subject import Against, ReportSubject


def subject_of(found: ImportedCalibration, calibration: Calibration | None, name: str) -> ReportSubject:
    """Return what is reported when nothing but the calibration is known.

    Args:
        found: what was read.
        calibration: the same with a camera, as `known_calibration` returns it.
        name: of the file, without its folder.
    """
    return ReportSubject(name_text(name), found, calibration, version())


def known_calibration(found: ImportedCalibration, name: str, *, camera: Camera | None) -> Calibration | None:
    """Return a calibration with the camera that it states, else with the given one; None if there is neither.

    Args:
        found: what was read.
        name: of the file, without its folder.
        camera: the user's intrinsics, or those of the recording.

    Raises:
        InputError: the file contradicts itself, or fails its own check point.
    """
    if found.file is None and found.camera is None and camera is None:
        return None
    return calibration_of(found, name_text(name), camera)


def against_of(
    name: str,
    inputs: tuple[InputFile, ...],
    other: ImportedCalibration,
    found: ImportedCalibration,
    *,
    camera: Camera | None = None,
    judged: Sequence[str] = (),
) -> Against:
    """Compare with another calibration.

    Args:
        name: of the other's file.
        inputs: the files that the other was read from.
        other: what was read.
        found: the calibration that is reported.
        camera: the intrinsics, if neither has any.
        judged: which one is better on the recording.
    """
    return Against(name_text(name), inputs, compare(other, found, camera=camera), tuple(judged))
