"""Find the times of files in their names, and decide together what the digits after the second mean."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.measurements import NS_PER_S
from calib_core.recordings.time.written_times import WrittenMoment, epoch_in_name, moments_in

_FRACTIONS = (3, 6, 9)
_MOST_PER_SECOND = 250


@dataclass(frozen=True, slots=True, eq=False)
class NamedTimes:
    """The times in the names of files.

    Attributes:
        places: (n,) which of the names have a time.
        times_ns: (n,) their times.
        zoneless: whether they are dates without a zone.
        assumed: what the digits after the second were taken for, if they do not say it; "" if they do.
        disorder: how many neighbours in time have numbers in their names that run backwards.
    """

    places: tuple[int, ...]
    times_ns: TimesNs
    zoneless: bool = False
    assumed: str = ""
    disorder: int = 0


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
        found = [(place, moment) for place, moment in enumerate(moments) if moment is not None]
        if len(found) > (len(best.places) if best else 0):
            best = _named(stems, found, zone_s) or best
    return best


def _named(stems: Sequence[str], found: Sequence[tuple[int, WrittenMoment]], zone_s: int | None) -> NamedTimes | None:
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
