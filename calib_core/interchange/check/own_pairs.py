"""Do the pairs of a calibration-1 file project where the file says?"""

import numpy as np

from calib_core.arrays import Values
from calib_core.interchange.check.explanation import CheckResult
from calib_core.interchange.check.rounding import rounding_of
from calib_core.interchange.imported import ImportedCalibration
from calib_core.results import PairResult

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
    as_printed = not file.calibration.options.models_noise  # averages what disagrees, too
    averaged = [pair.distance_px for pair in pairs if (not pair.excluded if as_printed else pair.inlier)]
    aed_px = file.calibration.metrics.aed_px
    if averaged and np.isfinite(aed_px) and abs(np.mean(averaged) - aed_px) > tolerances.max():
        which = "pairs that are used" if as_printed else "inliers"
        message = f"aed_px is {aed_px:.3f}, but the {which} average {np.mean(averaged):.3f} px"
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
