"""Open tables of radar returns, CSV or JSON: one file with all scans, or a folder with one file per scan."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import TimeNs
from calib_core.radar import cartesian_from_polar
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.plain_files.file_stamps import StampedFiles, stamp_files
from calib_core.recordings.plain_files.source import PlainOptions, PlainSource, cloud_channel, cloud_message, topic_of
from calib_core.recordings.plain_files.tables.columns import TABLE_EXAMPLE, TableColumns, choose_columns
from calib_core.recordings.plain_files.tables.json_files import JsonTable, open_json_table, read_json_rows
from calib_core.recordings.plain_files.tables.text_tables import (
    TableRows,
    TextTable,
    first_rows,
    open_text_table,
    read_rows,
    require_header,
)
from calib_core.recordings.plain_files.tables.times import TimeReader, time_reader
from calib_core.recordings.plain_files.tables.units import TableUnits, settle_units
from calib_core.results import DataWarning

JSON_SUFFIXES = (".json", ".jsonl", ".ndjson")
TABLE_SUFFIXES = (".csv", ".tsv", ".txt", *JSON_SUFFIXES)
_SAMPLED_FILES = 12
Table: TypeAlias = TextTable | JsonTable
RADAR_FRAME = "radar"
_MOST_NAMES = 8


def open_radar_table(path: Path, options: PlainOptions) -> PlainSource:
    """Read a table of radar returns; rows with the same time form one scan.

    Raises:
        RecordingError: a position or the time is missing, a unit is unknown, or a row is damaged.
    """
    table = _open(path, options)
    columns = _columns(table, options)
    times = _times(table, columns, topic_of(path, "radar"), options)
    if times is None:
        shown = ", ".join(name.strip() for name in table.names[:12])
        raise RecordingError(
            f"{path}: no time column; the first line must name columns and units, such as {TABLE_EXAMPLE}; "
            f"the columns are {shown}: say which is the time with --map time=NAME:s"
        )
    rows = _read(table, columns, times)
    if not len(rows.times_ns):
        raise RecordingError(f"{path}: the file has a header but no rows")
    what = "radar JSON" if isinstance(table, JsonTable) else "radar CSV"
    read = ReturnTable(columns, rows, times.zoneless, times.counted, times.assumptions, times.remarks)
    return source_of(path, what, read, options)


def table_fault(path: Path, options: PlainOptions) -> str:
    """Say why a file is not a table of radar returns, judging by its beginning; "" if it is one."""
    try:
        _columns(_open(path, options), options)
    except RecordingError as error:
        return str(error).removeprefix(f"{path}: ")
    return ""


def is_one_scan_each(files: Sequence[Path], options: PlainOptions) -> bool:
    """Return whether tables with numbered or dated names hold one scan each: no times inside, or one time each."""
    try:
        table = _open(files[0], options)
        columns = _columns(table, options)
        times = _times(table, columns, "", options)
        if times is None or times.counted:
            return True
        return len(set(map(times.key, _rows(table)))) <= 1
    except (RecordingError, IndexError):
        return False


def open_table_folder(
    folder: Path, files: Sequence[Path], options: PlainOptions, numbered: Mapping[int, TimeNs]
) -> PlainSource:
    """Open a folder of tables with one scan each; their times stand in them, or come from their names.

    Args:
        folder: of the files.
        files: the tables.
        options: the user's.
        numbered: times of pictures by their number.

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
    columns = _columns(tables[0], options)
    values = [_read(table, _same_columns(table, columns, options), None).values for table in tables]
    units = settle_units(columns, np.concatenate(values), topic, options)
    times = _times(tables[0], columns, topic, options)
    inside = times is not None and not times.counted
    stamped = (
        _stamped_inside(files, times, options) if times and inside else stamp_files(folder, files, options, numbered)
    )

    def message(row: int) -> bytes:
        return cloud_message(
            TimeNs(int(stamped.times_ns[row])), RADAR_FRAME, _points(stamped.files[row], columns, units, options)
        )

    remarks = (*units.remarks, *(times.remarks if times and inside else ()))
    return PlainSource(
        folder,
        sum(file.stat().st_size for file in stamped.files),
        f"folder of radar {files[0].suffix}, {len(stamped.files)} files{table_words(columns, remarks)}",
        cloud_channel(topic),
        stamped.times_ns,
        message,
        stamped.warnings,
        assumptions=(*stamped.assumptions(topic), *(times.assumptions if times and inside else ()), *units.assumptions),
        zoneless=stamped.zoneless,
        counted=stamped.counted,
        mapped=any(column.mapped for column in (*columns.values, *columns.time)),
        computed=computed_words(columns),
    )


def _open(path: Path, options: PlainOptions) -> Table:
    if path.suffix.lower() in JSON_SUFFIXES:
        return open_json_table(path)
    table = open_text_table(path)
    require_header(table, options)
    return table


def _columns(table: Table, options: PlainOptions) -> TableColumns:
    units = table.units if isinstance(table, TextTable) else ()
    return choose_columns(table.path, table.names, units, table.first_row, options.mapped)


def _same_columns(table: Table, columns: TableColumns, options: PlainOptions) -> TableColumns:
    """Return the columns of one file of a folder.

    Raises:
        MessageError: they are not those of the first.
    """
    own = _columns(table, options)
    if [(c.quantity, c.unit) for c in own.values] != [(c.quantity, c.unit) for c in columns.values]:
        raise MessageError(f"{table.path.name} has other columns than the other files: {', '.join(table.names[:12])}")
    return own


def _rows(table: Table) -> Sequence[Sequence[str]]:
    return table.sample if isinstance(table, JsonTable) else first_rows(table)


