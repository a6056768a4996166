"""Errors that all pairs share: what is known of each of them, and in words what to do about the largest.

The estimate takes them from `estimation/systematic_errors`; a file keeps their numbers, and their names say the rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix66

__all__ = [
    "ERROR_WORDS",
    "DominantError",
    "ErrorWords",
    "SystematicErrorResult",
    "dominant_errors",
    "error_words",
    "knowledge_text",
]

_DOMINANT_SHARE = 1.0 / 3.0
_UNDETERMINED = 0.97  # of the prior's sigma: the pairs say nothing
_SHARES = (
    (0.9, "nearly all"),
    (0.71, "about three quarters"),
    (0.58, "about two thirds"),
    (0.42, "about half"),
    (0.0, "about a third"),
)


@dataclass(frozen=True, slots=True)
class SystematicErrorResult:
    """One error that all pairs share: what is known of it, and its part in the uncertainty of the pose.

    Attributes:
        name: key in files, with its unit; scales and shares have none.
        text: what it is, for users.
        value: estimated; for an error that is not taken out of the pose, what the residuals suggest.
        sigma: standard deviation of that value.
        prior_sigma: the same before any pair, as the options state it.
        estimated: whether the pose was estimated together with it; otherwise it only widens the covariance.
        position_share: its part of the variance of the translation, 0 to 1.
        rotation_share: the same of the rotation.
    """

    name: str
    text: str
    value: float
    sigma: float
    prior_sigma: float
    estimated: bool
    position_share: float
    rotation_share: float


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
        family: what errors along several axes are called together; "" if it stands alone.
    """

    label: str
    text: str
    factor: float
    unit: str
    remedy: str
    remedy_with_tape: str = ""
    family: str = ""


_PERCENT = (100.0, "%")
_CENTIMETRES = (100.0, "cm")
_EDGES = "placements at both edges of the picture"
_HEIGHTS = "placements at several heights (a tripod)"
_TAPE = "a tape-measured camera position"
_PHASE_CENTRE = "the distance of the clicked point from the radar's phase centre"
_CLICKED = "the principal point, or what one person's clicks are all off by"
_APEX = (
    "clicking the reflector's apex, where its three sheets meet, and stating a smaller sigma for it, would reduce it"
)
_PRINCIPAL_POINT = (
    "a camera calibration that determines the principal point well, and its sigma among the options, would reduce it"
)
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
        "clicks right of the phase centre",
        "clicks to the right of the radar's phase centre",
        *_CENTIMETRES,
        _APEX,
        family=_PHASE_CENTRE,
    ),
    "reflector_down_m": ErrorWords(
        "clicks below the phase centre",
        "clicks below the radar's phase centre",
        *_CENTIMETRES,
        _APEX,
        family=_PHASE_CENTRE,
    ),
    "reflector_forward_m": ErrorWords(
        "clicks beyond the phase centre",
        "clicks beyond the radar's phase centre",
        *_CENTIMETRES,
        _APEX,
        family=_PHASE_CENTRE,
    ),
    "click_right_px": ErrorWords(
        "clicks or principal point, right",
        "clicks or the principal point too far to the right",
        1.0,
        "px",
        _PRINCIPAL_POINT,
        family=_CLICKED,
    ),
    "click_down_px": ErrorWords(
        "clicks or principal point, down",
        "clicks or the principal point too far down",
        1.0,
        "px",
        _PRINCIPAL_POINT,
        family=_CLICKED,
    ),
    "focal_length": ErrorWords("focal length", "the focal length", *_PERCENT, _LENS),
    "distortion": ErrorWords("distortion (k1)", "the lens distortion", 1.0, "", _LENS),
}
"""By the name of the error."""


def error_words(name: str) -> ErrorWords:
    """Return how an error is shown; one of a later version by its name."""
    return ERROR_WORDS.get(name) or ErrorWords(name, name, 1.0, "", "more placements may reduce it")


@dataclass(frozen=True, slots=True)
class DominantError:
    """An error, or one along several axes, with a third or more of the variance of the position, the rotation or both.

    Attributes:
        position_share: its part of the variance of the translation; 0 if below a third.
        rotation_share: the same of the rotation.
        text: a few words: which error it is, and what is known of it.
        sentence: its part in the uncertainty, what is known of it, and what would reduce it.
    """

    position_share: float
    rotation_share: float
    text: str
    sentence: str


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
        families.setdefault(error_words(one.name).family or one.name, []).append(one)
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


def _sum_of(rows: Sequence[SystematicErrorResult], share: str) -> float:
    return min(float(sum(getattr(row, share) for row in rows)), 1.0)


def _dominant(
    rows: Sequence[SystematicErrorResult],
    position_share: float,
    rotation_share: float,
    covariance: Matrix66,
    measured: bool,
) -> DominantError:
    words = error_words(rows[0].name)
    known = knowledge_text(max(rows, key=lambda row: row.position_share + row.rotation_share))
    position_cm = 100.0 * float(np.sqrt(np.trace(covariance[:3, :3])))
    rotation_deg = float(np.rad2deg(np.sqrt(np.trace(covariance[3:, 3:]))))
    parts = []
    if position_share:
        parts.append(f"{_share_text(position_share)} of the variance of the position ({position_cm:.2g} cm)")
    if rotation_share:
        parts.append(f"{_share_text(rotation_share)} of that of the rotation ({rotation_deg:.2g} deg)")
    if not position_share:
        parts = [parts[0].replace("that of", "the variance of")]
    name = words.family or words.text
    come = "come" if len(parts) > 1 else "comes"
    remedy = (words.remedy_with_tape if measured else "") or words.remedy
    return DominantError(
        position_share,
        rotation_share,
        f"{name}, {known}",
        f"{' and '.join(parts)} {come} from {name}: {known}; {remedy}",
    )


def _share_text(share: float) -> str:
    return next(words for least, words in _SHARES if share >= least)


def knowledge_text(error: SystematicErrorResult) -> str:
    """Say what is known of an error: "+1.2 ± 0.9 %, ± 2 % before any pair", or that the pairs do not determine it."""
    words = error_words(error.name)
    unit = f" {words.unit}" if words.unit else ""
    prior = f"± {words.factor * error.prior_sigma:.2g}{unit}"
    if error.sigma > _UNDETERMINED * error.prior_sigma:
        return f"{prior} assumed, the pairs do not determine it"
    sigma = words.factor * error.sigma
    decimals = max(0, 1 - int(np.floor(np.log10(sigma)))) if sigma > 0.0 else 2
    return f"{words.factor * error.value:+.{decimals}f} ± {sigma:.{decimals}f}{unit}, {prior} before any pair"
