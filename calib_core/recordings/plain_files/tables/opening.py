"""Open tables of radar returns, CSV or JSON: one file with all scans, or a folder with one file per scan."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import TimeNs
from calib_core.recordings.plain_files.file_stamps import StampedFiles, stamp_files
from calib_core.recordings.plain_files.messages import cloud_channel, cloud_message
from calib_core.recordings.plain_files.reading_options import PlainOptions
from calib_core.recordings.plain_files.source import PlainSource, topic_of
from calib_core.recordings.plain_files.tables.columns import TableColumns, choose_columns
from calib_core.recordings.plain_files.tables.csv_files import first_rows, read_rows, require_header
from calib_core.recordings.plain_files.tables.json_files import JsonTable, open_json_table, read_json_rows
from calib_core.recordings.plain_files.tables.scans import (
    RADAR_FRAME,
    ReturnTable,
    computed_words,
    points_of,
    source_of,
    table_words,
)
from calib_core.recordings.plain_files.tables.text_tables import TABLE_EXAMPLE, TableRows, TextTable, open_text_table
from calib_core.recordings.plain_files.tables.times import TimeReader, time_reader
from calib_core.recordings.plain_files.tables.units import TableUnits, settle_units

JSON_SUFFIXES = (".json", ".jsonl", ".ndjson")
TABLE_SUFFIXES = (".csv", ".tsv", ".txt", *JSON_SUFFIXES)
_SAMPLED_FILES = 12

Table: TypeAlias = TextTable | JsonTable


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
