"""Units as names, comments and --map spell them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

Dimension: TypeAlias = Literal["length", "angle", "speed", "level", "time"]


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit.

    Attributes:
        name: for display, such as "cm" or "0.01 deg".
        dimension: what it measures.
        scale: factor to m, rad, m/s, dB or ns.
        flag: its spelling in --map, such as "cm" or "mps"; "" if it has none.
    """

    name: str
    dimension: Dimension
    scale: float
    flag: str = ""

    def times(self, number: float) -> "Unit":
        """Return a multiple of this unit."""
        return self if number == 1.0 else Unit(f"{number:g} {self.name}", self.dimension, number * self.scale)


_DEGREE = math.pi / 180.0
_SPELLINGS: tuple[tuple[str, Dimension, float, str], ...] = (
    ("m", "length", 1.0, "m meter meters metre metres"),
    ("cm", "length", 0.01, "cm centimeter centimeters centimetre centimetres"),
    ("mm", "length", 0.001, "mm millimeter millimeters millimetre millimetres"),
    ("km", "length", 1000.0, "km kilometer kilometers kilometre kilometres"),
    ("rad", "angle", 1.0, "rad rads radian radians"),
    ("deg", "angle", _DEGREE, "deg degs degree degrees \u00b0"),
    ("mrad", "angle", 0.001, "mrad milliradian milliradians"),
    ("0.01 deg", "angle", 0.01 * _DEGREE, "cdeg centideg centidegree centidegrees"),
    ("0.001 deg", "angle", 0.001 * _DEGREE, "mdeg millideg millidegree millidegrees"),
    ("m/s", "speed", 1.0, "mps m/s ms^-1 ms-1 m*s^-1 mpers m/sec"),
    ("km/h", "speed", 1 / 3.6, "kmh km/h kph kmph"),
    ("cm/s", "speed", 0.01, "cmps cm/s"),
    ("mm/s", "speed", 0.001, "mmps mm/s"),
    ("dB", "level", 1.0, "db decibel decibels"),
    ("dBsm", "level", 1.0, "dbsm dbm2 dbm^2 dbsqm"),
    ("dBm", "level", 1.0, "dbm"),
    ("ns", "time", 1.0, "ns nsec nsecs nanosec nanosecs nanosecond nanoseconds"),
    ("us", "time", 1e3, "us \u00b5s \u03bcs usec usecs microsec microsecs microsecond microseconds"),
    ("ms", "time", 1e6, "ms msec msecs millisec millisecs millisecond milliseconds"),
    ("s", "time", 1e9, "s sec secs second seconds"),
)
"""Name, dimension, factor and spellings of each unit; the first spelling is that of --map."""

UNITS: tuple[Unit, ...] = tuple(
    Unit(name, dimension, scale, words.split()[0]) for name, dimension, scale, words in _SPELLINGS
)
"""All units; the first of a dimension is the one that is assumed."""

UNITS_BY_SPELLING: Mapping[str, Unit] = {
    word: unit for unit, (*_, words) in zip(UNITS, _SPELLINGS, strict=True) for word in words.split()
}
"""All units by each of their spellings, in lower case."""

_IN_WORDS: Mapping[tuple[str, ...], str] = {
    ("m", "s"): "m/s", ("m", "sec"): "m/s", ("m", "per", "s"): "m/s", ("m", "per", "sec"): "m/s", ("m", "s", "1"): "m/s",
    ("meter", "per", "second"): "m/s", ("meters", "per", "second"): "m/s", ("metres", "per", "second"): "m/s",
    ("km", "h"): "km/h", ("km", "per", "h"): "km/h", ("cm", "s"): "cm/s", ("mm", "s"): "mm/s", ("dbm", "2"): "dbm2",
}  # fmt: skip
"""Units that a name splits into several words."""

_DIMENSIONS: Mapping[str, Dimension] = {
    "x": "length", "y": "length", "z": "length", "range": "length", "azimuth": "angle", "elevation": "angle",
    "doppler": "speed", "vx": "speed", "vy": "speed", "vz": "speed", "amplitude": "level", "snr": "level", "rcs": "level",
    "power": "level", "intensity": "level", "time": "time",
}  # fmt: skip


def dimension_of(quantity: str) -> Dimension:
    """Return what a quantity's unit measures; that of sigma_range is the range's."""
    return _DIMENSIONS[quantity.removeprefix("sigma_")]


def units_for(quantity: str) -> tuple[Unit, ...]:
    """Return the units of a quantity; the first is the one that is assumed."""
    return tuple(unit for unit in UNITS if unit.dimension == dimension_of(quantity))


def unit_of_word(word: str) -> Unit | None:
    """Return the unit that a word names."""
    return UNITS_BY_SPELLING.get(word.lower().replace("²", "2").replace("m s-1", "m/s"))


def unit_of_words(words: tuple[str, ...]) -> Unit | None:
    """Return the unit that the last words of a name state, such as ("m", "s")."""
    spelling = _IN_WORDS.get(words) or (words[0] if len(words) == 1 else "")
    return UNITS_BY_SPELLING.get(spelling)
