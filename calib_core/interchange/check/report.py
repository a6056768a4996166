"""Check a calibration file: its check point, its plausibility, its pairs, other calibrations; a mismatch comes with its slip.

The report is written as JSON with documented keys, and as JUnit XML for continuous integration.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal
from xml.etree import ElementTree

import msgspec
import numpy as np

from calib_core.camera import Camera
from calib_core.estimation.pose_change import AXES
from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.input_files import encodable
from calib_core.interchange.check.agreement import (
    LEVEL,
    AgreementLimits,
    Comparison,
    Judgement,
    by_other_calibration,
    compare,
    judge,
)
from calib_core.interchange.check.pair_residuals import CheckPairs, by_own_pairs, by_pairs
from calib_core.interchange.check.pixel_differences import LOST_TEXT, Lenses, far_outside, lenses_of, shown
from calib_core.interchange.check.slips import (
    QUESTIONS,
    CheckResult,
    Rounding,
    answering,
    explain,
    explained,
    rounding_of,
    undone_slips,
    within_rounding,
)
from calib_core.interchange.format import ImportedCalibration, StatedCheckPoint, WrittenPose
from calib_core.interchange.format import imported as calibration_imported
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.interchange.own.raw_data import for_raw
from calib_core.interchange.rotations import looks_forward, off_forward_rad
from calib_core.interchange.syntax.strict_json import json_text
from calib_core.radar import RadarErrors
from calib_core.words.warnings import warning_remark

Verdict = Literal["right", "wrong", "doubtful", "unproven"]
"""Confirmed; contradicted; implausible, with nothing to test it against; plausible, with nothing to test it against."""

_HOW_TO_TEST = "test it with --against FILE (a calibration you trust) or --pairs FILE (radar positions and pixels)"
_SUMMARIES: dict[Verdict, tuple[str, ...]] = {
    "doubtful": (f"DOUBTFUL: this looks wrong, but the file has nothing to test it against; {_HOW_TO_TEST}",),
    "unproven": (
        f"not proven: nothing contradicts this pose, but the file has nothing to test it against; {_HOW_TO_TEST}",
    ),
}
_ASSUMED = "what this pose rests on was assumed when it was imported, and its own check point shows only that the file is whole"
_SELF_EVIDENCE = frozenset({"check-point", "pairs"})
"""Results of what a file says of itself: no proof of a pose whose meaning was assumed."""
_BORROWED_EVIDENCE = {"against": frozenset({"agrees"}), "of": frozenset({"same-pose", "same-lens"})}
"""Results of what another file says: no proof either if the meaning of that one's pose was assumed."""
_DIFFERENCES = frozenset({"disagrees"})
_ANY_SIZE_PX = (1000, 1000)
_ASSUMED_REFERENCE = "assumed-reference"
_CONTRADICTORY, _RADAR_MISSING = "contradictory", "radar-missing"
_IMPLAUSIBLE = frozenset({"far-apart", "looks-elsewhere", "on-its-side", "placeholder", _CONTRADICTORY})