def _times(table: Table, columns: TableColumns, topic: str, options: PlainOptions) -> TimeReader | None:
    comma = isinstance(table, TextTable) and table.decimal_comma
    return time_reader(columns, _rows(table), topic, zone_s=options.zone_s, decimal_comma=comma)


def _read(table: Table, columns: TableColumns, times: TimeReader | None) -> TableRows:
    return read_json_rows(table, columns, times) if isinstance(table, JsonTable) else read_rows(table, columns, times)


def _points(file: Path, columns: TableColumns, units: TableUnits, options: PlainOptions) -> np.ndarray:
    table = _open(file, options)
    if not table.first_row:
        return points_of(columns, np.zeros((0, len(columns.values))), units)
    own = _same_columns(table, columns, options)
    return points_of(own, _read(table, own, None).values, units)


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


@dataclass(frozen=True, slots=True, eq=False)
class ReturnTable:
    """A table as read.

    Attributes:
        columns: which columns were read.
        rows: their times and values.
        zoneless: whether the times are dates without a zone.
        counted: whether the times are numbers of scans.
        assumptions: about the times.
        remarks: about the times.
    """

    columns: TableColumns
    rows: TableRows
    zoneless: bool = False
    counted: bool = False
    assumptions: tuple[Assumption, ...] = ()
    remarks: tuple[str, ...] = ()


def source_of(path: Path, what: str, table: ReturnTable, options: PlainOptions) -> PlainSource:
    """Return the scans of a table as a recording's topic."""
    topic = topic_of(path, "radar")
    units = settle_units(table.columns, table.rows.values, topic, options)
    order = np.argsort(table.rows.times_ns, kind="stable")
    stamps, first = np.unique(table.rows.times_ns[order], return_index=True)
    edges = np.append(first, len(order))
    points = points_of(table.columns, table.rows.values[order], units)
    warnings = (*([_counted(path)] if table.counted else ()), *([_cut_off(path)] if table.rows.is_cut_off else ()))
    return PlainSource(
        path,
        path.stat().st_size,
        f"{what}{table_words(table.columns, (*units.remarks, *table.remarks))}",
        cloud_channel(topic),
        stamps,
        _message(stamps, edges, points),
        warnings,
        assumptions=(*table.assumptions, *units.assumptions),
        zoneless=table.zoneless,
        counted=table.counted,
        mapped=any(column.mapped for column in (*table.columns.values, *table.columns.time)),
        computed=computed_words(table.columns),
    )


def _counted(path: Path) -> DataWarning:
    return DataWarning(
        "numbered-files",
        f"{path.name}: the scans are numbered and have no times; an interval of 0.1 s is assumed",
        "correct only if scans and camera files with the same number belong together; otherwise add a column time_ns",
    )


def _cut_off(path: Path) -> DataWarning:
    return DataWarning(
        "cut-off-row",
        f"{path.name}: the file ends within a row, which is left out; its writer was stopped",
        "no action needed for one row; if more should follow, copy the file again from its source",
    )


def points_of(columns: TableColumns, values: np.ndarray, units: TableUnits) -> np.ndarray:
    """Return returns in SI units as a structured array, one field per quantity."""
    names = [column.quantity for column in columns.values]
    scaled = np.ascontiguousarray(values * units.scales)
    if units.x_is_right:
        x, y = names.index("x"), names.index("y")
        scaled[:, [x, y]] = scaled[:, [y, x]] * (1.0, -1.0)
        if "vx" in names and "vy" in names:
            x, y = names.index("vx"), names.index("vy")
            scaled[:, [x, y]] = scaled[:, [y, x]] * (1.0, -1.0)
    if "x" not in names or "y" not in names:
        names, scaled = _with_positions(names, scaled)
    return scaled.view(np.dtype([(name, "<f8") for name in names]))[:, 0]


def _with_positions(names: Sequence[str], values: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Put x, y, z before range and angles, so that what was settled about these is not asked again of the message."""
    polar = np.zeros((len(values), 3))
    for place, name in enumerate(("range", "azimuth", "elevation")):
        if name in names:
            polar[:, place] = values[:, names.index(name)]
    kept = [place for place, name in enumerate(names) if name not in ("x", "y", "z")]
    with np.errstate(invalid="ignore"):  # an angle may be infinite
        positions = np.column_stack([cartesian_from_polar(polar), values[:, kept]])
    return ["x", "y", "z", *(names[place] for place in kept)], np.ascontiguousarray(positions)


def computed_words(columns: TableColumns) -> str:
    """Say which columns x, y and z were computed from; "" if the table has positions of its own."""
    if columns.of("x") and columns.of("y"):
        return ""
    polar = (columns.of(quantity) for quantity in ("range", "azimuth", "elevation"))
    return f"x, y, z computed from {', '.join(column.written for column in polar if column)}"


def table_words(columns: TableColumns, remarks: tuple[str, ...]) -> str:
    """Describe what was read and what was not, for the list of files."""
    renamed = [f"{c.quantity} from {c.written}" for c in columns.values if c.rank or c.mapped]
    words = [", ".join(renamed), "; ".join(remarks)]
    if columns.unused:
        more = len(columns.unused) - _MOST_NAMES
        words.append(
            f"without {', '.join(columns.unused[:_MOST_NAMES])}" + (f" and {more} more columns" if more > 0 else "")
        )
    text = "; ".join(filter(None, words))
    return f", {text}" if text else ""


def _message(stamps: TimesNs, edges: np.ndarray, points: np.ndarray) -> Callable[[int], bytes]:
    def message(row: int) -> bytes:
        return cloud_message(TimeNs(int(stamps[row])), RADAR_FRAME, points[int(edges[row]) : int(edges[row + 1])])

    return message
