"""How radar drivers and loggers name what a radar measures, in which units: one vocabulary for messages, tables and --map.

A spelling is written as words in lower case, in any order, without the words that FILLERS lists: "pos x" also stands for
posX, x_pos, target.position_x and f_PosX. A new spelling is added here, once.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal, TypeAlias

from calib_core.errors import OptionError

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
_UNITS: tuple[tuple[str, Dimension, float, str], ...] = (
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
    Unit(name, dimension, scale, words.split()[0]) for name, dimension, scale, words in _UNITS
)
"""All units; the first of a dimension is the one that is assumed."""

UNITS_BY_SPELLING: Mapping[str, Unit] = {
    word: unit for unit, (*_, words) in zip(UNITS, _UNITS, strict=True) for word in words.split()
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


@dataclass(frozen=True, slots=True)
class Spelling:
    """One spelling.

    Attributes:
        words: separated by spaces.
        kind: x, y, z, range, azimuth, elevation, doppler, vx, vy, vz, snr, intensity, rcs, power or amplitude; "radial" for a
            speed that can only be the radial one, "longitudinal" or "lateral" for an axis named by its direction; among
            AMBIGUOUS also "vague", an angle that fits azimuth and elevation alike.
        rank: 0 for the plainest names; larger for names that are used for other things too.
    """

    words: str
    kind: str
    rank: int


_TABLE = """
range 0: range; rng; radial range; radial distance; radial dist; slant range; range rad; range distance
range 1: distance; dist; r dist; r distance; r range
range 2: r; radius; rho
azimuth 0: azimuth; azi; azim; az; azimuth angle; azi angle; az angle; horizontal angle; hor angle; h angle; azimuth ang; az ang
azimuth 0: azimuthal; azimuthal angle
azimuth 1: bearing; bearing angle
elevation 0: elevation; elev; ele; el; elevation angle; elev angle; el angle; vertical angle; ver angle; angle v; elevation ang
x 0: x; pos x; position x; dist x; distance x; p x; px; center x; centre x
x 1: d x; range x
longitudinal 1: longitudinal; long dist; long distance; long pos; long position; d long; dlong; long d; long range
y 0: y; pos y; position y; dist y; distance y; p y; py; center y; centre y
y 1: d y; range y
lateral 1: lateral; lat dist; lat distance; lat pos; lat position; d lat; dlat; lat d; lat range
z 0: z; pos z; position z; dist z; distance z; p z; pz; center z; centre z
z 1: d z; range z; vertical; vertical dist; vertical distance; vertical pos; vertical position
radial 0: doppler; radial velocity; radial speed; radial vel; doppler velocity; v radial; doppler speed; doppler vel
radial 0: range rate; rangerate; v doppler; v rad; vel rad; velocity rad; speed rad; r rate; r dot; rdot; range dot
radial 0: range velocity; v r; vr; vel r; velocity r; speed r; dist rate; distance rate; range speed; vrad; rr; dop; dop vel
radial 0: dop velocity
doppler 4: velocity; speed; vel; spd; v
vx 0: vx; v x; vel x; velocity x; speed x; x dot; xdot; long vel; long velocity; v long; vlong; long speed; twist linear x
vy 0: vy; v y; vel y; velocity y; speed y; y dot; ydot; lat vel; lat velocity; v lat; vlat; lat speed; twist linear y
vz 0: vz; v z; vel z; velocity z; speed z; z dot; zdot; vertical vel; vertical velocity; vertical speed; twist linear z
snr 0: snr; signal noise ratio; signal to noise; signal to noise ratio; signaltonoise; signaltonoiseratio; snr ratio
intensity 1: intensity; intens
rcs 2: rcs; radar cross section; cross section
power 3: power; pow; pwr; signal power; received power; rssi
amplitude 3: amplitude; ampl; amp; magnitude; mag; level; strength; signal strength; signal level
"""

_AMBIGUOUS_TABLE = """
vague 3: phi; alpha; aoa; doa; phi angle; alpha angle
vague 4: theta; beta; theta angle; beta angle
vague 5: angle; ang
x 1: dx
y 1: dy
z 1: dz; height; altitude
"""


def _spellings(table: str) -> tuple[Spelling, ...]:
    rows = (row.partition(":") for row in table.strip().splitlines())
    return tuple(
        Spelling(words.strip(), head.split()[0], int(head.split()[1]))
        for head, _, line in rows
        for words in line.split(";")
    )


SPELLINGS: tuple[Spelling, ...] = _spellings(_TABLE)
"""All spellings that mean the same wherever they are found."""

AMBIGUOUS: tuple[Spelling, ...] = _spellings(_AMBIGUOUS_TABLE)
"""Spellings of which each reader decides: a message's comments and values tell the angles apart, and its type tells that it
describes returns; in a table dx may be the size of an object, and altitude a place on Earth."""

TABLE_ANGLES = (Spelling("theta", "azimuth", 4), Spelling("angle", "azimuth", 5), Spelling("phi", "elevation", 4))
"""The ambiguous angles as tables use them."""


def words_in(text: str) -> frozenset[str]:
    """Return the words of a text."""
    return frozenset(text.split())


TYPE_PREFIXES = words_in("f s m u i b n g p fl dbl flt ui my us ul si sl af mf mu ms a l k e t st str")
"""Letters at the start of a name that encode its type or scope."""

TABLE_TYPE_PREFIXES = words_in("f s n d i u b m fl ui dbl flt p str")
"""Fewer than in messages: t_x is a translation."""

SUBJECTS = words_in(
    "radar radarpoint target targets tgt detection detections det dets point points pt pts return returns object objects obj "
    "objs reflection reflections refl cluster clusters hit hits plot plots echo echoes peak peaks track tracks data list frames "
    "scans samples messages msg header field value val values cartesian polar raw meas measured measurement"
)
"""Words for what a name belongs to, such as a return: they may precede any name."""

FILLERS = SUBJECTS | words_in(
    "report sensor can tx rx detect est estimated rel relative cart spherical sph coord coords coordinate coordinates pose loc "
    "location filtered reflector current cur info general kinematic kinematics the of to from in"
)
"""Words that may stand anywhere in a name without changing its meaning."""

STATISTICS = words_in("std stddev stdev sigma rms dev deviation")
"""Words that make a quantity its standard deviation."""

BLOCKERS = words_in(
    "var variance cov covariance err error unc uncertainty accuracy acc conf confidence quality valid invalid flag flags "
    "min max maximum minimum res resolution bin idx index id ids count cnt num number offset bias scale limit accel "
    "acceleration origin ref reference prev previous pred predicted gate width length size "
    "time age status type class classification prob probability fov orient orientation heading yaw pitch roll "
    "start end ego host abs absolute delta diff lever mount mounting install vehicle odom state mode threshold thresh "
    "existence history covar turn steer steering lane road boundary corner curvature dynamic property dyn prop"
)
"""Words that make a name mean something else."""

SECOND = words_in("2 3 second secondary alt alternative alternate hyp2 amb ambig ambiguity ambiguous other")
"""Words that make a quantity a second hypothesis."""

NUMBERS = frozenset(("1", "0", "first", "primary", "hyp", "hypothesis"))
"""Words that number hypotheses, and mean the first."""

_SYNONYMS = {
    "longitudinal": "long", "longitude": "long", "latitude": "lat", "lon": "long", "lng": "long", "lateral": "lat",
    "vrel": "v", "vabs": "v",
    "ranges": "range", "azimuths": "azimuth", "elevations": "elevation", "angles": "angle", "velocities": "velocity",
    "speeds": "speed", "dopplers": "doppler", "distances": "distance", "intensities": "intensity", "amplitudes": "amplitude",
    "powers": "power", "xs": "x", "ys": "y", "zs": "z", "positions": "position", "snrs": "snr",
}  # fmt: skip
_CHUNK = re.compile(r"[A-Z]+(?![a-zµμ])|[A-Z]?[a-zµμ]+|\d+|°")
_DECIBEL = re.compile(r"d[Bb](sm|m2|m)?(?![a-z])")
_SHORTEST = 3
_LETTERS = frozenset("xyzvr")
_PLACES = words_in("coord coords coordinate coordinates")
_QUANTITY_WORDS = (
    frozenset(word for one in (*SPELLINGS, *AMBIGUOUS) for word in one.words.split() if len(word) > 1)
    | frozenset(_SYNONYMS)
    | {"db", "std", "deg"}
)
_PARTS = (
    _QUANTITY_WORDS | {word for word in FILLERS if len(word) > _SHORTEST} - {"from"} | STATISTICS | {"rel", "rx", "tx"}
)
_TAILS = _QUANTITY_WORDS | _PLACES


@cache
def words_of(name: str) -> tuple[str, ...]:
    """Split a name into lower-case words: at dots, underscores and capitals, and compounds of known words."""
    text = _DECIBEL.sub(lambda match: f"_db{match[1] or ''}_", name.replace("²", "2"))
    words: list[str] = []
    for chunk in _CHUNK.findall(text):
        word = chunk.lower()
        if word.isdigit() and words and len(words[-1]) == 1 and word in ("8", "16", "32", "64"):
            words[-1] = "f"  # a type prefix such as u16
        else:
            words.extend(_split(word))
    return folded(words)


def folded(words: list[str]) -> tuple[str, ...]:
    """Replace plurals and synonyms by the words that the table of spellings uses."""
    return tuple(_SYNONYMS.get(word, word) for word in words)


def has_word(name: str, *wanted: str) -> bool:
    """Return whether one of the words is part of a name."""
    return not set(wanted).isdisjoint(words_of(name))


def _split(word: str) -> list[str]:
    """Split a compound such as posx, xpos or distlong into known words; leave any other as it is."""
    if word in _PARTS or word in FILLERS or word in BLOCKERS or len(word) < _SHORTEST:
        return [word]
    for size in range(len(word) - 1, 1, -1):
        head, tail = word[:size], word[size:]
        if head in _PARTS:
            rest = [tail] if tail in _LETTERS or tail in _PARTS else _split(tail)
            if all(part in _PARTS or part in _LETTERS for part in rest):
                return [head, *rest]
    if word[0] in _LETTERS and word[1:] in _TAILS:
        return [word[0], word[1:]]
    return [word]


_QUANTITIES = {
    "longitudinal": "x", "lateral": "y", "radial": "doppler", "vague": "azimuth",
    **dict.fromkeys(("snr", "intensity", "rcs", "power"), "amplitude"),
}  # fmt: skip
_MOST_WORDS_OF_A_UNIT = 3
_ON_EARTH = words_in("latitude longitude altitude lon lng gps gnss")
_BARE = words_in("lat long")
_WITH_SIGMA = ("range", "azimuth", "elevation")
_ACCURACY = re.compile("accuracy", re.IGNORECASE)
_PLAIN_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a name states.

    Attributes:
        kind: of its spelling.
        rank: of its spelling.
        unit: None if the name states none.
        sigma: it is the quantity's standard deviation.
        second: it is a second hypothesis, such as azimuth2.
        numbered: it is the first or a further hypothesis, such as azimuth1.
        bare: it is a single word, without prefixes and unit.
    """

    kind: str
    rank: int
    unit: Unit | None = None
    sigma: bool = False
    second: bool = False
    numbered: bool = False
    bare: bool = False

    @property
    def quantity(self) -> str:
        """One of x, y, z, range, azimuth, elevation, doppler, vx, vy, vz and amplitude."""
        return _QUANTITIES.get(self.kind, self.kind)