@dataclass(frozen=True, slots=True, eq=False)
class CheckReport:
    """The report of a check.

    Attributes:
        imported: what was read.
        results: in the order of the checks.
        comparison: with the other calibration, if one was given.
        judgment: on the comparison.
        no_proof: codes of results that prove nothing, because they rest on a meaning that was assumed.
    """

    imported: ImportedCalibration
    results: tuple[CheckResult, ...]
    comparison: Comparison | None = None
    judgement: Judgement | None = None
    no_proof: frozenset[str] = frozenset()

    def __str__(self) -> str:
        return "\n".join(self.lines())

    @property
    def ok(self) -> bool:
        """Whether there is no error; warnings do not count."""
        return all(result.level != "error" for result in self.results)

    @property
    def verdict(self) -> Verdict:
        """The overall verdict."""
        if not self.ok:
            return "wrong"
        if any(result.level == "good" and result.code not in self.no_proof for result in self.results):
            return "right"
        return "doubtful" if any(result.code in _IMPLAUSIBLE for result in self.results) else "unproven"

    @property
    def agree(self) -> bool | None:
        """Whether the two calibrations agree; None without another one."""
        return None if self.judgement is None else self.judgement.agree

    @property
    def p_value(self) -> float | None:
        """How often right calibrations differ by as much, by their covariances; None if these do not say."""
        change = self.comparison.change if self.comparison is not None else None
        return None if change is None else change.p_value

    @property
    def noticeable(self) -> dict[str, float] | None:
        """The change along each axis that would be noticed with 95 %, such as "rotX_deg"; None if the covariances do not say."""
        change = self.comparison.change if self.comparison is not None else None
        if change is None:
            return None
        sizes = zip(AXES, change.noticeable(LEVEL).tolist(), strict=True)
        return {f"{axis}_{'deg' if k < 3 else 'cm'}": size for k, (axis, size) in enumerate(sizes)}

    @property
    def rests_on_assumption(self) -> bool:
        """Whether the file says that the meaning of its pose was assumed."""
        return self.imported.evidence == "imported_assumed"

    def lines(self) -> tuple[str, ...]:
        """Return the report as readable lines."""
        frames = self.imported.frames
        named = f", radar {frames.radar!r}, camera {frames.camera!r}" if frames else ", frames not named"
        rows = [f"read as {self.imported.format}{named}"]
        if self.imported.for_raw:
            rows.append("note: its pose is for radar data as reported, without corrections, and is compared as such")
        rows += [f"assumed: {assumption.removeprefix('assumed ')}" for assumption in self.imported.assumptions]
        rows += [f"note: {note}" for note in self.imported.notes]
        stated = self.imported.file.verdict if self.imported.file is not None else None
        if stated is not None and stated.level != "contradictory":  # which is a result
            rows.append(f"stored verdict: {stated.line}")
        for result in self.results:
            rows.append(f"{_label(result)}: {result.message}" + (f"; {result.hint}" if result.hint else ""))
        if self.comparison is not None:
            rows += [f"compared with the other: {line}" for line in self.comparison.lines()]
        if self.rests_on_assumption and self.verdict in ("unproven", "doubtful"):
            rows.append(f"note: {_ASSUMED}")
        return (*rows, *_SUMMARIES.get(self.verdict, ()))


def _label(result: CheckResult) -> str:
    if result.level == "error" and result.code in _DIFFERENCES:
        return "DIFFERS"
    return {"good": "ok", "warning": "warning", "error": "WRONG"}[result.level]


def check(
    imported: ImportedCalibration,
    *,
    against: ImportedCalibration | None = None,
    of: ImportedCalibration | None = None,
    limits: AgreementLimits | None = None,
    camera: Camera | None = None,
    pairs: CheckPairs | None = None,
    same_sensors: bool = False,
    same_person: bool = False,
) -> CheckReport:
    """Check a calibration against its own check point, another calibration and pairs, and for plausibility.

    Args:
        imported: what read_any returned.
        against: a calibration of the same sensors that is known to be right: do the two agree?
        of: the calibration that the file should have been made from: is it that calibration's file?
        limits: what counts as agreement with `against`; None judges by the covariances.
        camera: the intrinsics, if the file has none.
        pairs: radar positions and the pixels where they were seen.
        same_sensors: radar and camera of `against` are the same, whatever serials, topics and intrinsics say.
        same_person: the same person clicked the same reflector in both.

    Raises:
        InputError: a limit cannot be tested with these files.
    """
    if imported.for_raw:
        of, against = (None if one is None else _as_reported(one) for one in (of, against))
        pairs = None if pairs is None else dataclasses.replace(pairs, radar_errors=RadarErrors())
    faults = [
        CheckResult("error", "contradiction", fault, "correct the one that is wrong") for fault in imported.faults
    ]
    results = answering("consistent", faults)
    known = (imported, of, against, pairs)
    camera = imported.camera or camera or next((one.camera for one in known if one and one.camera), None)
    stated = imported.check_point
    if stated is not None:
        point = by_check_point(imported.pose, stated, camera, own=_own_camera(imported))
        results += answering("check-point", [point])
    if of is not None:
        results += answering("of", by_its_calibration(imported, of))
    comparison = (
        compare(against, imported, camera=camera, same_sensors=same_sensors, same_person=same_person)
        if against is not None
        else None
    )
    judgement = judge(comparison, limits or AgreementLimits()) if comparison is not None else None
    if against is not None and comparison is not None and judgement is not None:
        changed = any(result.code == CHECK_POINT_MISSED for result in results)
        agreement = by_other_calibration(
            imported, against, comparison, judgement, limits or AgreementLimits(), changed=changed
        )
        results += answering("against", agreement)
    if pairs is not None:
        given = pairs.under(imported.file.calibration) if imported.file else pairs
        results += answering("pairs", by_pairs(imported, given))
    results += answering("own-pairs", by_own_pairs(imported))
    no_proof = _no_proof(imported, against=against, of=of)
    results += answering("solved", _by_own_verdict(imported))
    results += [
        CheckResult(
            "warning",
            _ASSUMED_REFERENCE,
            f"what the file given with --{option} means was assumed when it was imported: being like it proves nothing",
            "prove that one first: cocalib import FILE --pairs PAIRS",
            option,
        )
        for option, other in (("against", against), ("of", of))
        if _is_assumed(other)
    ]
    untested = {"contradiction", CHECK_POINT_UNUSED, _ASSUMED_REFERENCE, _CONTRADICTORY, _RADAR_MISSING, *no_proof}
    tested = [result for result in results if result.code not in untested]
    if not tested or (against is None and not any(result.level == "error" for result in tested)):
        results += answering("plausible", by_plausibility(imported.pose, verified=bool(tested)))
    return CheckReport(imported, tuple(results), comparison, judgement, no_proof)


