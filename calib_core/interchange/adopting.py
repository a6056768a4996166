"""Convert a calibration written by another tool, in any known format, to a calibration-1 file."""

from dataclasses import dataclass, replace
from pathlib import PurePath

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames, Provenance, choose_check_point
from calib_core.interchange.check.pair_residuals import CheckPairs
from calib_core.interchange.check.report import CheckReport, check
from calib_core.interchange.evidence import Evidence
from calib_core.interchange.imported import TRUTH_FORMAT, ImportedCalibration
from calib_core.options import CalibrationOptions
from calib_core.radar import RadarErrors
from calib_core.results import Calibration, DataWarning, Metrics

_UNKNOWN = float("nan")
_SAME_LENS_PX = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Adoption:
    """A converted calibration, and what was found when it was checked.

    Attributes:
        file: the calibration-1 file.
        report: of the check; its verdict is never "wrong".
    """

    file: CalibrationFile
    report: CheckReport


def _judged(
    found: ImportedCalibration,
    source: str,
    *,
    camera: Camera | None = None,
    against: ImportedCalibration | None = None,
    pairs: CheckPairs | None = None,
) -> CheckReport:
    """Check what a reader found before it is converted.

    Args:
        found: what `read_any` returned.
        source: the file's name, for error messages.
        camera: the intrinsics, if the file has none.
        against: a calibration of the same sensors that is known to be right.
        pairs: radar positions and the pixels where they were seen.

    Raises:
        InputError: the file is a simulation's ground truth, contradicts itself, or fails a check; the message names the slip.
    """
    if found.format == TRUTH_FORMAT:
        raise InputError(
            f"{source}: is the ground truth of a simulation, not a calibration; compare with it: cocalib check FILE --against"
        )
    report = check(found, camera=camera, against=against, pairs=pairs)
    for result in report.results:
        if result.level == "error":
            raise InputError(f"{source}: {result.message}; {result.hint}")
    return report


def _evidence(found: ImportedCalibration, report: CheckReport, *, tested: bool) -> Evidence:
    """Return what an import rests on: reading alone never raises the level that a file states.

    Args:
        found: what was read.
        report: of its check, which found no error.
        tested: whether it was held against pairs or another calibration.
    """
    proven = report.verdict == "right"
    if found.evidence == "imported_assumed" and not tested:
        proven = False
    return "imported_proven" if proven else "imported_assumed"


def adopt(
    found: ImportedCalibration, source: str, *, camera: Camera | None = None, provenance: Provenance | None = None
) -> CalibrationFile:
    """Convert what a reader found to a calibration-1 file; `adoption` without anything to hold it against.

    Raises:
        InputError: the file contradicts itself, fails its own check point, states another camera, or there is no camera.
    """
    return adoption(found, source, camera=camera, provenance=provenance).file


def adoption(
    found: ImportedCalibration,
    source: str,
    *,
    camera: Camera | None = None,
    provenance: Provenance | None = None,
    against: ImportedCalibration | None = None,
    pairs: CheckPairs | None = None,
    replace_camera: bool = False,
) -> Adoption:
    """Convert what a reader found to a calibration-1 file; calibration-1 keeps everything that it contains.

    Args:
        found: what `read_any` returned.
        source: the file's name, for error messages.
        camera: the intrinsics, if the file has none.
        provenance: where the calibration comes from.
        against: a calibration of the same sensors that is known to be right: agreeing with it proves the meaning of the file.
        pairs: radar positions and the pixels where they were seen: fitting them proves it, too.
        replace_camera: use the given camera although the file states another.

    Raises:
        InputError: the file contradicts itself, fails a check, states another camera, or there is no camera.
    """
    if found.file is not None and camera is not None:
        raise InputError(
            f"{source}: is calibration-1 and contains the camera it was solved with; omit the other camera"
        )
    report = _judged(found, source, camera=camera, against=against, pairs=pairs)
    tested = against is not None or pairs is not None
    if found.file is not None:
        raised = tested and found.file.rests_on == "imported_assumed" and report.verdict == "right"
        return Adoption(replace(found.file, evidence="imported_proven") if raised else found.file, report)
    known = _camera(found, camera, source=source, replace_camera=replace_camera)
    calibration = _as_calibration(found, source, camera=known)
    file = CalibrationFile(
        calibration,
        found.frames or FrameNames(),
        choose_check_point(calibration),
        provenance or Provenance(),
        evidence=_evidence(found, report, tested=tested),
    )
    return Adoption(file, report)


