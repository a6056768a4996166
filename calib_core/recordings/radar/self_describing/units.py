"""Units as names and comments of fields state them."""

import math
import re
from dataclasses import dataclass
from typing import Literal, TypeAlias

__all__ = ["Dimension", "Unit", "dimension_of", "unit_in", "unit_of_tokens", "unit_of_word"]

Dimension: TypeAlias = Literal["length", "angle", "speed", "level"]


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit.

    Attributes:
        name: for display, such as "cm" or "0.01 deg".
        dimension: what it measures.
        scale: factor to m, rad, m/s or dB.
    """

    name: str
    dimension: Dimension
    scale: float

    def times(self, number: float) -> "Unit":
        """Return a multiple of this unit."""
        return self if number == 1.0 else Unit(f"{number:g} {self.name}", self.dimension, number * self.scale)


_DEGREE = math.pi / 180.0
_UNITS: tuple[tuple[str, Dimension, float, str], ...] = (
    ("m", "length", 1.0, "m meter meters metre metres"),
    ("cm", "length", 0.01, "cm centimeter centimeters centimetre centimetres"),
    ("mm", "length", 0.001, "mm millimeter millimeters millimetre millimetres"),
    ("km", "length", 1000.0, "km kilometer kilometers kilometre kilometres"),
    ("rad", "angle", 1.0, "rad rads radian radians"),
    ("mrad", "angle", 0.001, "mrad milliradian milliradians"),
    ("deg", "angle", _DEGREE, "deg degs degree degrees \u00b0"),
    ("0.01 deg", "angle", 0.01 * _DEGREE, "cdeg centideg centidegree centidegrees"),
    ("0.001 deg", "angle", 0.001 * _DEGREE, "mdeg millideg"),
    ("m/s", "speed", 1.0, "m/s mps ms^-1 ms-1 m*s^-1 mpers"),
    ("km/h", "speed", 1 / 3.6, "km/h kmh kph kmph"),
    ("cm/s", "speed", 0.01, "cm/s cmps"),
    ("mm/s", "speed", 0.001, "mm/s mmps"),
    ("dB", "level", 1.0, "db decibel decibels"),
    ("dBsm", "level", 1.0, "dbsm dbm2 dbm^2 dbsqm"),
    ("dBm", "level", 1.0, "dbm"),
)
_BY_WORD = {word: Unit(name, kind, scale) for name, kind, scale, words in _UNITS for word in words.split()}
_TOKENS: dict[tuple[str, ...], str] = {
    ("m", "s"): "m/s", ("m", "per", "s"): "m/s", ("meter", "per", "second"): "m/s", ("meters", "per", "second"): "m/s",
    ("km", "h"): "km/h", ("km", "per", "h"): "km/h", ("cm", "s"): "cm/s", ("mm", "s"): "mm/s",
}  # fmt: skip
_DIMENSIONS: dict[str, Dimension] = {
    "x": "length", "y": "length", "z": "length", "range": "length", "azimuth": "angle", "elevation": "angle",
    "doppler": "speed", "vx": "speed", "vy": "speed", "vz": "speed", "amplitude": "level",
}  # fmt: skip
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


def dimension_of(quantity: str) -> Dimension:
    """Return what a quantity's unit measures."""
    return _DIMENSIONS[quantity]


def unit_of_word(word: str) -> Unit | None:
    """Return the unit that a word names."""
    return _BY_WORD.get(word.lower())


def unit_of_tokens(tokens: tuple[str, ...]) -> Unit | None:
    """Return the unit that the last parts of a field's name state, such as ("m", "s")."""
    word = _TOKENS.get(tokens) or (tokens[0] if len(tokens) == 1 else "")
    return _BY_WORD.get(word)


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
        unit = _BY_WORD[match["unit"].lower()] if match else None
        if match and unit and unit.dimension == dimension:
            return _with_scale(unit.times(_number(match["number"])), text)
    for match in _LONG_WORD.finditer(text):
        unit = _BY_WORD[match["unit"].lower()]
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