def _as_reported(other: ImportedCalibration) -> ImportedCalibration:
    """Return another calibration as its pose for radar data as reported, if it has the pairs to solve it from.

    Raises:
        InputError: its pairs determine no such pose.
    """
    return other if other.for_raw or other.file is None else calibration_imported(for_raw(other.file))


def _own_camera(imported: ImportedCalibration) -> Camera | None:
    """Return the file's camera; that of rectified images has no size in the files, and needs none to project a point."""
    if imported.camera is not None or imported.check_point is None or imported.check_point.rectified_px is None:
        return imported.camera
    try:
        return imported.camera_for(_ANY_SIZE_PX)
    except ValueError:  # not a camera matrix; reading or importing it says so
        return None


def _no_proof(imported: ImportedCalibration, **others: ImportedCalibration | None) -> frozenset[str]:
    """Return the codes of the results that prove nothing, because what they rest on was assumed."""
    codes = _SELF_EVIDENCE if imported.evidence == "imported_assumed" or _by_own_verdict(imported) else frozenset()
    return codes.union(*(_BORROWED_EVIDENCE[option] for option, other in others.items() if _is_assumed(other)))


def _by_own_verdict(imported: ImportedCalibration) -> list[CheckResult]:
    """Pass on that the pose was in doubt when it was solved: then its own check point and pairs prove nothing."""
    file = imported.file
    if file is None or file.verdict is None:
        return []
    if file.is_contradictory:
        message = f"contradictory when it was solved: {file.verdict.reason}"
        return [CheckResult("warning", _CONTRADICTORY, message, file.verdict.action)]
    missing = [warning_remark(one) for one in file.calibration.warnings if one.code == _RADAR_MISSING]
    return [CheckResult("warning", _RADAR_MISSING, str(one.message), str(one.hint)) for one in missing]


def _is_assumed(other: ImportedCalibration | None) -> bool:
    return other is not None and other.evidence == "imported_assumed"


_FAR_M = 20.0
_SIDEWAYS_RAD = np.radians(60.0)
_NAMED = 3
_PARALLEL = 1e-9
_SEEN = 0.5


def by_plausibility(pose: WrittenPose, *, verified: bool) -> list[CheckResult]:
    """Warn about poses that two forward-looking sensors on one vehicle do not have; other rigs may have them."""
    results = []
    camera_from_radar = pose.camera_from_radar()
    distance_m = float(np.linalg.norm(camera_from_radar.translation_m))
    if distance_m > _FAR_M:
        message = f"the sensors are {distance_m:.4g} m apart"
        results.append(CheckResult("warning", "far-apart", message, "is the translation in millimeters?"))
    if not verified and _is_placeholder(camera_from_radar):
        message = "the camera is exactly at the radar's place, turned by exact right angles"
        results.append(CheckResult("warning", "placeholder", message, "is this the placeholder of a template?"))
    off = off_forward_rad(camera_from_radar)
    if off > _SIDEWAYS_RAD and not verified:
        likely = [s for s in undone_slips(pose) if len(s.slips) == 1 and _is_forward(s.pose)]
        hint = "if it is not mounted like that, perhaps " + ", or ".join(
            list(dict.fromkeys(s.slips[0].message for s in likely))[:_NAMED]
        )
        message = f"the camera points {np.degrees(off):.0f} deg away from the radar's x axis"
        results.append(
            CheckResult("warning", "looks-elsewhere", message, hint if likely else "is it mounted like that?")
        )
    lean = _lean(camera_from_radar)
    if off <= _SIDEWAYS_RAD and lean > _SIDEWAYS_RAD and not verified:
        message = f"the image leans {np.degrees(lean):.0f} deg to one side"
        hint = "if the camera is not mounted like that, perhaps its frame has other axes: optical (z forward) or body (x forward)"
        results.append(CheckResult("warning", "on-its-side", message, hint))
    return results


