"""Merge the scans of several topics of one radar: moments, alternatives of one return, and returns that two topics report.

A radar may publish near and far scans in turn, and two azimuths for each return where its antennas cannot tell which is true.
How far apart two reports of one return may lie is measured in each topic (`spread_of`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Indices, TimesNs, Values, Vector3
from calib_core.association.clustering import CLUSTER_SCALE, report_spread
from calib_core.measurements import RETURN_COLUMNS, RadarScans
from calib_core.radar import direction_cosines
from calib_core.recordings.radar.columns import Returns
from calib_core.recordings.radar.layouts import RadarLayout
from calib_core.recordings.radar.scan_stream import RadarStream, ScanBlocks
from calib_core.recordings.topics import Topic

_HALF_STEP_MPS = (0.01, 0.5)  # least and largest half of a Doppler bin
_LEAST_STEPS = 0.01  # of clustering's scale: a stated standard deviation may be 0
_SPAN_M = 1e5  # between the ranges of two scans in one sorted list
_SNR_DB = 3.0
_PER_ROW = 1e-3
_STRETCHES = 3
_SCANS_OF_A_STRETCH = 10


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """How far apart two reports of one return may lie.

    Attributes:
        step: (3,) in range [m], u and w.
        doppler_mps: in speed [m/s].
    """

    step: Vector3
    doppler_mps: float


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Which scans of several topics show the same moment.

    Attributes:
        times_ns: (m,) ascending.
        scan_of: (parts, m) the scan of each topic in each moment; -1 where it has none.
    """

    times_ns: TimesNs
    scan_of: Indices


def spread_of(scans: RadarScans) -> Spread:
    """Measure how far apart two reports of one return lie in some consecutive scans of one topic.

    Where they do not show it, the standard deviations in the messages count, and without these a usual radar's bins.
    """
    scans = scans.take(np.flatnonzero(np.isfinite(scans.points_radar_m).all(axis=1)))
    step = report_spread(scans)
    if step is None:
        sigma = scans.sigma_polar[np.isfinite(scans.sigma_polar).all(axis=1)]
        step = 3.5 * np.median(sigma, axis=0) if len(sigma) else CLUSTER_SCALE
    speeds = np.unique(scans.doppler_mps[np.isfinite(scans.doppler_mps)])
    bin_mps = float(np.quantile(np.diff(speeds), 0.1)) if len(speeds) > 2 else 0.0
    return Spread(np.maximum(step, _LEAST_STEPS * CLUSTER_SCALE), float(np.clip(0.5 * bin_mps, *_HALF_STEP_MPS)) * 2.0)


def moments_of(times: Sequence[TimesNs]) -> Moments:
    """Find the scans of one moment: within half a cycle of the fastest topic, each scan in one moment only.

    Args:
        times: the stamps of each topic, ascending.
    """
    fastest = int(np.argmax([len(own) for own in times]))
    half_ns = 0.5 * float(np.median(np.diff(times[fastest]))) if len(times[fastest]) > 1 else 0.0
    moments = times[fastest]
    places: list[Indices] = []
    for own in times:
        place = _nearest_of(moments, own, half_ns)
        extra = np.flatnonzero(place < 0)
        moments = np.concatenate([moments, own[extra]])
        order = np.argsort(moments, kind="stable")
        rank = np.empty(len(order), dtype=np.int64)
        rank[order] = np.arange(len(order))
        place[extra] = np.arange(len(moments) - len(extra), len(moments))
        places = [rank[before] for before in (*places, place)]
        moments = moments[order]
    scan_of = np.full((len(times), len(moments)), -1, dtype=np.int64)
    for row, place in zip(scan_of, places, strict=True):
        row[place] = np.arange(len(place))
    return Moments(moments, scan_of)


