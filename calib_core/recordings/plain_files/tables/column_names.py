"""Recognise the quantity and the unit in the name of a table's column: times, the shared spellings, and sizes of noise."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from calib_core.recordings.field_words.names import NamedQuantity, named_quantity, quantity_of, spelt
from calib_core.recordings.field_words.spellings import SPELLINGS, Spelling
from calib_core.recordings.field_words.units import dimension_of, unit_of_word, unit_of_words
from calib_core.recordings.field_words.words import SUBJECTS, words_of

_TIMES: Mapping[str, str] = {
    "time": "time timestamp stamp t epoch unixtime unixtimestamp headerstamp datetime utc utctime timeutc timeofmeasurement "
    "measurementtime rostime ts gpstime timegps",
    "sec": "sec secs seconds stampsec stampsecs timesec timesecs headerstampsec headerstampsecs timestampsec timestampsecs "
    "epochsec tvsec",
    "nanosec": "nanosec nanosecs nsec nsecs nanoseconds stampnanosec stampnsec stampnsecs timensec timenanosec "
    "headerstampnanosec headerstampnsec headerstampnsecs timestampnsec timestampnanosec tvnsec",
    "date": "date day",
    "frame": "frame frameid framenumber framenr frameno frameindex frameidx scan scanid scannumber scanindex cycle cyclecounter",
}
TIME_QUANTITIES: tuple[str, ...] = tuple(_TIMES)
"""What a column of times may hold."""

_ANGLES = (Spelling("theta", "azimuth", 4), Spelling("angle", "azimuth", 5), Spelling("phi", "elevation", 4))
_KNOWN = spelt((*SPELLINGS, *_ANGLES))
_QUANTITIES = (
    "x", "y", "z", "range", "azimuth", "elevation", "doppler", "vx", "vy", "vz", "snr", "rcs", "power", "amplitude", "intensity"
)  # fmt: skip
_WITH_SIGMA = ("range", "azimuth", "elevation")
_ACCURACY = re.compile("accuracy", re.IGNORECASE)
_ON_EARTH = frozenset({"latitude", "longitude", "altitude", "lon", "lng", "gps", "gnss"})
_BARE = frozenset({"lat", "long"})
_HAS_LETTER = re.compile(r"[^\W\d_]")
_LONGEST_NAME = 500
"""No name of a column is longer; the patterns take the cube of the length of what is none."""
_BRACKETS = re.compile(r"(?P<name>.*?)\s*[\[(<]\s*(?P<unit>[^\])>]*?)\s*[\])>]\s*")
_TYPE_PREFIXES = frozenset({"f", "s", "n", "d", "i", "u", "b", "m", "fl", "ui", "dbl", "flt", "p", "str"})
"""Fewer than in messages: t_x is a translation."""
_PREFIXES = _TYPE_PREFIXES | SUBJECTS


def _spellings() -> dict[str, tuple[str, ...]]:
    found = {quantity: tuple(words.split()) for quantity, words in _TIMES.items()}
    for quantity in _QUANTITIES:
        found[quantity] = tuple(one.words for one in (*SPELLINGS, *_ANGLES) if quantity_of(one) == quantity)
    return found | {f"sigma_{name}": (f"sigma {name}", f"{name} std", f"{name} accuracy") for name in _WITH_SIGMA}


COLUMN_SPELLINGS: Mapping[str, tuple[str, ...]] = _spellings()
"""Spellings of each quantity in words, without prefixes and units; the first is the one in the documentation."""

_TIME_OF = {
    spelling: (quantity, rank)
    for quantity in TIME_QUANTITIES
    for rank, spelling in enumerate(COLUMN_SPELLINGS[quantity])
}
_RANKS = {one: rank for rank, one in enumerate((*SPELLINGS, *_ANGLES), start=1)}


@dataclass(frozen=True, slots=True)
class ColumnName:
    """What the name of a column says.

    Attributes:
        quantity: a key of COLUMN_SPELLINGS.
        unit: as --map spells it; "" if the name has none; any other word in brackets or after the quantity as it is written.
        rank: the place of its spelling among those of its quantity; 0 is the one in the documentation.
    """

    quantity: str
    unit: str
    rank: int

    @property
    def unit_is_known(self) -> bool:
        """Whether the unit is one of the quantity's."""
        unit = unit_of_word(self.unit)
        dated = self.quantity in TIME_QUANTITIES and self.quantity != "time"
        return unit is not None and not dated and unit.dimension == dimension_of(self.quantity)