def spelt(spellings: Iterable[Spelling]) -> Mapping[frozenset[str], Spelling]:
    """Return spellings by the set of their words; of two with the same words, the first."""
    found: dict[frozenset[str], Spelling] = {}
    for spelling in spellings:
        words = frozenset(folded(spelling.words.split()))
        found.setdefault(words - FILLERS or words, spelling)
    return found


_SPELT_IN_MESSAGES = spelt((*SPELLINGS, *AMBIGUOUS))
_SPELT_IN_TABLES = spelt((*SPELLINGS, *TABLE_ANGLES))


_PIXELS = spelt(
    _spellings("""
u 0: u; u px; px u; x px; px x; pixel u; pixel x; image u; image x; img u; img x; col; column; pixel column
v 0: v; v px; px v; y px; px y; pixel v; pixel y; image v; image y; img v; img y; row; pixel row
""")
)


def pixel_axis(name: str) -> str:
    """Return "u" or "v" if a column of pairs holds this coordinate of a pixel, else ""."""
    spelling = _PIXELS.get(frozenset(words_of(name)) - SUBJECTS)
    return spelling.kind if spelling else ""


@cache
def meaning_of(name: str) -> Meaning | None:
    """Return what the dotted name of a message's field means; None if it is none of the quantities in use."""
    return _meaning(words_of(name), _SPELT_IN_MESSAGES, TYPE_PREFIXES)


