"""Stamps for the files of a folder: from a CSV or text file, from dates or epochs in the file names, or from their numbers."""

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, DataWarning, TimeNs
from calib_core.recordings.containers.sources import Assumption, Channel
from calib_core.recordings.plain_files.source import PlainOptions, PlainSource
from calib_core.recordings.time.written_times import (
    TimeUnit,
    WrittenMoment,
    date_text,
    epoch_in_name,
    moments_in,
    read_time,
)

_FRACTIONS = (3, 6, 9)


_MOST_PER_SECOND = 250


_FILE_NAMES = ("file", "filename", "file_name", "image", "name", "path", "frame", "image_name", "filepath")


_TIME_NAME = re.compile(r"(?:time|timestamp|stamp|t)(?:[_ ]*[\[(]?\s*(ns|us|ms|s)\s*[\])]?)?")


_STEP_NS = NS_PER_S // 10
_LONGEST_STEP = 1000  # of numbers that count frames, not time


_MAX_TABLE_BYTES = 1 << 28


_ENOUGH = 0.8


_HEADER_ROWS = 10


COUNTED = "assumed: the files or scans are numbered and have no times, and are taken as 0.1 s apart"


_NUMBERED_LINE = re.compile(
    r"(?:frame|id|image|file)\s*[:=]\s*(\S+?)[,;]?\s+(?:time|timestamp|stamp)\s*[:=]\s*(\S+)", re.I
)
"""Such as RADIATE's "Frame: 000001 Time: 1574859772.427742418"."""


@dataclass(frozen=True, slots=True, eq=False)
class NamedTimes:
    """The times in the names of files.

    Attributes:
        places: (n,) which of the names have a time.
        times_ns: (n,) their times.
        zoneless: whether they are dates without a zone.
        assumed: what the digits after the second were taken for, if they do not say it; "" if they do.
        disorder: how many neighbors in time have numbers in their names that run backwards.
    """

    places: tuple[int, ...]
    times_ns: TimesNs
    zoneless: bool = False
    assumed: str = ""
    disorder: int = 0


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
        times_from: where the times come from, as a clause.
    """

    files: tuple[Path, ...]
    times_ns: TimesNs
    warnings: tuple[DataWarning, ...] = ()
    zoneless: bool = False
    counted: bool = False
    assumed: str = ""
    times_from: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Of the files, without suffix."""
        return tuple(file.stem for file in self.files)

    def assumptions(self, topic: str) -> tuple[Assumption, ...]:
        """Return what was assumed about the times, for the topic that the files become."""
        if not self.assumed:
            return ()
        return (Assumption("name-times", topic, self.assumed, "a CSV with the columns file,time_ns in the folder"),)

    def source(self, folder: Path, what: str, channel: Channel, message: Callable[[int], bytes]) -> PlainSource:
        """Return the files of a folder as the messages of a topic.

        Args:
            folder: of the files.
            what: they are, for the list of files.
            channel: of the topic.
            message: builds the message of a file.
        """
        return PlainSource(
            folder,
            sum(file.stat().st_size for file in self.files),
            what,
            channel,
            self.times_ns,
            message,
            self.warnings,
            assumptions=self.assumptions(channel.topic),
            zoneless=self.zoneless,
            counted=self.counted,
            names=self.names,
            times_from=self.times_from,
        )


def stamp_files(
    folder: Path,
    files: Sequence[Path],
    options: PlainOptions | None = None,
    known: PlainSource | None = None,
) -> StampedFiles:
    """Assign a time to every file; files without one are skipped, with a warning.

    Sources, in this order: a table of times in or beside the folder, which names the files, numbers them, or has as many lines
    as there are files; times in the file names; the times of another folder's files of equal names, then of equal numbers;
    otherwise numbered files are taken as 0.1 s apart.

    Args:
        folder: of the files.
        files: without the tables of times.
        options: the user's.
        known: another folder, whose files have times.

    Raises:
        RecordingError: no file has a time.
    """
    files, options = sorted(files), options or PlainOptions()
    own = set(files)
    inside = (*sorted(folder.glob("*.csv")), *sorted(folder.glob("*.txt")))
    beside = tuple(folder.parent / name for name in (f"{folder.stem}.csv", "timestamps.txt", f"{folder.stem}.txt"))
    for table in (path for path in (*inside, *beside) if path.is_file() and path not in own):
        times, zoneless = _from_table(table, files, options.zone_s)
        if times:
            return _stamped(folder, files, times, zoneless=zoneless, times_from=f"those in {table.name}")
    named = times_in_names([file.stem for file in files], options.zone_s)
    if named is not None:
        return _by_name(folder, files, named)
    matched = _like_files_of(known, folder, files) if known is not None else None
    if matched is not None:
        return matched
    numbers = {file: number for file in files if (number := _number(file)) is not None}
    steps = np.diff(sorted(numbers.values()))
    counts = not len(steps) or (steps.min() > 0 and np.median(steps) <= _LONGEST_STEP)
    if len(numbers) < len(files) or not counts:
        raise RecordingError(
            f"{folder}: no times in the file names ({files[0].name}); name the files by their time since 1970 "
            "(19 digits for ns, 16 us, 13 ms, 10 s), or add a CSV with the columns file,time_ns to the folder"
        )
    return _stamps_by_count(folder, files, numbers)


