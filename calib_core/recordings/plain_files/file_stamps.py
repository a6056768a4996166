"""Stamps for the files of a folder: from a CSV or text file, from the file names, or from consecutive file numbers."""

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings.time.written_times import TimeUnit, read_time, time_from_name
from calib_core.results import DataWarning

__all__ = ["StampedFiles", "stamp_files"]

_FILE_NAMES = ("file", "filename", "file_name", "image", "name", "path", "frame")
_TIME_NAME = re.compile(r"(?:time|timestamp|stamp|t)(?:[_ ]*[\[(]?\s*(ns|us|ms|s)\s*[\])]?)?")
_STEP_NS = NS_PER_S // 10
_MAX_TABLE_BYTES = 1 << 28


@dataclass(frozen=True, slots=True, eq=False)
class StampedFiles:
    """Files in order of time.

    Attributes:
        files: paths.
        times_ns: (n,) ascending.
        warnings: what the user must know about the times.
    """

    files: tuple[Path, ...]
    times_ns: TimesNs
    warnings: tuple[DataWarning, ...] = ()


def stamp_files(folder: Path, files: Sequence[Path]) -> StampedFiles:
    """Assign a time to every file; files without one are skipped, with a warning.

    Sources, in this order: a CSV with a column of file names and one of times; a text file with one time per line and as
    many lines as files; times in the file names; numbers in all file names, taken as 0.1 s apart.

    Raises:
        RecordingError: no file has a time.
    """
    files = sorted(files)
    tables = [path for path in (*sorted(folder.glob("*.csv")), *sorted(folder.glob("*.txt")))]
    tables += [path for path in (folder.with_suffix(".csv"), folder.parent / "timestamps.txt") if path.is_file()]
    for table in tables:
        times = _from_table(table, files)
        if times:
            return _stamped(folder, files, times)
    named = {file: time for file in files if (time := time_from_name(file.stem)) is not None}
    if named:
        return _stamped(folder, files, named)
    numbers = {file: int(match[0]) for file in files if (match := re.search(r"\d{1,9}$", file.stem))}
    if len(numbers) < len(files) or len(set(numbers.values())) < len(files):
        raise RecordingError(
            f"{folder}: no times in the file names ({files[0].name}); name the files by their time since 1970 "
            "(19 digits for ns, 16 us, 13 ms, 10 s), or add a CSV with the columns file,time_ns to the folder"
        )
    counted = {file: TimeNs((number + 10) * _STEP_NS) for file, number in numbers.items()}
    warning = DataWarning(
        "numbered-files",
        f"{folder.name}: the files are numbered and have no times; an interval of 0.1 s is assumed",
        "correct only if radar and camera files with the same number belong together; otherwise add a CSV with the columns "
        "file,time_ns to the folder",
    )
    return _stamped(folder, files, counted, warning)


def _stamped(folder: Path, files: Sequence[Path], times: dict[Path, TimeNs], *warnings: DataWarning) -> StampedFiles:
    ordered = sorted(times, key=lambda file: (times[file], file))
    left_out = [file for file in files if file not in times]
    if left_out:
        count = f"{len(left_out)} of {len(files)} files"
        what = f"{folder.name}: {count} have no time and are skipped; the first is {left_out[0].name}"
        warnings = (
            *warnings,
            DataWarning("unstamped-files", what, "name them by their time, or list them in the folder's CSV"),
        )
    return StampedFiles(tuple(ordered), np.array([times[file] for file in ordered], dtype=np.int64), tuple(warnings))


def _from_table(table: Path, files: Sequence[Path]) -> dict[Path, TimeNs]:
    """Read the times of files from a table; empty if the table is about something else.

    Raises:
        RecordingError: it is such a table, but a time in it cannot be read.
    """
    if table.stat().st_size > _MAX_TABLE_BYTES:
        return {}
    text = table.read_text(encoding="utf-8-sig", errors="replace")
    rows = [row for row in csv.reader(text.splitlines()) if any(cell.strip() for cell in row)]
    if not rows:
        return {}
    head = [cell.strip().lower().lstrip("# ") for cell in rows[0]]
    time_place = next((n for n, cell in enumerate(head) if _TIME_NAME.fullmatch(cell)), None)
    file_place = next((n for n, cell in enumerate(head) if cell in _FILE_NAMES), None)
    if time_place is None or file_place is None:
        return _one_per_line(table, rows, files)
    unit = _TIME_NAME.fullmatch(head[time_place])
    by_name = {name: file for file in files for name in (file.name, file.stem)}
    times: dict[Path, TimeNs] = {}
    for number, row in enumerate(rows[1:], start=2):
        file = by_name.get(Path(row[file_place].strip()).name) if len(row) > max(file_place, time_place) else None
        if file is not None:
            times[file] = _time(table, number, row[time_place], unit[1] if unit else None)
    return times


def _one_per_line(table: Path, rows: Sequence[Sequence[str]], files: Sequence[Path]) -> dict[Path, TimeNs]:
    if table.suffix != ".txt" or len(rows) != len(files):
        return {}
    return {
        file: _time(table, number, row[0], None) for number, (file, row) in enumerate(zip(files, rows, strict=True), 1)
    }


def _time(table: Path, number: int, text: str, unit: str | None) -> TimeNs:
    units: dict[str, TimeUnit] = {"ns": "ns", "us": "us", "ms": "ms", "s": "s"}
    try:
        return read_time(text, units[unit] if unit else None)
    except RecordingError as error:
        raise RecordingError(f"{table}: line {number}: {error}") from error