def names_a_speed(names: Iterable[str]) -> bool:
    """Return whether a column's name says that it is a radial speed, which only a radar or a rare lidar measures."""
    return any(meaning is not None and meaning.kind == "radial" for meaning in map(meaning_of, names))


@cache
def column_meaning(name: str) -> Meaning | None:
    """Return what the name of a table's column means, without a unit in brackets; None if nothing or a place on Earth.

    A table may be about anything: dx may be the size of an object, and a second azimuth or a bare lat no radar's.
    """
    plain, words = {word.lower() for word in _PLAIN_WORD.findall(name)}, words_of(_ACCURACY.sub("_sigma_", name))
    meaning = _meaning(words, _SPELT_IN_TABLES, TABLE_TYPE_PREFIXES)
    if meaning is None or meaning.numbered or (meaning.sigma and meaning.quantity not in _WITH_SIGMA):
        return None
    on_earth = not plain.isdisjoint(_ON_EARTH) or (meaning.bare and not plain.isdisjoint(_BARE))
    return None if on_earth else meaning


def is_plain(name: str, meaning: Meaning) -> bool:
    """Return whether a name is that of the documentation: the quantity itself, after words for a return and before a unit."""
    words = [word.lower() for word in _PLAIN_WORD.findall(name)]
    while len(words) > 1 and words[0] in TABLE_TYPE_PREFIXES | SUBJECTS:
        words.pop(0)
    quantity = meaning.kind if meaning.quantity == "amplitude" else meaning.quantity
    own = ["sigma"] * meaning.sigma + [quantity]
    rest = tuple(words[len(own) :])
    return words[: len(own)] == own and (not rest or unit_of_words(rest) is not None)