def _nearest_of(moments: TimesNs, times: TimesNs, half_ns: float) -> Indices:
    """Return the moment (n,) nearest to each time within half a cycle; -1 where there is none, or another is nearer."""
    if not len(moments) or not len(times):
        return np.full(len(times), -1, dtype=np.int64)
    after = np.clip(np.searchsorted(moments, times), 1, max(len(moments) - 1, 1))
    before, after = after - 1, np.minimum(after, len(moments) - 1)
    place = np.where(times - moments[before] <= moments[after] - times, before, after).astype(np.int64)
    apart = np.abs(times - moments[place])
    order = np.lexsort((apart, place))
    first = np.concatenate([[True], np.diff(place[order]) > 0])
    kept = np.zeros(len(times), dtype=np.bool_)
    kept[order[first]] = True
    return np.where(kept & (apart <= half_ns), place, -1)


def aligned(scans: RadarScans, numbers: Indices, times_ns: TimesNs) -> RadarScans:
    """Arrange scans in moments: moment i gets scan numbers[i], or none if that is negative.

    Args:
        scans: of one topic.
        numbers: (m,) into scans.
        times_ns: (m,) of the moments.
    """
    counts = np.where(numbers >= 0, np.append(np.diff(scans.first_return), 0)[numbers], 0)
    first = np.concatenate([[0], np.cumsum(counts)])
    rows = np.repeat(scans.first_return[numbers] - first[:-1], counts) + np.arange(first[-1])
    return scans.with_rows(rows, times_ns, first)


def merged(parts: Sequence[RadarScans], spreads: Sequence[Spread], repeats: Sequence[int]) -> RadarScans:
    """Merge the scans of several topics, moment by moment.

    A return that two topics report counts once, as the topic of the finer angles has it.

    Args:
        parts: the scans of each topic, aligned to the same moments.
        spreads: of each topic.
        repeats: for each topic, the one whose returns it repeats at another azimuth; itself if it repeats none.
    """
    own = sorted(set(repeats), key=lambda part: (float(np.prod(spreads[part].step[1:])), part))
    whole = None
    for part in own:
        others = [k for k, of in enumerate(repeats) if of == part and k != part]
        scans = _with_alternatives(parts[part], [parts[k] for k in others], spreads[part]) if others else parts[part]
        if whole is None:
            whole, spread = scans, spreads[part]
            continue
        both = Spread(np.hypot(spread.step, spreads[part].step), max(spread.doppler_mps, spreads[part].doppler_mps))
        whole = _stack_topics(whole, scans.take(np.flatnonzero(~_reported(whole, scans, both))))
    assert whole is not None
    return _renumbered(whole)


def _with_alternatives(first: RadarScans, others: Sequence[RadarScans], spread: Spread) -> RadarScans:
    """Stack the returns of one topic and those of others, which repeat them at other azimuths.

    What has no position, or lies where the first topic has it, is left out.
    """
    parts, labels = [first], [np.full(len(first.points_radar_m), -1, dtype=np.int64)]
    for other in others:
        mine, theirs = matches(first, other, spread, azimuth=False)
        u = [direction_cosines(part.points_radar_m[rows])[:, 1] for part, rows in ((first, mine), (other, theirs))]
        apart = np.abs(u[0] - u[1]) > spread.step[1]
        own = np.full(len(other.points_radar_m), -1, dtype=np.int64)
        own[theirs] = np.where(apart, mine, -2)
        labels[0][mine[apart]] = mine[apart]
        kept = np.flatnonzero((own > -2) & np.isfinite(other.points_radar_m).all(axis=1))
        parts.append(other.take(kept))
        labels.append(own[kept])
    return _stacked(parts, np.concatenate(labels))


def _stack_topics(whole: RadarScans, scans: RadarScans) -> RadarScans:
    """Stack the returns of two topics; the alternatives of the one stay apart from those of the other."""
    if whole.alternative_of is None and scans.alternative_of is None:
        return _stacked([whole, scans], None)
    before, after = (
        np.full(len(part.points_radar_m), -1, dtype=np.int64) if part.alternative_of is None else part.alternative_of
        for part in (whole, scans)
    )
    shifted = np.where(after >= 0, after + int(before.max(initial=-1)) + 1, -1)
    return _stacked([whole, scans], np.concatenate([before, shifted]))


