"""Check a calibration file: does it reproduce its check point, and if not, which slip explains it?"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.interchange.check.comparison import Comparison, compare, shown
from calib_core.interchange.check.explanation import CheckResult, explain, explained
from calib_core.interchange.check.pair_residuals import CheckPairs, by_pairs
from calib_core.interchange.check.slips import undone_slips
from calib_core.interchange.imported import ImportedCalibration, StatedCheckPoint, WrittenPose

__all__ = ["CheckReport", "Verdict", "check"]

Verdict = Literal["right", "wrong", "doubtful", "unproven"]
"""Confirmed; contradicted; implausible, with nothing to test it against; plausible, with nothing to test it against."""

_CHECK_POINT_UNUSED = "check-point-unused"
_HOW_TO_TEST = "test it with --against FILE (a calibration you trust) or --pairs FILE (radar positions and pixels)"
_SUMMARIES: dict[Verdict, tuple[str, ...]] = {
    "doubtful": (f"DOUBTFUL: this looks wrong, but the file has nothing to test it against; {_HOW_TO_TEST}",),
    "unproven": (
        f"not proven: nothing contradicts this pose, but the file has nothing to test it against; {_HOW_TO_TEST}",
    ),
}
_CLOSE = 1e-4
_CLOSE_PX = 0.05
_SAME_SENSORS_RAD = np.radians(10.0)
_SAME_SENSORS_M = 0.5
_CLEARLY_BETTER = 0.2
_EXACT_FIT = 1e-3
_ROUNDING = 1e-4
_FAR_M = 20.0
_SIDEWAYS_RAD = np.radians(60.0)
_FORWARD_RAD = np.radians(35.0)


@dataclass(frozen=True, slots=True, eq=False)
class CheckReport:
    """The report of a check.

    Attributes:
        imported: what was read.
        results: in the order of the checks.
        comparison: with the other calibration, if one was given.
    """

    imported: ImportedCalibration
    results: tuple[CheckResult, ...]
    comparison: Comparison | None = None

    def __str__(self) -> str:
        return "\n".join(self.lines())

    @property
    def ok(self) -> bool:
        """Whether there is no error; warnings do not count."""
        return all(result.level != "error" for result in self.results)

    @property
    def verdict(self) -> Verdict:
        """The overall verdict."""
        levels = {result.level for result in self.results}
        if "error" in levels:
            return "wrong"
        if "good" in levels:
            return "right"
        return "doubtful" if any(result.code != _CHECK_POINT_UNUSED for result in self.results) else "unproven"

    def lines(self) -> tuple[str, ...]:
        """Return the report as readable lines."""
        frames = self.imported.frames
        named = f", radar {frames.radar!r}, camera {frames.camera!r}" if frames else ", frames not named"
        rows = [f"read as {self.imported.format}{named}"]
        rows += [f"note: {note}" for note in self.imported.notes]
        for result in self.results:
            label = {"good": "ok", "warning": "warning", "error": "WRONG"}[result.level]
            rows.append(f"{label}: {result.message}" + (f"; {result.hint}" if result.hint else ""))
        if self.comparison is not None:
            rows += [f"compared with the other: {line}" for line in self.comparison.lines()]
        return (*rows, *_SUMMARIES.get(self.verdict, ()))


def check(
    imported: ImportedCalibration,
    *,
    against: ImportedCalibration | None = None,
    camera: Camera | None = None,
    pairs: CheckPairs | None = None,
) -> CheckReport:
    """Check a calibration against its own check point, another calibration and pairs, and for plausibility.

    Args:
        imported: what read_any returned.
        against: a calibration of the same sensors that is known to be right.
        camera: the intrinsics, if the file has none.
        pairs: radar positions and the pixels where they were seen.
    """
    results = [
        CheckResult("error", "contradiction", fault, "correct the one that is wrong") for fault in imported.faults
    ]
    camera = imported.camera or camera or (against.camera if against else None) or (pairs.camera if pairs else None)
    stated = imported.check_point
    if stated is not None:
        results.append(_by_check_point(imported.pose, stated, camera))
    if against is not None:
        results.append(_by_other(imported.pose, against.camera_from_radar))
    if pairs is not None:
        results.append(by_pairs(imported.pose, pairs.under(imported.file.calibration) if imported.file else pairs))
    if imported.file is not None:
        results += _by_its_pairs(imported)
    pose_tests = [result for result in results if result.code not in ("contradiction", _CHECK_POINT_UNUSED)]
    if not pose_tests or (against is None and not any(result.level == "error" for result in pose_tests)):
        results += _by_plausibility(imported.pose, verified=bool(pose_tests))
    comparison = compare(against, imported, camera=camera) if against is not None else None
    return CheckReport(imported, tuple(results), comparison)


def _by_check_point(pose: WrittenPose, stated: StatedCheckPoint, camera: Camera | None) -> CheckResult:
    point = "(" + ", ".join(f"{value:.4g}" for value in stated.radar_m) + ") m"
    if stated.camera_m is None and camera is None:
        return CheckResult(
            "warning",
            _CHECK_POINT_UNUSED,
            f"the check point {point} is given as a pixel, but there is no camera to project it with",
            "check it with --against calibration.json, which has the camera",
        )

    def miss(candidate: RigidTransform) -> float:
        return _miss(candidate, stated, camera)

    missed = miss(pose.camera_from_radar())
    if missed <= 1.0:
        return CheckResult("good", "check-point", f"the check point {point} is reproduced")
    undone = explain(pose, miss, 1.0)
    mismatch = _mismatch(pose.camera_from_radar(), stated, camera)
    if undone is None:
        return CheckResult(
            "error",
            "check-point-missed",
            f"the check point {point} {mismatch}, and no known slip explains it",
            "the numbers were changed; export the file again",
        )
    return explained(undone, f"the check point {point} {mismatch}")


def _miss(candidate: RigidTransform, stated: StatedCheckPoint, camera: Camera | None) -> float:
    """Return the error of the check point in units of the tolerance."""
    point_camera_m = candidate @ stated.radar_m[None]
    if stated.camera_m is not None:
        return float(np.linalg.norm(point_camera_m[0] - stated.camera_m) / (_CLOSE * np.linalg.norm(stated.camera_m)))
    if stated.pixel_px is None or camera is None:
        return float("inf")
    apart = float(np.hypot(*(camera.project(point_camera_m)[0] - stated.pixel_px))) / _CLOSE_PX
    return apart if np.isfinite(apart) else float("inf")


def _mismatch(candidate: RigidTransform, stated: StatedCheckPoint, camera: Camera | None) -> str:
    point_camera_m = candidate @ stated.radar_m[None]
    if stated.pixel_px is not None and camera is not None:
        pixel = camera.project(point_camera_m)[0]
        there = f"to ({pixel[0]:.1f}, {pixel[1]:.1f})" if np.isfinite(pixel).all() else "behind the camera"
        return f"projects {there} instead of to pixel ({stated.pixel_px[0]:.1f}, {stated.pixel_px[1]:.1f})"
    wanted = stated.camera_m if stated.camera_m is not None else np.full(3, np.nan)
    got, want = (", ".join(f"{value:.3f}" for value in point) for point in (point_camera_m[0], wanted))
    return f"is at ({got}) m in the camera frame instead of ({want}) m"


def _apart(a: RigidTransform, b: RigidTransform) -> tuple[float, float]:
    return rotation_angle_rad(a.rotation @ b.rotation.T), float(np.linalg.norm(a.translation_m - b.translation_m))


def _by_other(pose: WrittenPose, other: RigidTransform) -> CheckResult:
    """Compare with a pose known to be right: two calibrations differ a little; a large difference needs an explanation."""

    def miss(candidate: RigidTransform) -> float:
        angle, distance_m = _apart(candidate, other)
        return max(angle / _SAME_SENSORS_RAD, distance_m / _SAME_SENSORS_M)

    missed = miss(pose.camera_from_radar())
    angle, distance_m = _apart(pose.camera_from_radar(), other)
    difference = f"{shown(np.degrees(angle))} deg and {shown(distance_m)} m from the other calibration"
    exact = explain(pose, miss, _EXACT_FIT * missed) if missed > _ROUNDING else None
    if exact is not None:  # the same calibration except for a slip, however small its effect
        return explained(exact, difference)
    undone = explain(pose, miss, min(1.0, _CLEARLY_BETTER * missed))
    if missed <= _CLEARLY_BETTER or (missed <= 1.0 and undone is None):
        return CheckResult("good", "agrees", f"agrees: {difference}")
    if undone is not None:
        found = explained(undone, difference)
        level: Literal["warning", "error"] = "error" if missed > 1.0 else "warning"
        return CheckResult(level, found.code, found.message, found.hint)
    return CheckResult(
        "error",
        "disagrees",
        f"{difference}, and no known slip explains it",
        "the sensors moved, or one of the two is wrong",
    )


def _by_its_pairs(imported: ImportedCalibration) -> list[CheckResult]:
    """Recompute the pair results that a calibration-1 file states."""
    file = imported.file
    pairs = [pair for pair in file.calibration.pairs if np.isfinite(pair.projected_px).all()] if file else []
    if file is None or not pairs:
        return []
    again = file.calibration.reproject(np.array([pair.point_radar_m for pair in pairs]))
    apart = np.linalg.norm(again - [pair.projected_px for pair in pairs], axis=1)
    wrong = [pair.id for pair, px in zip(pairs, apart, strict=True) if not px <= _CLOSE_PX]
    if wrong:
        named = ", ".join(wrong[:5]) + (", ..." if len(wrong) > 5 else "")
        message = f"{len(wrong)} of {len(pairs)} pairs do not project where the file says ({named})"
        hint = "pose, camera or pairs were changed after solving; solve again"
        return [CheckResult("error", "pairs-disagree", message, hint)]
    results = [CheckResult("good", "pairs", f"all {len(pairs)} pairs project where the file says")]
    as_printed = file.calibration.options.method == "paper"  # averages what RANSAC left out, too
    averaged = [pair.distance_px for pair in pairs if (not pair.excluded if as_printed else pair.inlier)]
    aed_px = file.calibration.metrics.aed_px
    if averaged and np.isfinite(aed_px) and abs(np.mean(averaged) - aed_px) > _CLOSE_PX:
        which = "pairs that are used" if as_printed else "inliers"
        message = f"aed_px is {aed_px:.3f}, but the {which} average {np.mean(averaged):.3f} px"
        results.append(CheckResult("error", "metrics-disagree", message, "solve again"))
    return results


def _by_plausibility(pose: WrittenPose, *, verified: bool) -> list[CheckResult]:
    """Warn about poses that two forward-looking sensors on one vehicle do not have; other rigs may have them."""
    results = []
    camera_from_radar = pose.camera_from_radar()
    distance_m = float(np.linalg.norm(camera_from_radar.translation_m))
    if distance_m > _FAR_M:
        message = f"the sensors are {distance_m:.4g} m apart"
        results.append(CheckResult("warning", "far-apart", message, "is the translation in millimetres?"))
    off = _off_forward(camera_from_radar)
    if off > _SIDEWAYS_RAD and not verified:
        likely = [s for s in undone_slips(pose) if len(s.slips) == 1 and _is_forward(s.pose)]
        hint = "if it is not mounted like that, perhaps " + ", or ".join(
            dict.fromkeys(s.slips[0].message for s in likely)
        )
        message = f"the camera points {np.degrees(off):.0f} deg away from the radar's x axis"
        results.append(
            CheckResult("warning", "looks-elsewhere", message, hint if likely else "is it mounted like that?")
        )
    return results


def _off_forward(camera_from_radar: RigidTransform) -> float:
    """Return the angle between the camera's viewing direction and the radar's x axis [rad]."""
    return float(np.arccos(np.clip(camera_from_radar.rotation[2, 0], -1.0, 1.0)))


def _is_forward(pose: WrittenPose) -> bool:
    """Return whether the camera is upright and looks along the radar's x axis."""
    try:
        camera_from_radar = pose.camera_from_radar()
    except ValueError:
        return False
    upright = -camera_from_radar.rotation[1, 2]
    return _off_forward(camera_from_radar) < _FORWARD_RAD and upright > np.cos(_FORWARD_RAD)
