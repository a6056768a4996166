"""Errors that all pairs share: what is known of each of them, and in words what to do about the largest.

The estimate takes them from `estimation/systematic_errors`; a file keeps their numbers, and their names say the rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix66


@dataclass(frozen=True, slots=True)
class ErrorWords:
    """How an error is shown.

    Attributes:
        label: a few words, for tables.
        text: what it is, within a sentence.
        factor: from its own unit to the one shown.
        unit: shown behind the number; "" if it has none.
        remedy: what would reduce its part in the uncertainty.
        remedy_with_tape: the same if the camera position is measured already; "" if it is no different.
        family: label and text of errors along several axes together; empty if it stands alone.
        named_in_family: whether the largest of a family is named with it.
        stated: where its standard deviation before any pair comes from, after the number.
    """

    label: str
    text: str
    factor: float
    unit: str
    remedy: str
    remedy_with_tape: str = ""
    family: tuple[str, ...] = ()
    named_in_family: bool = False
    stated: str = "assumed"


_PERCENT = (100.0, "%")
_CENTIMETRES = (100.0, "cm")
_EDGES = "placements at both edges of the picture"
_HEIGHTS = "placements at several heights (a tripod)"
_TAPE = "a tape-measured camera position"
_PHASE_CENTRE = ("clicks off the phase centre", "the distance of the clicked point from the radar's phase centre")
_CLICKED = ("clicks or principal point", "the principal point, or what one person's clicks are all off by")
_APEX = (
    "clicking the reflector's apex, where its three sheets meet, and stating a smaller sigma for it, would reduce it"
)
_PRINCIPAL_POINT = (
    "a camera calibration that determines the principal point well, and its sigma among the options, would reduce it"
)
_REFINED_CENTRE = ("principal point", "the principal point")
_CALIBRATED_LENS = ("lens", "the lens, as far as its calibration knows it")
_BOARD = "a camera calibration with more views of the board, over the whole picture, would reduce it"
_LENS = "a better camera calibration, and its sigma among the options, would reduce it"

ERROR_WORDS: dict[str, ErrorWords] = {
    "azimuth_scale": ErrorWords(
        "azimuth scale",
        "the radar's azimuth scale",
        *_PERCENT,
        f"{_TAPE}, or {_EDGES}, would reduce it",
        f"{_EDGES} would reduce it",
    ),
    "elevation_scale": ErrorWords(
        "elevation scale",
        "the radar's elevation scale",
        *_PERCENT,
        f"{_TAPE}, or {_HEIGHTS}, would reduce it",
        f"{_HEIGHTS} would reduce it",
    ),
    "squared_height_m2": ErrorWords(
        "height, squared",
        "the height of the placements",
        1.0,
        "m²",
        "near placements, and the reflector's centre at the radar's height, would reduce it",
    ),
    "range_bias_m": ErrorWords(
        "range bias",
        "a constant range error",
        *_CENTIMETRES,
        "comparing one placement's range with a tape, and stating a smaller sigma for it, would reduce it",
    ),
    "range_scale": ErrorWords(
        "range scale",
        "the radar's range scale",
        *_PERCENT,
        "comparing a far placement's range with a tape, and stating a smaller sigma for it, would reduce it",
    ),
    "reflector_right_m": ErrorWords(
        "clicks right of centre",
        "clicks to the right of the radar's phase centre",
        *_CENTIMETRES,
        _APEX,
        family=_PHASE_CENTRE,
    ),
    "reflector_down_m": ErrorWords(
        "clicks below centre",
        "clicks below the radar's phase centre",
        *_CENTIMETRES,
        _APEX,
        family=_PHASE_CENTRE,
    ),
    "reflector_forward_m": ErrorWords(
        "clicks beyond centre",
        "clicks beyond the radar's phase centre",
        *_CENTIMETRES,
        _APEX,
        family=_PHASE_CENTRE,
    ),
    "click_right_px": ErrorWords(
        "clicks off, right",
        "clicks or the principal point too far to the right",
        1.0,
        "px",
        _PRINCIPAL_POINT,
        family=_CLICKED,
    ),
    "click_down_px": ErrorWords(
        "clicks off, down",
        "clicks or the principal point too far down",
        1.0,
        "px",
        _PRINCIPAL_POINT,
        family=_CLICKED,
    ),
    "focal_length": ErrorWords("focal length", "the focal length", *_PERCENT, _LENS),
    "principal_right_px": ErrorWords(
        "principal point, right", "the principal point's column", 1.0, "px", _BOARD, family=_REFINED_CENTRE
    ),
    "principal_down_px": ErrorWords(
        "principal point, down", "the principal point's row", 1.0, "px", _BOARD, family=_REFINED_CENTRE
    ),
    "distortion": ErrorWords("distortion (k1)", "the lens distortion", 1.0, "", _LENS),
}
"""By the name of the error; those of a lens with a covariance are made by `error_words`."""

_LENS_NAMES = {
    "fx_px": ("focal length fx", "the focal length fx"),
    "fy_px": ("focal length fy", "the focal length fy"),
    "cx_px": ("principal point, right", "the principal point's column"),
    "cy_px": ("principal point, down", "the principal point's row"),
}


def error_words(name: str) -> ErrorWords:
    """Return how an error is shown; one of a later version by its name."""
    known = ERROR_WORDS.get(name)
    if known is not None:
        return known
    if not name.startswith("lens_"):
        return ErrorWords(name, name, 1.0, "", "more placements may reduce it")
    parameter = name.removeprefix("lens_")
    label, text = _LENS_NAMES.get(parameter, (f"distortion {parameter}", f"the lens distortion ({parameter})"))
    unit = "px" if parameter.endswith("_px") else ""
    return ErrorWords(
        label, text, 1.0, unit, _BOARD, family=_CALIBRATED_LENS, named_in_family=True, stated="by its calibration"
    )


_DOMINANT_SHARE = 1.0 / 3.0
_UNDETERMINED = 0.97  # of the prior's sigma: the pairs say nothing
_BEYOND = 3.0  # standard deviations of the prior
_WOULD_REDUCE = " would reduce it"
_SHARES = (
    (0.9, "nearly all"),
    (0.71, "about three quarters"),
    (0.58, "about two thirds"),
    (0.44, "about half"),
    (0.0, "about a third"),
)


@dataclass(frozen=True, slots=True)
class SystematicErrorResult:
    """One error that all pairs share: what is known of it, and its part in the uncertainty of the pose.

    Attributes:
        name: key in files, with its unit; scales and shares have none.
        value: estimated; for an error that is not taken out of the pose, what the residuals suggest.
        sigma: standard deviation of that value.
        prior_sigma: the same before any pair, as the options state it.
        estimated: whether the pose was estimated together with it; otherwise it only widens the covariance.
        position_share: its part of the variance of the translation, 0 to 1.
        rotation_share: the same of the rotation.
    """

    name: str
    value: float
    sigma: float
    prior_sigma: float
    estimated: bool
    position_share: float
    rotation_share: float

    @property
    def text(self) -> str:
        """What it is, within a sentence."""
        return error_words(self.name).text


@dataclass(frozen=True, slots=True)
class DominantError:
    """An error, or one along several axes, with a third or more of the variance of the position, the rotation or both.

    Attributes:
        position_share: its part of the variance of the translation; 0 if below a third.
        rotation_share: the same of the rotation.
        label: a few words: which error it is, and what is known of it.
        sentence: its part in the uncertainty, what is known of it, and what would reduce it.
        action: what would reduce it, as a sentence of its own without a full stop.
    """

    position_share: float
    rotation_share: float
    label: str
    sentence: str
    action: str


def dominant_errors(
    errors: Sequence[SystematicErrorResult], covariance: Matrix66, *, measured: bool
) -> tuple[DominantError, ...]:
    """Name the errors that make up most of the uncertainty, the largest share first: at most one each of position and rotation.

    Args:
        errors: all that the pairs share.
        covariance: (6, 6) of (dt, dtheta) [m, rad].
        measured: whether the camera position was measured, so that a tape is no remedy.
    """
    families: dict[str, list[SystematicErrorResult]] = {}
    for one in errors:
        families.setdefault("".join(error_words(one.name).family) or one.name, []).append(one)
    shares = {
        name: (_sum_of(rows, "position_share"), _sum_of(rows, "rotation_share")) for name, rows in families.items()
    }
    chosen: dict[str, list[float]] = {}
    for part in (0, 1):
        most = max(shares, key=lambda name: shares[name][part], default="")
        if most and shares[most][part] >= _DOMINANT_SHARE:
            chosen.setdefault(most, [0.0, 0.0])[part] = shares[most][part]
    found = [
        _dominant(families[name], position, rotation, covariance, measured)
        for name, (position, rotation) in chosen.items()
    ]
    return tuple(sorted(found, key=lambda one: -max(one.position_share, one.rotation_share)))


def rescaled(
    errors: Sequence[SystematicErrorResult], position: float, rotation: float
) -> tuple[SystematicErrorResult, ...]:
    """Multiply the shares of the position's and of the rotation's variance, as when only a part of that variance is meant."""
    return tuple(
        replace(one, position_share=position * one.position_share, rotation_share=rotation * one.rotation_share)
        for one in errors
    )


def _sum_of(rows: Sequence[SystematicErrorResult], share: str) -> float:
    return min(float(sum(getattr(row, share) for row in rows)), 1.0)


def _dominant(
    rows: Sequence[SystematicErrorResult],
    position_share: float,
    rotation_share: float,
    covariance: Matrix66,
    measured: bool,
) -> DominantError:
    largest = max(rows, key=lambda row: row.position_share + row.rotation_share)
    words, known = error_words(largest.name), knowledge_text(largest)
    position_cm = 100.0 * float(np.sqrt(np.trace(covariance[:3, :3])))
    rotation_deg = float(np.rad2deg(np.sqrt(np.trace(covariance[3:, 3:]))))
    parts = []
    if position_share:
        parts.append(f"{_share_text(position_share)} of the variance of the position ({_two_digits(position_cm)} cm)")
    if rotation_share:
        parts.append(f"{_share_text(rotation_share)} of that of the rotation ({_two_digits(rotation_deg)} deg)")
    if not position_share:
        parts = [parts[0].replace("that of", "the variance of")]
    label, name = words.family or (words.label, words.text)
    if words.named_in_family:
        label, name = f"{label}, {words.label}", f"{name}, above all {words.text}"
    come = "come" if len(parts) > 1 else "comes"
    remedy = (words.remedy_with_tape if measured else "") or words.remedy
    whole = f"{remedy[:1].upper()}{remedy[1:].removesuffix(_WOULD_REDUCE)}"
    return DominantError(
        position_share=position_share,
        rotation_share=rotation_share,
        label=f"{label} {_value_text(largest) if is_determined(largest) else known.partition(f' {words.stated}')[0]}",
        sentence=f"{' and '.join(parts)} {come} from {name}: {known}; {remedy}",
        action=f"{whole} would help most: {parts[0]} comes from {name}",
    )


def dominance_text(dominant: Sequence[DominantError]) -> str:
    """Name these errors with their shares, in one line."""
    parts = [
        f"{100 * share:.0f} % of the {what}: {one.label}"
        for one in dominant
        for what, share in (("position", one.position_share), ("rotation", one.rotation_share))
        if share
    ]
    return "; ".join(parts) or "none with a third of the uncertainty"


def _share_text(share: float) -> str:
    return next(words for least, words in _SHARES if share >= least)


def _two_digits(value: float) -> str:
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"


def knowledge_text(error: SystematicErrorResult) -> str:
    """Say what is known of an error: "+1.2 ± 0.9 %, ± 2 % before any pair", or that the pairs do not determine it."""
    words = error_words(error.name)
    prior = f"± {_two_digits(words.factor * error.prior_sigma)} {words.unit}".rstrip()
    if not is_determined(error) and not is_beyond_its_prior(error):
        return f"{prior} {words.stated}, the pairs do not determine it"
    return f"{_value_text(error)}, {prior} before any pair"


def is_determined(error: SystematicErrorResult) -> bool:
    """Return whether the pairs say anything about an error."""
    return error.sigma <= _UNDETERMINED * error.prior_sigma


def is_beyond_its_prior(error: SystematicErrorResult) -> bool:
    """Whether an error was estimated so large that what was stated of it before any pair cannot be right."""
    return error.estimated and 0.0 < _BEYOND * error.prior_sigma < abs(error.value)


def _value_text(error: SystematicErrorResult) -> str:
    words = error_words(error.name)
    sigma = words.factor * error.sigma
    decimals = max(0, 1 - int(np.floor(np.log10(sigma)))) if sigma > 0.0 else 2
    return f"{words.factor * error.value:+.{decimals}f} ± {sigma:.{decimals}f} {words.unit}".rstrip()
