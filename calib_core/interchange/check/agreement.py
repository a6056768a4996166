"""Do two calibrations agree: how far apart they are, judged by limits or by the covariances they state; if not, by which slip."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, pose_difference, rotation_angle_rad, squared_distance
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

CHI2_95 = 12.591587243743977
"""The 95 % quantile of chi2 with 6 degrees of freedom."""


@dataclass(frozen=True, slots=True)
class ComparedFigure:
    """One line of a comparison, the same in every report.

    Attributes:
        label: what differs.
        text: by how much, with its standard deviation if that is known.
    """

    label: str
    text: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """The difference between two calibrations.

    Attributes:
        rotation_deg: angle between the two rotations.
        rotation_sigma_deg: its standard deviation about its own axis, from the covariances; NaN if neither is known.
        position_cm: distance between the two camera positions in the radar frame.
        position_sigma_cm: its standard deviation along its own direction; NaN if neither is known.
        pixels: at 5, 20 and 60 m; empty without a camera.
        chi2: squared Mahalanobis distance under the known covariances, 6 degrees of freedom; NaN if neither is known.
        chi2_limit: what chi2 is below in 95 % of cases if the two are independent and right: the largest quantile they state.
        p_value: probability of a chi2 this large in that case; NaN if chi2 is.
        covariances: how many of the two covariances are known.
        sigmas: the same as p_value, as the standard deviations that one normal variable exceeds as rarely; NaN if chi2 is.
        lens: how far the two lenses are apart; None if one of the two states none.
        lens_note: what of the lenses is compared, if that is not all of them; else "".
        beyond: for each of the two, whether the other's pose is outside its 95 % ellipsoid; None if it states no uncertainty.
    """

    rotation_deg: float
    rotation_sigma_deg: float
    position_cm: float
    position_sigma_cm: float
    pixels: tuple[PixelDifference, ...]
    chi2: float
    p_value: float
    covariances: int
    beyond: tuple[bool | None, bool | None]
    sigmas: float = float("nan")
    lens: LensDifference | None = None
    lens_note: str = ""
    chi2_limit: float = CHI2_95

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
        if np.isfinite(self.chi2):
            independent = f"(p = {self.p_value:.2g} if the two are independent, {self.sigmas:.3g} sigma)"
            rows.append(ComparedFigure("overall", f"chi2 {shown(self.chi2)} for 6 degrees of freedom {independent}"))
        return tuple(rows)

    def verdict(self, a: str, b: str) -> str:
        """Say whether the difference exceeds what the two state about themselves, with these names for them."""
        parts = {True: "exceeds", False: "is within", None: "cannot be judged by"}
        of_a, of_b = (parts[beyond] for beyond in self.beyond)
        what = "the stated 95 % uncertainty of"
        if self.beyond == (None, None):
            return "neither of the two states an uncertainty"
        if self.beyond[0] == self.beyond[1]:
            return f"the difference {of_a} {what} both"
        if None in self.beyond:
            (part, name), silent = ((of_a, a), b) if self.beyond[1] is None else ((of_b, b), a)
            return f"the difference {part} {what} {name}; {silent} states none"
        return f"the difference {of_a} {what} {a} and {of_b} that of {b}"

    def lines(self) -> tuple[str, ...]:
        """Return the comparison as readable lines; the first of the two is called the other."""
        rows = [f"{row.label}: {row.text}" for row in self.figures]
        rows.append(self.verdict("the other", "this one"))
        if self.lens_note:
            rows.append(self.lens_note)
        if self.covariances == 1:
            rows.append("only one of the two uncertainties is known; the standard deviations come from that one alone")
        return tuple(rows)


def _lens_text(lens: LensDifference) -> str:
    if np.isnan(lens.rms_px):
        return f"another camera: {lens.text}"
    return f"{shown(lens.rms_px)} px rms, {shown(lens.max_px)} px max by the lens alone ({lens.text})"


def _by_pose(at: PixelDifference) -> str:
    return LOST_TEXT if np.isinf(at.pose_rms_px) else f"{shown(at.pose_rms_px)} px rms"


def _plus_minus(sigma: float, unit: str) -> str:
    return "" if np.isnan(sigma) else f" (standard deviation {sigma:.2g} {unit})"


def compare(a: ImportedCalibration, b: ImportedCalibration, *, camera: Camera | None = None) -> Comparison:
    """Compare two calibrations of the same sensors, each through its own lens; covariances are added, as for independent data.

    Args:
        a: one of them.
        b: the other.
        camera: the intrinsics, if neither has any.
    """
    a_pose, b_pose = a.camera_from_radar, b.camera_from_radar
    known = _known_covariances(a, b)
    covariance = np.sum(known, axis=0) if known else np.full((6, 6), np.nan)
    difference = pose_difference(a_pose, b_pose, covariance)
    limit = _chi2_limit(a, b)
    likelihood = difference.squared * CHI2_95 / limit  # a larger quantile stands for heavier tails: 5 % are beyond it
    lenses = lenses_of(a, b, camera)
    return Comparison(
        rotation_deg=difference.rotation_deg,
        rotation_sigma_deg=difference.rotation_sigma_deg,
        position_cm=difference.position_cm,
        position_sigma_cm=difference.position_sigma_cm,
        pixels=tuple(pixel_difference(a_pose, b_pose, lenses, distance_m, covariance) for distance_m in DISTANCES_M)
        if lenses
        else (),
        chi2=difference.squared,
        p_value=_p_value(likelihood),
        covariances=len(known),
        beyond=(_beyond(a, difference.error), _beyond(b, a_pose.error_from(b_pose))),
        sigmas=_sigmas(likelihood),
        chi2_limit=limit,
        lens=lenses.difference if lenses else None,
        lens_note=lenses.note if lenses else "",
    )


def _beyond(side: ImportedCalibration, error: np.ndarray) -> bool | None:
    """Return whether an error (6,) of a pose is outside its 95 % ellipsoid; None if it states none."""
    if side.file is None:
        return None
    squared = squared_distance(error, side.file.calibration.covariance)
    quantile = side.file.calibration.covariance_quantile
    return squared > quantile if np.isfinite(squared) and np.isfinite(quantile) else None


def _known_covariances(a: ImportedCalibration, b: ImportedCalibration) -> list[Matrix66]:
    return [
        side.file.calibration.covariance
        for side in (a, b)
        if side.file is not None and np.isfinite(side.file.calibration.covariance).all()
    ]


def _chi2_limit(a: ImportedCalibration, b: ImportedCalibration) -> float:
    quantiles = [side.file.calibration.covariance_quantile for side in (a, b) if side.file is not None]
    return max(CHI2_95, *(quantile for quantile in quantiles if np.isfinite(quantile)), CHI2_95)


def _p_value(chi2: float) -> float:
    from scipy.special import chdtrc

    return float(chdtrc(6, chi2)) if np.isfinite(chi2) else float("nan")


def _sigmas(chi2: float) -> float:
    """Return how many standard deviations one normal variable exceeds as rarely as chi2 of 6 degrees of freedom is exceeded."""
    from scipy.special import ndtri_exp

    half = chi2 / 2.0
    tail = np.log1p(half + half**2 / 2.0) - half  # of 6 degrees of freedom; p itself is 0 in floating point beyond 1500
    return max(0.0, float(-ndtri_exp(tail - np.log(2.0)))) if np.isfinite(chi2) else float("nan")


WITHOUT_COVARIANCE = {"deg": 1.0, "cm": 5.0, "px": 10.0}
_JUDGED_AT_M = 20.0
_MAX_LENS_PX = 2.0


@dataclass(frozen=True, slots=True)
class AgreementLimits:
    """The largest differences that count as agreement; None where no limit is given.

    Attributes:
        max_deg: between the rotations.
        max_cm: between the camera positions.
        max_px: root mean square over the picture, at each of 5, 20 and 60 m, and by the lens alone.
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
    """

    criteria: tuple[Criterion, ...]
    basis: str
    significant: bool | None

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
        return said


def judge(comparison: Comparison, limits: AgreementLimits) -> Judgement:
    """Judge a comparison by the limits; without any by the covariances, and without these by 1 deg, 5 cm and 10 px at 20 m.

    Raises:
        InputError: a limit cannot be tested: the covariances or the camera are unknown.
    """
    tested = np.isfinite(comparison.chi2)
    significant = bool(comparison.chi2 > comparison.chi2_limit) if tested else None
    if limits.given:
        criteria, basis = _by_limits(comparison, limits), "limits as given"
    elif tested:
        criteria, basis = [_by_covariance(comparison)], "95 % test under the stated covariances"
    else:
        criteria = _by_limits(comparison, AgreementLimits(WITHOUT_COVARIANCE["deg"], WITHOUT_COVARIANCE["cm"]))
        criteria += _pixels_at(comparison, _JUDGED_AT_M, WITHOUT_COVARIANCE["px"])
        basis = "usual limits, because no covariance is known; give yours with --max-deg, --max-cm and --max-px"
    return Judgement((*criteria, *_by_lens(comparison, limits)), basis, significant)


def _by_covariance(comparison: Comparison) -> Criterion:
    beyond = ">" if comparison.chi2 > comparison.chi2_limit else "<="
    text = f"chi2 {shown(comparison.chi2)} {beyond} {comparison.chi2_limit:.3g}, p = {comparison.p_value:.2g}"
    return Criterion("chi2", comparison.chi2, comparison.chi2_limit, text)


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
        if not np.isfinite(comparison.sigmas):
            raise InputError(
                "--max-sigma needs a covariance, and neither file states one that determines the pose; "
                "use --max-deg, --max-cm and --max-px"
            )
        criteria.append(_criterion("sigma", comparison.sigmas, limits.max_sigma, "standard deviations"))
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
        judgement: on the comparison.
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


def _lens_checks(comparison: Comparison, judgement: Judgement) -> list[CheckResult]:
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
