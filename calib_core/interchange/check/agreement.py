"""Do two calibrations agree: judged by limits, or else by the covariances that they state."""

from dataclasses import dataclass

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.check.comparison import Comparison
from calib_core.interchange.check.pixel_differences import LOST_TEXT, shown

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