def _by_name(folder: Path, files: Sequence[Path], named: NamedTimes) -> StampedFiles:
    times = {files[place]: TimeNs(int(time)) for place, time in zip(named.places, named.times_ns, strict=True)}
    warnings: tuple[DataWarning, ...] = ()
    if named.disorder:
        what = f"{folder.name}: the times and the numbers in the file names disagree about the order at {named.disorder} files"
        warnings = (
            DataWarning.reported(
                "file-order",
                what,
                "check a few names; the times are used: add a CSV with the columns file,time_ns if they are wrong",
            ),
        )
    told = f"those in the file names{f'; {named.assumed}' if named.assumed else ''}"
    return _stamped(folder, files, times, *warnings, zoneless=named.zoneless, assumed=named.assumed, times_from=told)


def _like_files_of(known: PlainSource, folder: Path, files: Sequence[Path]) -> StampedFiles | None:
    """Stamp files like those of another folder with the same names, or else the same numbers; None if most have neither."""
    by_name = {name: TimeNs(int(time)) for name, time in zip(known.names, known.times_ns, strict=True)}
    by_number = {number: by_name[name] for number, name in _numbers(known.names).items()}
    numbers = {file: _number(file) for file in files}
    for what, times in (
        ("names", {file: by_name[file.stem] for file in files if file.stem in by_name}),
        ("numbers", {file: by_number[number] for file, number in numbers.items() if number in by_number}),
    ):
        if len(times) >= max(1, _ENOUGH * len(files)):
            warning = DataWarning.reported(
                "numbered-files",
                f"{folder.name}: the files have no times; they have those of the files of {known.path.name} with the same {what}",
                f"correct only if files with the same {what} belong together; otherwise add a CSV with the columns "
                "file,time_ns to the folder",
            )
            told = f"those of the files of {known.path.name} with the same {what}"
            return _stamped(folder, files, times, warning, zoneless=known.zoneless, times_from=told)
    return None


def _stamps_by_count(folder: Path, files: Sequence[Path], numbers: Mapping[Path, int]) -> StampedFiles:
    """Stamp numbered files 0.1 s apart."""
    counted = {file: TimeNs((number + 10) * _STEP_NS) for file, number in numbers.items()}
    warning = DataWarning.reported(
        "numbered-files",
        f"{folder.name}: the files are numbered and have no times; an interval of 0.1 s is assumed",
        "correct only if radar and camera files with the same number belong together; otherwise add a CSV with the columns "
        "file,time_ns to the folder",
    )
    return _stamped(folder, files, counted, warning, counted=True, times_from=COUNTED)


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
    times_from: str = "",
) -> StampedFiles:
    ordered = sorted(times, key=lambda file: (times[file], file))
    left_out = [file for file in files if file not in times]
    if left_out:
        count = f"{len(left_out)} of {len(files)} files"
        what = f"{folder.name}: {count} have no time and are skipped; the first is {left_out[0].name}"
        warnings = (
            *warnings,
            DataWarning.reported("unstamped-files", what, "name them by their time, or list them in the folder's CSV"),
        )
    times_ns = np.array([times[file] for file in ordered], dtype=np.int64)
    return StampedFiles(tuple(ordered), times_ns, tuple(warnings), zoneless, counted, assumed, times_from)