def _camera(found: ImportedCalibration, given: Camera | None, *, source: str, replace_camera: bool) -> Camera:
    """Return the camera of the file or the given one, which must not contradict each other.

    Raises:
        InputError: they image the same rays more than half a pixel apart, or there is neither.
    """
    if given is not None and not replace_camera:
        _refuse_another_camera(found, given, source=source)
    known = given or found.camera
    if known is None and found.matrix_px is not None:
        raise InputError(
            f"{source}: {found.format} states the camera matrix but not the image size; give it with --image-size WIDTH HEIGHT, "
            "or give the intrinsics with --camera FILE"
        )
    if known is None:
        raise InputError(f"{source}: {found.format} contains no camera; give its intrinsics with --camera FILE")
    return known


def _refuse_another_camera(found: ImportedCalibration, given: Camera, *, source: str) -> None:
    """Refuse a given camera that images the rays of the file's camera elsewhere.

    A file with a camera matrix alone is for undistorted pictures; that matrix is compared.

    Raises:
        InputError: they image a ray more than half a pixel apart.
    """
    stated, compared = found.camera, given
    if stated is None and found.matrix_px is not None:
        size = given.width_px, given.height_px
        stated = found.camera_for(size)
        if not found.distortion.any() and found.lens_model == "pinhole":
            compared = Camera("pinhole", *size, given.matrix_px)
    apart_px = largest_difference_px(stated, compared) if stated is not None else 0.0
    if stated is None or apart_px <= _SAME_LENS_PX:
        return
    in_file, in_given = (
        f"{one.width_px} x {one.height_px} px, fx {one.matrix_px[0, 0]:.6g}, cx {one.matrix_px[0, 2]:.6g}, "
        f"cy {one.matrix_px[1, 2]:.6g}, {one.model}"
        for one in (stated, compared)
    )
    apart = f", up to {apart_px:.3g} px apart" if np.isfinite(apart_px) else ""
    raise InputError(
        f"{source}: states a camera ({in_file}) other than the given one ({in_given}){apart}; omit --camera, or take the given "
        "one with --replace-camera"
    )


def adopted_calibration(found: ImportedCalibration, source: str, *, camera: Camera) -> Calibration:
    """Return what a reader found as a calibration with a given camera; whatever the file does not state is unknown.

    Args:
        found: what `read_any` returned.
        source: the file's name, for error messages and the warning.
        camera: the intrinsics to use.

    Raises:
        InputError: the file contradicts itself, or fails its own check point.
    """
    _judged(found, source, camera=camera)
    return _as_calibration(found, source, camera=camera)


def _as_calibration(found: ImportedCalibration, source: str, *, camera: Camera) -> Calibration:
    """Return what was read and checked as a calibration with a given camera."""
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
        covariance_parts=found.file.calibration.covariance_parts if found.file else None,
    )


def _covariance(found: ImportedCalibration) -> Matrix66:
    if found.file is not None:
        return found.file.calibration.covariance
    return np.full((6, 6), _UNKNOWN) if found.covariance is None else found.covariance


def _imported_warning(found: ImportedCalibration, source: str) -> DataWarning:
    return DataWarning(
        "imported",
        f"imported from {PurePath(source).name} ({found.format}): its pairs and input data are unknown",
        "check it with cocalib open RECORDING --calibration FILE: click the reflector",
    )


_GRID = 9


def largest_difference_px(a: Camera, b: Camera) -> float:
    """Return the largest distance [px] between the pixels of one ray, over the picture of the first camera.

    Infinite if the pictures have different sizes, or the second camera does not image a ray of the first.
    """
    if (a.width_px, a.height_px) != (b.width_px, b.height_px):
        return float("inf")
    columns, rows = np.linspace(0, a.width_px - 1, _GRID), np.linspace(0, a.height_px - 1, _GRID)
    pixels_px = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    rays = a.rays(pixels_px)
    seen = np.isfinite(rays).all(axis=1)
    apart_px = np.linalg.norm(b.project(rays[seen]) - pixels_px[seen], axis=1)
    return float(np.where(np.isfinite(apart_px), apart_px, np.inf).max(initial=0.0))
