"""Do two calibrations agree: how far apart they are, judged by limits or by the covariances they state; if not, by which slip."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.camera import Camera
from calib_core.errors import InputError, word_list
from calib_core.estimation.pose_change import PoseChange, level_of, pose_change
from calib_core.geometry import RigidTransform, pose_difference, rotation_angle_rad, squared_distance
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.check.pixel_differences import (
    DISTANCES_M,
    LOST_TEXT,
    LensDifference,
    PixelDifference,
    lenses_of,
    pixel_difference,
    pixels_text,
    shown,
)
from calib_core.interchange.check.slips import CheckResult, explain, explained
from calib_core.interchange.format import ImportedCalibration, WrittenPose
from calib_core.interchange.own.documents import camera_document
from calib_core.results.verdict import degrees_of_freedom

LEVEL = 0.05
"""Of the test by the covariances, unless --max-sigma gives another: one of twenty right pairs of calibrations fails it."""


@dataclass(frozen=True, slots=True)
class ComparedFigure:
    """One line of a comparison, the same in every report.

    Attributes:
        label: what differs.
        text: by how much, with its standard deviation if that is known.
    """

    label: str
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """The difference between two calibrations.

    Attributes:
        rotation_deg: angle between the two rotations.
        rotation_sigma_deg: its standard deviation about its own axis, from the covariances; NaN if neither is known.
        position_cm: distance between the two camera positions in the radar frame.
        position_sigma_cm: its standard deviation along its own direction; NaN if neither is known.
        pixels: at 5, 20 and 60 m; empty without a camera.
        change: of the camera between the two, what they share taken out; None if neither covariance is known.
        shared: whose errors are the same in both, so that they were taken out; empty if every error counts as independent.
        unshared: why no error was taken out; "" if some were, or if there is nothing to say.
        covariances: how many of the two covariances are known.
        lens: how far the two lenses are apart; None if one of the two states none.
        lens_note: what of the lenses is compared, if that is not all of them; else "".
    """

    rotation_deg: float
    rotation_sigma_deg: float
    position_cm: float
    position_sigma_cm: float
    pixels: tuple[PixelDifference, ...]
    change: PoseChange | None
    shared: tuple[str, ...]
    unshared: str
    covariances: int
    lens: LensDifference | None = None
    lens_note: str = ""

    @property
    def figures(self) -> tuple[ComparedFigure, ...]:
        """The differences as final text; every report shows these."""
        rows = [
            ComparedFigure(
                "rotation", f"{shown(self.rotation_deg)} deg apart{_plus_minus(self.rotation_sigma_deg, 'deg')}"
            ),
            ComparedFigure(
                "camera position", f"{shown(self.position_cm)} cm apart{_plus_minus(self.position_sigma_cm, 'cm')}"
            ),
        ]
        other_lens = self.lens is not None and not self.lens.same
        if self.lens is not None and other_lens:
            rows.append(ComparedFigure("lens", _lens_text(self.lens)))
        for at in self.pixels:
            by_pose = f", {_by_pose(at)} by the pose alone" if other_lens else ""
            expected = "" if np.isnan(at.sigma_px) else f", expected {at.sigma_px:.3g} px from the covariances"
            rows.append(ComparedFigure(f"at {at.distance_m:g} m", f"{pixels_text(at)}{by_pose}{expected}"))
        if self.change is not None:
            rows.append(ComparedFigure("change", _change_text(self.change)))
        return tuple(rows)

    @property
    def verdict(self) -> str:
        """Whether the two agree by their covariances, or by the usual limits, and why."""
        found = judge(self, AgreementLimits())
        return f"{'the two agree' if found.agree else 'the two differ'}: {found.text}"

    def lines(self) -> tuple[str, ...]:
        """Return the comparison as readable lines; the first of the two is called the other."""
        return (*(f"{row.label}: {row.text}" for row in self.figures), *self.notes)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was compared, if that is not all of both."""
        one = "only one of the two uncertainties is known; the standard deviations come from that one alone"
        shared = (
            f"the errors of {word_list(self.shared)} are the same in both, and are taken out" if self.shared else ""
        )
        unshared = f"every error counts as independent, because {self.unshared}" if self.unshared else ""
        return tuple(filter(None, (self.lens_note, shared, unshared, one if self.covariances == 1 else "")))


