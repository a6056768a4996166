"""Radar sensors: which topics of a recording are one radar, judged by their returns, frames and times.

A list and a cloud of one sensor hold the same returns, even if only one of them has stamps and a frame. Near and far scans agree
where their ranges overlap. Two azimuths of each return agree in range and speed, and differ in
azimuth. Radars at other places agree in neither: each is a sensor of its own. Topics of one frame whose scans alternate in time
are one radar that switches between two antennas, unless they show the same ranges in other directions.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.measurements import RadarScans
from calib_core.radar import direction_cosines, polar_from_cartesian
from calib_core.recordings.radar.merging import Spread, aligned, matches, measured_spread, moments_of
from calib_core.recordings.radar.scan_stream import RadarStream
from calib_core.recordings.topics import Rhythm

Relation = Literal["same", "alternatives", "ranges", "apart"]
"""Of two topics: the same returns, other azimuths of the same returns, other ranges of one radar, or two radars."""

_SAMPLED_MOMENTS = 80
_SAMPLED_SCANS = 40
_FEWEST = 30  # returns, to judge two topics by
_SAME_SHARE, _ALTERNATIVE_SHARE = 0.9, 0.8
_MOST_BY_CHANCE = 0.5
_SHIFT = 7.0  # spreads in range, to see how many returns match by chance
_TIGHT = 0.1  # spreads: the azimuths of one detection share its range
_AGREE, _CONTRADICT = 0.25, 0.1  # share of the returns in the common region, beyond chance
_CHANCE = 0.03
_FEWEST_SCANS = 10  # of each of two topics that alternate
_IN_TURN, _CLEAR = 0.9, 0.2  # share of the scans; part of a cycle between a scan of the one and the next of the other
_FARTHER = 1.5  # times: near and far scans differ in how far they reach
_STATIC_MPS = 0.1
_LEAST_SPREAD = 0.02  # of the sines of azimuths in a scene
_AHEAD_RAD = np.deg2rad(60.0)
_RANGE_WORDS = ("near", "far", "short", "long", "mid", "medium", "close", "srr", "mrr", "lrr")
_PLACE_WORDS = ("left", "right", "front", "rear", "back", "side", "corner")


@dataclass(frozen=True, slots=True)
class Figures:
    """What a sample of a radar's scans shows.

    Attributes:
        returns_per_scan: median.
        rate_hz: scans per second; None with fewer than two, or if the times are assumed.
        doppler: whether returns have a speed.
        static_share: share of the returns slower than 0.1 m/s; None without Doppler.
        ahead_per_scan: mean number of static returns within 60 deg of straight ahead, where a camera next to it looks.
        nearest_m: range that 2 % of the returns fall below.
        farthest_m: range that 2 % of the returns exceed.
    """

    returns_per_scan: float
    rate_hz: float | None
    doppler: bool
    static_share: float | None
    ahead_per_scan: float
    nearest_m: float
    farthest_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Examined:
    """A radar topic with its figures.

    Attributes:
        stream: of its scans.
        frame: frame_id of its first message; "" if there is none.
        figures: of a sample.
        spread: how far apart two reports of one return lie.
        returns: whether it has returns, not tracked objects, and is no lidar.
        stamped: whether its times are stamps of its messages, not receive times.
    """

    stream: RadarStream
    frame: str
    figures: Figures
    spread: Spread
    returns: bool = True
    stamped: bool = True

    @classmethod
    def of(cls, stream: RadarStream, frame: str = "", *, returns: bool = True, stamped: bool = True) -> "Examined":
        """Examine a topic."""
        return cls(stream, frame, figures_of(stream), measured_spread(stream), returns, stamped)

    @property
    def name(self) -> str:
        """The topic."""
        return self.stream.topic.name


@dataclass(frozen=True, slots=True)
class RadarSensor:
    """A radar and its topics.

    Attributes:
        name: accepted by --radar-topic: the topic, or what the names of its topics have in common.
        topics: the first one has the most returns.
        repeats: for each topic, the place of the one whose returns it repeats at another azimuth; its own place otherwise.
        copies: topics with the same returns, which are not read.
        frame: their frame_id.
        figures: of all its topics together.
    """

    name: str
    topics: tuple[str, ...]
    repeats: tuple[int, ...]
    copies: tuple[str, ...]
    frame: str
    figures: Figures


def figures_of(stream: RadarStream) -> Figures:
    """Measure a sample of scans spread over the recording."""
    scans = stream.sample(_SAMPLED_SCANS)
    polar = polar_from_cartesian(scans.points_radar_m)
    finite = np.isfinite(polar).all(axis=1)
    speeds = scans.doppler_mps[finite]
    known = np.isfinite(speeds)
    slow = ~(np.abs(speeds) > _STATIC_MPS)
    ahead = slow & (np.abs(polar[finite, 1]) <= _AHEAD_RAD)
    nearest_m, farthest_m = np.quantile(polar[finite, 0], [0.02, 0.98]) if finite.any() else (0.0, 0.0)
    return Figures(
        returns_per_scan=float(np.median(np.diff(scans.first_return))) if len(scans) else 0.0,
        rate_hz=Rhythm.of(stream.times_ns).rate_hz if stream.is_timed else None,
        doppler=bool(known.any()),
        static_share=float(slow[known].mean()) if known.any() else None,
        ahead_per_scan=float(ahead.sum() / max(len(scans), 1)),
        nearest_m=float(nearest_m),
        farthest_m=float(farthest_m),
    )


def sensors_of(topics: Sequence[Examined], *, together: bool = False) -> tuple[RadarSensor, ...]:
    """Group topics into radars, in the order given.

    Args:
        topics: the preferred ones first; of several with the same returns the first is read.
        together: whether the user says that they are one radar; otherwise their figures decide.
    """
    related = {(i, j): relation(topics[i], topics[j]) for i, j in combinations(range(len(topics)), 2)}
    copy_of = _copies(len(topics), related) if not together else {}
    kept = [i for i in range(len(topics)) if i not in copy_of]
    groups: list[set[int]] = []
    for i in kept:
        joined = [group for group in groups if together or any(related[j, i] != "apart" for j in group)]
        groups = [group for group in groups if group not in joined] + [{i}.union(*joined)]
    groups.sort(key=min)
    return tuple(_sensor(topics, sorted(group), related, copy_of) for group in groups)


def _copies(count: int, related: dict[tuple[int, int], Relation]) -> dict[int, int]:
    """Return the topics that hold the same returns as an earlier one, and that one."""
    found: dict[int, int] = {}
    for j in range(count):
        same = [i for i in range(j) if i not in found and related[i, j] == "same"]
        if same:
            found[j] = same[0]
    return found


def _sensor(
    topics: Sequence[Examined], group: list[int], related: dict[tuple[int, int], Relation], copy_of: dict[int, int]
) -> RadarSensor:
    order = sorted(
        group, key=lambda i: (-round(topics[i].figures.returns_per_scan), len(topics[i].name), topics[i].name)
    )
    repeats: list[int] = []
    for index, i in enumerate(order):
        first = [
            k for k in range(index) if repeats[k] == k and related[min(order[k], i), max(order[k], i)] == "alternatives"
        ]
        repeats.append(first[0] if first else index)
    names = tuple(topics[i].name for i in order)
    copies = tuple(topics[j].name for j, i in copy_of.items() if i in group)
    own = [topics[i].figures for index, i in enumerate(order) if repeats[index] == index]
    return RadarSensor(sensor_name(names), names, tuple(repeats), copies, topics[order[0]].frame, _all_together(own))


def sensor_name(topics: Sequence[str]) -> str:
    """Return what the names of topics have in common, or all of them if that is nothing or a topic itself."""
    if len(topics) == 1:
        return topics[0]
    common = 0
    while len({name[: common + 1] for name in topics}) == 1 and common < len(topics[0]):
        common += 1
    name = topics[0][:common].rstrip("/_-")
    return ",".join(topics) if len(name) < 2 or name in topics else name


def _all_together(figures: Sequence[Figures]) -> Figures:
    """Return the figures of several topics that show different returns of one radar."""
    if len(figures) == 1:
        return figures[0]
    rates = [figure.rate_hz for figure in figures if figure.rate_hz is not None]
    counts = [figure.returns_per_scan for figure in figures]
    static = [figure.static_share for figure in figures]
    weighed = [share * count for share, count in zip(static, counts, strict=True) if share is not None]
    return Figures(
        returns_per_scan=sum(counts),
        rate_hz=max(rates, default=None),
        doppler=any(figure.doppler for figure in figures),
        static_share=sum(weighed) / max(sum(counts), 1e-9) if weighed else None,
        ahead_per_scan=sum(figure.ahead_per_scan for figure in figures),
        nearest_m=min(figure.nearest_m for figure in figures),
        farthest_m=max(figure.farthest_m for figure in figures),
    )


def relation(examined: Examined, other: Examined) -> Relation:
    """Judge how two topics belong together."""
    elsewhere = _words(examined.name, _PLACE_WORDS) != _words(other.name, _PLACE_WORDS)
    unnamed = examined.frame != other.frame and not (examined.frame and other.frame)
    if (examined.frame != other.frame and not unnamed) or elsewhere or not (examined.returns and other.returns):
        return "apart"
    stamped = examined.stamped == other.stamped
    times = (
        [examined.stream.times_ns, other.stream.times_ns]
        if stamped
        else [examined.stream.receive_ns, other.stream.receive_ns]
    )
    alternating = not unnamed and alternate(*times)
    both = _common_moments((examined.stream, other.stream), times)
    if both is None:
        return "ranges" if alternating else "apart"
    spreads = examined.spread, other.spread
    spread = Spread(np.hypot(spreads[0].step, spreads[1].step), max(spread.doppler_mps for spread in spreads))
    first, second = both
    fewer = min(_count(first), _count(second))
    if alternating:
        return "apart" if _are_turned(examined, other, first, second, spread) else "ranges"
    if fewer < _FEWEST:
        return "apart"
    if len(matches(first, second, spread)[0]) >= _SAME_SHARE * fewer:
        return "same"
    if unnamed:
        return "apart"
    if _are_alternatives(first, second, spread, fewer):
        return "alternatives"
    return "ranges" if _are_ranges(examined, other, first, second, spread) else "apart"


def alternate(times: TimesNs, others: TimesNs) -> bool:
    """Return whether the scans of two topics follow each other in turn, clear of each other in time.

    Args:
        times: (n,) stamps, ascending.
        others: (m,) of the other topic.
    """
    if min(len(times), len(others)) < _FEWEST_SCANS:
        return False
    both = np.concatenate([times, others])
    order = np.argsort(both, kind="stable")
    in_turn = np.diff(order < len(times))
    between = np.diff(both[order])[in_turn]
    cycle_ns = max(float(np.median(np.diff(times))), float(np.median(np.diff(others))))
    return float(in_turn.mean()) >= _IN_TURN and float(np.quantile(between, 0.1)) >= _CLEAR * cycle_ns


def other_azimuths(stream: RadarStream) -> tuple[RadarStream, ...]:
    """Return the same scans at each other azimuth that the messages give for the returns; most messages give none."""
    found = []
    for column in stream.layout.plan.other_azimuths:
        other = stream.at_azimuth(column)
        if _varies(other) and relation(Examined.of(stream), Examined.of(other)) == "alternatives":
            found.append(other)
    return tuple(found)


def _varies(stream: RadarStream) -> bool:
    """Return whether the azimuths of a sample differ as those of a scene do: a constant column holds something else."""
    points = stream.sample(_SAMPLED_SCANS).points_radar_m
    points = points[np.isfinite(points).all(axis=1)]
    return len(points) > 1 and float(np.std(direction_cosines(points)[:, 1])) > _LEAST_SPREAD


def _common_moments(
    streams: tuple[RadarStream, RadarStream], times: Sequence[TimesNs]
) -> tuple[RadarScans, RadarScans] | None:
    """Decode some moments that both show; None if there are none.

    Args:
        streams: of two topics.
        times: (n,) of the scans of each by one clock, ascending.
    """
    if not min(map(len, times)):
        return None
    moments = moments_of(times)
    shown = np.flatnonzero((moments.scan_of >= 0).all(axis=0))
    if not len(shown):
        return None
    chosen = shown[np.unique(np.linspace(0, len(shown) - 1, min(len(shown), _SAMPLED_MOMENTS)).astype(np.int64))]
    scans = []
    for stream, numbers in zip(streams, moments.scan_of[:, chosen], strict=True):
        wanted = np.unique(numbers)
        scans.append(aligned(stream.decoded(wanted), np.searchsorted(wanted, numbers), moments.times_ns[chosen]))
    return scans[0], scans[1]


def _count(scans: RadarScans) -> int:
    return int(np.isfinite(scans.points_radar_m).all(axis=1).sum())


def _are_alternatives(first: RadarScans, second: RadarScans, spread: Spread, fewer: int) -> bool:
    """Return whether nearly every return has a partner of its range and speed, and most of these lie elsewhere."""
    tight = Spread(spread.step * _TIGHT, spread.doppler_mps)
    mine, theirs = matches(first, second, tight, azimuth=False)
    by_chance = len(matches(first, _shifted(second, spread), tight, azimuth=False)[0])
    u, v = (direction_cosines(scans.points_radar_m[rows])[:, 1] for scans, rows in ((first, mine), (second, theirs)))
    elsewhere = float((np.abs(u - v) > spread.step[1]).mean()) if len(mine) else 0.0
    return len(mine) >= _ALTERNATIVE_SHARE * fewer and by_chance <= _MOST_BY_CHANCE * fewer and elsewhere > 0.5


def _shifted(scans: RadarScans, spread: Spread) -> RadarScans:
    """Move all returns away by several spreads, so that they match only by chance."""
    range_m = np.linalg.norm(scans.points_radar_m, axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        points = scans.points_radar_m * (1.0 + _SHIFT * spread.step[0] / range_m)
    return RadarScans(scans.times_ns, scans.first_return, points, scans.doppler_mps, scans.snr_db, scans.sigma_polar)


def _are_ranges(examined: Examined, other: Examined, first: RadarScans, second: RadarScans, spread: Spread) -> bool:
    """Return whether two topics are near and far scans of one radar: they agree where both see, or are named so."""
    named = _words(examined.name, _RANGE_WORDS) != _words(other.name, _RANGE_WORDS)
    far = sorted((examined.figures.farthest_m, other.figures.farthest_m))
    near = sorted((examined.figures.nearest_m, other.figures.nearest_m))
    # one reaches much farther than the other, or begins where the other ends
    complementary = far[1] > _FARTHER * far[0] or (near[1] > _FARTHER * near[0] and far[0] < far[1])
    if not (named or complementary):
        return False
    common = [_in_common(scans, examined.figures, other.figures) for scans in (first, second)]
    if min(map(_count, common)) < _FEWEST:
        return named and complementary
    agree = _agreement(common[0], common[1], spread)
    return agree >= _AGREE or (agree > _CONTRADICT and named and complementary)


def _are_turned(examined: Examined, other: Examined, first: RadarScans, second: RadarScans, spread: Spread) -> bool:
    """Return whether two topics show the same ranges in other directions, as radars of two mountings do."""
    near, far = (_in_common(scans, examined.figures, other.figures) for scans in (first, second))
    if min(_count(near), _count(far)) < _FEWEST:
        return False
    return _agreement(near, far, spread) < _CHANCE and _agreement(near, far, spread, azimuth=False) >= _AGREE


def _agreement(scans: RadarScans, other: RadarScans, spread: Spread, *, azimuth: bool = True) -> float:
    """Return the share of the returns that two topics report alike, beyond chance."""
    by_chance = len(matches(scans, _shifted(other, spread), spread, azimuth=azimuth)[0])
    return (len(matches(scans, other, spread, azimuth=azimuth)[0]) - by_chance) / min(_count(scans), _count(other))


def _in_common(scans: RadarScans, figures: Figures, other: Figures) -> RadarScans:
    """Keep the returns at ranges that both topics show."""
    range_m = np.linalg.norm(scans.points_radar_m, axis=1)
    low, high = max(figures.nearest_m, other.nearest_m), min(figures.farthest_m, other.farthest_m)
    return scans.take(np.flatnonzero((range_m >= low) & (range_m <= high)))


def _words(name: str, words: Sequence[str]) -> frozenset[str]:
    return frozenset(word for word in words if word in name.lower())
