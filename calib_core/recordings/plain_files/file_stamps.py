"""Stamps for the files of a folder: from a CSV or text file, from the file names, or from consecutive file numbers."""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.recordings.assumptions import Assumption
from calib_core.recordings.plain_files.name_times import NamedTimes, times_in_names
from calib_core.recordings.plain_files.reading_options import PlainOptions
from calib_core.recordings.time.written_times import TimeUnit, date_text, read_time
from calib_core.results import DataWarning

_FILE_NAMES = ("file", "filename", "file_name", "image", "name", "path", "frame", "image_name", "filepath")
_TIME_NAME = re.compile(r"(?:time|timestamp|stamp|t)(?:[_ ]*[\[(]?\s*(ns|us|ms|s)\s*[\])]?)?")
_STEP_NS = NS_PER_S // 10
_MAX_TABLE_BYTES = 1 << 28
_ENOUGH = 0.8
_HEADER_ROWS = 10


def _no_numbers() -> dict[int, TimeNs]:
    return {}


@dataclass(frozen=True, slots=True, eq=False)
class StampedFiles:
    """Files in order of time.

    Attributes:
        files: paths.
        times_ns: (n,) ascending.
        warnings: what the user must know about the times.
        zoneless: whether the times are dates without a zone.
        counted: whether they come from the numbers of the files.
        assumed: what the digits in the names were taken for, if they do not say it.
        numbers: times by the numbers in the file names; empty if the times themselves come from those numbers.
    """

    files: tuple[Path, ...]
    times_ns: TimesNs
    warnings: tuple[DataWarning, ...] = ()
    zoneless: bool = False
    counted: bool = False
    assumed: str = ""
    numbers: Mapping[int, TimeNs] = field(default_factory=_no_numbers)

    def assumptions(self, topic: str) -> tuple[Assumption, ...]:
        """Return what was assumed about the times, for the topic that the files become."""
        if not self.assumed:
            return ()
        return (Assumption("name-times", topic, self.assumed, "a CSV with the columns file,time_ns in the folder"),)


def stamp_files(
    folder: Path,
    files: Sequence[Path],
    options: PlainOptions | None = None,
    numbered: Mapping[int, TimeNs] | None = None,
) -> StampedFiles:
    """Assign a time to every file; files without one are skipped, with a warning.

    Sources, in this order: a CSV with a column of file names and one of times; a text file with one time per line and as
    many lines as files; times in the file names; numbers in all file names, which have the time of the picture with the same
    number, or else are taken as 0.1 s apart.

    Args:
        folder: of the files.
        files: without the tables of times.
        options: the user's.
        numbered: times of pictures by their number.

    Raises:
        RecordingError: no file has a time.
    """
    files, options = sorted(files), options or PlainOptions()
    own = set(files)
    tables = [path for path in (*sorted(folder.glob("*.csv")), *sorted(folder.glob("*.txt"))) if path not in own]
    beside = (folder.with_suffix(".csv"), folder.parent / "timestamps.txt", folder.with_suffix(".txt"))
    for table in [*tables, *(path for path in beside if path.is_file() and path not in own)]:
        times, zoneless = _from_table(table, files, options.zone_s)
        if times:
            return _stamped(folder, files, times, zoneless=zoneless)
    named = times_in_names([file.stem for file in files], options.zone_s)
    if named is not None:
        return _by_name(folder, files, named)
    numbers = {file: number for file in files if (number := _number(file)) is not None}
    if len(numbers) < len(files) or len(set(numbers.values())) < len(files):
        raise RecordingError(
            f"{folder}: no times in the file names ({files[0].name}); name the files by their time since 1970 "
            "(19 digits for ns, 16 us, 13 ms, 10 s), or add a CSV with the columns file,time_ns to the folder"
        )
    return _counted(folder, files, numbers, numbered or {})


def _by_name(folder: Path, files: Sequence[Path], named: NamedTimes) -> StampedFiles:
    times = {files[place]: TimeNs(int(time)) for place, time in zip(named.places, named.times_ns, strict=True)}
    warnings: tuple[DataWarning, ...] = ()
    if named.disorder:
        what = f"{folder.name}: the times and the numbers in the file names disagree about the order at {named.disorder} files"
        warnings = (
            DataWarning(
                "file-order",
                what,
                "check a few names; the times are used: add a CSV with the columns file,time_ns if they are wrong",
            ),
        )
    return _stamped(folder, files, times, *warnings, zoneless=named.zoneless, assumed=named.assumed)


def _counted(
    folder: Path, files: Sequence[Path], numbers: Mapping[Path, int], numbered: Mapping[int, TimeNs]
) -> StampedFiles:
    """Stamp numbered files: like the pictures with the same numbers, or 0.1 s apart."""
    paired = {file: numbered[number] for file, number in numbers.items() if number in numbered}
    if len(paired) >= max(1, _ENOUGH * len(files)):
        warning = DataWarning(
            "numbered-files",
            f"{folder.name}: the files are numbered and have no times; they have the times of the pictures with their numbers",
            "correct only if radar and camera files with the same number belong together; otherwise add a CSV with the columns "
            "file,time_ns to the folder",
        )
        return _stamped(folder, files, paired, warning)
    counted = {file: TimeNs((number + 10) * _STEP_NS) for file, number in numbers.items()}
    warning = DataWarning(
        "numbered-files",
        f"{folder.name}: the files are numbered and have no times; an interval of 0.1 s is assumed",
        "correct only if radar and camera files with the same number belong together; otherwise add a CSV with the columns "
        "file,time_ns to the folder",
    )
    return _stamped(folder, files, counted, warning, counted=True)