def _change_text(change: PoseChange) -> str:
    pose = change.first.perturbed(change.error)
    difference = pose_difference(change.first, pose, change.covariance)
    turned = f"{shown(difference.rotation_deg)} deg{_plus_minus(difference.rotation_sigma_deg, 'deg')}"
    moved = f"{shown(difference.position_cm)} cm{_plus_minus(difference.position_sigma_cm, 'cm')}"
    return f"turned by {turned}, moved by {moved}"


def noticed_text(change: PoseChange, level: float) -> str:
    """Return what change a test at this level would have noticed, from the most to the least visible axis."""
    deg, cm = (f"{part.min():.2g} to {part.max():.2g}" for part in np.split(change.noticeable(level), 2))
    return f"detectable change (95 % power): {deg} deg or {cm} cm, by axis"


def _lens_text(lens: LensDifference) -> str:
    if np.isnan(lens.rms_px):
        return f"another camera: {lens.text}"
    return f"{shown(lens.rms_px)} px rms, {shown(lens.max_px)} px max by the lens alone ({lens.text})"


def _by_pose(at: PixelDifference) -> str:
    return LOST_TEXT if np.isinf(at.pose_rms_px) else f"{shown(at.pose_rms_px)} px rms"


def _plus_minus(sigma: float, unit: str) -> str:
    return "" if np.isnan(sigma) else f" (standard deviation {sigma:.2g} {unit})"


def compare(
    a: ImportedCalibration,
    b: ImportedCalibration,
    *,
    camera: Camera | None = None,
    same_sensors: bool = False,
    same_person: bool = False,
) -> Comparison:
    """Compare two calibrations of the same sensors, each through its own lens; which of the two is the first changes nothing.

    Args:
        a: one of them.
        b: the other.
        camera: the intrinsics, if neither has any.
        same_sensors: radar and camera are the same, whatever serials, topics and intrinsics say.
        same_person: the same person clicked the same reflector in both.
    """
    a_pose, b_pose = a.camera_from_radar, b.camera_from_radar
    known = [
        side.file.calibration.covariance
        for side in (a, b)
        if side.file is not None and np.isfinite(side.file.calibration.covariance).all()
    ]
    covariance = np.sum(known, axis=0) if known else np.full((6, 6), np.nan)
    difference = pose_difference(a_pose, b_pose, covariance)
    change, shared, unshared = _change(a, b, covariance, same_sensors=same_sensors, same_person=same_person)
    lenses = lenses_of(a, b, camera)
    return Comparison(
        rotation_deg=difference.rotation_deg,
        rotation_sigma_deg=difference.rotation_sigma_deg,
        position_cm=difference.position_cm,
        position_sigma_cm=difference.position_sigma_cm,
        pixels=tuple(pixel_difference(a_pose, b_pose, lenses, distance_m, covariance) for distance_m in DISTANCES_M)
        if lenses
        else (),
        change=change,
        shared=shared,
        unshared=unshared,
        covariances=len(known),
        lens=lenses.difference if lenses else None,
        lens_note=lenses.note if lenses else "",
    )


def _change(
    a: ImportedCalibration, b: ImportedCalibration, covariance: Matrix66, *, same_sensors: bool, same_person: bool
) -> tuple[PoseChange | None, tuple[str, ...], str]:
    """Return the change between the two, whose errors were taken out of it, and why none were."""
    error = b.camera_from_radar.error_from(a.camera_from_radar)
    if not np.isfinite(squared_distance(error, covariance)):
        return None, (), ""
    files = [side.file for side in (a, b) if side.file is not None]
    freedom = min(degrees_of_freedom(file.calibration.covariance_quantile) for file in files)
    apart = PoseChange(a.camera_from_radar, error, covariance, freedom)
    if len(files) < 2:
        return apart, (), ""
    if unshared := "" if same_sensors else _other_sensors(*files):
        return apart, (), unshared
    lens = not _other_intrinsics(*files)
    joint = pose_change(files[0].calibration, files[1].calibration, same_lens=lens, same_person=same_person)
    if not isinstance(joint, PoseChange):
        return apart, (), joint
    return joint, ("radar", *(["lens"] if lens else []), *(["clicks"] if same_person else [])), ""