def _lean(camera_from_radar: RigidTransform) -> float:
    """Return how far the radar's up axis leans to one side in the image [rad]; 0 where it is seen from its end."""
    right, down = camera_from_radar.rotation[0, 2], camera_from_radar.rotation[1, 2]
    return abs(float(np.arctan2(right, -down))) if np.hypot(right, down) > _SEEN else 0.0


def _is_placeholder(camera_from_radar: RigidTransform) -> bool:
    """Return whether a pose is what templates contain: no distance, and axes that are parallel to the last digit."""
    rotation = camera_from_radar.rotation
    parallel = np.abs(np.abs(rotation) - np.abs(rotation).round()).max() <= _PARALLEL
    return bool(parallel and not camera_from_radar.translation_m.any())


def _is_forward(pose: WrittenPose) -> bool:
    """Return whether the camera is upright and looks along the radar's x axis."""
    try:
        return looks_forward(pose.camera_from_radar())
    except ValueError:
        return False


CHECK_POINT_MISSED = "check-point-missed"
CHECK_POINT_UNUSED = "check-point-unused"
_CLOSE = 1e-4
_CLOSE_PX = 0.05
_OWN_LENS_PX = 0.01


def by_check_point(
    pose: WrittenPose, stated: StatedCheckPoint, camera: Camera | None, *, own: Camera | None = None
) -> CheckResult:
    """Recompute the check point; if the pose misses it, find the slip or the rounding that explains it.

    Args:
        pose: as written.
        stated: the check point.
        camera: what projects it, if only its pixel is stated.
        own: the camera in the file; it must project the point in the camera frame to the pixel, if both are stated.
    """
    point = "(" + ", ".join(f"{value:.4g}" for value in stated.radar_m) + ") m"
    if stated.camera_m is None and camera is None:
        return CheckResult(
            "warning",
            CHECK_POINT_UNUSED,
            f"the check point {point} is given as a pixel, but there is no camera to project it with",
            "check it with --of calibration.json, which has the camera",
        )

    def miss(candidate: RigidTransform) -> float:
        return _miss(candidate, stated, camera)

    missed = miss(pose.camera_from_radar())
    if missed <= 1.0:
        return _by_own_lens(pose, stated, own, point)
    rounding = rounding_of(pose)
    rounded = _explains(rounding, pose, stated, camera)
    if rounded and rounding.is_harmless:
        return CheckResult("good", "check-point", f"the check point {point} is reproduced; {rounding.text}")
    undone = explain(pose, miss, 1.0)
    mismatch = f"the check point {point} {_mismatch(pose.camera_from_radar(), stated, camera)}"
    if undone is not None:
        return explained(undone, mismatch)
    if rounded:
        return CheckResult("error", "rounded", f"{mismatch}: {rounding.text}", "write all the digits")
    return CheckResult(
        "error",
        CHECK_POINT_MISSED,
        f"{mismatch}, not explained by a convention error",
        "the numbers were changed; export the file again",
    )


def _by_own_lens(pose: WrittenPose, stated: StatedCheckPoint, own: Camera | None, point: str) -> CheckResult:
    """Return the result for a pose that reproduces the point: good, unless the file's own camera puts it elsewhere."""
    pixel_px = stated.pixel_px if stated.rectified_px is None else stated.rectified_px
    if own is not None and stated.camera_m is not None and pixel_px is not None:
        pixel = own.project(stated.camera_m[None])[0]
        if not np.hypot(*(pixel - pixel_px)) <= _OWN_LENS_PX:
            seen = dataclasses.replace(stated, camera_m=None, pixel_px=pixel_px)
            mismatch = _mismatch(pose.camera_from_radar(), seen, own)
            return CheckResult(
                "error",
                "other-lens",
                f"the check point {point} is right in the camera frame, but {mismatch}: the intrinsics are another camera's",
                "export the file again, or put back the camera that it was solved with",
            )
    return CheckResult("good", "check-point", f"the check point {point} is reproduced")