@cache
def read_column_name(written: str) -> ColumnName | None:
    """Recognise a name such as x_m, "Range [m]", f_Azimuth_deg, detections.posX or velocityRadial; None if unknown.

    A unit may follow in brackets or after a separator. Letters that encode a type (f_) and the word for a return
    (detections.) are skipped.
    """
    text = written[:_LONGEST_NAME].strip().strip("#%\"'\ufeff ").strip()
    if not _HAS_LETTER.search(text):
        return None  # a number
    bracketed = _BRACKETS.fullmatch(text)
    if bracketed:
        found = _time(_words(bracketed["name"])) or _quantity(bracketed["name"])
        stated = unit_of_word(bracketed["unit"].strip())
        unit = stated.flag if stated else bracketed["unit"].strip().lower()
        return ColumnName(found.quantity, unit, found.rank) if found else None
    words = _words(text)
    return _with_time(words) or _quantity(text) or _time(words) or _with_foreign_unit(words)


def _words(text: str) -> tuple[str, ...]:
    """Split a name at separators and capitals only: headerStampSec -> header, stamp, sec."""
    spaced = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", text.replace("dB", "db"))
    words = tuple(word.lower() for word in re.split(r"[^A-Za-z0-9µμ]+", spaced) if word)
    return words[:-1] if len(words) > 1 and words[-1] in ("value", "val") else words


def _time(words: tuple[str, ...]) -> ColumnName | None:
    """Return the time that words name; prefixes are dropped one at a time."""
    for start in range(len(words)):
        found = _TIME_OF.get("".join(words[start:]))
        if found:
            return ColumnName(found[0], "", found[1])
        if words[start] not in _PREFIXES:
            return None
    return None


def _with_time(words: tuple[str, ...]) -> ColumnName | None:
    """Return the time, with its unit, that words name; seconds and nanoseconds may be a time's unit."""
    whole = _time(words)
    if whole and whole.quantity not in ("sec", "nanosec"):
        return whole
    unit = unit_of_words(words[-1:]) if len(words) > 1 else None
    found = _time(words[:-1]) if unit and unit.dimension == "time" else None
    return ColumnName("time", unit.flag, found.rank) if unit and found and found.quantity == "time" else None


def _quantity(text: str) -> ColumnName | None:
    """Return the quantity, with its unit, that a name states in the shared spellings."""
    words = words_of(_ACCURACY.sub("_sigma_", text))
    plain = _words(text)
    if not _ON_EARTH.isdisjoint(plain):
        return None
    found = named_quantity(words, _KNOWN, type_prefixes=_TYPE_PREFIXES)
    if found is None or found.numbered or (found.sigma and found.quantity not in _WITH_SIGMA):
        return None
    if len(found.words) == 1 and not _BARE.isdisjoint(plain):
        return None
    quantity = f"sigma_{found.quantity}" if found.sigma else found.quantity
    return ColumnName(quantity, found.unit.flag if found.unit else "", _rank(found, plain))


def _rank(found: NamedQuantity, plain: tuple[str, ...]) -> int:
    """Return 0 for the spelling in the documentation, also after prefixes and before a unit."""
    documented = "sigma " * found.sigma + found.quantity
    for start in range(len(plain)):
        words, rest = plain[start : start + 1 + found.sigma], plain[start + 1 + found.sigma :]
        if " ".join(words) == documented and (not rest or unit_of_words(rest)):
            return 0
        if plain[start] not in _PREFIXES:
            break
    return _RANKS[found.spelling]


def _with_foreign_unit(words: tuple[str, ...]) -> ColumnName | None:
    """Return the quantity of a plain name that one unknown word follows, such as x_ft."""
    if len(words) != 2 or words[0] in _TYPE_PREFIXES:
        return None
    found = _time(words[:1]) or _quantity(words[0])
    measured = found is not None and (found.quantity == "time" or found.quantity not in TIME_QUANTITIES)
    return (
        ColumnName(found.quantity, words[1], 0) if found and measured and found.rank == 0 and not found.unit else None
    )
