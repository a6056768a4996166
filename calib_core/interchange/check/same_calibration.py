"""Is a file that calibration's file: the same pose up to the digits written, the same lens and frames, and not stale?"""

import numpy as np

from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.interchange.check.pixel_differences import Lenses, lenses_of, shown
from calib_core.interchange.check.slips import CheckResult, explain, explained, rounding_of, within_rounding
from calib_core.interchange.imported import ImportedCalibration
from calib_core.interchange.own.calibration_json import calibration_sha256

_TINY = 1e-6
_SLIP_FIT, _CLOSE = 1e-3, 1e-3


def by_its_calibration(imported: ImportedCalibration, origin: ImportedCalibration) -> list[CheckResult]:
    """Compare a file with the calibration that it should have been made from.

    Args:
        imported: what is checked.
        origin: that calibration.
    """
    results = [_by_pose(imported, origin)]
    lenses = lenses_of(imported, origin, None)
    if lenses is not None and lenses.difference is not None:
        results.append(_by_lens(lenses))
    stale = _stale(imported, origin, same_pose=results[0].level == "good")
    old = [result for result in stale if result.level == "error"]
    if imported.frames is not None and origin.frames is not None and imported.frames != origin.frames:
        results.append(_other_frames(imported, origin, renamed=not stale and imported.calibration_sha256 is not None))
    return [*old, *results] if old else [*results, *stale]


def _by_pose(imported: ImportedCalibration, origin: ImportedCalibration) -> CheckResult:
    pose, right = imported.pose, origin.camera_from_radar
    found = imported.camera_from_radar
    deg = np.degrees(rotation_angle_rad(found.rotation @ right.rotation.T))
    cm = 100.0 * float(np.linalg.norm(found.inverse().translation_m - right.inverse().translation_m))
    difference = f"{shown(deg)} deg and {shown(cm)} cm from that calibration"
    missed = _miss(found, right)
    if missed <= _TINY * (1.0 + float(np.linalg.norm(right.translation_m))):
        return CheckResult("good", "same-pose", "the pose is that calibration's")
    undone = explain(pose, lambda candidate: _miss(candidate, right), max(_TINY, min(_SLIP_FIT * missed, _CLOSE)))
    if undone is not None:
        return explained(undone, difference)
    rounding = rounding_of(pose)
    if within_rounding(pose, right, rounding):
        if rounding.is_harmless:
            return CheckResult("good", "same-pose", f"the pose is that calibration's; {rounding.text}: {difference}")
        return CheckResult("error", "rounded", f"{difference}: {rounding.text}", "export it again with all digits")
    return CheckResult(
        "error",
        "other-pose",
        f"{difference}, and no known slip explains it",
        "it is not this calibration's file, or was changed: export it again",
    )


def _miss(candidate: RigidTransform, right: RigidTransform) -> float:
    angle_rad = rotation_angle_rad(candidate.rotation @ right.rotation.T)
    return max(angle_rad, float(np.linalg.norm(candidate.translation_m - right.translation_m)))


def _by_lens(lenses: Lenses) -> CheckResult:
    lens = lenses.difference
    assert lens is not None
    if lens.same:
        return CheckResult("good", "same-lens", "the lens is that calibration's")
    by_how_much = "" if np.isnan(lens.rms_px) else f", {shown(lens.rms_px)} px rms apart"
    message = f"the intrinsics are not that calibration's{by_how_much}: {lens.text}"
    if lenses.note:
        return CheckResult(
            "warning", "other-lens", message, f"{lenses.note}; right only for pictures undistorted with it"
        )
    return CheckResult("error", "other-lens", message, "export it again, or put back the intrinsics")


def _other_frames(imported: ImportedCalibration, origin: ImportedCalibration, *, renamed: bool) -> CheckResult:
    found, wanted = imported.frames, origin.frames
    assert found is not None
    assert wanted is not None
    message = (
        f"the file names radar {found.radar!r} and camera {found.camera!r}, the calibration radar {wanted.radar!r} and "
        f"camera {wanted.camera!r}"
    )
    if (found.radar, found.camera) == (wanted.camera, wanted.radar):
        return CheckResult("error", "swapped-frames", f"the two frame names are swapped: {message}", "swap them back")
    if renamed:
        return CheckResult("warning", "other-frames", message, "right if the frames were renamed on purpose")
    return CheckResult("error", "other-frames", message, "rename the frames in one of the two")


def _stale(imported: ImportedCalibration, origin: ImportedCalibration, *, same_pose: bool) -> list[CheckResult]:
    """Return what the file's statement of its origin shows: nothing if it states none, or the same one."""
    if imported.calibration_sha256 is None or origin.file is None:
        return []
    right = calibration_sha256(origin.file)
    if imported.calibration_sha256 == right:
        return []
    message = (
        f"stale: exported from another calibration than this one (sha256 {imported.calibration_sha256[:12]}..., "
        f"this one's is {right[:12]}...)"
    )
    if same_pose:
        return [CheckResult("warning", "stale", f"{message}, whose pose is the same", "export it again to be sure")]
    return [CheckResult("error", "stale", message, "export it again from this calibration")]
