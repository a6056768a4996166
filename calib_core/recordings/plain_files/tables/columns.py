"""Choose the columns of a table that hold a radar's quantities and times: by their names, or as --map says."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cache
from pathlib import Path

from calib_core.errors import RecordingError
from calib_core.recordings.field_words import (
    SPELLINGS,
    SUBJECTS,
    MappedColumn,
    NamedQuantity,
    Spelling,
    dimension_of,
    named_quantity,
    quantity_of,
    spelt,
    unit_of_word,
    unit_of_words,
    units_for,
    words_of,
)

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
_RANKS = {one: rank for rank, one in enumerate((*SPELLINGS, *_ANGLES), start=1)}
TABLE_EXAMPLE = "time_ns,x_m,y_m,z_m,doppler_mps,snr_db"
_POSITION = ("x", "y", "z", "range", "azimuth", "elevation")
_CLOCK = re.compile(r"\d{1,2}:\d\d(?::\d\d(?:[.,]\d+)?)?")


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


QUANTITIES: tuple[str, ...] = tuple(name for name in COLUMN_SPELLINGS if name not in TIME_QUANTITIES)
"""What a column of numbers may hold, and the name it has from then on."""


def units_of(quantity: str) -> dict[str, float]:
    """Return the units of a quantity with their factors to m, rad, m/s, dB or ns; the first is assumed if none is given."""
    return {unit.flag: unit.scale for unit in units_for(quantity)}


@dataclass(frozen=True, slots=True)
class TableColumn:
    """One column in use.

    Attributes:
        place: its index in a row.
        written: its name in the file.
        quantity: one of QUANTITIES or of the quantities of time.
        unit: a key of units_of(quantity); "" if the file does not state it.
        rank: 0 if the name is the documented one; see ColumnName.
        mapped: whether --map chose it.
        sign: -1 where --map turns its sign.
    """

    place: int
    written: str
    quantity: str
    unit: str = ""
    rank: int = 0
    mapped: bool = False
    sign: int = 1

    @property
    def is_documented(self) -> bool:
        """Whether it is spelled exactly as in the documentation, which then states its sign: azimuth_deg."""
        return self.written == f"{self.quantity}_{self.unit}"


@dataclass(frozen=True, slots=True)
class TableColumns:
    """The columns in use.

    Attributes:
        values: of the returns.
        time: one column (a number or a date), two (seconds and nanoseconds, or date and time of day), or none.
        frame: the column that numbers the scans, if there is one and no time.
        unused: names of all other columns.
        rivals: of columns in use, with the names of others that claim the same quantity.
    """

    values: tuple[TableColumn, ...]
    time: tuple[TableColumn, ...]
    frame: TableColumn | None
    unused: tuple[str, ...]
    rivals: dict[str, str] = field(default_factory=dict)

    def of(self, quantity: str) -> TableColumn | None:
        """Return the column of a quantity."""
        return next((column for column in self.values if column.quantity == quantity), None)


def choose_columns(
    path: Path,
    names: Sequence[str],
    units: Sequence[str],
    first_row: Sequence[str],
    mapped: Sequence[MappedColumn] = (),
) -> TableColumns:
    """Choose the columns to read.

    Args:
        path: for messages.
        names: of all columns, as written.
        units: of all columns, from a line under the header; () if there is none.
        first_row: cells of the first row.
        mapped: the user's --map.

    Raises:
        RecordingError: a mapped column does not exist, a position is missing, or its unit is unknown.
    """
    stated = [_mapped(path, names, one) for one in mapped]
    taken = {column.place for column in stated}
    given = {column.quantity for column in stated}
    claims: dict[str, list[TableColumn]] = {}
    foreign: list[tuple[str, ColumnName]] = []
    for place, written in enumerate(names):
        words = read_column_name(written)
        if place in taken or words is None or words.quantity in given:
            continue
        if not words.unit and place < len(units) and units[place].strip("[]() -"):
            below = read_column_name(f"x [{units[place].strip('[]() ')}]")
            words = replace(words, unit=below.unit if below else "")
        if words.unit and not words.unit_is_known and words.quantity in (*QUANTITIES, "time"):
            foreign.append((written, words))
            continue
        claims.setdefault(words.quantity, []).append(
            TableColumn(place, written.strip(), words.quantity, words.unit, words.rank)
        )
    chosen, rivals = _best(claims)
    if given & {"range", "azimuth"} and not given & {"x", "y"}:
        chosen = [column for column in chosen if column.quantity not in ("x", "y", "z")]  # the user says what to use
    values = [column for column in (*stated, *chosen) if column.quantity in QUANTITIES]
    _require_position(path, names, values, foreign)
    mapped_time = [column for column in stated if column.quantity == "time"]
    time = tuple(mapped_time) or _time_columns(claims, first_row)
    if not time and any(words.quantity == "time" for _, words in foreign):
        raise _foreign_unit(path, *next(one for one in foreign if one[1].quantity == "time"))
    frame = None if time else next(iter(claims.get("frame", ())), None)
    used = {column.place for column in (*values, *time, *((frame,) if frame else ()))}
    unused = tuple(name.strip() for place, name in enumerate(names) if place not in used and name.strip())
    return TableColumns(tuple(values), time, frame, unused, rivals)


def _mapped(path: Path, names: Sequence[str], one: MappedColumn) -> TableColumn:
    spelt = [name.strip().strip("#% ") for name in names]
    place = next((n for n, name in enumerate(spelt) if name == one.column), None)
    if place is None:
        place = next((n for n, name in enumerate(spelt) if name.lower() == one.column.lower()), None)
    if place is None:
        near = get_close_matches(one.column, spelt, 1, 0.0)
        hint = f"; did you mean '{near[0]}'? " if near else "; "
        raise RecordingError(
            f"{path}: --map {one.words}: no column '{one.column}'{hint}The columns are {_listed(spelt)}"
        )
    return TableColumn(place, spelt[place], one.quantity, one.unit, 0, True, one.sign)


def _best(claims: dict[str, list[TableColumn]]) -> tuple[list[TableColumn], dict[str, str]]:
    """Choose one column per quantity: with a unit above without, then by the order of spellings."""
    chosen, rivals = [], {}
    for quantity in QUANTITIES:
        columns = sorted(claims.get(quantity, ()), key=lambda column: (not column.unit, column.rank, column.place))
        if not columns:
            continue
        chosen.append(columns[0])
        others = [column.written for column in columns[1:] if bool(column.unit) == bool(columns[0].unit)]
        if others and quantity in _POSITION:
            rivals[quantity] = ", ".join(others)
    return chosen, rivals


def _require_position(
    path: Path, names: Sequence[str], values: Sequence[TableColumn], foreign: Sequence[tuple[str, ColumnName]]
) -> None:
    have = {column.quantity for column in values}
    if {"x", "y"} <= have or {"range", "azimuth"} <= have:
        return
    claimed = have | {words.quantity for _, words in foreign}
    for written, words in foreign:
        if words.quantity in _POSITION and ({"x", "y"} <= claimed or {"range", "azimuth"} <= claimed):
            raise _foreign_unit(path, written, words)
    raise RecordingError(
        f"{path}: no position columns; x_m and y_m, or range_m and azimuth_deg, are required, such as {TABLE_EXAMPLE}; "
        f"the columns are {_listed([name.strip() for name in names])}: say which is which with --map x=NAME:m --map y=NAME:m"
    )


def _foreign_unit(path: Path, written: str, words: ColumnName) -> RecordingError:
    units = units_of(words.quantity)
    return RecordingError(
        f"{path}: column '{written.strip()}' has the unknown unit '{words.unit}'; known units: {', '.join(units)}; "
        f"if it is one of these, say so with --map {words.quantity}={written.strip()}:{next(iter(units))}"
    )


def _time_columns(claims: dict[str, list[TableColumn]], first_row: Sequence[str]) -> tuple[TableColumn, ...]:
    """Choose the columns of time: date and time of day, seconds and nanoseconds, or a single one."""

    def cell(column: TableColumn) -> str:
        return first_row[column.place].strip() if column.place < len(first_row) else ""

    times = sorted(
        claims.get("time", ()), key=lambda c: (cell(c) in ("0", "0.0", ""), "stamp" not in c.written.lower(), not c.unit, c.rank)
    )  # fmt: skip
    dates = claims.get("date", [])
    clock = next((column for column in times if _CLOCK.fullmatch(cell(column))), None)
    if dates and clock is not None:
        return dates[0], clock
    whole = [*claims.get("sec", ()), *(column for column in times if column.unit == "s")]
    parts = [*claims.get("nanosec", ()), *(column for column in times if column.unit == "ns")]
    for seconds in whole:
        for nanoseconds in parts:
            if cell(seconds).isdigit() and cell(nanoseconds).isdigit() and len(cell(nanoseconds)) <= 9:
                return seconds, nanoseconds
    if times:
        return (times[0],)
    if claims.get("sec"):
        return (replace(claims["sec"][0], unit="s"),)
    return tuple(dates[:1])


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:12])
    return f"{shown} and {len(names) - 12} more" if len(names) > 12 else shown or "none"