def _explains(rounding: Rounding, pose: WrittenPose, stated: StatedCheckPoint, camera: Camera | None) -> bool:
    """Return whether rounding alone can have moved the check point as far as it is from where it should be."""
    camera_from_radar = pose.camera_from_radar()
    point_camera_m = camera_from_radar @ stated.radar_m
    missed = _miss(camera_from_radar, stated, camera)
    if stated.camera_m is not None:
        missed_m = missed * _CLOSE * float(np.linalg.norm(stated.camera_m))
    elif camera is not None:
        px_per_m = float(np.linalg.norm(camera.project_with_jacobian(point_camera_m[None])[1]))
        missed_m = missed * _CLOSE_PX / px_per_m if px_per_m else float("inf")
    else:
        return False
    return missed_m <= rounding.at(stated.radar_m, camera_from_radar)


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
        lost = far_outside(np.linalg.norm((pixel - stated.pixel_px)[None], axis=1), camera)[0]
        decimals = 1 if lost or np.abs(pixel - stated.pixel_px).max() > _CLOSE_PX * 2 else 3
        there, right = (f"({one[0]:.{decimals}f}, {one[1]:.{decimals}f})" for one in (pixel, stated.pixel_px))
        return f"projects {LOST_TEXT if lost else f'to {there}'} instead of to pixel {right}"
    wanted = stated.camera_m if stated.camera_m is not None else np.full(3, np.nan)
    got, want = (", ".join(f"{value:.3f}" for value in point) for point in (point_camera_m[0], wanted))
    return f"is at ({got}) m in the camera frame instead of ({want}) m"


_TINY = 1e-6
_SLIP_FIT, _CLOSE_TO_ORIGIN = 1e-3, 1e-3


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
    transform = imported.camera_from_radar
    deg = np.degrees(rotation_angle_rad(transform.rotation @ right.rotation.T))
    cm = 100.0 * float(np.linalg.norm(transform.inverse().translation_m - right.inverse().translation_m))
    difference = f"{shown(deg)} deg and {shown(cm)} cm from that calibration"
    missed = _pose_miss(transform, right)
    if missed <= _TINY * (1.0 + float(np.linalg.norm(right.translation_m))):
        return CheckResult("good", "same-pose", "the pose is that calibration's")
    undone = explain(
        pose, lambda candidate: _pose_miss(candidate, right), max(_TINY, min(_SLIP_FIT * missed, _CLOSE_TO_ORIGIN))
    )
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
        f"{difference}, not explained by a convention error",
        "it is not this calibration's file, or was changed: export it again",
    )


def _pose_miss(candidate: RigidTransform, right: RigidTransform) -> float:
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
            "warning", "other-lens", message, f"{lenses.note}; right only for images undistorted with it"
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


CHECK_SCHEMA = "cocalib/check-1"
_CODES = {"right": 0, "unproven": 3, "doubtful": 3, "wrong": 1}


@dataclass(frozen=True, slots=True, eq=False)
class CheckedFile:
    """One file of a check.

    Attributes:
        name: of the file.
        report: None if it cannot be read.
        unreadable: why not; "" if it can.
    """

    name: str
    report: CheckReport | None = None
    unreadable: str = ""

    @property
    def verdict(self) -> str:
        """The report's verdict, or "unreadable"."""
        return self.report.verdict if self.report else "unreadable"

    @property
    def line(self) -> str:
        """The verdict and what decided it, for lists of many files."""
        if self.report is None:
            return self.unreadable
        results = self.report.results
        first = next(
            (result for level in ("error", "good", "warning") for result in results if result.level == level), None
        )
        return f"{self.name}: {self.verdict}" + (f": {first.message}" if first else "")


def exit_code(files: Sequence[CheckedFile]) -> int:
    """Return the exit code of a check: 1 if a file is wrong, else 2 if one cannot be read, else 3 if one is not decided."""
    codes = {_CODES.get(file.verdict, 2) for file in files}
    return next((code for code in (1, 2, 3) if code in codes), 0)


def check_json(files: Sequence[CheckedFile], on_recording: dict[str, Any] | None = None) -> str:
    """Return the reports as one JSON object, with what a recording says of two files; docs/formats.md lists its keys."""
    document = {"schema": CHECK_SCHEMA, "exit_code": exit_code(files), "files": [_document(file) for file in files]}
    return json_text(encodable(document if on_recording is None else document | {"on_recording": on_recording}))