def _other_sensors(a: CalibrationFile, b: CalibrationFile) -> str:
    """Return what shows that two calibrations may be of other sensors; "" if nothing does."""
    told = "give --same-sensors if they are the same"
    if (a.vehicle.radar_serial, a.vehicle.camera_serial) != (b.vehicle.radar_serial, b.vehicle.camera_serial):
        return f"the two state other serials; {told}"
    topics = [(*one.provenance.radar_topics, one.provenance.image_topic) for one in (a, b)]
    if topics[0] != topics[1]:
        return f"the two are of other topics; {told}"
    return f"the two have other intrinsics; {told}" if _other_intrinsics(a, b) else ""


def _other_intrinsics(a: CalibrationFile, b: CalibrationFile) -> bool:
    """Return whether two calibrations were solved with different intrinsics, or with others to refine."""
    one, other = (file.calibration.given_camera or file.calibration.camera for file in (a, b))
    return camera_document(one) != camera_document(other)


WITHOUT_COVARIANCE = {"deg": 1.0, "cm": 5.0, "px": 10.0}
_JUDGED_AT_M = 20.0
_MAX_LENS_PX = 2.0


@dataclass(frozen=True, slots=True)
class AgreementLimits:
    """The largest differences that count as agreement; None where no limit is given.

    Attributes:
        max_deg: between the rotations.
        max_cm: between the camera positions.
        max_px: root mean square over the image, at each of 5, 20 and 60 m, and by the lens alone.
        max_sigma: of the difference under the covariances, in standard deviations of one normal variable.

    Raises:
        InputError: a limit is negative, or not a number.
    """

    max_deg: float | None = None
    max_cm: float | None = None
    max_px: float | None = None
    max_sigma: float | None = None

    def __post_init__(self) -> None:
        for name in ("max_deg", "max_cm", "max_px", "max_sigma"):
            limit = getattr(self, name)
            if limit is not None and not 0.0 <= limit < np.inf:
                raise InputError(f"--{name.replace('_', '-')} {limit:g}: a limit is a number of at least 0")

    @property
    def given(self) -> bool:
        """Whether there is a limit at all."""
        return any(limit is not None for limit in (self.max_deg, self.max_cm, self.max_px, self.max_sigma))


@dataclass(frozen=True, slots=True)
class Criterion:
    """One figure and its limit.

    Attributes:
        name: one word for programs: deg, cm, px, sigma, chi2 or lens_px.
        value: of the comparison; infinite where nothing can be compared.
        limit: the largest value that counts as agreement.
        text: both, in words.
    """

    name: str
    value: float
    limit: float
    text: str

    @property
    def met(self) -> bool:
        """Whether the value is within the limit."""
        return self.value <= self.limit


@dataclass(frozen=True, slots=True)
class Judgement:
    """Whether two calibrations agree, and by what.

    Attributes:
        criteria: all of them must be met.
        basis: what decided, in words.
        significant: whether the difference is beyond what the covariances allow in 95 % of cases; None if they do not say.
        noticed: what change the test would have noticed; "" if it was none.
    """

    criteria: tuple[Criterion, ...]
    basis: str
    significant: bool | None
    noticed: str = ""

    @property
    def agree(self) -> bool:
        """Whether every criterion is met."""
        return all(one.met for one in self.criteria)

    @property
    def text(self) -> str:
        """Why they agree or not: the criteria that are not met, or all that are, and what else is known."""
        named = [one.text for one in self.criteria if one.met == self.agree]
        said = f"{', '.join(named)} ({self.basis})"
        if self.agree and self.significant:
            said += "; the difference is significant under the covariances, but within the limits"
        return "; ".join(filter(None, (said, self.noticed)))


def judge(comparison: Comparison, limits: AgreementLimits) -> Judgement:
    """Judge a comparison by the limits; without any by the covariances, and without these by 1 deg, 5 cm and 10 px at 20 m.

    Raises:
        InputError: a limit cannot be tested: the covariances or the camera are unknown.
    """
    change = comparison.change
    significant = None if change is None else change.p_value < LEVEL
    level = LEVEL
    if limits.given:
        criteria, basis = _by_limits(comparison, limits), "limits as given"
        level = LEVEL if limits.max_sigma is None else level_of(limits.max_sigma)
    elif change is not None:
        criteria, basis = [_by_change(change)], "95 % test under the stated covariances"
        basis = f"95 % test with the errors of {word_list(comparison.shared)} taken out" if comparison.shared else basis
    else:
        criteria = _by_limits(comparison, AgreementLimits(WITHOUT_COVARIANCE["deg"], WITHOUT_COVARIANCE["cm"]))
        criteria += _pixels_at(comparison, _JUDGED_AT_M, WITHOUT_COVARIANCE["px"])
        basis = "usual limits, because no covariance is known; give yours with --max-deg, --max-cm and --max-px"
    by_test = change is not None and (not limits.given or limits.max_sigma is not None)
    noticed = noticed_text(change, level) if by_test and change is not None else ""
    return Judgement((*criteria, *_by_lens(comparison, limits)), basis, significant, noticed)


