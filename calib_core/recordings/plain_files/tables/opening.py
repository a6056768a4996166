"""Open tables of radar returns, CSV or JSON: one file with all scans, or a folder with one file per scan."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import TypeAlias

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import DataWarning, TimeNs
from calib_core.recordings.containers.sources import Assumption
from calib_core.recordings.field_words import MappedColumn, is_plain
from calib_core.recordings.plain_files.file_stamps import COUNTED, StampedFiles, stamp_files
from calib_core.recordings.plain_files.source import PlainOptions, PlainSource, cloud_channel, cloud_message, topic_of
from calib_core.recordings.plain_files.tables.json_files import JsonTable, is_echo, open_json_table, read_json_rows
from calib_core.recordings.plain_files.tables.text_tables import (
    TableRows,
    TextTable,
    first_rows,
    open_text_table,
    read_rows,
    require_header,
)
from calib_core.recordings.plain_files.tables.times import (
    TABLE_EXAMPLE,
    TimeColumns,
    TimeReader,
    choose_times,
    time_reader,
    unknown_unit_error,
)
from calib_core.recordings.radar.column_guess import (
    VALID,
    DescribedColumn,
    guess_columns,
    split_unit,
    table_meaning,
    unknown_unit,
)
from calib_core.recordings.radar.column_plan import ColumnPlan, RadarAxes, StatedReading
from calib_core.recordings.radar.columns import Returns, returns_from
from calib_core.recordings.radar.message_layouts.single_returns import POINT_NUMBERS, SHORTEST_CYCLE_NS, first_of_scans

JSON_SUFFIXES = (".json", ".jsonl", ".ndjson")
TABLE_SUFFIXES = (".csv", ".tsv", ".txt", *JSON_SUFFIXES)
_SAMPLED_FILES = 12
Table: TypeAlias = TextTable | JsonTable
RADAR_FRAME = "radar"
_MOST_NAMES = 8
_SAMPLED_ROWS = 20_000
_FLAGS = ("0", "1", "false", "true")
_POLAR = ("range", "azimuth", "elevation")
_POSITION = ("x", "y", "z", *_POLAR)


@dataclass(frozen=True, slots=True, eq=False)
class RadarColumns:
    """The columns of a table with a radar's positions.

    Attributes:
        names: of all columns, as written.
        units: from a line of units under the header, "" where it has none.
        stated: what the user states; its columns are spelled as in names.
        times: the columns of times.
        wanted: places of the columns that may hold returns.
        plan: which of these are read; made without values until they are known.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    stated: StatedReading
    times: TimeColumns
    wanted: tuple[int, ...]
    plan: ColumnPlan

    def with_values(self, path: Path, values: np.ndarray) -> "RadarColumns":
        """Return the same with the plan that the values show."""
        return replace(self, plan=_plan(path, self.names, self.units, self.wanted, self.stated, values))

    @property
    def shown(self) -> ColumnPlan:
        """The plan with what is claimed, to find contradictions where positions are not made of it."""
        return replace(self.plan, claiming=not self.plan.polar)

    def returns(self, values: np.ndarray) -> Returns:
        """Return what rows hold, given the values of the wanted columns (n, k), in SI units and the radar's axes."""
        places = {self.names[place]: number for number, place in reversed(list(enumerate(self.wanted)))}
        return returns_from(self.shown, lambda name: values[:, places[name]])


def open_radar_table(path: Path, options: PlainOptions) -> PlainSource:
    """Read a table of radar returns; rows with the same time form one scan, and so do rows a few microseconds apart.

    Raises:
        RecordingError: a position or the time is missing, a unit is unknown, or a row is damaged.
    """
    table, topic = _open(path, options), topic_of(path, "radar")
    columns = radar_columns(table, options)
    times = times_of(table, columns, topic, options)
    if times is None:
        shown = ", ".join(name.strip() for name in table.names[:12])
        raise RecordingError(
            f"{path}: no time column; the first line must name columns and units, such as {TABLE_EXAMPLE}; "
            f"the columns are {shown}: say which is the time with --map time=NAME:s"
        )
    rows = _read(table, columns, times)
    if not len(rows.times_ns):
        raise RecordingError(f"{path}: the file has a header but no rows")
    columns = columns.with_values(path, rows.values)
    order = np.argsort(rows.times_ns, kind="stable")
    first = _first_of_scans(columns, rows.times_ns[order], rows.values[order])
    stamps, edges = rows.times_ns[order][first], np.append(first, len(order))
    points = _points(columns, rows.values[order])
    what = table.what if isinstance(table, JsonTable) else "radar CSV"
    return PlainSource(
        path,
        path.stat().st_size,
        f"{what}{_table_words(columns, times.remarks)}",
        cloud_channel(topic),
        stamps,
        _message(stamps, edges, points),
        (*([_count_warning(path)] if times.counted else ()), *([_cut_off(path)] if rows.is_cut_off else ())),
        assumptions=(*times.assumptions, *_assumptions(columns, topic)),
        zoneless=times.zoneless,
        counted=times.counted,
        times_from=COUNTED if times.counted else "",
        mapped=bool(options.mapped),
        computed=_computed_words(columns.plan),
    )


