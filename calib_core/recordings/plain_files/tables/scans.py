"""Make scans of a table of returns: rows with the same time form one scan."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.measurements import TimeNs
from calib_core.radar import cartesian_from_polar
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.plain_files.messages import cloud_channel, cloud_message
from calib_core.recordings.plain_files.reading_options import PlainOptions
from calib_core.recordings.plain_files.source import PlainSource, topic_of
from calib_core.recordings.plain_files.tables.columns import TableColumns
from calib_core.recordings.plain_files.tables.text_tables import TableRows
from calib_core.recordings.plain_files.tables.units import TableUnits, settle_units
from calib_core.results import DataWarning

RADAR_FRAME = "radar"
_MOST_NAMES = 8


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
