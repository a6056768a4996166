"""Hold a calibration against the returns of a recording: do its residuals at the clicks fit what it states?"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib_core.association.pairing import RadarSource, pair_clicks, scans_around
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.evaluation.residuals import ResidualTest, residual_test
from calib_core.interchange.check.pixel_differences import LOST_TEXT, far_outside, lenses_of
from calib_core.interchange.check.report import CheckReport
from calib_core.interchange.check.slips import CheckResult, answering
from calib_core.interchange.format import ImportedCalibration
from calib_core.interchange.importing import adopted_calibration
from calib_core.measurements import MIN_PAIRS, ReflectorClick
from calib_core.recordings import Recording
from calib_core.results import Calibration, DataWarning, InputFile

_LEAST_P = 0.01
_MOST_MISFITS = 0.2
_NEAR_PX = 10.0
_NAMED = 5


def clicks_in(imported: ImportedCalibration, first_ns: int, last_ns: int) -> tuple[ReflectorClick, ...]:
    """Return the clicks that a calibration-1 file keeps in its pairs, if all of them are within a recording; else none.

    Args:
        imported: what was read.
        first_ns: stamp of the recording's first frame.
        last_ns: of its last.
    """
    pairs = [pair for pair in imported.file.calibration.pairs if pair.measured is not None] if imported.file else []
    clicks = [
        ReflectorClick(
            pair.image_time, pair.id, float(pair.pixel_px[0]), float(pair.pixel_px[1]), chosen=pair.measured.chosen
        )
        for pair in pairs
        if pair.image_time is not None and pair.measured is not None and not pair.excluded
    ]
    within = all(first_ns <= click.image_time <= last_ns for click in clicks)
    return tuple(clicks) if within else ()


def stale_inputs(imported: ImportedCalibration, inputs: Sequence[InputFile]) -> tuple[CheckResult, ...]:
    """Say which files of a recording are not those that the calibration names as its inputs, though they have their names."""
    named = {one.name: one for one in imported.file.provenance.inputs} if imported.file else {}
    return tuple(
        CheckResult(
            "warning",
            "other-input",
            f"the calibration was made from another {one.name} (sha256 {named[one.name].sha256[:12]}..., this one's is "
            f"{one.sha256[:12]}...)",
            "right if this is another recording of the same name",
            "recording",
        )
        for one in inputs
        if one.name in named and named[one.name].sha256 != one.sha256
    )


def other_camera(imported: ImportedCalibration, camera: Camera | None) -> tuple[CheckResult, ...]:
    """Say that a recording states another lens than the calibration, which is projected through its own."""
    if imported.camera is None or camera is None:
        return ()
    lenses = lenses_of(imported, dataclasses.replace(imported, camera=camera), None)
    lens = lenses.difference if lenses else None
    if lens is None or lens.same or _was_refined_from(imported, camera):
        return ()
    message = f"the recording states other intrinsics than the calibration: {lens.text}"
    return (
        CheckResult("warning", "other-lens", message, "the residuals are through the calibration's own", "recording"),
    )


def _was_refined_from(imported: ImportedCalibration, camera: Camera) -> bool:
    """Return whether a calibration's intrinsics are refined ones, and a recording states those they were refined from."""
    given = imported.file.calibration.given_camera if imported.file is not None else None
    if given is None:
        return False
    lenses = lenses_of(dataclasses.replace(imported, camera=given), dataclasses.replace(imported, camera=camera), None)
    return lenses is not None and lenses.difference is not None and lenses.difference.same


def with_recording(
    report: CheckReport,
    source: str,
    recording: RadarSource,
    clicks: Sequence[ReflectorClick],
    *,
    camera: Camera | None = None,
) -> CheckReport:
    """Add to a report whether the calibration holds on a recording; a file of another format that is wrong stays that.

    Args:
        report: of the calibration.
        source: its file's name, for error messages.
        recording: where the radar scans come from.
        clicks: in this recording.
        camera: the intrinsics, if the file has none.

    Raises:
        InputError: there are no intrinsics, or too few of the clicks have radar returns.
    """
    if report.imported.file is None and not report.ok:
        return report
    calibration = calibration_of(report.imported, source, camera)
    scans = scans_around(recording, clicks, calibration.options)
    pairs = pair_clicks([click for click in clicks if click.counts], scans, calibration.options).pairs
    if len(pairs) < MIN_PAIRS:
        raise InputError(
            f"{source}: {len(pairs)} clicks have radar returns in this recording; the comparison needs at least {MIN_PAIRS}"
        )
    (result,) = answering("recording", [_result(residual_test(pairs, calibration), calibration)])
    if report.imported.camera is None:
        message = f"{result.message}; through the given intrinsics or the recording's, because the file has none"
        result = dataclasses.replace(result, message=message)
    return dataclasses.replace(report, results=(*report.results, result))