def _first_of_scans(columns: RadarColumns, times_ns: TimesNs, values: np.ndarray) -> np.ndarray:
    """Return the row that begins each scan: a row with another time, or of rows with times of their own, as of messages."""
    pauses_ns = np.diff(times_ns)
    if np.count_nonzero((pauses_ns > 0) & (pauses_ns < SHORTEST_CYCLE_NS)) <= np.count_nonzero(pauses_ns == 0):
        return np.unique(times_ns, return_index=True)[1]
    numbers = next(
        (values[:, n] for n, place in enumerate(columns.wanted) if _numbers_returns(columns.names[place])), None
    )
    return first_of_scans(times_ns, point_numbers=None if numbers is None else np.nan_to_num(numbers))


def _numbers_returns(name: str) -> bool:
    return _last_word(name) in POINT_NUMBERS


def _last_word(name: str) -> str:
    return name.lower().rpartition(".")[2]


def table_fault(path: Path, options: PlainOptions) -> str:
    """Say why a file is not a table of radar returns, judging by its beginning; "" if it is one."""
    try:
        radar_columns(_open(path, options), options)
    except RecordingError as error:
        return str(error).removeprefix(f"{path}: ")
    return ""


def is_one_scan_each(files: Sequence[Path], options: PlainOptions) -> bool:
    """Return whether tables with numbered or dated names hold one scan each: no times inside, or one time each."""
    try:
        table = _open(files[0], options)
        columns = radar_columns(table, options)
        times = times_of(table, columns, "", options)
        if times is None or times.counted:
            return True
        return len(set(map(times.key, _rows(table)))) <= 1
    except (RecordingError, IndexError):
        return False


def open_table_folder(
    folder: Path, files: Sequence[Path], options: PlainOptions, known: PlainSource | None = None
) -> PlainSource:
    """Open a folder of tables with one scan each; their times stand in them, or come from their names.

    Args:
        folder: of the files.
        files: the tables.
        options: the user's.
        known: another folder, whose files have times.

    Raises:
        RecordingError: they have no times or no positions, or different columns.
    """
    topic = topic_of(folder, "radar")
    sample = [
        files[place] for place in np.unique(np.linspace(0, len(files) - 1, min(_SAMPLED_FILES, len(files))).astype(int))
    ]
    tables = [table for file in sample if (table := _open(file, options)).first_row]
    if not tables:
        raise RecordingError(f"{folder}: {len(files)} tables without a row in the {len(sample)} that were looked at")
    columns = radar_columns(tables[0], options)
    values = [_values(table, columns, options) for table in tables]
    columns = columns.with_values(folder, np.concatenate(values))
    times = times_of(tables[0], columns, topic, options)
    inside = times is not None and not times.counted
    stamped = _stamped_inside(files, times, options) if times and inside else stamp_files(folder, files, options, known)

    def message(row: int) -> bytes:
        return cloud_message(
            TimeNs(int(stamped.times_ns[row])), RADAR_FRAME, _points_of_file(stamped.files[row], columns, options)
        )

    words = _table_words(columns, times.remarks if times and inside else ())
    text = f"folder of radar {files[0].suffix}, {len(stamped.files)} files{words}"
    source = stamped.source(folder, text, cloud_channel(topic), message)
    of_times = times.assumptions if times and inside else ()
    return replace(
        source,
        assumptions=(*source.assumptions, *of_times, *_assumptions(columns, topic)),
        mapped=bool(options.mapped),
        computed=_computed_words(columns.plan),
    )


def _open(path: Path, options: PlainOptions) -> Table:
    if path.suffix.lower() in JSON_SUFFIXES or is_echo(path):
        return open_json_table(path)
    table = open_text_table(path)
    require_header(table, options)
    return table


