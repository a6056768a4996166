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
vx 0: vx; v x; vel x; velocity x; speed x; x dot; xdot; long vel; long velocity; v long; vlong; long speed
vy 0: vy; v y; vel y; velocity y; speed y; y dot; ydot; lat vel; lat velocity; v lat; vlat; lat speed
vz 0: vz; v z; vel z; velocity z; speed z; z dot; zdot; vertical vel; vertical velocity; vertical speed
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


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


TYPE_PREFIXES = _words("f s m u i b n g p fl dbl flt ui my us ul si sl af mf mu ms a l k e t st str")
"""Letters at the start of a name that encode its type or scope."""

SUBJECTS = _words(
    "radar radarpoint target targets tgt detection detections det dets point points pt pts return returns object objects obj "
    "objs reflection reflections refl cluster clusters hit hits plot plots echo echoes peak peaks track tracks data list frames "
    "scans samples messages msg header field value val values cartesian polar raw meas measured measurement"
)
"""Words for what a name belongs to, such as a return: they may precede any name."""

FILLERS = SUBJECTS | _words(
    "report sensor can tx rx detect est estimated rel relative cart spherical sph coord coords coordinate coordinates pose loc "
    "location filtered reflector current cur info general kinematic kinematics the of to from in"
)
"""Words that may stand anywhere in a name without changing its meaning."""

STATISTICS = _words("std stddev stdev sigma rms dev deviation")
"""Words that make a quantity its standard deviation."""

BLOCKERS = _words(
    "var variance cov covariance err error unc uncertainty accuracy acc conf confidence quality valid invalid flag flags "
    "min max maximum minimum res resolution bin idx index id ids count cnt num number offset bias scale limit accel "
    "acceleration origin ref reference prev previous pred predicted ambiguous ambig ambiguity gate width length size "
    "time age status type class classification prob probability fov orient orientation heading yaw pitch roll "
    "start end ego host abs absolute delta diff lever mount mounting install vehicle odom state mode threshold thresh "
    "existence history covar turn steer steering lane road boundary corner curvature dynamic property dyn prop"
)
"""Words that make a name mean something else."""

SECOND = _words("2 3 second secondary alt alternative alternate hyp2 amb other")
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
_PLACES = _words("coord coords coordinate coordinates")
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


_QUANTITIES = {"longitudinal": "x", "lateral": "y", "radial": "doppler", "vague": "azimuth"}
_MOST_WORDS_OF_A_UNIT = 3


@dataclass(frozen=True, slots=True)
class NamedQuantity:
    """What a name states.

    Attributes:
        spelling: of the quantity.
        words: of the name, without type prefixes, fillers and unit.
        unit: None if the name states none.
        sigma: it is the quantity's standard deviation.
        second: it is a second hypothesis, such as azimuth2.
        numbered: it is the first or a further hypothesis, such as azimuth1.
    """

    spelling: Spelling
    words: tuple[str, ...]
    unit: Unit | None = None
    sigma: bool = False
    second: bool = False
    numbered: bool = False

    @property
    def quantity(self) -> str:
        """One of x, y, z, range, azimuth, elevation, doppler, vx, vy, vz, snr, intensity, rcs, power and amplitude."""
        return quantity_of(self.spelling)


def quantity_of(spelling: Spelling) -> str:
    """Return the quantity of a spelling: x for longitudinal, doppler for radial."""
    return _QUANTITIES.get(spelling.kind, spelling.kind)


def spelt(spellings: Iterable[Spelling]) -> Mapping[frozenset[str], Spelling]:
    """Return spellings by the set of their words; of two with the same words, the first."""
    found: dict[frozenset[str], Spelling] = {}
    for one in spellings:
        words = frozenset(folded(one.words.split()))
        found.setdefault(words - FILLERS or words, one)
    return found


SPELT: Mapping[frozenset[str], Spelling] = spelt(SPELLINGS)
"""The shared spellings."""


def named_quantity(
    words: tuple[str, ...],
    known: Mapping[frozenset[str], Spelling] = SPELT,
    *,
    type_prefixes: Set[str] = TYPE_PREFIXES,
) -> NamedQuantity | None:
    """Return what the words of a name state; None if they name none of the known quantities.

    Args:
        words: of the name; see words_of.
        known: the reader's spellings.
        type_prefixes: that the reader drops.
    """
    if not BLOCKERS.isdisjoint(words):
        return None
    for start in range(_prefixes(words, type_prefixes) + 1):
        found = _with_unit(tuple(word for word in words[start:] if word not in FILLERS), known)
        if found is not None:
            return found
    return None


def _prefixes(words: tuple[str, ...], type_prefixes: Set[str]) -> int:
    """Return how many leading words may be dropped: type prefixes, only if something remains."""
    count = 0
    while count < len(words) - 1 and words[count] in type_prefixes:
        count += 1
    return count


def _with_unit(words: tuple[str, ...], known: Mapping[frozenset[str], Spelling]) -> NamedQuantity | None:
    for size in range(min(_MOST_WORDS_OF_A_UNIT, len(words) - 1), 0, -1):
        unit = unit_of_words(words[-size:])
        found = _plain(words[:-size], known) if unit else None
        if unit and found and dimension_of(found.quantity) == unit.dimension:
            return replace(found, unit=unit)
    return _plain(words, known)


def _plain(words: tuple[str, ...], known: Mapping[frozenset[str], Spelling]) -> NamedQuantity | None:
    numbering = SECOND | NUMBERS
    spelling = known.get(frozenset(words) - STATISTICS - numbering)
    if spelling is None:
        return None
    return NamedQuantity(
        spelling,
        words,
        sigma=not STATISTICS.isdisjoint(words),
        second=not SECOND.isdisjoint(words),
        numbered=not numbering.isdisjoint(words),
    )


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