def _meaning(
    words: tuple[str, ...], known: Mapping[frozenset[str], Spelling], type_prefixes: Set[str]
) -> Meaning | None:
    """Return what the words of a name state: after as many type prefixes as need be, and before a unit."""
    if not BLOCKERS.isdisjoint(words):
        return None
    for start in range(_prefixes(words, type_prefixes) + 1):
        meaning = _with_unit(tuple(word for word in words[start:] if word not in FILLERS), known)
        if meaning is not None:
            return meaning
    return None


def _prefixes(words: tuple[str, ...], type_prefixes: Set[str]) -> int:
    """Return how many leading words may be dropped: type prefixes, only if something remains."""
    count = 0
    while count < len(words) - 1 and words[count] in type_prefixes:
        count += 1
    return count


def _with_unit(words: tuple[str, ...], known: Mapping[frozenset[str], Spelling]) -> Meaning | None:
    for size in range(min(_MOST_WORDS_OF_A_UNIT, len(words) - 1), 0, -1):
        unit = unit_of_words(words[-size:])
        meaning = _plain(words[:-size], known) if unit else None
        if unit and meaning and dimension_of(meaning.quantity) == unit.dimension:
            return replace(meaning, unit=unit)
    return _plain(words, known)


def _plain(words: tuple[str, ...], known: Mapping[frozenset[str], Spelling]) -> Meaning | None:
    numbering = SECOND | NUMBERS
    spelling = known.get(frozenset(words) - STATISTICS - numbering)
    if spelling is None:
        return None
    return Meaning(
        spelling.kind,
        spelling.rank,
        sigma=not STATISTICS.isdisjoint(words),
        second=not SECOND.isdisjoint(words),
        numbered=not numbering.isdisjoint(words),
        bare=len(words) == 1,
    )


