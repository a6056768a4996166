"""Units as comments of fields state them."""

import re

from calib_core.recordings.field_words.units import UNITS_BY_SPELLING, Dimension, Unit

_BY_WORD = {word: unit for word, unit in UNITS_BY_SPELLING.items() if unit.dimension != "time"}
_WORDS = "|".join(sorted((re.escape(word) for word in _BY_WORD), key=len, reverse=True))
_NUMBER = r"(?:(?P<number>\d+\s*/\s*\d+|\d*\.?\d+(?:e-?\d+)?)\s*\*?\s*)?"
_ALONE = re.compile(rf"{_NUMBER}(?P<unit>{_WORDS})", re.IGNORECASE)
_BRACKETS = re.compile(rf"[\[(<{{]\s*(?:in\s+|unit:?\s*)?{_NUMBER}(?P<unit>{_WORDS})\s*[\])>}},;]", re.IGNORECASE)
_SAID = re.compile(
    rf"\b(?:in|units?|lsb|scale|factor|resolution|of|per bit)\b\s*(?:is|of|in|:|=)*\s*{_NUMBER}(?P<unit>{_WORDS})(?![\w/])",
    re.IGNORECASE,
)
_SCALE = re.compile(
    r"\b(?:lsb|scale|factor|resolution|mult[a-z]+)\D{0,12}(?P<number>\d*\.\d+(?:e-?\d+)?)", re.IGNORECASE
)
_LONG_WORDS = "|".join(sorted((re.escape(word) for word in _BY_WORD if len(word) > 2), key=len, reverse=True))
_LONG_WORD = re.compile(rf"(?<![\w/])(?P<unit>{_LONG_WORDS})(?![\w/])", re.IGNORECASE)
_LIMITS = r"\b(?:max\w*|min\w*|up to|accuracy|precision|limited to{})\b[^,;\])]*"
_OF_FLOATS, _OF_INTEGERS = (re.compile(_LIMITS.format(more), re.IGNORECASE) for more in ("|resolution|step", ""))


def unit_in(comment: str, dimension: Dimension, *, integer: bool = False) -> Unit | None:
    """Return the unit of a dimension that a comment states; None if it states none.

    Understood are the unit alone ("m", "0.01 deg"), in brackets ("range [cm]"), after words such as "in" or "unit:", and long
    words such as "degrees" anywhere. A number counts as a factor only where it cannot be a limit or an accuracy.

    Args:
        comment: of the field.
        dimension: what the unit must measure.
        integer: the field is an integer, whose resolution is its unit.
    """
    text = (_OF_INTEGERS if integer else _OF_FLOATS).sub("", comment).strip(" .,;")
    pieces = [_ALONE.fullmatch(piece.strip()) for piece in re.split("[,;]", text)]
    matches = [*pieces, *_BRACKETS.finditer(text), *_SAID.finditer(text)]
    for match in matches:
        unit = _BY_WORD[match["unit"].casefold()] if match else None
        if match and unit and unit.dimension == dimension:
            return _with_scale(unit.times(_number(match["number"])), text)
    for match in _LONG_WORD.finditer(text):
        unit = _BY_WORD[match["unit"].casefold()]
        if unit.dimension == dimension:
            return _with_scale(unit, text)
    return None


def _with_scale(unit: Unit, text: str) -> Unit:
    """Apply a factor that the comment states apart from the unit, such as "[m], scale 0.1"."""
    factor = _SCALE.search(text)
    return unit.times(float(factor["number"])) if factor and not unit.name[0].isdigit() else unit


def _number(text: str | None) -> float:
    if not text:
        return 1.0
    above, _, below = text.partition("/")
    return float(above) / float(below) if below and float(below) else float(above)