def _numbers(names: Sequence[str]) -> dict[int, str]:
    """Return names by their first number of at most nine digits, if it tells all of them apart."""
    found = {int(match[0]): name for name in names if (match := re.search(r"(?<!\d)\d{1,9}(?!\d)", name))}
    return found if len(found) == len(names) else {}


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
    labelled = _NUMBERED_LINE.fullmatch(line.strip())
    if labelled is not None:
        return [labelled[1], labelled[2]]
    if "," in line or ";" in line:
        return next(csv.reader([line], delimiter="," if line.count(",") >= line.count(";") else ";"), [])
    words = line.strip().lstrip("# ").split()
    named = len(words) == 2 and (Path(words[1]).suffix[1:].isalpha() or words[1].lower() in _FILE_NAMES)
    return words if named else [line]


def _zoneless(text: str) -> bool:
    moment = date_text(text)
    return moment is not None and not moment.zoned


def _one_per_line(
    table: Path, rows: Sequence[Sequence[str]], files: Sequence[Path], zone_s: int | None
) -> tuple[dict[Path, TimeNs], bool]:
    lines = _lines_of(table, len(rows), files) if table.suffix == ".txt" else ()
    times = {
        file: _time(table, line + 1, rows[line][0], None, zone_s)
        for file, line in zip(files, lines, strict=bool(lines))
    }
    return times, zone_s is None and any(_zoneless(rows[line][0]) for line in lines)


def _lines_of(table: Path, count: int, files: Sequence[Path]) -> Sequence[int]:
    """Return the line of each file, from 0: the next one, or that of its number in a part of a raw KITTI drive; () if unknown."""
    if count == len(files):
        return range(count)
    numbers = [number for file in files if (number := _number(file)) is not None]
    is_kitti = table == files[0].parent.parent / "timestamps.txt" and files[0].parent.name == "data"
    return numbers if is_kitti and len(numbers) == len(files) and max(numbers) < count else ()


def _time(table: Path, number: int, text: str, unit: str | None, zone_s: int | None) -> TimeNs:
    units: dict[str, TimeUnit] = {"ns": "ns", "us": "us", "ms": "ms", "s": "s"}
    try:
        return read_time(text, units[unit] if unit else None, zone_s or 0)
    except RecordingError as error:
        raise RecordingError(f"{table}: line {number}: {error}") from error


def times_in_names(stems: Sequence[str], zone_s: int | None = None) -> NamedTimes | None:
    """Find the times in the names of files; None if there are none, or all files have the same.

    A number that counts from 1970 is preferred to a date. If a name has several, the last that differs between files is
    used. Digits after the second are a fraction if they have 3, 6 or 9 places, unless they count the files.

    Args:
        stems: names without their suffix.
        zone_s: offset from UTC of dates without a zone [s]; None if not given.
    """
    best: NamedTimes | None = None
    for moments in _candidates(stems):
        found = [(index, moment) for index, moment in enumerate(moments) if moment is not None]
        if len(found) > (len(best.places) if best else 0):
            best = _stamps_by_name(stems, found, zone_s) or best
    return best


def _stamps_by_name(
    stems: Sequence[str], found: Sequence[tuple[int, WrittenMoment]], zone_s: int | None
) -> NamedTimes | None:
    """Return the times of one way to choose moments; None if they do not tell the files apart."""
    times = _times([moment for _, moment in found])
    if times is None or (len(found) > 1 and len(np.unique(times[0])) == 1) or _is_numbered_day(stems, found):
        return None
    zoned = np.array([moment.zoned for _, moment in found])
    shift = np.where(zoned, 0, (zone_s or 0) * NS_PER_S)
    numbers = [_number_outside(stems[place], moment) for place, moment in found]
    return NamedTimes(
        tuple(place for place, _ in found),
        times[0] - shift,
        zone_s is None and not zoned.all(),
        times[1],
        _disorder(times[0], numbers),
    )


def _is_numbered_day(stems: Sequence[str], found: Sequence[tuple[int, WrittenMoment]]) -> bool:
    """Return whether what looks like a time of day counts files: 2024-05-17_000060 is none, and 000001, 000002 may be none."""
    if any(moment.tail or moment.zoned for _, moment in found):
        return False
    shapes = {re.sub(r"\d", "0", stems[place]) for place, _ in found}
    dated = {place for place, _ in found}
    if any(place not in dated and re.sub(r"\d", "0", stem) in shapes for place, stem in enumerate(stems)):
        return True
    seconds = np.sort([moment.second for _, moment in found])
    return len(seconds) > 1 and int(seconds[0]) % 86_400 <= 1 and bool((np.diff(seconds) == 1).all())