def _reported(whole: RadarScans, scans: RadarScans, spread: Spread) -> Flags:
    """Return which rows (n,) of some scans are a return that others already hold; alternatives share their fate."""
    found = np.zeros(len(scans.points_radar_m), dtype=np.bool_)
    found[matches(whole, scans, spread)[1]] = True
    labels = scans.alternative_of
    if labels is not None:
        found |= (labels >= 0) & np.isin(labels, labels[found & (labels >= 0)])
    return found


def _stacked(parts: Sequence[RadarScans], labels: Indices | None) -> RadarScans:
    """Put the returns of the same moments of several topics together, with their labels as alternatives."""
    order = np.argsort(np.concatenate([part.scan_of_return() for part in parts]), kind="stable")
    columns = {name: np.concatenate([getattr(part, name) for part in parts])[order] for name in RETURN_COLUMNS}
    first = np.sum([part.first_return for part in parts], axis=0)
    alternative_of = None if labels is None else labels[order]
    return RadarScans(times_ns=parts[0].times_ns, first_return=first, alternative_of=alternative_of, **columns)


def _renumbered(scans: RadarScans) -> RadarScans:
    """Number the alternatives of each scan from 0, by their first row; what has lost its alternatives has none."""
    labels = scans.alternative_of
    if labels is None:
        return scans
    _, first, inverse, counts = np.unique(labels, return_index=True, return_inverse=True, return_counts=True)
    real = (labels >= 0) & (counts[inverse] > 1)
    opens = np.zeros(len(labels) + 1, dtype=np.int64)
    opens[1:] = np.cumsum(real & (first[inverse] == np.arange(len(labels))))
    numbers = opens[first[inverse]] - opens[scans.first_return[scans.scan_of_return()]]
    return replace(scans, alternative_of=np.where(real, numbers, -1))


def matches(scans: RadarScans, other: RadarScans, spread: Spread, *, azimuth: bool = True) -> tuple[Indices, Indices]:
    """Find the returns of the same scan that are each other's nearest within the spread: their rows in both.

    Args:
        scans: scans.
        other: the scans of the same moments.
        spread: how far apart two reports of one return may lie.
        azimuth: whether the directions must agree too.
    """
    mine, theirs = _sortable(scans), _sortable(other)
    order = np.argsort(theirs, kind="stable")
    keys = theirs[order]
    low = np.searchsorted(keys, mine - spread.step[0], side="left")
    high = np.searchsorted(keys, mine + spread.step[0], side="right")
    counts = np.where(np.isfinite(mine), high - low, 0)
    a = np.repeat(np.arange(len(mine)), counts)
    b = order[np.repeat(low - np.cumsum(counts) + counts, counts) + np.arange(len(a))]
    apart, inside = _squared_distances(scans, other, a, b, spread, azimuth=azimuth)
    a, b, apart = a[inside], b[inside], apart[inside]
    nearest = _best(a, apart) & _best(b, apart)
    return a[nearest], b[nearest]


def _sortable(scans: RadarScans) -> Values:
    """Return the ranges (n,) with those of later scans larger; NaN for a return without a position."""
    range_m = np.linalg.norm(scans.points_radar_m, axis=1)
    return np.asarray(np.where(range_m < 0.5 * _SPAN_M, range_m + _SPAN_M * scans.scan_of_return(), np.nan))


