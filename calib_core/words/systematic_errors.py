"""Names of the systematic errors, what is known of them, and what would reduce them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from calib_core.results.actions import Action, CalibrateLens, MeasureCameraPosition, SetOption, SpreadPlacements
from calib_core.results.systematic_errors import (
    DominantError,
    SystematicErrorResult,
    family_of,
    is_beyond_its_prior,
    is_determined,
)
from calib_core.words.text import Words, join, option, say, words


@dataclass(frozen=True, slots=True)
class Remedy:
    """What would reduce an error's part in the uncertainty: a phrase that "would reduce it" follows, and the same as a value."""

    phrase: Words
    action: Action


@dataclass(frozen=True, slots=True)
class ErrorWords:
    """How an error is shown.

    Attributes:
        label: a few words, for tables.
        text: what it is, within a sentence.
        remedy: what would reduce its part in the uncertainty.
        factor: from its own unit to the one shown.
        unit: shown behind the number; "" if it has none.
        remedy_with_tape: the same if the camera position is measured already; None if it is no different.
        stated: where its prior standard deviation comes from, after the number.
    """

    label: str
    text: str
    remedy: Remedy
    factor: float = 1.0
    unit: str = ""
    remedy_with_tape: Remedy | None = None
    stated: str = "assumed"


@dataclass(frozen=True, slots=True)
class FamilyWords:
    """How errors along several axes are shown together; `names_largest` if the largest is named with them."""

    label: str
    text: str
    names_largest: bool = False


_EDGES = "placements at both edges of the image"
_HEIGHTS = "placements at several heights (a tripod)"
_TAPE = "a tape-measured camera position"


def _by(template: str, action: Action, path: str = "") -> Remedy:
    return Remedy(say(template, option=option(path)), action)


_APEX = _by(
    "clicking the inner corner, where the three plates meet, and stating a smaller sigma for it,",
    SetOption("reflector.offset_sigma_m"),
)
_BOARD = _by("a camera calibration with more views of the board, over the whole image,", CalibrateLens())
_LENS = _by("a better camera calibration, and its error as {option},", CalibrateLens(), path="lens.focal_length_sigma")
_PRINCIPAL_POINT = _by(
    "a camera calibration that determines the principal point well, and its error as {option},",
    CalibrateLens(),
    path="lens.principal_point_sigma_px",
)
_RANGE = "comparing {which} placement's range with a tape, and stating a smaller sigma for it,"

ERRORS: Mapping[str, ErrorWords] = {
    "azimuth_scale": ErrorWords(
        "azimuth scale",
        "the radar's azimuth scale",
        _by(f"{_TAPE}, or {_EDGES},", MeasureCameraPosition()),
        100.0,
        "%",
        _by(_EDGES, SpreadPlacements("edges")),
    ),
    "elevation_scale": ErrorWords(
        "elevation scale",
        "the radar's elevation scale",
        _by(f"{_TAPE}, or {_HEIGHTS},", MeasureCameraPosition()),
        100.0,
        "%",
        _by(_HEIGHTS, SpreadPlacements("heights")),
    ),
    "elevation_lean": ErrorWords(
        "elevation lean",
        "radar elevations that lean with the azimuth",
        _by(_HEIGHTS, SpreadPlacements("heights")),
        100.0,
        "%",
    ),
    "squared_height_m2": ErrorWords(
        "height, squared",
        "the height of the placements",
        _by("near placements, and the reflector's center at the radar's height,", SpreadPlacements("near")),
        unit="m²",
    ),
    "range_bias_m": ErrorWords(
        "range bias",
        "a constant range error",
        _by(_RANGE.format(which="one"), SetOption("radar.range_bias_sigma_m")),
        100.0,
        "cm",
    ),
    "range_scale": ErrorWords(
        "range scale",
        "the radar's range scale",
        _by(_RANGE.format(which="a far"), SetOption("radar.range_scale_sigma")),
        100.0,
        "%",
    ),
    "reflector_right_m": ErrorWords(
        "clicks right of center", "clicks to the right of the radar's phase center", _APEX, 100.0, "cm"
    ),
    "reflector_down_m": ErrorWords("clicks below center", "clicks below the radar's phase center", _APEX, 100.0, "cm"),
    "reflector_forward_m": ErrorWords(
        "clicks beyond center", "clicks beyond the radar's phase center", _APEX, 100.0, "cm"
    ),
    "click_right_px": ErrorWords(
        "clicks off, right", "clicks or the principal point too far to the right", _PRINCIPAL_POINT, unit="px"
    ),
    "click_down_px": ErrorWords(
        "clicks off, down", "clicks or the principal point too far down", _PRINCIPAL_POINT, unit="px"
    ),
    "focal_length": ErrorWords("focal length", "the focal length", _LENS, 100.0, "%"),
    "principal_right_px": ErrorWords("principal point, right", "the principal point's column", _BOARD, unit="px"),
    "principal_down_px": ErrorWords("principal point, down", "the principal point's row", _BOARD, unit="px"),
    "distortion": ErrorWords("distortion (k1)", "the lens distortion", _LENS),
}
"""By the name of the error; those of a lens with a covariance are made by `error_words`."""

