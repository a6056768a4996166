"""Check a calibration against pairs, its own or others': the radar positions must project near their pixels."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from calib_core.arrays import Points2, Points3, Values, freeze
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.estimation.pair_results import averaged_distances_px
from calib_core.geometry import RigidTransform
from calib_core.input_files import read_text
from calib_core.interchange.check.pixel_differences import LOST_TEXT, far_outside, lenses_of, shown
from calib_core.interchange.check.slips import CheckResult, explain, explained, rounding_of
from calib_core.interchange.format import ImportedCalibration, WrittenPose
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.interchange.own.documents import CALIBRATION_SCHEMA
from calib_core.interchange.own.pairs_files import read_pairs
from calib_core.interchange.syntax.strict_json import json_object
from calib_core.measurements import MIN_PAIRS
from calib_core.radar import RadarErrors
from calib_core.results import Calibration, PairResult

_NEAR = 0.03
_CLEARLY_BETTER = 0.2
_OTHER_LENS_PX = 2.0
_MAX_BYTES = 64 * 1024 * 1024


@dataclass(frozen=True, slots=True, eq=False)
class CheckPairs:
    """Radar positions and the pixels where they were seen.

    Attributes:
        points_radar_m: (n, 3), n at least 4.
        pixels_px: (n, 2).
        camera: the camera the pixels belong to.
        radar_errors: what the radar gets wrong in these positions, as far as it is known.
    """

    points_radar_m: Points3
    pixels_px: Points2
    camera: Camera
    radar_errors: RadarErrors = field(default_factory=RadarErrors)

    def __post_init__(self) -> None:
        freeze(self, points_radar_m=(None, 3), pixels_px=(None, 2))

    def under(self, calibration: Calibration) -> "CheckPairs":
        """Take out of the positions what a calibration says that this radar gets wrong."""
        return replace(self, radar_errors=calibration.radar_errors)

    def misses_px(self, camera_from_radar: RigidTransform, camera: Camera | None = None) -> Values:
        """Return the distances (n,) between the projected points and their pixels; infinite behind the camera or nearly so.

        Args:
            camera_from_radar: the pose.
            camera: what projects; None uses the camera of the pairs.
        """
        points_radar_m = self.radar_errors.corrected(self.points_radar_m)
        apart = np.linalg.norm(
            (camera or self.camera).project(camera_from_radar @ points_radar_m) - self.pixels_px, axis=1
        )
        return np.where(far_outside(apart, self.camera), np.inf, apart)

    def median_miss_px(self, camera_from_radar: RigidTransform) -> float:
        """Return the median of these distances."""
        return float(np.median(self.misses_px(camera_from_radar)))


def read_check_pairs_file(path: Path) -> CheckPairs:
    """Read pairs-1, or the inliers of a calibration-1 file.

    Raises:
        InputError: the file cannot be read, is neither, or contains fewer than four pairs.
    """
    text = read_text(path, max_bytes=_MAX_BYTES, is_what="pairs-1 or calibration-1 JSON")
    return read_check_pairs(text, str(path))


def read_check_pairs(text: str, source: str = "pairs") -> CheckPairs:
    """Read pairs-1, or the inliers of a calibration-1 text with what that says about the radar's errors.

    Raises:
        InputError: it is neither, or contains fewer than four pairs.
    """
    if json_object(text, source=source).get("schema") == CALIBRATION_SCHEMA:
        calibration = read_calibration(text, source).calibration
        camera, radar_errors = calibration.camera, calibration.radar_errors
        inliers = [pair for pair in calibration.pairs if pair.inlier]
        points, pixels = [pair.point_radar_m for pair in inliers], [pair.pixel_px for pair in inliers]
    else:
        file = read_pairs(text, source)
        camera, radar_errors = file.camera, RadarErrors()
        points = [pair.candidates[0].position_radar_m for pair in file.pairs]
        pixels = [pair.pixel_px for pair in file.pairs]
    if len(points) < MIN_PAIRS:
        raise InputError(f"{source}: contains {len(points)} pairs; a check needs at least {MIN_PAIRS}")
    return CheckPairs(np.array(points), np.array(pixels), camera, radar_errors)


def by_pairs(imported: ImportedCalibration, pairs: CheckPairs) -> list[CheckResult]:
    """Check a calibration against pairs through its own lens: it fits, a slip explains why not, or nothing does.

    Another lens than that of the pairs is named.
    """
    lenses = lenses_of(imported, ImportedCalibration("pairs", imported.pose, camera=pairs.camera), None)
    lens = lenses.difference if lenses is not None else None
    if lens is None or lens.same or (lenses is not None and lenses.note):
        return [_by_pose(imported.pose, pairs, None)]
    message = f"the file's intrinsics are not those of the camera that saw the pairs: {lens.text}"
    if imported.camera is None or np.isnan(lens.rms_px):
        hint = "use the pairs of the same camera; the pairs were projected through their own"
        return [_by_pose(imported.pose, pairs, None), CheckResult("error", "other-lens", message, hint)]
    by_pose = pairs.misses_px(imported.camera_from_radar)
    alone = f"{shown(lens.rms_px)} px rms by the lens alone, {_half_within(by_pose)} by the pose alone"
    level: Literal["warning", "error"] = "error" if lens.rms_px > _OTHER_LENS_PX else "warning"
    result = CheckResult(level, "other-lens", f"{message}; {alone}", "give both the intrinsics of one camera")
    return [_by_pose(imported.pose, pairs, imported.camera), result]


def _half_within(misses_px: Values) -> str:
    missed_px = float(np.median(misses_px))
    return f"half of the pairs within {shown(missed_px)} px" if np.isfinite(missed_px) else f"half {LOST_TEXT}"


def _by_pose(pose: WrittenPose, pairs: CheckPairs, camera: Camera | None) -> CheckResult:
    near_px = _NEAR * float(np.hypot(pairs.camera.width_px, pairs.camera.height_px))
    misses_px = pairs.misses_px(pose.camera_from_radar(), camera)
    missed_px, count = float(np.median(misses_px)), len(pairs.points_radar_m)
    where = f"{shown(missed_px)} px or more from their pixels" if np.isfinite(missed_px) else LOST_TEXT
    aed = f", AED {shown(float(misses_px.mean()))} px" if np.isfinite(misses_px).all() else ""
    mismatch = f"half of the {count} pairs project {where}"
    if missed_px <= near_px:
        return CheckResult(
            "good", "pairs-fit", f"half of the {count} pairs project within {shown(missed_px)} px of their pixels{aed}"
        )
    undone = explain(pose, pairs.median_miss_px, min(near_px, _CLEARLY_BETTER * missed_px))
    if undone is not None:
        return explained(undone, mismatch)
    return CheckResult(
        "error",
        "pairs-missed",
        f"{mismatch}, not explained by a convention error",
        "the sensors moved, or the pose is wrong",
    )


_CLOSE_PX = 0.05


def by_own_pairs(imported: ImportedCalibration) -> list[CheckResult]:
    """Recompute the pair results that a calibration-1 file states."""
    file = imported.file
    pairs = [pair for pair in file.calibration.pairs if np.isfinite(pair.projected_px).all()] if file else []
    if file is None or not pairs:
        return []
    again = file.calibration.reproject(np.array([pair.point_radar_m for pair in pairs]))
    apart = np.linalg.norm(again - [pair.projected_px for pair in pairs], axis=1)
    tolerances = _tolerances_px(imported, pairs)
    wrong = [pair.id for pair, px, most in zip(pairs, apart, tolerances, strict=True) if not px <= most]
    if wrong:
        named = ", ".join(wrong[:5]) + (", ..." if len(wrong) > 5 else "")
        message = f"{len(wrong)} of {len(pairs)} pairs do not project where the file says ({named})"
        hint = "pose, camera or pairs were changed after solving; solve again"
        return [CheckResult("error", "pairs-disagree", message, hint)]
    results = [CheckResult("good", "pairs", f"all {len(pairs)} pairs project where the file says")]
    averaged_px = averaged_distances_px(file.calibration)
    aed_px = file.calibration.metrics.aed_px
    if len(averaged_px) and np.isfinite(aed_px) and abs(np.mean(averaged_px) - aed_px) > tolerances.max():
        which = "placements that agree" if file.calibration.options.models_noise else "pairs that are used"
        message = f"aed_px is {aed_px:.3f}, but the {which} average {np.mean(averaged_px):.3f} px"
        results.append(CheckResult("error", "metrics-disagree", message, "solve again"))
    return results


def _tolerances_px(imported: ImportedCalibration, pairs: list[PairResult]) -> Values:
    """Return how far (n,) each pair may project from where the file says: more if the numbers of the pose are rounded."""
    pose, rounding = imported.camera_from_radar, rounding_of(imported.pose)
    points_radar_m = np.array([pair.point_radar_m for pair in pairs])
    camera = imported.camera
    if camera is None or not rounding.is_harmless:
        return np.full(len(pairs), _CLOSE_PX)
    px_per_m = np.linalg.norm(camera.project_with_jacobian(pose @ points_radar_m)[1], axis=(1, 2))
    moved_m = np.array([rounding.at(point, pose) for point in points_radar_m])
    return np.asarray(_CLOSE_PX + np.where(np.isfinite(px_per_m), px_per_m * moved_m, 0.0))