def _document(file: CheckedFile) -> dict[str, Any]:
    report = file.report
    document: dict[str, Any] = {"file": file.name, "verdict": file.verdict, "error": file.unreadable or None}
    if report is None:
        unknown = dict.fromkeys(("format", "evidence", "stated_verdict", "calibration_sha256", "frames", "comparison"))
        return document | unknown | {"assumptions": [], "notes": [], "results": []}
    calibration = report.imported
    return document | {
        "format": calibration.format,
        "evidence": calibration.evidence,
        "stated_verdict": msgspec.to_builtins(calibration.file.verdict) if calibration.file is not None else None,
        "calibration_sha256": calibration.calibration_sha256,
        "frames": msgspec.to_builtins(calibration.frames),
        "assumptions": list(calibration.assumptions),
        "notes": list(calibration.notes),
        "results": msgspec.to_builtins(report.results),
        "comparison": _comparison(report),
    }


def _comparison(report: CheckReport) -> dict[str, Any] | None:
    both, judgement = report.comparison, report.judgement
    if both is None or judgement is None:
        return None
    lens = None if both.lens is None else {"rms_px": both.lens.rms_px, "differs": both.lens.text}
    return {
        "agree": judgement.agree,
        "significant": judgement.significant,
        "basis": judgement.basis,
        "criteria": [
            {"name": one.name, "value": one.value, "limit": one.limit, "met": one.met} for one in judgement.criteria
        ],
        "rotation_deg": both.rotation_deg,
        "rotation_sigma_deg": both.rotation_sigma_deg,
        "position_cm": both.position_cm,
        "position_sigma_cm": both.position_sigma_cm,
        "pixels": msgspec.to_builtins(both.pixels),
        "lens": lens,
        **_change(report),
        "covariances": both.covariances,
        "shared": list(both.shared),
        "unshared": both.unshared,
    }


def _change(report: CheckReport) -> dict[str, Any]:
    change = report.comparison.change if report.comparison is not None else None
    return {
        "chi2": None if change is None else change.squared,
        "chi2_limit": None if change is None else change.limit(LEVEL),
        "p_value": report.p_value,
        "sigmas": None if change is None else change.sigmas,
        "noticeable": report.noticeable,
    }


def check_junit(files: Sequence[CheckedFile]) -> str:
    """Return the reports as JUnit XML: a test suite per file, the same test case per question whatever the answers."""
    root = ElementTree.Element("testsuites", name="cocalib check")
    for file in files:
        _add_suite(root, file)
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_suite(root: ElementTree.Element, file: CheckedFile) -> None:
    suite = ElementTree.SubElement(root, "testsuite", name=_xml(file.name))
    readable = _case(suite, file, "readable")
    if file.report is None:
        ElementTree.SubElement(readable, "error", message=_xml(file.unreadable), type="unreadable")
    results = file.report.results if file.report else ()
    for question in QUESTIONS:
        _add_answer(_case(suite, file, question), [result for result in results if result.question == question])
    _add_verdict(_case(suite, file, "verdict"), file)
    for key, tag in (("tests", "testcase"), ("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        suite.set(key, str(len(list(suite.iter(tag)))))


def _case(suite: ElementTree.Element, file: CheckedFile, name: str) -> ElementTree.Element:
    return ElementTree.SubElement(suite, "testcase", classname=_xml(file.name), name=name, time="0")


def _add_answer(case: ElementTree.Element, results: Sequence[CheckResult]) -> None:
    """Fill a case: it fails with the code of its first error, and is skipped if nothing answers it."""
    if not results:
        ElementTree.SubElement(case, "skipped", message="nothing to answer it with, or nothing to say")
        return
    text = _xml("; ".join(filter(None, (part for result in results for part in (result.message, result.hint)))))
    wrong = next((result.code for result in results if result.level == "error"), None)
    if wrong is None:
        ElementTree.SubElement(case, "system-out").text = text
    else:
        ElementTree.SubElement(case, "failure", message=text, type=wrong)


def _add_verdict(case: ElementTree.Element, file: CheckedFile) -> None:
    """Fill the case for the proof as a whole: a wrong or doubtful file fails, one that is not decided or not read is skipped."""
    text = _xml(file.line if file.report is None else file.report.lines()[-1])
    if file.verdict in ("wrong", "doubtful"):
        ElementTree.SubElement(case, "failure", message=text, type=file.verdict)
    elif file.verdict != "right":
        ElementTree.SubElement(case, "skipped", message=text)


def _xml(text: str) -> str:
    """Replace what XML cannot contain: control characters, and halves of surrogate pairs."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
