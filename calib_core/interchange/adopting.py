"""Convert a calibration written by another tool, in any known format, to a calibration-1 file."""

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames, Provenance, choose_check_point
from calib_core.interchange.check.report import check
from calib_core.interchange.imported import TRUTH_FORMAT, ImportedCalibration
from calib_core.options import CalibrationOptions
from calib_core.radar import RadarErrors
from calib_core.results import Calibration, DataWarning, Metrics

__all__ = ["adopt", "adopted_calibration"]

_UNKNOWN = float("nan")


def adopt(
    found: ImportedCalibration, source: str, *, camera: Camera | None = None, provenance: Provenance | None = None
) -> CalibrationFile:
    """Convert what a reader found to a calibration-1 file; calibration-1 is returned unchanged.

    Args:
        found: what `read_any` returned.
        source: the file's name, for error messages.
        camera: the intrinsics, if the file has none.
        provenance: where the calibration comes from.

    Raises:
        InputError: the file contradicts itself, fails its own check point, or there is no camera.
    """
    if found.file is not None and camera is not None:
        raise InputError(
            f"{source}: is calibration-1 and contains the camera it was solved with; omit the other camera"
        )
    _refuse_wrong(found, source, camera)
    if found.file is not None:
        return found.file
    known = found.camera or camera
    if known is None and found.matrix_px is not None:
        raise InputError(
            f"{source}: {found.format} states the camera matrix but not the image size; give it with --image-size WIDTH HEIGHT, "
            "or give the intrinsics with --camera FILE"
        )
    if known is None:
        raise InputError(f"{source}: {found.format} contains no camera; give its intrinsics with --camera FILE")
    calibration = adopted_calibration(found, source, camera=known)
    frames = found.frames or FrameNames()
    return CalibrationFile(calibration, frames, choose_check_point(calibration), provenance or Provenance())


def adopted_calibration(found: ImportedCalibration, source: str, *, camera: Camera) -> Calibration:
    """Return what a reader found as a calibration with a given camera; whatever the file does not state is unknown.

    Args:
        found: what `read_any` returned.
        source: the file's name, for error messages and the warning.
        camera: the intrinsics to use.

    Raises:
        InputError: the file contradicts itself, or fails its own check point.
    """
    _refuse_wrong(found, source, camera)
    assumed = tuple(DataWarning("assumed", note, "verify this assumption") for note in found.assumptions)
    return Calibration(
        camera_from_radar=found.camera_from_radar,
        covariance=_covariance(found),
        camera=camera,
        metrics=Metrics(_UNKNOWN, _UNKNOWN, _UNKNOWN, 0),
        pairs=(),
        unpaired=(),
        warnings=(*assumed, _imported_warning(found, source)),
        options=CalibrationOptions(),
        radar_errors=found.file.calibration.radar_errors if found.file else RadarErrors(),
        systematic_errors=found.file.calibration.systematic_errors if found.file else (),
    )


def _covariance(found: ImportedCalibration) -> Matrix66:
    if found.file is not None:
        return found.file.calibration.covariance
    return np.full((6, 6), _UNKNOWN) if found.covariance is None else found.covariance


def _imported_warning(found: ImportedCalibration, source: str) -> DataWarning:
    return DataWarning(
        "imported",
        f"imported from {source} ({found.format}): its pairs and input data are unknown",
        "check it with cocalib open RECORDING --calibration FILE: click the reflector",
    )


def _refuse_wrong(found: ImportedCalibration, source: str, camera: Camera | None) -> None:
    if found.format == TRUTH_FORMAT:
        raise InputError(
            f"{source}: is the ground truth of a simulation, not a calibration; compare with it: cocalib check FILE --against"
        )
    for result in check(found, camera=camera).results:
        if result.level == "error":
            raise InputError(f"{source}: {result.message}; {result.hint}")
