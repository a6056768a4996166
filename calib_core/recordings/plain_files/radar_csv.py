"""Read radar returns from a CSV file whose header names columns and units: time_ns,x_m,y_m,z_m,doppler_mps,snr_db."""

import csv
import math
import re
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib_core.errors import RecordingError
from calib_core.measurements import TimeNs
from calib_core.recordings.plain_files.messages import cloud_channel, cloud_message
from calib_core.recordings.plain_files.source import PlainSource, topic_of
from calib_core.recordings.time.written_times import TimeUnit, read_time

__all__ = ["CSV_EXAMPLE", "csv_columns", "open_radar_csv"]

CSV_EXAMPLE = "time_ns,x_m,y_m,z_m,doppler_mps,snr_db"
_FRAME = "radar"
_DELIMITERS = ",;\t"
_MAX_HEADER = 1 << 16
_LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0}
_ANGLES = {"rad": 1.0, "deg": math.pi / 180.0, "mrad": 0.001}
_SPEEDS = {"mps": 1.0, "kmh": 1 / 3.6, "kph": 1 / 3.6, "cmps": 0.01}
_DECIBELS = {"db": 1.0, "dbsm": 1.0, "dbm": 1.0}
_TIMES: dict[str, TimeUnit] = {"ns": "ns", "us": "us", "ms": "ms", "s": "s"}
_TIME_NAMES = ("time", "timestamp", "stamp", "t")
_QUANTITIES = {
    "x": ("x", _LENGTHS), "y": ("y", _LENGTHS), "z": ("z", _LENGTHS),
    "range": ("range", _LENGTHS), "r": ("range", _LENGTHS), "distance": ("range", _LENGTHS),
    "azimuth": ("azimuth", _ANGLES), "elevation": ("elevation", _ANGLES),
    "doppler": ("doppler", _SPEEDS), "range_rate": ("doppler", _SPEEDS), "velocity": ("doppler", _SPEEDS),
    "radial_speed": ("doppler", _SPEEDS),
    "snr": ("snr", _DECIBELS), "rcs": ("rcs", _DECIBELS), "power": ("power", _DECIBELS), "amplitude": ("amplitude", _DECIBELS),
    "sigma_range": ("sigma_range", _LENGTHS), "sigma_azimuth": ("sigma_azimuth", _ANGLES),
    "sigma_elevation": ("sigma_elevation", _ANGLES),
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Column:
    """One used column: its index, the quantity it holds, and the factor to apply."""

    place: int
    name: str
    scale: float


@dataclass(frozen=True, slots=True)
class _Header:
    """A parsed header."""

    time_place: int
    time_unit: TimeUnit
    columns: tuple[_Column, ...]
    unused: tuple[str, ...]


def csv_columns() -> tuple[str, ...]:
    """Return the table rows of columns and units for the documentation."""
    rows = [f"| {', '.join(f'`{name}`' for name in _TIME_NAMES)} | {', '.join(_TIMES)} |"]
    for becomes, units in dict(_QUANTITIES.values()).items():
        names = ", ".join(f"`{name}`" for name, (quantity, _) in _QUANTITIES.items() if quantity == becomes)
        rows.append(f"| {names} | {', '.join(units)} |")
    return tuple(rows)


def open_radar_csv(path: Path) -> PlainSource:
    """Read a CSV file of radar returns; rows with the same time form one scan.

    Raises:
        RecordingError: a column has no unit or an unknown one, a position or the time is missing, or a row is damaged.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            delimiter = max(_DELIMITERS, key=file.readline(_MAX_HEADER).count)
            file.seek(0)
            rows = csv.reader(file, delimiter=delimiter)
            header = _read_header(path, next(rows, []))
            times, values = _read_rows(path, header, rows)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: cannot be read as CSV: {error}") from error
    order = np.argsort(times, kind="stable")
    stamps, first = np.unique(times[order], return_index=True)
    edges = np.append(first, len(times))
    dtype = np.dtype([(column.name, "<f8") for column in header.columns])
    points = np.ascontiguousarray(values[order]).view(dtype)[:, 0]
    unused = f", without {', '.join(header.unused)}" if header.unused else ""
    return PlainSource(
        path, path.stat().st_size, f"radar CSV{unused}", cloud_channel(topic_of(path, "radar")), stamps,
        _message(stamps, edges, points),
    )  # fmt: skip


def _message(stamps: np.ndarray, edges: np.ndarray, points: np.ndarray) -> Callable[[int], bytes]:
    def message(row: int) -> bytes:
        return cloud_message(TimeNs(int(stamps[row])), _FRAME, points[int(edges[row]) : int(edges[row + 1])])

    return message


def _read_header(path: Path, names: Sequence[str]) -> _Header:
    time: tuple[int, TimeUnit] | None = None
    columns: list[_Column] = []
    unused = []
    for place, written in enumerate(names):
        name, unit = _split(written)
        if name in _TIME_NAMES:
            time = place, _TIMES[_unit(path, written, unit, _TIMES)]
        elif name in _QUANTITIES:
            becomes, units = _QUANTITIES[name]
            columns.append(_Column(place, becomes, units[_unit(path, written, unit, units)]))
        else:
            unused.append(written.strip())
    if time is None:
        raise RecordingError(
            f"{path}: no time column; the first line must name columns and units, such as {CSV_EXAMPLE}"
        )
    have = {column.name for column in columns}
    if len(have) < len(columns):
        raise RecordingError(f"{path}: two columns hold the same quantity: {', '.join(names)}; keep one of them")
    if not ({"x", "y"} <= have or {"range", "azimuth"} <= have):
        raise RecordingError(
            f"{path}: no position columns; x_m and y_m, or range_m and azimuth_deg, are required, such as {CSV_EXAMPLE}"
        )
    return _Header(*time, tuple(columns), tuple(unused))


def _split(written: str) -> tuple[str, str]:
    """Split "x_m", "x [m]" or "#timestamp (ns)" into name and unit."""
    text = written.strip().lower().lstrip("# ")
    match = re.fullmatch(r"(.*?)\s*[\[(]\s*(.*?)\s*[\])]", text)
    if match:
        return match[1].replace(" ", "_"), match[2].replace("m/s", "mps").replace("km/h", "kmh")
    if text in _QUANTITIES or text in _TIME_NAMES:
        return text, ""
    name, _, unit = text.replace(" ", "_").removeprefix("position_").rpartition("_")
    if not name or unit in ("x", "y", "z", "id"):
        return (f"{name}_{unit}" if name else unit), ""
    return name, unit


def _unit(path: Path, written: str, unit: str, known: Mapping[str, object]) -> str:
    if unit in known:
        return unit
    units = ", ".join(known)
    example = f"{_split(written)[0]}_{next(iter(known))}"
    if not unit:
        raise RecordingError(f"{path}: column '{written.strip()}' has no unit; write {example}; known units: {units}")
    raise RecordingError(f"{path}: column '{written.strip()}' has the unknown unit '{unit}'; known units: {units}")


def _read_rows(path: Path, header: _Header, rows: Iterable[list[str]]) -> tuple[np.ndarray, np.ndarray]:
    times, values = array("q"), array("d")  # eight bytes per number; a Python list would take forty
    places = [column.place for column in header.columns]
    known, time = "", 0  # rows of a scan have the same time
    for number, row in enumerate(rows, start=2):
        if not row or not any(map(str.strip, row)):
            continue
        try:
            if (text := row[header.time_place]) != known:
                known, time = text, read_time(text, header.time_unit)
            times.append(time)
            values.extend([_number(row[place]) for place in places])
        except (ValueError, IndexError, OverflowError, RecordingError) as error:
            why = "too few columns" if isinstance(error, IndexError) else str(error)
            raise RecordingError(f"{path}: line {number}: {why}; fix or remove the line") from error
    if not times:
        raise RecordingError(f"{path}: the file has a header but no rows")
    scale = np.array([column.scale for column in header.columns])
    return np.array(times, dtype=np.int64), np.array(values, dtype=np.float64).reshape(-1, len(scale)) * scale


def _number(text: str) -> float:
    return math.nan if not text or text.isspace() else float(text)