def _number(file: Path) -> int | None:
    match = re.search(r"\d{1,9}$", file.stem)
    return int(match[0]) if match else None


def _stamped(
    folder: Path,
    files: Sequence[Path],
    times: Mapping[Path, TimeNs],
    *warnings: DataWarning,
    zoneless: bool = False,
    assumed: str = "",
    counted: bool = False,
) -> StampedFiles:
    ordered = sorted(times, key=lambda file: (times[file], file))
    left_out = [file for file in files if file not in times]
    if left_out:
        count = f"{len(left_out)} of {len(files)} files"
        what = f"{folder.name}: {count} have no time and are skipped; the first is {left_out[0].name}"
        warnings = (
            *warnings,
            DataWarning("unstamped-files", what, "name them by their time, or list them in the folder's CSV"),
        )
    times_ns = np.array([times[file] for file in ordered], dtype=np.int64)
    numbers = {} if counted else _numbers(times)
    return StampedFiles(tuple(ordered), times_ns, tuple(warnings), zoneless, counted, assumed, numbers)


def _numbers(times: Mapping[Path, TimeNs]) -> dict[int, TimeNs]:
    """Return times by the first number of at most nine digits in the names, if it tells all files apart."""
    found = {
        int(match[0]): time for file, time in times.items() if (match := re.search(r"(?<!\d)\d{1,9}(?!\d)", file.stem))
    }
    return found if len(found) == len(times) else {}


def _from_table(table: Path, files: Sequence[Path], zone_s: int | None) -> tuple[dict[Path, TimeNs], bool]:
    """Read the times of files from a table, and whether they are dates without a zone; empty if it is about something else.

    Raises:
        RecordingError: it is such a table, but a time in it cannot be read.
    """
    if table.stat().st_size > _MAX_TABLE_BYTES:
        return {}, False
    text = table.read_text(encoding="utf-8-sig", errors="replace")
    by_name = {name: file for file in files for name in (file.name, file.stem)}
    rows = [row for row in map(_cells, text.splitlines()) if any(cell.strip() for cell in row)]
    first, time_place, file_place, unit = _places(rows, by_name)
    if time_place < 0:
        return _one_per_line(table, rows, files, zone_s)
    times: dict[Path, TimeNs] = {}
    zoneless = False
    for number, row in enumerate(rows[first:], start=first + 1):
        file = by_name.get(Path(row[file_place].strip()).name) if len(row) > max(file_place, time_place) else None
        if file is not None:
            times[file] = _time(table, number, row[time_place], unit, zone_s)
            zoneless = zoneless or _zoneless(row[time_place])
    return times, zoneless and zone_s is None


def _places(rows: Sequence[Sequence[str]], by_name: Mapping[str, Path]) -> tuple[int, int, int, str | None]:
    """Return the first row, the column of times, that of files, and the unit of times; -1 for columns that are not there."""
    for number, row in enumerate(rows[:_HEADER_ROWS]):
        head = [cell.strip().lower().lstrip("# ") for cell in row]
        times = [(n, match[1]) for n, cell in enumerate(head) if (match := _TIME_NAME.fullmatch(cell))]
        names = [n for n, cell in enumerate(head) if cell in _FILE_NAMES]
        if times and names:
            return number + 1, times[0][0], names[0], times[0][1]
    for number, row in enumerate(rows[:_HEADER_ROWS]):
        places = [n for n, cell in enumerate(row) if Path(cell.strip()).name in by_name]
        if len(row) == 2 and len(places) == 1:
            return number, 1 - places[0], places[0], None
    return 0, -1, -1, None


def _cells(line: str) -> list[str]:
    """Split a line at commas or semicolons; without any, at spaces if the second word is a file, as in "1305.27 rgb/a.png"."""
    if "," in line or ";" in line:
        return next(csv.reader([line], delimiter="," if line.count(",") >= line.count(";") else ";"), [])
    words = line.strip().lstrip("# ").split()
    named = len(words) == 2 and (Path(words[1]).suffix[1:].isalpha() or words[1].lower() in _FILE_NAMES)
    return words if named else [line]


def _zoneless(text: str) -> bool:
    found = date_text(text)
    return found is not None and not found.zoned


def _one_per_line(
    table: Path, rows: Sequence[Sequence[str]], files: Sequence[Path], zone_s: int | None
) -> tuple[dict[Path, TimeNs], bool]:
    if table.suffix != ".txt" or len(rows) != len(files):
        return {}, False
    times = {
        file: _time(table, number, row[0], None, zone_s)
        for number, (file, row) in enumerate(zip(files, rows, strict=True), 1)
    }
    return times, zone_s is None and any(_zoneless(row[0]) for row in rows)


def _time(table: Path, number: int, text: str, unit: str | None, zone_s: int | None) -> TimeNs:
    units: dict[str, TimeUnit] = {"ns": "ns", "us": "us", "ms": "ms", "s": "s"}
    try:
        return read_time(text, units[unit] if unit else None, zone_s or 0)
    except RecordingError as error:
        raise RecordingError(f"{table}: line {number}: {error}") from error
