"""The words of the errors that all pairs share: what each is called, how it is shown, and what would reduce it."""

from dataclasses import dataclass


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