FAMILIES: Mapping[str, FamilyWords] = {
    "reflector_": FamilyWords(
        "clicks off the phase center", "the distance of the clicked point from the radar's phase center"
    ),
    "click_": FamilyWords("clicks or principal point", "the principal point, or a constant click offset"),
    "principal_": FamilyWords("principal point", "the principal point"),
    "lens_": FamilyWords("lens", "the lens, as far as its calibration knows it", names_largest=True),
}
"""By what the names of the errors of a family begin with."""

_LENS_PARAMETERS = {
    "fx_px": ("focal length fx", "the focal length fx"),
    "fy_px": ("focal length fy", "the focal length fy"),
    "cx_px": ("principal point, right", "the principal point's column"),
    "cy_px": ("principal point, down", "the principal point's row"),
}


def error_words(name: str) -> ErrorWords:
    """Return how an error is shown; an unknown one by its name."""
    known = ERRORS.get(name)
    if known is not None:
        return known
    if family_of(name) != "lens_":
        return ErrorWords(name, name, _by("more placements", SpreadPlacements("")))
    parameter = name.removeprefix("lens_")
    label, text = _LENS_PARAMETERS.get(parameter, (f"distortion {parameter}", f"the lens distortion ({parameter})"))
    return ErrorWords(label, text, _BOARD, unit="px" if parameter.endswith("_px") else "", stated="by its calibration")


def remedy_of(name: str, *, measured: bool) -> Remedy:
    """Return what would reduce an error's part; a tape is none if the camera position is measured already."""
    known = error_words(name)
    return (known.remedy_with_tape if measured else None) or known.remedy


_SHARES = (
    (0.9, "nearly all"),
    (0.71, "about three quarters"),
    (0.58, "about two thirds"),
    (0.44, "about half"),
    (0.0, "about a third"),
)


def dominant_label(error: DominantError) -> str:
    """Return which error it is, in a few words, and what is known of it."""
    largest = error.largest
    family, known = FAMILIES.get(family_of(largest.name)), error_words(largest.name)
    label = known.label if family is None else family.label
    if family is not None and family.names_largest:
        label = f"{label}, {known.label}"
    if is_determined(largest):
        return f"{label} {value_text(largest.name, largest.value, largest.sigma)}"
    return f"{label} {prior_text(largest.name, largest.prior_sigma)}"


def dominant_sentence(error: DominantError, *, measured: bool, with_remedy: bool = True) -> Words:
    """Return its part in the uncertainty, what is known of it, and what would reduce it, as a phrase."""
    largest = error.largest
    family, known = FAMILIES.get(family_of(largest.name)), error_words(largest.name)
    parts = []
    if error.position_share:
        parts.append(f"{_share(error.position_share)} of the position variance ({two_digits(error.position_cm)} cm)")
    if error.rotation_share:
        parts.append(f"{_share(error.rotation_share)} of the rotation variance ({two_digits(error.rotation_deg)} deg)")
    name = known.text if family is None else family.text
    if family is not None and family.names_largest:
        name = f"{name}, above all {known.text}"
    verb = "are" if len(parts) > 1 else "is"
    sentence = words(f"{' and '.join(parts)} {verb} {name}: {knowledge(largest)}")
    if not with_remedy:
        return sentence
    return join((sentence, remedy_of(largest.name, measured=measured).phrase + " would reduce it"), "; ")


def dominance_text(dominant: tuple[DominantError, ...]) -> str:
    """Name these errors with their shares, in one line."""
    parts = [
        f"{100 * share:.0f} % of the {what}: {dominant_label(error)}"
        for error in dominant
        for what, share in (("position", error.position_share), ("rotation", error.rotation_share))
        if share
    ]
    return "; ".join(parts) or "none with a third of the uncertainty"


def _share(share: float) -> str:
    return next(text for least, text in _SHARES if share >= least)


def two_digits(value: float) -> str:
    """Write a size with two digits, more only before the decimal point."""
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"


def prior_text(name: str, prior_sigma: float) -> str:
    """Write a prior standard deviation: "± 2 %"."""
    known = error_words(name)
    return f"± {two_digits(known.factor * prior_sigma)} {known.unit}".rstrip()


def knowledge(error: SystematicErrorResult) -> str:
    """Say what is known of an error: "+1.2 ± 0.9 % (± 2 % assumed)", or that the pairs do not determine it."""
    prior = f"{prior_text(error.name, error.prior_sigma)} {error_words(error.name).stated}"
    if not is_determined(error) and not is_beyond_its_prior(error):
        return f"{prior}, the pairs do not determine it"
    return f"{value_text(error.name, error.value, error.sigma)} ({prior})"


def value_text(name: str, value: float, sigma: float) -> str:
    """Write an error and its standard deviation: "+1.2 ± 0.9 %"."""
    known = error_words(name)
    shown = known.factor * sigma
    decimals = max(0, 1 - int(np.floor(np.log10(shown)))) if shown > 0.0 else 2
    return f"{known.factor * value:+.{decimals}f} ± {shown:.{decimals}f} {known.unit}".rstrip()


def percent(value: float, sigma: float, *, sign: bool = False) -> str:
    """Write a share and its standard deviation in percent."""
    return f"{100.0 * value:{'+' if sign else ''}.1f} ± {100.0 * sigma:.1f} %"