def calibration_of(imported: ImportedCalibration, source: str, camera: Camera | None) -> Calibration:
    """Return what was read as a calibration.

    Args:
        imported: what was read.
        source: the file's name, for error messages.
        camera: the intrinsics, if the file has none.

    Raises:
        InputError: there are none, or the file contradicts itself.
    """
    if imported.file is not None:
        return imported.file.calibration
    known = imported.camera or camera
    if known is None:
        raise InputError(
            f"{source}: neither the file nor the recording has intrinsics to project with; give --camera FILE"
        )
    return adopted_calibration(imported, source, camera=known)


def _result(test: ResidualTest, calibration: Calibration) -> CheckResult:
    count, misfits = len(test.ids), int(test.misfits.sum())
    median_px = float(np.median(test.distances_px))
    lost = far_outside(np.array([median_px]), calibration.camera)[0]
    seen = f"most of them {LOST_TEXT}" if lost else f"{median_px:.3g} px in the middle"
    if np.isfinite(calibration.metrics.aed_px):
        seen += f" (mean reprojection error when solved {calibration.metrics.aed_px:.3g} px)"
    residuals = f"residuals of {count} clicks on this recording: {seen}"
    if not np.isfinite(calibration.firm_covariance).all():
        holds, judged = median_px <= _NEAR_PX, f"the file states no uncertainty, so {_NEAR_PX:g} px decide"
    else:
        holds = misfits <= _MOST_MISFITS * count and test.p_value >= _LEAST_P
        together = f", chi2 {test.chi2:.3g} for {test.degrees_of_freedom} degrees of freedom, p = {test.p_value:.2g}"
        if misfits == count:
            together = ""
        judged = f"{int(test.outside.sum())} outside their stated 95 %{together}{_outlier_names(test)}"
    if holds:
        return CheckResult("good", "holds", f"holds: {residuals}; {judged}")
    return CheckResult(
        "error",
        "does-not-hold",
        f"{residuals}; {judged}",
        "the sensors moved, the clicks are wrong, or the calibration is; solve this recording",
    )


def _outlier_names(test: ResidualTest) -> str:
    misfits = [name for name, misfit in zip(test.ids, test.misfits, strict=True) if misfit]
    more = ", ..." if len(misfits) > _NAMED else ""
    return f"; far off: {', '.join(misfits[:_NAMED])}{more}" if misfits else ""


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
    imported: ImportedCalibration, path: Path, recording: Recording, *, camera: Camera | None = None
) -> JudgedCalibration:
    """Return what was read as a calibration that can be judged on a recording.

    Args:
        imported: what was read.
        path: of its file, for messages.
        recording: that it is judged on.
        camera: the intrinsics, if the file has none.

    Raises:
        InputError: there are no intrinsics, or they are of images of another size.
    """
    recorded = recording.camera()
    calibration = calibration_of(imported, str(path), camera or recorded)
    require_size(calibration.camera, recording, path)
    lens = other_camera(imported, recorded)
    return JudgedCalibration(
        imported,
        calibration,
        tuple(DataWarning.reported(one.code, f"{path.name}: {one.message}", one.hint) for one in lens),
    )


def require_size(camera: Camera, recording: Recording, path: Path) -> None:
    """Refuse a calibration for images of another size.

    Raises:
        InputError: the recording's camera has another size.
    """
    recorded = recording.camera()
    if recorded is None:
        return
    size, wanted = (camera.width_px, camera.height_px), (recorded.width_px, recorded.height_px)
    if size != wanted:
        raise InputError(
            f"{path}: calibrated for images of {size[0]} x {size[1]} px, but the recording's camera has {wanted[0]} x "
            f"{wanted[1]} px; give the calibration of this camera"
        )