def _squared_distances(
    scans: RadarScans, other: RadarScans, a: Indices, b: Indices, spread: Spread, *, azimuth: bool
) -> tuple[Values, Flags]:
    """Return the squared distances (k,) of rows, in spreads, and which are within; unknown speeds agree with all."""
    cosines = (
        np.abs(direction_cosines(scans.points_radar_m[a]) - direction_cosines(other.points_radar_m[b])) / spread.step
    )
    speed = np.abs(scans.doppler_mps[a] - other.doppler_mps[b]) / spread.doppler_mps
    inside = ~(speed > 1.0)
    apart = cosines[:, 0] ** 2 + np.where(np.isfinite(speed), speed, 0.0) ** 2
    if azimuth:
        inside &= (cosines[:, 1:] <= 1.0).all(axis=1)
        return apart + (cosines[:, 1:] ** 2).sum(axis=1), inside
    louder = (scans.snr_db[a] - other.snr_db[b]) / _SNR_DB
    rows = (a - scans.first_return[scans.scan_of_return()[a]]) - (b - other.first_return[other.scan_of_return()[b]])
    return apart + np.where(np.isfinite(louder), louder, 0.0) ** 2 + _PER_ROW * rows**2, inside


def _best(rows: Indices, apart: Values) -> Flags:
    """Return which entries (k,) are the nearest of their row; of equals, the first."""
    order = np.lexsort((apart, rows))
    best = np.zeros(len(rows), dtype=np.bool_)
    best[order[np.flatnonzero(np.diff(rows[order], prepend=-1) > 0)]] = True
    return best


class MergedStream(ScanBlocks):
    """The scans of several topics of one radar, moment by moment, with the same face as the stream of one topic.

    Args:
        parts: the streams of the topics, the most useful first.
        repeats: for each topic, the one whose returns it repeats at another azimuth; itself if it repeats none.
    """

    def __init__(self, parts: Sequence[RadarStream], repeats: Sequence[int]) -> None:
        self.parts: tuple[RadarStream, ...] = tuple(parts)
        self.topic: Topic = parts[0].topic
        self.layout: RadarLayout = parts[0].layout
        self._repeats = tuple(repeats)
        moments = moments_of([part.times_ns for part in parts])
        self._scan_of = moments.scan_of
        self._spreads: tuple[Spread, ...] = tuple(map(measured_spread, parts))
        super().__init__(moments.times_ns)

    @property
    def other_azimuths(self) -> tuple[str, ...]:
        """The topics, or the columns of a topic, that hold other azimuths of the returns of another topic."""
        found = []
        for index, part in enumerate(self.parts):
            column = part.layout.plan.azimuth_from
            if self._repeats[index] != index:
                found.append(part.topic.name if column is None else f"{column} of {part.topic.name}")
        return tuple(found)

    @property
    def most_together(self) -> int:
        """The largest number of scans to decode at once."""
        return min(part.most_together for part in self.parts)

    def decoded(self, scans: np.ndarray) -> RadarScans:
        """Decode the moments with the given numbers, ascending, without caching."""
        return merged([self._aligned(part, scans) for part in range(len(self.parts))], self._spreads, self._repeats)

    def _aligned(self, part: int, moments: np.ndarray) -> RadarScans:
        numbers = self._scan_of[part][moments]
        wanted = np.unique(numbers[numbers >= 0])
        places = np.where(numbers >= 0, np.searchsorted(wanted, numbers), -1)
        return aligned(self.parts[part].decoded(wanted), places, self.times_ns[moments])

    def claims(self, count: int) -> Returns:
        """Decode ranges and angles as given by the first topic; see RadarStream."""
        return self.parts[0].claims(count)


def measured_spread(stream: RadarStream) -> Spread:
    """Measure how far apart two reports of one return lie, in a few stretches of consecutive scans."""
    first = np.linspace(0, max(len(stream.times_ns) - _SCANS_OF_A_STRETCH, 0), _STRETCHES).astype(np.int64)
    wanted = np.unique((first[:, None] + np.arange(_SCANS_OF_A_STRETCH)).ravel())
    return spread_of(stream.decoded(wanted[wanted < len(stream.times_ns)]))
