"""Check a calibration file: does it reproduce its check point, and if not, which slip explains it?"""

from dataclasses import dataclass
from typing import Literal

from calib_core.camera import Camera
from calib_core.interchange.check.agreement import AgreementLimits, Judgement, judge
from calib_core.interchange.check.check_point import CHECK_POINT_MISSED, CHECK_POINT_UNUSED, by_check_point
from calib_core.interchange.check.comparison import Comparison, compare
from calib_core.interchange.check.explanation import CheckResult
from calib_core.interchange.check.other_calibration import by_other_calibration
from calib_core.interchange.check.own_pairs import by_own_pairs
from calib_core.interchange.check.pair_residuals import CheckPairs, by_pairs
from calib_core.interchange.check.plausible_pose import by_plausibility
from calib_core.interchange.check.same_calibration import by_its_calibration
from calib_core.interchange.imported import ImportedCalibration

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
_OWN_WORD = frozenset({"check-point", "pairs"})
"""Results of what a file says of itself: no proof of a pose whose meaning was assumed."""
_WORD_OF_ANOTHER = {"against": frozenset({"agrees"}), "of": frozenset({"same-pose", "same-lens"})}
"""Results of what another file says: no proof either if the meaning of that one's pose was assumed."""
_DIFFERENCES = frozenset({"disagrees"})
_ANY_SIZE_PX = (1000, 1000)
_ASSUMED_REFERENCE = "assumed-reference"
_IMPLAUSIBLE = frozenset({"far-apart", "looks-elsewhere", "on-its-side", "placeholder"})


@dataclass(frozen=True, slots=True, eq=False)
class CheckReport:
    """The report of a check.

    Attributes:
        imported: what was read.
        results: in the order of the checks.
        comparison: with the other calibration, if one was given.
        judgement: on the comparison.
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
    def rests_on_assumption(self) -> bool:
        """Whether the file says that the meaning of its pose was assumed."""
        return self.imported.evidence == "imported_assumed"

    def lines(self) -> tuple[str, ...]:
        """Return the report as readable lines."""
        frames = self.imported.frames
        named = f", radar {frames.radar!r}, camera {frames.camera!r}" if frames else ", frames not named"
        rows = [f"read as {self.imported.format}{named}"]
        rows += [f"assumed: {assumption.removeprefix('assumed ')}" for assumption in self.imported.assumptions]
        rows += [f"note: {note}" for note in self.imported.notes]
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
) -> CheckReport:
    """Check a calibration against its own check point, another calibration and pairs, and for plausibility.

    Args:
        imported: what read_any returned.
        against: a calibration of the same sensors that is known to be right: do the two agree?
        of: the calibration that the file should have been made from: is it that calibration's file?
        limits: what counts as agreement with `against`; None judges by the covariances.
        camera: the intrinsics, if the file has none.
        pairs: radar positions and the pixels where they were seen.

    Raises:
        InputError: a limit cannot be tested with these files.
    """
    results = [
        CheckResult("error", "contradiction", fault, "correct the one that is wrong") for fault in imported.faults
    ]
    known = (imported, of, against, pairs)
    camera = imported.camera or camera or next((one.camera for one in known if one and one.camera), None)
    stated = imported.check_point
    if stated is not None:
        results.append(by_check_point(imported.pose, stated, camera, own=_own_camera(imported)))
    if of is not None:
        results += by_its_calibration(imported, of)
    comparison = compare(against, imported, camera=camera) if against is not None else None
    judgement = judge(comparison, limits or AgreementLimits()) if comparison is not None else None
    if against is not None and comparison is not None and judgement is not None:
        changed = any(result.code == CHECK_POINT_MISSED for result in results)
        results += by_other_calibration(
            imported, against, comparison, judgement, limits or AgreementLimits(), changed=changed
        )
    if pairs is not None:
        results += by_pairs(imported, pairs.under(imported.file.calibration) if imported.file else pairs)
    results += by_own_pairs(imported)
    no_proof = _no_proof(imported, against=against, of=of)
    results += _assumed_references(against=against, of=of)
    untested = {"contradiction", CHECK_POINT_UNUSED, _ASSUMED_REFERENCE, *no_proof}
    tested = [result for result in results if result.code not in untested]
    if not tested or (against is None and not any(result.level == "error" for result in tested)):
        results += by_plausibility(imported.pose, verified=bool(tested))
    return CheckReport(imported, tuple(results), comparison, judgement, no_proof)


def _own_camera(imported: ImportedCalibration) -> Camera | None:
    """Return the file's camera; that of rectified pictures has no size in the files, and needs none to project a point."""
    if imported.camera is not None or imported.check_point is None or imported.check_point.rectified_px is None:
        return imported.camera
    try:
        return imported.camera_for(_ANY_SIZE_PX)
    except ValueError:  # not a camera matrix; reading or importing it says so
        return None


def _no_proof(imported: ImportedCalibration, **others: ImportedCalibration | None) -> frozenset[str]:
    """Return the codes of the results that prove nothing, because what they rest on was assumed."""
    codes = _OWN_WORD if imported.evidence == "imported_assumed" else frozenset()
    return codes.union(*(_WORD_OF_ANOTHER[option] for option, other in others.items() if _is_assumed(other)))


def _assumed_references(**others: ImportedCalibration | None) -> list[CheckResult]:
    return [
        CheckResult(
            "warning",
            _ASSUMED_REFERENCE,
            f"what the file given with --{option} means was assumed when it was imported: being like it proves nothing",
            "prove that one first: cocalib import FILE --pairs PAIRS",
        )
        for option, other in others.items()
        if _is_assumed(other)
    ]


def _is_assumed(other: ImportedCalibration | None) -> bool:
    return other is not None and other.evidence == "imported_assumed"