Direction: TypeAlias = Literal["forward", "backward", "left", "right", "up", "down"]
_SIDES: Mapping[str, Direction] = {
    "forward": "forward", "forwards": "forward", "ahead": "forward", "front": "forward", "longitudinal": "forward",
    "boresight": "forward", "backward": "backward", "backwards": "backward", "behind": "backward",
    "left": "left", "right": "right", "up": "up", "upward": "up", "upwards": "up", "down": "down", "downward": "down",
    "downwards": "down",
}  # fmt: skip
OPPOSITE: Mapping[Direction, Direction] = {
    "forward": "backward", "backward": "forward", "left": "right", "right": "left", "up": "down", "down": "up"
}  # fmt: skip
_ANY = "|".join(sorted(_SIDES, key=len, reverse=True))
_BETWEEN = (
    r"(?:\W+(?:is|are|values?|means?|points?|pointing|axis|direction|side|to|towards|the|of|in|on|sensor|angles?))*\W*"
)
_POSITIVE_SIDE = re.compile(rf"(?P<sign>positive|pos\.|negative|neg\.|\+){_BETWEEN}\b(?P<side>{_ANY})\b", re.IGNORECASE)
_SIDE_POSITIVE = re.compile(rf"\b(?P<side>{_ANY})\b{_BETWEEN}(?P<sign>positive|negative|\+)", re.IGNORECASE)
_LEADS_TO = r"(?:\s*(?:is|points?|pointing|=|:|->|to|towards|the|,|-|\(|\+)\s*)*\s*"
_AXIS = re.compile(rf"(?<![\w.])(?P<axis>[xyz])(?:[ -]?axis)?{_LEADS_TO}\b(?P<side>{_ANY})\b", re.IGNORECASE)
_LEFTWARD = re.compile(r"counter-?\s?clockwise|anti-?\s?clockwise|\bccw\b", re.IGNORECASE)
_RIGHTWARD = re.compile(r"(?<!counter)(?<!counter[- ])(?<!anti)(?<!anti[- ])clockwise|\bcw\b", re.IGNORECASE)
_BY_WORD = {word: unit for word, unit in UNITS_BY_SPELLING.items() if unit.dimension != "time"}
_UNIT_WORDS = "|".join(sorted((re.escape(word) for word in _BY_WORD), key=len, reverse=True))
_FACTOR = r"(?:(?P<number>\d+\s*/\s*\d+|\d*\.?\d+(?:e-?\d+)?)\s*\*?\s*)?"
_ALONE = re.compile(rf"{_FACTOR}(?P<unit>{_UNIT_WORDS})", re.IGNORECASE)
_BRACKETS = re.compile(rf"[\[(<{{]\s*(?:in\s+|unit:?\s*)?{_FACTOR}(?P<unit>{_UNIT_WORDS})\s*[\])>}},;]", re.IGNORECASE)
_SAID = re.compile(
    rf"\b(?:in|units?|lsb|scale|factor|resolution|of|per bit)\b\s*(?:is|of|in|:|=)*\s*{_FACTOR}(?P<unit>{_UNIT_WORDS})(?![\w/])",
    re.IGNORECASE,
)
_SCALE = re.compile(
    r"\b(?:lsb|scale|factor|resolution|mult[a-z]+)\D{0,12}(?P<number>\d*\.\d+(?:e-?\d+)?)", re.IGNORECASE
)
_LONG_WORDS = "|".join(sorted((re.escape(word) for word in _BY_WORD if len(word) > 2), key=len, reverse=True))
_LONG_WORD = re.compile(rf"(?<![\w/])(?P<unit>{_LONG_WORDS})(?![\w/])", re.IGNORECASE)
_LIMITS = r"\b(?:max\w*|min\w*|up to|accuracy|precision|limited to{})\b[^,;\])]*"
_OF_FLOATS, _OF_INTEGERS = (re.compile(_LIMITS.format(more), re.IGNORECASE) for more in ("|resolution|step", ""))


def positive_side(comment: str) -> Direction | None:
    """Return the direction in which the values of a field grow, as its comment states it; None if it does not.

    Args:
        comment: such as "azimuth, positive to the left" or "clockwise".
    """
    match = _POSITIVE_SIDE.search(comment) or _SIDE_POSITIVE.search(comment)
    if match:
        side = _SIDES[match["side"].lower()]
        return OPPOSITE[side] if match["sign"].lower().startswith("neg") else side
    if _LEFTWARD.search(comment):
        return "left"
    return "right" if _RIGHTWARD.search(comment) else None


def axis_side(comment: str) -> Direction | None:
    """Return the direction of an axis that its own comment names alone, such as "forward" or "[m] to the right"."""
    stated = positive_side(comment)
    if stated:
        return stated
    found = {_SIDES[word.lower()] for word in re.findall(rf"\b({_ANY})\b", comment, re.IGNORECASE)}
    return found.pop() if len(found) == 1 else None