def radar_columns(table: Table, options: PlainOptions) -> RadarColumns:
    """Choose the columns by their names.

    Raises:
        RecordingError: a mapped column does not exist, a position is missing, or a unit is unknown.
    """
    names, path = tuple(name.strip() for name in table.names), table.path
    below = tuple(word.strip("[]() -") for word in (table.units if isinstance(table, TextTable) else ()))
    units = (*below, *("" for _ in names))[: len(names)]
    mapped = [replace(one, column=_spelt(path, names, one)) for one in options.mapped]
    time = next((one for one in mapped if one.quantity == "time"), None)
    unit = None if not options.angle_unit else options.angle_unit == "deg"
    stated = StatedReading(
        tuple(one for one in mapped if one is not time), RadarAxes(degrees=unit, directed=options.axes_given)
    )
    taken = {one.column for one in stated.column_map}
    wanted = tuple(
        index
        for index, name in enumerate(names)
        if name in taken
        or _numbers_returns(name)
        or (_last_word(name) in VALID and "".join(table.first_row[index : index + 1]).strip().lower() in _FLAGS)
        or ((time is None or name != time.column) and table_meaning(name, units[index]) is not None)
    )
    try:
        times = choose_times(names, units, table.first_row, time, taken)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from error
    plan = _plan(path, names, units, wanted, stated, np.zeros((0, len(wanted))))
    return RadarColumns(names, units, stated, times, wanted, plan)


def _spelt(path: Path, names: Sequence[str], column: MappedColumn) -> str:
    """Return a mapped column as the table spells it.

    Raises:
        RecordingError: there is none of this name.
    """
    bare = [name.strip("#% ") for name in names]
    for wanted, known in ((column.column, bare), (column.column.lower(), [name.lower() for name in bare])):
        if wanted in known:
            return names[known.index(wanted)]
    near = get_close_matches(column.column, bare, 1, 0.0)
    hint = f"; did you mean '{near[0]}'? " if near else "; "
    raise RecordingError(
        f"{path}: --map {column.words}: no column '{column.column}'{hint}The columns are {_column_list(bare)}"
    )