def _candidates(stems: Sequence[str]) -> list[list[WrittenMoment | None]]:
    """Return for each way to choose a moment the moment of each name: since 1970, the last date, the first date."""
    dates = [list(moments_in(stem)) for stem in stems]
    ways: list[list[WrittenMoment | None]] = [[epoch_in_name(stem) for stem in stems]]
    ways += [[found[at] if found else None for found in dates] for at in (-1, 0)]
    return ways


def _times(moments: Sequence[WrittenMoment]) -> tuple[TimesNs, str] | None:
    """Return the times of moments, and what was assumed; None if whole seconds are all they have and too few."""
    seconds = np.array([moment.second for moment in moments], dtype=np.int64)
    open_tails = [moment.tail for moment in moments if not moment.exact]
    if not open_tails:
        return np.array([moment.time for moment in moments], dtype=np.int64), ""
    tails = np.array([int(moment.tail[:9] or 0) for moment in moments], dtype=np.int64)
    lengths = {len(tail) for tail in open_tails}
    if _counts(seconds, tails):
        return _spread(seconds, tails)
    decimal = seconds * NS_PER_S + [int(moment.tail[:9].ljust(9, "0")) for moment in moments]
    if len(lengths) == 1 and lengths <= set(_FRACTIONS):
        return decimal, ""
    if len(lengths) == 1:
        length = next(iter(lengths))
        return decimal, f"{length} digits follow the second ({open_tails[0]}); read as a decimal fraction of it"
    digits = next(length for length in _FRACTIONS if length >= max(lengths))
    unit = {3: "milliseconds", 6: "microseconds", 9: "nanoseconds"}[digits]
    whole = seconds * NS_PER_S + tails * 10 ** (9 - digits)
    if _jitter(decimal) < _jitter(whole):
        return (
            decimal,
            "one to nine digits follow the second; read as a decimal fraction of it, which gives the steadiest rate",
        )
    return whole, f"numbers of different lengths follow the second; read as {unit}, which gives the steadiest rate"


def _counts(seconds: np.ndarray, tails: np.ndarray) -> bool:
    """Return whether the digits after the second count files: steps of one within a second, or through all of them."""
    order = np.lexsort((tails, seconds))
    seconds, tails = seconds[order], tails[order]
    steps = np.diff(tails)
    within = steps[np.diff(seconds) == 0]
    if len(within) and np.median(within) == 1:
        return True
    return len(steps) > 1 and bool((steps > 0).all()) and float(np.median(steps)) <= 10 and len(within) == 0


def _spread(seconds: np.ndarray, tails: np.ndarray) -> tuple[TimesNs, str] | None:
    """Spread files evenly over the second their names give; None if there is only one second, or too many files in it."""
    _, counts = np.unique(seconds, return_counts=True)
    if len(counts) < 2 or counts.max() > _MOST_PER_SECOND:
        return None
    usual = int(np.median(counts[1:-1])) if len(counts) > 2 else int(counts.max())
    times = np.zeros(len(seconds), dtype=np.int64)
    for second in np.unique(seconds):
        mine = np.flatnonzero(seconds == second)
        mine = mine[np.argsort(tails[mine], kind="stable")]
        whole = max(len(mine), usual if second in (seconds.min(), seconds.max()) else 0)
        first = whole - len(mine) if second == seconds.min() else 0  # the recording begins within the first second
        times[mine] = second * NS_PER_S + (2 * (first + np.arange(len(mine))) + 1) * NS_PER_S // (2 * whole)
    return times, "the names give whole seconds and a number; the files of a second are spread evenly over it"


def _jitter(times_ns: TimesNs) -> float:
    steps = np.diff(np.sort(times_ns))
    if not len(steps):
        return 0.0
    middle = float(np.median(steps))
    return float(np.mean(np.abs(steps - middle))) / max(middle, 1.0)


def _number_outside(stem: str, moment: WrittenMoment) -> int | None:
    """Return the number of a file beside its time: the last group of digits; None if there is none."""
    rest = f"{stem[: moment.span[0]]} {stem[moment.span[1] :]}"
    groups = re.findall(r"\d{1,9}", rest)
    return int(groups[-1]) if groups else None


def _disorder(times_ns: TimesNs, numbers: Sequence[int | None]) -> int:
    """Count the steps in time at which the files' own numbers run backwards; 0 if the files are not numbered."""
    if len(numbers) < 3 or any(number is None for number in numbers) or len(set(numbers)) < len(numbers):
        return 0
    ordered = np.array(numbers, dtype=np.int64)[np.argsort(times_ns, kind="stable")]
    return int(np.count_nonzero(np.diff(ordered) < 0))