def axes_in(remarks: str) -> Mapping[str, Direction]:
    """Return the directions of x, y and z that comments state, such as "x right, y forward, z up".

    Args:
        remarks: the comments of a message or of its elements.
    """
    found: dict[str, Direction] = {}
    for match in _AXIS.finditer(remarks):
        found.setdefault(match["axis"].lower(), _SIDES[match["side"].lower()])
    return found


def angle_in(comment: str) -> Literal["azimuth", "elevation"] | None:
    """Return which angle a comment names; None if none or both."""
    azimuth = re.search(r"azimuth|horizontal|\bbearing\b", comment, re.IGNORECASE)
    elevation = re.search(r"elevation|vertical", comment, re.IGNORECASE)
    if bool(azimuth) == bool(elevation):
        return None
    return "azimuth" if azimuth else "elevation"


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


QUANTITIES: tuple[str, ...] = (
    "x", "y", "z", "range", "azimuth", "elevation", "doppler", "amplitude", "time", "sigma_range", "sigma_azimuth",
    "sigma_elevation",
)  # fmt: skip
MAPPED_UNITS: Mapping[str, Mapping[str, float]] = {
    quantity: {unit.flag: unit.scale for unit in units_for(quantity)} for quantity in QUANTITIES
}
"""Units of each quantity, and the factor to m, rad, m/s, dB or ns. The first is the one that is assumed."""

_WORDS = re.compile(r"(?P<quantity>\w+)=(?P<minus>-?)(?P<column>[^:=]+)(?::(?P<unit>\w+))?")
_EXAMPLE = "for example --map x=posX:m, or --map azimuth=-theta:deg where the message counts it to the right"


@dataclass(frozen=True, slots=True)
class MappedColumn:
    """One --map.

    Attributes:
        quantity: one of QUANTITIES.
        column: the field or column, as the recording spells it; nested fields dotted.
        unit: a key of MAPPED_UNITS[quantity]; "" if not given.
        sign: -1 where the column's values have the opposite sign.
    """

    quantity: str
    column: str
    unit: str = ""
    sign: int = 1

    @property
    def scale(self) -> float:
        """The factor to m, rad, m/s, dB or ns, with the sign."""
        return self.sign * (MAPPED_UNITS[self.quantity][self.unit] if self.unit else 1.0)

    @property
    def words(self) -> str:
        """The value of --map."""
        minus = "-" if self.sign < 0 else ""
        return f"{self.quantity}={minus}{self.column}" + (f":{self.unit}" if self.unit else "")


def parse_column_map(texts: Sequence[str]) -> tuple[MappedColumn, ...]:
    """Parse the values of --map, each QUANTITY=COLUMN, QUANTITY=COLUMN:UNIT or QUANTITY=-COLUMN:UNIT.

    Raises:
        OptionError: one is malformed, its quantity or unit is unknown, or a quantity is given twice.
    """
    columns: dict[str, MappedColumn] = {}
    for text in texts:
        match = _WORDS.fullmatch(text.strip())
        if match is None:
            raise OptionError(f"--map {text}: give QUANTITY=COLUMN:UNIT; {_EXAMPLE}")
        quantity, unit = match["quantity"].lower(), _unit(match["unit"] or "")
        if quantity not in MAPPED_UNITS:
            raise OptionError(f"--map {text}: unknown quantity '{quantity}'; known: {', '.join(QUANTITIES)}")
        if unit and unit not in MAPPED_UNITS[quantity]:
            raise OptionError(
                f"--map {text}: unknown unit '{unit}' of {quantity}; known: {', '.join(MAPPED_UNITS[quantity])}"
            )
        if quantity in columns:
            raise OptionError(f"--map {text}: {quantity} is already read from '{columns[quantity].column}'")
        columns[quantity] = MappedColumn(quantity, match["column"].strip(), unit, -1 if match["minus"] else 1)
    return tuple(columns.values())


def _unit(written: str) -> str:
    """Return a unit in the spelling of MAPPED_UNITS: kmh for kph, m for metres."""
    unit = unit_of_word(written)
    return unit.flag if unit else written.lower()