def _plan(
    path: Path,
    names: Sequence[str],
    units: Sequence[str],
    wanted: Sequence[int],
    stated: StatedReading,
    values: np.ndarray,
) -> ColumnPlan:
    """Decide what the columns are.

    Raises:
        RecordingError: there is no position, or its unit is unknown or ambiguous; the message has the --map that states it.
    """
    step = max(1, len(values) // _SAMPLED_ROWS)
    columns = [
        DescribedColumn(names[place], False, units[place], values[::step, number])
        for number, place in enumerate(wanted)
    ]
    try:
        with np.errstate(all="ignore"):
            plan = guess_columns(columns, rules="table", stated=stated)
        if plan is None:
            foreign = {
                name: found for name, below in zip(names, units, strict=True) if (found := unknown_unit(name, below))
            }
            whole = {quantity for quantity, _ in foreign.values()} | {
                meaning.quantity for place in wanted if (meaning := table_meaning(names[place], units[place]))
            }
            for name, (quantity, unit) in foreign.items():
                if quantity in _POSITION and ({"x", "y"} <= whole or {"range", "azimuth"} <= whole):
                    raise unknown_unit_error(name, quantity, unit)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from error
    if plan is None:
        raise RecordingError(
            f"{path}: no position columns; x_m and y_m, or range_m and azimuth_deg, are required, such as {TABLE_EXAMPLE}; "
            f"the columns are {_column_list(names)}: say which is which with --map x=NAME:m --map y=NAME:m"
        )
    return plan


def _column_list(names: Sequence[str]) -> str:
    shown = ", ".join(names[:12])
    return f"{shown} and {len(names) - 12} more" if len(names) > 12 else shown or "none"


def _assumptions(columns: RadarColumns, topic: str) -> tuple[Assumption, ...]:
    return tuple(replace(assumption.assumption, topic=topic) for assumption in columns.plan.assumptions)


def _values(table: Table, columns: RadarColumns, options: PlainOptions) -> np.ndarray:
    """Return the values of one file of a folder, in the order of columns.wanted.

    Raises:
        MessageError: its columns are not those of the first.
    """
    own = radar_columns(table, options)
    places = {name: place for place, name in reversed(list(enumerate(own.names)))}
    wanted = [columns.names[place] for place in columns.wanted]
    same = all(
        name in places and own.units[places[name]] == columns.units[place]
        for name, place in zip(wanted, columns.wanted, strict=True)
    )
    if not same:
        raise MessageError(f"{table.path.name} has other columns than the other files: {', '.join(table.names[:12])}")
    rows = _read(table, replace(own, wanted=tuple(places[name] for name in wanted)), None)
    if rows.is_cut_off:
        raise RecordingError(
            f"{table.path}: its last row is cut off; copy the file from its source again, or remove the row"
        )
    return rows.values


def _rows(table: Table) -> Sequence[Sequence[str]]:
    return table.sample if isinstance(table, JsonTable) else first_rows(table)


def times_of(table: Table, columns: RadarColumns, topic: str, options: PlainOptions) -> TimeReader | None:
    """Return how the times of a table are read; None if it has none."""
    comma = isinstance(table, TextTable) and table.decimal_comma
    return time_reader(columns.times, _rows(table), topic, zone_s=options.zone_s, decimal_comma=comma)


def _read(table: Table, columns: RadarColumns, times: TimeReader | None) -> TableRows:
    read = columns.wanted
    return read_json_rows(table, read, times) if isinstance(table, JsonTable) else read_rows(table, read, times)


def _points_of_file(file: Path, columns: RadarColumns, options: PlainOptions) -> np.ndarray:
    table = _open(file, options)
    values = _values(table, columns, options) if table.first_row else np.zeros((0, len(columns.wanted)))
    return _points(columns, values)


def _stamped_inside(files: Sequence[Path], times: TimeReader, options: PlainOptions) -> StampedFiles:
    """Stamp every file by its first row; files without a row are left out."""
    found: dict[Path, TimeNs] = {}
    for file in files:
        table = _open(file, options)
        if table.first_row:
            try:
                found[file] = times.read(times.key(table.first_row))
            except (ValueError, IndexError, OverflowError, RecordingError) as error:
                raise RecordingError(f"{file}: the time of the first row cannot be read: {error}") from error
    ordered = sorted(found, key=lambda file: (found[file], file))
    times_ns = np.array([found[file] for file in ordered], dtype=np.int64)
    return StampedFiles(tuple(ordered), times_ns, zoneless=times.zoneless)


def _count_warning(path: Path) -> DataWarning:
    return DataWarning.reported(
        "numbered-files",
        f"{path.name}: the scans are numbered and have no times; an interval of 0.1 s is assumed",
        "correct only if scans and camera files with the same number belong together; otherwise add a column time_ns",
    )


def _cut_off(path: Path) -> DataWarning:
    return DataWarning.reported(
        "cut-off-row",
        f"{path.name}: the file ends within a row, which is left out; its writer was stopped",
        "no action needed for one row; if more should follow, copy the file again from its source",
    )


def _points(columns: RadarColumns, values: np.ndarray) -> np.ndarray:
    """Return returns in SI units and the radar's axes as a structured array, one field per quantity."""
    plan, returns = columns.shown, columns.returns(values)
    height = plan.polar or len(plan.position) == 3
    fields = dict(zip("xyz" if height else "xy", returns.points_radar_m.T, strict=False))
    if returns.claimed_polar is not None:
        fields |= {n: c for n, c, own in zip(_POLAR, returns.claimed_polar.T, plan.claimed, strict=True) if own}
    if plan.doppler or plan.velocity:
        fields["doppler"] = returns.doppler_mps
    if plan.amplitude:
        meaning = table_meaning(plan.amplitude)
        fields[meaning.kind if meaning and meaning.quantity == "amplitude" else "amplitude"] = returns.snr_db
    fields |= {f"sigma_{n}": c for n, c, own in zip(_POLAR, returns.sigma_polar.T, plan.sigma, strict=True) if own}
    points = np.empty(len(values), dtype=[(name, "<f8") for name in fields])
    for name, column in fields.items():
        points[name] = column
    return points


def _computed_words(plan: ColumnPlan) -> str:
    """Say which columns x, y and z were computed from; "" if the table has positions of its own."""
    return f"x, y, z computed from {', '.join(plan.position)}" if plan.polar else ""


def _is_documented(written: str) -> bool:
    meaning = table_meaning(written)
    return meaning is not None and is_plain(split_unit(written)[0], meaning)


def _table_words(columns: RadarColumns, remarks: tuple[str, ...]) -> str:
    """Describe what was read and what was not, for the list of files."""
    plan = columns.plan
    renamed = [
        f"{reading.quantity} from {reading.column}"
        for reading in plan.readings
        if reading.why.startswith("--map") or not _is_documented(reading.column)
    ]
    shown = {why: [r for r in plan.readings if r.why == why] for why in dict.fromkeys(r.why for r in plan.readings)}
    by_values = [
        f"{', '.join(row.column for row in rows)} in {rows[0].unit}: {why.removeprefix('unit: ').partition(';')[0]}"
        for why, rows in shown.items()
        if why.startswith("unit: ") and not why.startswith(("unit: name", "unit: assumed", "unit: --map"))
    ]
    used = {*plan.columns, *(name for name in plan.claimed if name)}
    unused = [
        name
        for index, name in enumerate(columns.names)
        if name and name not in used and index not in columns.times.places
    ]
    more = len(unused) - _MOST_NAMES
    left = (
        f"without {', '.join(unused[:_MOST_NAMES])}" + (f" and {more} more columns" if more > 0 else "")
        if unused
        else ""
    )
    text = "; ".join(filter(None, (", ".join(renamed), "; ".join((*by_values, *remarks)), left)))
    return f", {text}" if text else ""


def _message(stamps: TimesNs, edges: np.ndarray, points: np.ndarray) -> Callable[[int], bytes]:
    def message(row: int) -> bytes:
        return cloud_message(TimeNs(int(stamps[row])), RADAR_FRAME, points[int(edges[row]) : int(edges[row + 1])])

    return message