def _by_change(change: PoseChange) -> Criterion:
    limit = change.limit(LEVEL)
    beyond = ">" if change.squared > limit else "<="
    return Criterion(
        "chi2",
        change.squared,
        limit,
        f"chi2 {shown(change.squared)} {beyond} {limit:.3g}, p = {change.p_value:.2g}",
    )


def _by_limits(comparison: Comparison, limits: AgreementLimits) -> list[Criterion]:
    criteria = []
    if limits.max_deg is not None:
        criteria.append(_criterion("deg", comparison.rotation_deg, limits.max_deg, "deg"))
    if limits.max_cm is not None:
        criteria.append(_criterion("cm", comparison.position_cm, limits.max_cm, "cm"))
    if limits.max_px is not None:
        if not comparison.pixels:
            raise InputError("--max-px needs the intrinsics, and none of the files has any; give --camera FILE")
        for at in comparison.pixels:
            criteria += _pixels_at(comparison, at.distance_m, limits.max_px)
    if limits.max_sigma is not None:
        if comparison.change is None:
            raise InputError(
                "--max-sigma needs a covariance, and neither file states one that determines the pose; "
                "use --max-deg, --max-cm and --max-px"
            )
        criteria.append(_criterion("sigma", comparison.change.sigmas, limits.max_sigma, "standard deviations"))
    return criteria


def _pixels_at(comparison: Comparison, distance_m: float, limit_px: float) -> list[Criterion]:
    found = []
    for at in comparison.pixels:
        if at.distance_m == distance_m:
            value = float("inf") if at.lost_share else at.rms_px
            found.append(_criterion("px", value, limit_px, f"px at {distance_m:g} m"))
    return found


def _by_lens(comparison: Comparison, limits: AgreementLimits) -> list[Criterion]:
    lens = comparison.lens
    if lens is None or lens.same:
        return []
    limit_px = _MAX_LENS_PX if limits.max_px is None else limits.max_px
    if np.isnan(lens.rms_px):
        return [Criterion("lens_px", float("inf"), limit_px, f"another camera: {lens.text}")]
    one = _criterion("lens_px", lens.rms_px, limit_px, "px by the lens alone")
    return [Criterion(one.name, one.value, one.limit, f"{one.text} ({lens.text})")]


def _criterion(name: str, value: float, limit: float, unit: str) -> Criterion:
    if np.isinf(value):
        return Criterion(name, value, limit, f"{LOST_TEXT} {unit.removeprefix('px ')}")
    sign = "<=" if value <= limit else ">"
    return Criterion(name, value, limit, f"{shown(value)} {sign} {limit:g} {unit}")


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
        judgment: on the comparison.
        limits: that it was judged by.
        changed: no slip explains how the file misses its own check point, so none is guessed from a rough fit either.
    """
    difference = (
        f"{shown(comparison.rotation_deg)} deg and {shown(comparison.position_cm)} cm from the other calibration"
    )
    only_exact = judgement.agree or changed
    slipped = _slipped(imported.pose, other.camera_from_radar, limits, difference, only_exact=only_exact)
    lens = _lens_checks(comparison, judgement)
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
            f"{difference}; {judgement.text}, not explained by a convention error",
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


def _lens_checks(comparison: Comparison, judgement: Judgement) -> list[CheckResult]:
    """Return what to say of the lens: nothing if the two are one."""
    lens = comparison.lens
    if lens is None or lens.same:
        return []
    by_how_much = "" if np.isnan(lens.rms_px) else f", {shown(lens.rms_px)} px rms by the lens alone"
    message = f"the two have different intrinsics{by_how_much}: {lens.text}"
    if comparison.lens_note:
        hint = f"{comparison.lens_note}; right only for images undistorted with this very matrix"
        return [CheckResult("warning", "other-lens", message, hint)]
    beyond = not all(one.met for one in judgement.criteria if one.name == "lens_px")
    hint = "use one camera's intrinsics in both, or compare calibrations of one camera"
    return [CheckResult("error" if beyond else "warning", "other-lens", message, hint)]
