"""Does a pose agree with that of another calibration, and if not, which slip explains it?"""

from collections.abc import Callable

import numpy as np

from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.interchange.check.agreement import WITHOUT_COVARIANCE, AgreementLimits, Judgement
from calib_core.interchange.check.comparison import Comparison
from calib_core.interchange.check.pixel_differences import shown
from calib_core.interchange.check.slips import CheckResult, explain, explained
from calib_core.interchange.imported import ImportedCalibration, WrittenPose

_COARSE_RAD = np.radians(10.0)
_COARSE_M = 0.5
_CLEARLY_BETTER = 0.2
_EXACT_FIT, _EXACT = 1e-3, 1e-2
_ROUNDING = 1e-4


def by_other_calibration(
    imported: ImportedCalibration,
    other: ImportedCalibration,
    comparison: Comparison,
    judgement: Judgement,
    limits: AgreementLimits,
    *,
    changed: bool = False,
) -> list[CheckResult]:
    """Return whether the two agree as judged; a slip that explains their difference is named, however small its effect.

    Args:
        imported: what is checked.
        other: a calibration known to be right.
        comparison: of the two.
        judgement: on the comparison.
        limits: that it was judged by.
        changed: no slip explains how the file misses its own check point, so none is guessed from a rough fit either.
    """
    difference = (
        f"{shown(comparison.rotation_deg)} deg and {shown(comparison.position_cm)} cm from the other calibration"
    )
    only_exact = judgement.agree or changed
    slipped = _slipped(imported.pose, other.camera_from_radar, limits, difference, only_exact=only_exact)
    lens = _by_lens(comparison, judgement)
    if slipped is not None:
        return [slipped, *lens]
    if judgement.agree:
        return [CheckResult("good", "agrees", f"agrees: {difference}; {judgement.text}"), *lens]
    if lens and all(one.met or one.name == "lens_px" for one in judgement.criteria):
        return lens
    return [
        CheckResult(
            "error",
            "disagrees",
            f"{difference}; {judgement.text}, and no known slip explains it",
            "the sensors moved, or one of the two is wrong",
        ),
        *lens,
    ]


def _slipped(
    pose: WrittenPose, other: RigidTransform, limits: AgreementLimits, difference: str, *, only_exact: bool
) -> CheckResult | None:
    coarse = _misses(other, _COARSE_RAD, _COARSE_M)
    missed = coarse(pose.camera_from_radar())
    exact = explain(pose, coarse, min(_EXACT_FIT * missed, _EXACT)) if missed > _ROUNDING else None
    if exact is not None:
        return explained(exact, difference)
    if only_exact:
        return None
    deg = WITHOUT_COVARIANCE["deg"] if limits.max_deg is None else limits.max_deg
    cm = WITHOUT_COVARIANCE["cm"] if limits.max_cm is None else limits.max_cm
    fine = _misses(other, np.radians(max(deg, WITHOUT_COVARIANCE["deg"])), max(cm, WITHOUT_COVARIANCE["cm"]) / 100.0)
    undone = explain(pose, fine, min(1.0, _CLEARLY_BETTER * fine(pose.camera_from_radar())), most=1)
    if undone is None and missed > 1.0:
        undone = explain(pose, coarse, min(1.0, _CLEARLY_BETTER * missed))
    return explained(undone, difference) if undone else None


def _misses(other: RigidTransform, angle_rad: float, distance_m: float) -> Callable[[RigidTransform], float]:
    """Return a function that measures how far a pose is from the other, in units of an angle and a distance."""

    def miss(candidate: RigidTransform) -> float:
        angle = rotation_angle_rad(candidate.rotation @ other.rotation.T)
        return max(angle / angle_rad, float(np.linalg.norm(candidate.translation_m - other.translation_m)) / distance_m)

    return miss


def _by_lens(comparison: Comparison, judgement: Judgement) -> list[CheckResult]:
    """Return what to say of the lens: nothing if the two are one."""
    lens = comparison.lens
    if lens is None or lens.same:
        return []
    by_how_much = "" if np.isnan(lens.rms_px) else f", {shown(lens.rms_px)} px rms by the lens alone"
    message = f"the two have different intrinsics{by_how_much}: {lens.text}"
    if comparison.lens_note:
        hint = f"{comparison.lens_note}; right only for pictures undistorted with this very matrix"
        return [CheckResult("warning", "other-lens", message, hint)]
    beyond = not all(one.met for one in judgement.criteria if one.name == "lens_px")
    hint = "use one camera's intrinsics in both, or compare calibrations of one camera"
    return [CheckResult("error" if beyond else "warning", "other-lens", message, hint)]
