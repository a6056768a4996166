"""Take over a calibration that somebody else wrote: whatever format it was in, it becomes a calibration-1 file."""

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames, Provenance, choose_check_point
from calib_core.interchange.check.report import check
from calib_core.interchange.imported import TRUTH_FORMAT, ImportedCalibration
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration, DataWarning, Metrics

__all__ = ["adopt", "adopted_calibration"]

_UNKNOWN = float("nan")


def adopt(
    found: ImportedCalibration, source: str, *, camera: Camera | None = None, provenance: Provenance | None = None
) -> CalibrationFile:
    """Return a calibration-1 file of what a reader found; one that is calibration-1 already stays as it is.

    Args:
        found: what `read_any` returned.
        source: its name, for error messages.
        camera: the intrinsics, where the file has none.
        provenance: where it comes from.

    Raises:
        InputError: the file contradicts itself, misses its own check point, or there is no camera.
    """
    if found.file is not None and camera is not None:
        raise InputError(f"{source}: is calibration-1 and was solved with the camera in it; leave the other camera out")
    _refuse_wrong(found, source, camera)
    if found.file is not None:
        return found.file
    known = found.camera or camera
    if known is None:
        raise InputError(f"{source}: {found.format} carries no camera; give its intrinsics too: --camera FILE")
    calibration = adopted_calibration(found, source, camera=known)
    frames = found.frames or FrameNames()
    return CalibrationFile(calibration, frames, choose_check_point(calibration), provenance or Provenance())


def adopted_calibration(found: ImportedCalibration, source: str, *, camera: Camera) -> Calibration:
    """Return what a reader found as a calibration seen through a camera; what the file does not say stays unknown.

    Args:
        found: what `read_any` returned.
        source: its name, for error messages and for the warning.
        camera: the intrinsics to look through.

    Raises:
        InputError: the file contradicts itself, or misses its own check point.
    """
    _refuse_wrong(found, source, camera)
    assumed = tuple(DataWarning("assumed", note, "make sure that it is so") for note in found.notes)
    return Calibration(
        camera_from_radar=found.camera_from_radar,
        covariance=found.file.calibration.covariance if found.file else np.full((6, 6), _UNKNOWN),
        camera=camera,
        metrics=Metrics(_UNKNOWN, _UNKNOWN, _UNKNOWN, 0),
        pairs=(),
        unpaired=(),
        warnings=(*assumed, _taken_over(found, source)),
        options=CalibrationOptions(),
    )


def _taken_over(found: ImportedCalibration, source: str) -> DataWarning:
    return DataWarning(
        "imported",
        f"taken over from {source} ({found.format}): its pairs are not known, nor what it was made from",
        "check it: cocalib open RECORDING --calibration FILE, and click the reflector",
    )


def _refuse_wrong(found: ImportedCalibration, source: str, camera: Camera | None) -> None:
    if found.format == TRUTH_FORMAT:
        raise InputError(
            f"{source}: is what a simulation holds for true, no calibration; compare with it: cocalib check FILE --against"
        )
    for result in check(found, camera=camera).results:
        if result.level == "error":
            raise InputError(f"{source}: {result.message}; {result.hint}")
