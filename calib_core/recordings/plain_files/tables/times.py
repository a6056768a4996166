"""Read the times of a table's rows: numbers in any unit, dates, seconds with nanoseconds, date and time of day in two columns."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf, log
from operator import itemgetter

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.plain_files.tables.columns import TableColumn, TableColumns
from calib_core.recordings.time.written_times import TimeUnit, date_text, read_time, unit_of_epoch

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


def time_reader(
    columns: TableColumns, rows: Sequence[Sequence[str]], topic: str, *, zone_s: int | None, decimal_comma: bool = False
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


def _by_frame(frame: TableColumn | None) -> TimeReader | None:
    if frame is None:
        return None

    def read(text: object) -> TimeNs:
        number = _float(str(text))
        if number is None or number != int(number):
            raise RecordingError(f"'{text}' is not the number of a scan")
        return TimeNs((int(number) + 10) * _STEP_NS)

    return TimeReader(itemgetter(frame.place), read, counted=True)


def _of_two(columns: Sequence[TableColumn], rows: Sequence[Sequence[str]], zone_s: int | None) -> TimeReader:
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
    found = date_text(text)
    return (found is not None and found.zoned) or text.endswith("Z") or "+" in text


def _float(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if abs(number) < inf else None


def _of_gps(
    column: TableColumn, numbers: Sequence[float], topic: str, plain: Callable[[object], str]
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
    column: TableColumn, numbers: Sequence[float], topic: str
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
