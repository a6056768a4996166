"""Read the times of a table's rows: numbers in any unit, dates, seconds with nanoseconds, date and time of day in two columns."""

import re
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf, log
from operator import itemgetter

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings.containers.sources import Assumption
from calib_core.recordings.field_words import (
    SUBJECTS,
    TABLE_TYPE_PREFIXES,
    MappedColumn,
    unit_of_word,
    unit_of_words,
    units_for,
)
from calib_core.recordings.radar.column_guess import split_unit
from calib_core.recordings.time.written_times import TimeUnit, date_text, read_time, unit_of_epoch

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
TIME_SPELLINGS: Mapping[str, tuple[str, ...]] = {quantity: tuple(words.split()) for quantity, words in _TIMES.items()}
"""Spellings of what a column of times may hold, without prefixes and units."""
_SCALES: dict[TimeUnit, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_USUAL_STEP_S = 0.07
_GPS_EPOCH_S = 315_964_800
_LEAP_SECONDS = 18
_GPS_SINCE_2017_S = 1_167_264_018
_STEP_NS = NS_PER_S // 10


@dataclass(frozen=True, slots=True)
class TimeReader:
    """How the time of a row is read.

    Attributes:
        key: returns the cells of a row that hold its time; rows with equal cells have the same time.
        read: turns them into a time.
        zoneless: whether they are dates without a zone.
        counted: whether they are numbers of scans, taken as 0.1 s apart.
        assumptions: what the table does not state about them.
        remarks: what their values state.
    """

    key: Callable[[Sequence[str]], object]
    read: Callable[[object], TimeNs]
    zoneless: bool = False
    counted: bool = False
    assumptions: tuple[Assumption, ...] = ()
    remarks: tuple[str, ...] = ()


TABLE_EXAMPLE = "time_ns,x_m,y_m,z_m,doppler_mps,snr_db"
_PREFIXES = TABLE_TYPE_PREFIXES | SUBJECTS
_TIME_OF = {
    spelling: (quantity, rank) for quantity, words in TIME_SPELLINGS.items() for rank, spelling in enumerate(words)
}
_CLOCK = re.compile(r"\d{1,2}:\d\d(?::\d\d(?:[.,]\d+)?)?")


@dataclass(frozen=True, slots=True)
class TimeName:
    """What the name of a column of times says: the quantity, its unit as --map spells it, the place of its spelling."""

    quantity: str
    unit: str
    rank: int


@dataclass(frozen=True, slots=True)
class TimeColumn:
    """One column of times in use.

    Attributes:
        place: its index in a row.
        written: its name in the file.
        quantity: a key of TIME_SPELLINGS.
        unit: s, ms, us or ns; "" if the file does not state it.
        rank: 0 if the name is the documented one.
        mapped: whether --map chose it.
    """

    place: int
    written: str
    quantity: str
    unit: str = ""
    rank: int = 0
    mapped: bool = False


@dataclass(frozen=True, slots=True)
class TimeColumns:
    """The columns of times in use.

    Attributes:
        time: one column (a number or a date), two (seconds and nanoseconds, or date and time of day), or none.
        frame: the column that numbers the scans, if there is one and no time.
    """

    time: tuple[TimeColumn, ...] = ()
    frame: TimeColumn | None = None

    @property
    def places(self) -> set[int]:
        """Their indices in a row."""
        return {column.place for column in (*self.time, *((self.frame,) if self.frame else ()))}


def choose_times(
    names: Sequence[str], units: Sequence[str], first_row: Sequence[str], mapped: MappedColumn | None, taken: Set[str]
) -> TimeColumns:
    """Choose the columns that hold the times.

    Args:
        names: of all columns, as written.
        units: of all columns, from a line under the header; () if there is none.
        first_row: cells of the first row.
        mapped: the --map of the time, if there is one, of a column that exists.
        taken: columns that --map uses for something else.

    Raises:
        RecordingError: the unit of the only time is unknown.
    """
    if mapped is not None:
        return TimeColumns((TimeColumn(names.index(mapped.column), mapped.column, "time", mapped.unit, 0, True),))
    claims: dict[str, list[TimeColumn]] = {}
    foreign: list[tuple[str, str]] = []
    for index, written in enumerate(names):
        name = None if written in taken else time_name(written)
        if name is None:
            continue
        below = units[index].strip("[]() -") if index < len(units) else ""
        unit = unit_of_word(name.unit or below)
        if unit is None and name.quantity == "time" and (name.unit or below):
            foreign.append((written, name.unit or below))
            continue
        flag = unit.flag if unit and unit.dimension == "time" and name.quantity == "time" else ""
        claims.setdefault(name.quantity, []).append(TimeColumn(index, written.strip(), name.quantity, flag, name.rank))
    time = _time_columns(claims, first_row)
    if not time and foreign:
        raise unknown_unit_error(foreign[0][0], "time", foreign[0][1])
    return TimeColumns(time, None if time else next(iter(claims.get("frame", ())), None))


def unknown_unit_error(written: str, quantity: str, unit: str) -> RecordingError:
    """Return the refusal of a column whose unit is unknown, with the --map that states it."""
    known = [one.flag for one in units_for(quantity)]
    return RecordingError(
        f"column '{written.strip()}' has the unknown unit '{unit}'; known units: {', '.join(known)}; "
        f"if it is one of these, say so with --map {quantity}={written.strip()}:{known[0]}"
    )


def time_name(written: str) -> TimeName | None:
    """Recognize a column of times such as time_ns, header.stamp.sec or "Time [ms]"; None for any other."""
    text, unit = split_unit(written)
    words = _words(text)
    name = _time(words) if unit else _with_time(words) or _time(words)
    if name is None and not unit and len(words) == 2 and (name := _time(words[:1])) and name.quantity == "time":
        unit = "" if name.rank else words[1]
        name = name if unit else None
    stated = unit_of_word(unit)
    return replace(name, unit=stated.flag if stated else unit.lower()) if name and unit else name


def _words(text: str) -> tuple[str, ...]:
    """Split a name at separators and capitals only: headerStampSec -> header, stamp, sec."""
    spaced = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", text.replace("dB", "db"))
    words = tuple(word.lower() for word in re.split(r"[^A-Za-z0-9µμ]+", spaced) if word)
    return words[:-1] if len(words) > 1 and words[-1] in ("value", "val") else words


def _time(words: tuple[str, ...]) -> TimeName | None:
    """Return the time that words name; prefixes are dropped one at a time."""
    for start in range(len(words)):
        found = _TIME_OF.get("".join(words[start:]))
        if found:
            return TimeName(found[0], "", found[1])
        if words[start] not in _PREFIXES:
            return None
    return None


def _with_time(words: tuple[str, ...]) -> TimeName | None:
    """Return the time, with its unit, that words name; seconds and nanoseconds may be a time's unit."""
    whole = _time(words)
    if whole and whole.quantity not in ("sec", "nanosec"):
        return whole
    unit = unit_of_words(words[-1:]) if len(words) > 1 else None
    name = _time(words[:-1]) if unit and unit.dimension == "time" else None
    return TimeName("time", unit.flag, name.rank) if unit and name and name.quantity == "time" else None


def _time_columns(claims: dict[str, list[TimeColumn]], first_row: Sequence[str]) -> tuple[TimeColumn, ...]:
    """Choose the columns of time: date and time of day, seconds and nanoseconds, or a single one."""

    def cell(column: TimeColumn) -> str:
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


def time_reader(
    columns: TimeColumns, rows: Sequence[Sequence[str]], topic: str, *, zone_s: int | None, decimal_comma: bool = False
) -> TimeReader | None:
    """Decide how to read the times; None if the table has none.

    Args:
        columns: the columns in use.
        rows: the first rows.
        topic: for the assumptions.
        zone_s: offset from UTC of dates without a zone [s]; None if not given.
        decimal_comma: whether numbers are written as 1,5.
    """
    if not columns.time:
        return _by_frame(columns.frame)
    if len(columns.time) == 2:
        return _of_two(columns.time, rows, zone_s)
    (column,) = columns.time
    cells = [row[column.place].strip() for row in rows if column.place < len(row)]

    def plain(text: object) -> str:
        return str(text).replace(",", ".") if decimal_comma else str(text)

    numbers = [number for cell in cells if (number := _float(plain(cell))) is not None]
    if len(numbers) < len(cells) or not cells or (not column.unit and date_text(cells[0]) is not None):
        return TimeReader(
            itemgetter(column.place),
            lambda text: read_time(str(text), None, zone_s or 0),
            bool(cells) and zone_s is None and not _zoned(cells[0]),
        )
    if "gps" in column.written.lower() and (reader := _of_gps(column, numbers, topic, plain)):
        return reader
    unit, assumptions, remarks = _unit(column, numbers, topic)
    return TimeReader(
        itemgetter(column.place),
        lambda text: read_time(plain(text), unit),
        assumptions=assumptions,
        remarks=remarks,
    )


def _by_frame(frame: TimeColumn | None) -> TimeReader | None:
    if frame is None:
        return None

    def read(text: object) -> TimeNs:
        number = _float(str(text))
        if number is None or number != int(number):
            raise RecordingError(f"'{text}' is not the number of a scan")
        return TimeNs((int(number) + 10) * _STEP_NS)

    return TimeReader(itemgetter(frame.place), read, counted=True)


def _of_two(columns: Sequence[TimeColumn], rows: Sequence[Sequence[str]], zone_s: int | None) -> TimeReader:
    first, second = columns
    key = itemgetter(first.place, second.place)
    if first.quantity == "date":

        def read_date(cells: object) -> TimeNs:
            day, clock = cells if isinstance(cells, tuple) else ("", "")
            return read_time(f"{day.strip()} {clock.strip().replace(',', '.')}", None, zone_s or 0)

        zoned = bool(rows) and _zoned(" ".join(str(cell).strip() for cell in key(rows[0])))
        return TimeReader(key, read_date, zone_s is None and not zoned)

    def read_parts(cells: object) -> TimeNs:
        seconds, nanoseconds = cells if isinstance(cells, tuple) else ("", "")
        try:
            return TimeNs(int(float(seconds)) * NS_PER_S + int(float(nanoseconds)))
        except (ValueError, OverflowError):
            raise RecordingError(f"'{seconds}' and '{nanoseconds}' are not seconds and nanoseconds") from None

    return TimeReader(key, read_parts)


def _zoned(text: str) -> bool:
    moment = date_text(text)
    return (moment is not None and moment.zoned) or text.endswith("Z") or "+" in text


def _float(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if abs(number) < inf else None


def _of_gps(
    column: TimeColumn, numbers: Sequence[float], topic: str, plain: Callable[[object], str]
) -> TimeReader | None:
    """Read GPS time in seconds, which counts from 1980 and has no leap seconds; None for other numbers."""
    if column.unit not in ("", "s") or not _GPS_SINCE_2017_S <= numbers[0] < 2 * _GPS_SINCE_2017_S or column.mapped:
        return None
    text = f"{column.written} is read as GPS time, {_LEAP_SECONDS} s ahead of UTC; --map time={column.written}:s reads it as UTC"
    return TimeReader(
        itemgetter(column.place),
        lambda cell: TimeNs(read_time(plain(cell), "s") + (_GPS_EPOCH_S - _LEAP_SECONDS) * NS_PER_S),
        assumptions=(Assumption("time-scale", topic, text, "--confirm-assumptions"),),
    )


def _unit(
    column: TimeColumn, numbers: Sequence[float], topic: str
) -> tuple[TimeUnit, tuple[Assumption, ...], tuple[str, ...]]:
    """Return the unit of a column of numbers: as stated, as their size states, or as assumed from their steps."""
    units: dict[str, TimeUnit] = {"s": "s", "ms": "ms", "us": "us", "ns": "ns"}
    if column.unit:
        return units[column.unit], (), ()
    middle = sorted(numbers)[len(numbers) // 2]
    by_size = unit_of_epoch(middle)
    if by_size is not None:
        return by_size, (), (f"{column.written} in {by_size} since 1970, as its size shows",)
    ordered = sorted(set(numbers))
    steps = sorted(b - a for a, b in pairwise(ordered))
    step = steps[len(steps) // 2] if steps else 0.0
    unit: TimeUnit = "s"
    if step > 0:
        unit = min(_SCALES, key=lambda name: abs(log(step * _SCALES[name] / _USUAL_STEP_S)))
    text = f"{column.written} has no unit; read as {unit}, since its values are {step:g} apart" if step else (
        f"{column.written} has no unit; read as {unit}"
    )  # fmt: skip
    return unit, (Assumption("time-unit", topic, text, f"--map time={column.written}:{unit}"),), ()
