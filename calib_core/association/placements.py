"""Placement detection: where and when the reflector stood still, found from the radar alone.

A placement is a strong static return that appears, stays in one place for seconds, and disappears. What is there all the
time is clutter. What appears and disappears together with something stronger is its multipath ghost or what carries it, and
what is much weaker is the person waiting next to it. Two reflectors that stand at the same time are as strong as each other
and are moved in turn. The timeline shows the placements, and the N and P keys step through them.

They are chosen among the dwells (`find_dwells`), the intervals during which a return stays at one place. What is there all the
time is clutter and gives no dwell. The ends of a dwell, at which somebody holds the reflector and its echo is much weaker, are
cut off.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calib_core.arrays import Flags, Indices, Points3, TimesNs, Values, Vector3, freeze
from calib_core.association.alternatives import first_rows, return_keys
from calib_core.association.clustering import CLUSTER_SCALE, cluster_scale
from calib_core.association.gating import static_returns
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.options import GatingOptions
from calib_core.radar import direction_cosines

MOST_STATIC_RETURNS = 1_000_000
"""Limit of one stretch: more than an hour of 25 static returns in each of 10 scans a second; searching it takes about 200 MB."""

_SHORTEST_OVERLAP_S = 0.5
_WEAKER_DB = 10.0  # below the typical placement: a person standing still, or a door that moved
_WEAKER_AT_ONCE_DB = 7.0  # the same while something stronger stands
_SAME_MOMENT_S = 1.2  # between the starts, and between the ends, of dwells that belong together
_SAME_RETURN = 1.5  # reaches, between two simultaneous dwells of one return
_NOT_MOVED = 0.5  # reaches, between the two parts of an interrupted dwell
_LONGEST_BREAK_S = 6.0  # while somebody walks between radar and reflector
_LEAST_SCORE = 0.5  # times that of a good placement of this recording
_GOOD_SHARE = 0.75  # of the placements score less than a good one
_MOST_OF_ECHO = 0.9  # of its time the first echo of a second one is there
_LEAST_COMMON = 0.25  # of the returns of two dwells that are alternatives
_LISTED_LAST = 0.25  # share of a dwell's returns that are listed first, below which another alternative is
_FIRST_IS_RIGHT = 0.78  # probability of what is listed first, where one of them is right: 14 of 18 on real scenes
_MOST_SCANS = 0.75  # of those that show the best alternative: one of two scan types shows half


@dataclass(frozen=True, slots=True, eq=False)
class Dwell:
    """A placement before it is compared with the others.

    Attributes:
        start: first stamp.
        end: last stamp.
        position_radar_m: (3,) median.
        presence: share of its scans that show it.
        presence_outside: share of the other scans that show the same place.
        snr_db: mean of its returns; NaN when unknown.
        fading_db: standard deviation of the strongest in each scan; NaN when unknown.
        strength_db: SNR corrected for range, a measure of the radar cross-section; 0 if unknown.
        reach: (3,) of its returns about their median in range [m], u and w.
        begins: the scans show that it was not there before its start.
        ends: the same after its end.
        keys: (k,) numbers of those returns that have alternatives, which these share; ascending.
        listed_first: share of its returns that the radar lists first among their alternatives.
        first_listed_radar_m: (3,) median of those that are listed first in their place.
        first_listed_span: stamps between which returns are listed first there without a break: other azimuths may take turns.
        others_radar_m: (a, 3) further positions that the same returns may have.
    """

    start: TimeNs
    end: TimeNs
    position_radar_m: Vector3
    presence: float
    presence_outside: float
    snr_db: float
    fading_db: float
    strength_db: float
    reach: Vector3
    begins: bool
    ends: bool
    keys: Indices
    listed_first: float
    first_listed_radar_m: Vector3
    first_listed_span: tuple[TimeNs, TimeNs]
    others_radar_m: Points3 = field(default_factory=lambda: np.zeros((0, 3)))

    def is_alternative_of(self, other: "Dwell") -> bool:
        """Return whether both are the same returns, at positions of which at most one is true."""
        common = len(np.intersect1d(self.keys, other.keys, assume_unique=True))
        return common > _LEAST_COMMON * min(len(self.keys), len(other.keys))

    @property
    def weight(self) -> float:
        """Rank among simultaneous dwells: strength, presence and duration [dB]."""
        lasted_s = (self.end - self.start) / NS_PER_S
        # decibels of a power: the echoes of all scans add up [dB]
        return self.strength_db + float(10.0 * np.log10(self.presence * lasted_s))


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """One dwell of the reflector.

    Attributes:
        start: stamp of the first scan that shows it.
        end: stamp of the last.
        position_radar_m: (3,) median of its returns.
        score: 0 to 1: product of its presence, its novelty and its strength among the placements.
        snr_db: mean of its returns; NaN if the radar reports none.
        fading_db: standard deviation of its echo: small of one surface, 5.6 of many that move (Rayleigh); NaN if unknown.
        others_radar_m: (a, 3) further positions that the same returns may have: the images decide.
        likely: probability of `position_radar_m` among these.
    """

    start: TimeNs
    end: TimeNs
    position_radar_m: Vector3
    score: float
    snr_db: float = float("nan")
    fading_db: float = float("nan")
    others_radar_m: Points3 = field(default_factory=lambda: np.zeros((0, 3)))
    likely: float = 1.0

    def __post_init__(self) -> None:
        freeze(self, position_radar_m=(3,), others_radar_m=(None, 3))

    @property
    def at_each(self) -> tuple["Placement", ...]:
        """This placement at each position that its returns may have, the likeliest first."""
        count = len(self.others_radar_m)
        likely = [_FIRST_IS_RIGHT, *[(1.0 - _FIRST_IS_RIGHT) / count] * count] if count else [1.0]
        positions = (self.position_radar_m, *self.others_radar_m)
        return tuple(
            replace(self, position_radar_m=each, others_radar_m=np.zeros((0, 3)), likely=probability)
            for each, probability in zip(positions, likely, strict=True)
        )


def find_placements(scans: RadarScans, options: GatingOptions, *, min_dwell_s: float = 2.0) -> tuple[Placement, ...]:
    """Find the intervals during which a reflector stood still, sorted by start. They overlap if two stood at once.

    Takes O(n log n) time for n returns.

    Args:
        scans: of a whole recording; novelty is judged against the rest of it. A reflector that stays at one place for
            more than half of the recording is taken for part of the scene, unless the recording has several pieces, such as
            one bag for each placement.
        options: which returns are static and in range.
        min_dwell_s: the shortest placement [s].
    """
    dwells = find_dwells(scans, options, min_dwell_s=min_dwell_s)
    dwells = [dwell for dwell in dwells if not _is_second_echo(dwell, dwells)]
    alone = _one_at_a_time(dwells)
    typical_db = float(np.median([dwell.strength_db for dwell in alone])) if alone else 0.0
    strong = [dwell for dwell in alone if not dwell.strength_db < typical_db - _WEAKER_DB]
    kept = [_likeliest(dwell, dwells) for dwell in (*strong, *_at_once(dwells, strong, typical_db))]
    all_of_them = _without_breaks(kept)
    return _good([_placement(dwell, typical_db) for dwell in sorted(all_of_them, key=lambda dwell: dwell.start)])


def in_stretches(static: Iterable[RadarScans]) -> Iterator[RadarScans]:
    """Join the windows of a recording to search them together; in several pieces if there are too many returns.

    Args:
        static: the static returns of each window, in order of time.
    """
    pieces: list[RadarScans] = []
    for window in static:
        pieces.append(window)
        if sum(len(piece.points_radar_m) for piece in pieces) > MOST_STATIC_RETURNS:
            yield RadarScans.joined(pieces)
            pieces = []
    yield RadarScans.joined(pieces)


def _one_at_a_time(dwells: Sequence[Dwell]) -> list[Dwell]:
    """Keep only the dwell of largest weight among those that overlap in time."""
    kept: list[Dwell] = []
    for dwell in _heaviest_first(dwells):
        if all(_overlap_s(dwell, other) < _SHORTEST_OVERLAP_S for other in kept):
            kept.append(dwell)
    return kept


def _at_once(dwells: Sequence[Dwell], kept: Sequence[Dwell], typical_db: float) -> list[Dwell]:
    """Find the dwells of further reflectors: as strong as the kept ones, elsewhere, and moved at other times."""
    found = list(kept)
    for dwell in _heaviest_first(dwells):
        strong = np.isfinite(dwell.snr_db) and dwell.strength_db >= typical_db - _WEAKER_AT_ONCE_DB
        rivals = [other for other in found if _overlap_s(dwell, other) >= _SHORTEST_OVERLAP_S]
        if (
            strong
            and not any(_belong_together(dwell, other) for other in rivals)
            and not _is_second_echo(dwell, dwells)
        ):
            found.append(dwell)
    return found[len(kept) :]


def _likeliest(dwell: Dwell, dwells: Sequence[Dwell]) -> Dwell:
    """Return a dwell at the alternative that most scans show, else at all of them, the one that the radar lists first in front.

    A radar that measures in two ways, one scan after the other, has other alternatives in each: only the true one is in both.
    The one that is listed first may be no dwell, where clutter hides it at other times.
    """
    if not len(dwell.keys):
        return dwell
    others = [other for other in dwells if _overlap_s(dwell, other) > 0.0 and dwell.is_alternative_of(other)]
    most = max(one.presence for one in (dwell, *others))
    shown = [one for one in (dwell, *others) if one.presence > _MOST_SCANS * most]
    shown.sort(key=lambda one: (-round(one.listed_first), -one.weight))
    if len(shown) <= len(others):
        return shown[0]
    if shown[0].listed_first < _LISTED_LAST:
        best, (start, end) = shown[0], shown[0].first_listed_span
        shown.insert(0, replace(best, position_radar_m=best.first_listed_radar_m, start=start, end=end))
    apart = [one for i, one in enumerate(shown) if not any(_is_near(one, other, _SAME_RETURN) for other in shown[:i])]
    return replace(shown[0], others_radar_m=np.array([one.position_radar_m for one in apart[1:]]).reshape(-1, 3))


def _heaviest_first(dwells: Sequence[Dwell]) -> list[Dwell]:
    return sorted(dwells, key=lambda dwell: (-dwell.weight, dwell.start, dwell.end))


def _overlap_s(dwell: Dwell, other: Dwell) -> float:
    return (min(dwell.end, other.end) - max(dwell.start, other.start)) / NS_PER_S


def _belong_together(dwell: Dwell, other: Dwell) -> bool:
    """Return whether two simultaneous dwells are one return, or come and go together as far as the scans show."""
    together = [
        abs(first - second) < _SAME_MOMENT_S * NS_PER_S
        for first, second, shown in (
            (dwell.start, other.start, dwell.begins or other.begins),
            (dwell.end, other.end, dwell.ends or other.ends),
        )
        if shown
    ]
    one_return = _is_near(dwell, other, _SAME_RETURN) or dwell.is_alternative_of(other)
    return one_return or (bool(together) and all(together))


def _is_second_echo(dwell: Dwell, dwells: Sequence[Dwell]) -> bool:
    """Return whether a stronger echo comes from half as far in the same direction while it lasts: this one went there twice."""
    return any(
        other.snr_db > dwell.snr_db
        and _overlap_s(dwell, other) >= _MOST_OF_ECHO * (dwell.end - dwell.start) / NS_PER_S
        and _is_near(dwell, replace(other, position_radar_m=2.0 * other.position_radar_m), _SAME_RETURN)
        for other in dwells
    )


def _is_near(dwell: Dwell, other: Dwell, reaches: float) -> bool:
    apart = direction_cosines(dwell.position_radar_m) - direction_cosines(other.position_radar_m)
    return bool((np.abs(apart) <= reaches * dwell.reach).all())


def _without_breaks(dwells: Sequence[Dwell]) -> list[Dwell]:
    """Join the dwells of one place that a short break separates; the longest says where it is."""
    joined: list[Dwell] = []
    for dwell in sorted(dwells, key=lambda dwell: (dwell.start, dwell.end)):
        for i, other in enumerate(joined):
            if _is_near(dwell, other, _NOT_MOVED) and -_overlap_s(dwell, other) < _LONGEST_BREAK_S:
                longest = max(dwell, other, key=lambda one: one.end - one.start)
                joined[i] = replace(longest, start=min(dwell.start, other.start), end=TimeNs(max(dwell.end, other.end)))
                break
        else:
            joined.append(dwell)
    return joined


def _good(placements: Sequence[Placement]) -> tuple[Placement, ...]:
    """Leave out the placements that score far below a good one of the same recording."""
    if not placements:
        return ()
    good = float(np.quantile([placement.score for placement in placements], _GOOD_SHARE))
    return tuple(placement for placement in placements if placement.score >= _LEAST_SCORE * good)


def _placement(dwell: Dwell, typical_db: float) -> Placement:
    strength = float(np.clip(1.0 + (dwell.strength_db - typical_db) / (2.0 * _WEAKER_DB), 0.0, 1.0))
    novelty = 1.0 - dwell.presence_outside / dwell.presence
    return Placement(
        start=dwell.start,
        end=dwell.end,
        position_radar_m=dwell.position_radar_m,
        score=dwell.presence * novelty * strength,
        snr_db=dwell.snr_db,
        fading_db=dwell.fading_db,
        others_radar_m=dwell.others_radar_m,
    )


CELL = np.array([0.08, 0.04, 0.08])
"""Size of a cell in range [m], u = y / r and w = z / r: the reflector's returns scatter over a few of them.

It grows with the cluster scale for a radar that scatters more, and so does the reach.
"""

_REACH = np.array([0.07, 0.035, 0.09])  # of a dwell's returns about their median, in the same coordinates
_LARGEST_GAP_S = 0.7  # a longer gap ends a dwell
_SEED_GAP_S = 1.2  # within one cell, because the returns may alternate between neighbouring cells
_SEED_SHARE_OF_DWELL = 0.5
_LEAST_PRESENCE = 0.4  # share of a dwell's scans that show it
_MOST_PRESENCE_OUTSIDE = 0.25  # the same share of the other scans, relative to the dwell's
_MOST_OF_RECORDING = 0.5  # what stays longer is part of the scene, unless a piece of the recording does not show it
_BETWEEN_PIECES_S = 2.0  # without scans: another bag, in which the reflector stands elsewhere
_MARGIN_S = 1.0  # around a dwell, where the reflector is being put down or picked up
_BEFORE_S = (0.5, 1.5)  # before a dwell's start, or after its end: scans there show that it had not begun
_MOST_SEEDS = 4000  # number of runs tried, those in the most scans first: a choice that bounds the time of a search


def find_dwells(scans: RadarScans, options: GatingOptions, *, min_dwell_s: float) -> list["Dwell"]:
    """Find the dwells of a recording; one return may give several that hardly differ. O(n log n) for n returns.

    Args:
        scans: of a whole recording.
        options: which returns are static and in range.
        min_dwell_s: the shortest dwell [s].
    """
    static = static_returns(scans, options)
    grid = _Grid.of(static, cluster_scale([static]) / CLUSTER_SCALE)
    return [dwell for seed in _seeds(grid, min_dwell_s) if (dwell := _dwell_of(grid, seed, min_dwell_s)) is not None]


@dataclass(frozen=True, slots=True, eq=False)
class _Grid:
    """Static returns sorted by cell, and by time within a cell.

    Attributes:
        times_s: (m,) of all scans, from the first.
        times_ns: (m,) the same as stamps.
        cells: (k, 3) the occupied cells in the order of their keys.
        keys: (k,) ascending.
        first: (k + 1,) cell i owns the rows first[i] to first[i + 1].
        scan: (n,) the scan of each row.
        cosines: (n, 3) range [m], u, w.
        points_radar_m: (n, 3).
        snr_db: (n,) NaN where unknown.
        key: (n,) as of `return_keys`.
        listed_first: (n,) as of `first_rows`.
        first_keys: (l,) ascending, of the returns with alternatives that are listed first.
        first_points_radar_m: (l, 3) where these are.
        in_pieces: the scans stop for a while, as between bags.
        cell: (3,) size of a cell.
        reach: (3,) of a dwell's returns about their median.
    """

    times_s: Values
    times_ns: TimesNs
    cells: Indices
    keys: Indices
    first: Indices
    scan: Indices
    cosines: Points3
    points_radar_m: Points3
    snr_db: Values
    key: Indices
    listed_first: Flags
    first_keys: Indices
    first_points_radar_m: Points3
    in_pieces: bool
    cell: Vector3
    reach: Vector3

    @classmethod
    def of(cls, static: RadarScans, growth: Vector3) -> "_Grid":
        """Sort static returns into cells that are larger than the least size by a factor (3,)."""
        cosines = direction_cosines(static.points_radar_m)
        cells = np.floor(cosines / (CELL * growth)).astype(np.int64)
        keys = _keys(cells)
        keys_of_returns = return_keys(static)
        order = np.argsort(keys, kind="stable")
        unique, first = np.unique(keys[order], return_index=True)
        start_ns = static.times_ns[0] if len(static) else 0
        times_s = (static.times_ns - start_ns) / NS_PER_S
        listed_first = first_rows(keys_of_returns)
        firsts = np.flatnonzero(listed_first & (keys_of_returns >= 0))
        firsts = firsts[np.argsort(keys_of_returns[firsts])]
        return cls(
            times_s=times_s,
            times_ns=static.times_ns,
            cells=cells[order][first],
            keys=unique,
            first=np.append(first, len(order)),
            scan=static.scan_of_return()[order],
            cosines=cosines[order],
            points_radar_m=static.points_radar_m[order],
            snr_db=static.snr_db[order],
            key=keys_of_returns[order],
            listed_first=listed_first[order],
            first_keys=keys_of_returns[firsts],
            first_points_radar_m=static.points_radar_m[firsts],
            in_pieces=bool((np.diff(times_s) > _BETWEEN_PIECES_S).any()),
            cell=CELL * growth,
            reach=_REACH * growth,
        )

    def around(self, cell: Indices) -> Indices:
        """Return the rows of a cell and of its 26 neighbours."""
        keys = _keys(cell + _NEIGHBOURS)
        places = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        owned = places[self.keys[places] == keys]
        return np.concatenate([np.arange(self.first[i], self.first[i + 1]) for i in owned.tolist()])


_NEIGHBOURS = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
_CELLS = 64  # number of cells along u or w, which lie in -1 to 1: 51 and 26, and a margin for neighbours


def _keys(cells: Indices) -> Indices:
    return (cells[..., 0] * _CELLS + cells[..., 1] + _CELLS // 2) * _CELLS + cells[..., 2] + _CELLS // 2


@dataclass(frozen=True, slots=True)
class _Seed:
    """A run of returns in one cell: rows first to last of the grid."""

    first: int
    last: int


def _seeds(grid: _Grid, min_dwell_s: float) -> Iterator[_Seed]:
    """Yield the runs that may belong to a placement, those with the most scans first."""
    if not len(grid.scan):
        return
    times_s = grid.times_s[grid.scan]
    breaks = np.diff(times_s) > _SEED_GAP_S
    breaks[grid.first[1:-1] - 1] = True
    start = np.concatenate([[0], np.flatnonzero(breaks) + 1])
    end = np.append(start[1:], len(times_s))
    lasted_s = times_s[end - 1] - times_s[start]
    in_cell = np.diff(grid.first)[np.searchsorted(grid.first, start, side="right") - 1]
    inside = (end - start) / (lasted_s + _MARGIN_S)
    presence_outside = (in_cell - (end - start)) / np.maximum(grid.times_s[-1] - lasted_s, _MARGIN_S)
    likely = (lasted_s >= _SEED_SHARE_OF_DWELL * min_dwell_s) & (
        presence_outside <= 2.0 * _MOST_PRESENCE_OUTSIDE * inside
    )
    rows = np.flatnonzero(likely)
    for i in rows[np.argsort(start[rows] - end[rows], kind="stable")][:_MOST_SEEDS].tolist():
        yield _Seed(int(start[i]), int(end[i]))


def _dwell_of(grid: _Grid, seed: _Seed, min_dwell_s: float) -> Dwell | None:
    """Extend a seed beyond its cell: collect the returns around its median and find when they are present."""
    centre = np.median(grid.cosines[seed.first : seed.last], axis=0)
    rows = grid.around(np.floor(centre / grid.cell).astype(np.int64))
    seed_times_s = grid.times_s[grid.scan[seed.first : seed.last]]
    members = rows[:0]
    span: tuple[int, int] | None = None
    for _ in range(2):  # the second time around the median of the dwell itself
        members = _members(grid, rows, centre)
        span = _span(grid, members, float(np.median(seed_times_s)))
        if span is None:
            return None
        in_span = (grid.scan[members] >= span[0]) & (grid.scan[members] <= span[1])
        centre = np.median(grid.cosines[members[in_span]], axis=0)
    if span is None or grid.times_s[span[1]] - grid.times_s[span[0]] < min_dwell_s:
        return None
    return _checked_dwell(grid, members, span)


def _members(grid: _Grid, rows: Indices, centre: Vector3) -> Indices:
    """Return the rows within reach of direction cosines (3,)."""
    return rows[(np.abs(grid.cosines[rows] - centre) <= grid.reach).all(axis=1)]


def _span(grid: _Grid, members: Indices, within_s: float) -> tuple[int, int] | None:
    """Return the first and last scan of the uninterrupted presence around a time; None if there is none."""
    shown = np.unique(grid.scan[members])
    if not len(shown):
        return None
    nearest = int(np.argmin(np.abs(grid.times_s[shown] - within_s)))
    ends = np.flatnonzero(np.diff(grid.times_s[shown]) > _LARGEST_GAP_S)
    after = int(np.searchsorted(ends, nearest))
    first = int(ends[after - 1]) + 1 if after > 0 else 0
    last = int(ends[after]) if after < len(ends) else len(shown) - 1
    return int(shown[first]), int(shown[last])


def _without_hands(grid: _Grid, members: Indices, span: tuple[int, int]) -> tuple[int, int]:
    """Leave out the scans at both ends of a span in which the reflector was held."""
    strongest_db = np.full(span[1] - span[0] + 1, -np.inf)
    rows = members[
        (grid.scan[members] >= span[0]) & (grid.scan[members] <= span[1]) & np.isfinite(grid.snr_db[members])
    ]
    np.maximum.at(strongest_db, grid.scan[rows] - span[0], grid.snr_db[rows])
    strongest_db[np.isinf(strongest_db)] = np.nan
    firm = firm_span(grid.times_s[span[0] : span[1] + 1], strongest_db)
    return span[0] + firm.first, span[0] + firm.last


def _checked_dwell(grid: _Grid, members: Indices, span: tuple[int, int]) -> Dwell | None:
    """Measure the presence inside and outside a dwell's span; None if the dwell is clutter or chance."""
    span = _without_hands(grid, members, span)
    mine = members[(grid.scan[members] >= span[0]) & (grid.scan[members] <= span[1])]
    snr_db = grid.snr_db[mine]
    known = snr_db[np.isfinite(snr_db)]
    mean_db = float(known.mean()) if len(known) else float("nan")
    presence = float(len(np.unique(grid.scan[mine]))) / (span[1] - span[0] + 1)
    start_s, end_s = grid.times_s[span[0]], grid.times_s[span[1]]
    others = _outside(grid.times_s, start_s, end_s)
    strong_db = float(np.quantile(known, _STRONG_QUANTILE)) if len(known) else float("nan")
    as_strong = members[~(grid.snr_db[members] < strong_db - _WEAKER_DB)]
    shown = np.unique(grid.scan[as_strong])
    presence_outside = float(_outside(grid.times_s[shown], start_s, end_s).sum()) / max(float(others.sum()), 1.0)
    stays = end_s - start_s > _MOST_OF_RECORDING * grid.times_s[-1] and not grid.in_pieces
    if stays or presence < _LEAST_PRESENCE or presence_outside > _MOST_PRESENCE_OUTSIDE * presence:
        return None
    position_radar_m = np.median(grid.points_radar_m[mine], axis=0)
    range_m = float(np.linalg.norm(position_radar_m))
    keys = np.unique(grid.key[mine][grid.key[mine] >= 0])
    first_listed = grid.first_points_radar_m[np.searchsorted(grid.first_keys, keys)]
    first_radar_m = np.median(first_listed, axis=0) if len(keys) else position_radar_m
    first = direction_cosines(first_radar_m)
    at_first = _members(grid, grid.around(np.floor(first / grid.cell).astype(np.int64)), first)
    as_listed = grid.listed_first[at_first] & (grid.key[at_first] >= 0)
    at_first = at_first[as_listed & ~(grid.snr_db[at_first] < strong_db - _WEAKER_DB)]
    first_span = _span(grid, at_first, float(np.median(grid.times_s[grid.scan[mine]]))) or span
    start, end, first_start, first_end = (TimeNs(int(grid.times_ns[scan])) for scan in (*span, *first_span))
    return Dwell(
        start=start,
        end=end,
        position_radar_m=position_radar_m,
        presence=presence,
        presence_outside=presence_outside,
        snr_db=mean_db,
        fading_db=_fading_db(grid.scan[mine], snr_db),
        # radar equation: power falls with the fourth power of the range [dB]; at 0 m it has no logarithm
        strength_db=mean_db + 40.0 * float(np.log10(max(range_m, 1e-3))) if len(known) else 0.0,
        reach=grid.reach,
        begins=_any_within(grid.times_s, start_s - _BEFORE_S[1], start_s - _BEFORE_S[0]),
        ends=_any_within(grid.times_s, end_s + _BEFORE_S[0], end_s + _BEFORE_S[1]),
        keys=keys,
        listed_first=float(grid.listed_first[mine].mean()),
        first_listed_radar_m=first_radar_m,
        first_listed_span=(min(start, first_start), max(end, first_end)),
    )


def _fading_db(scan: Indices, snr_db: Values) -> float:
    """Return how far the strongest echo of each scan scatters; a radar may measure in two ways in turn, each of its own level."""
    known = np.isfinite(snr_db)
    scans, row = np.unique(scan[known], return_inverse=True)
    if len(scans) < _FEW:
        return float("nan")
    strongest_db = np.full(len(scans), -np.inf)
    np.maximum.at(strongest_db, row, snr_db[known])
    in_turn = [strongest_db[scans % 2 == way] for way in (0, 1)]
    return float(np.sqrt(sum(len(own) * own.var() for own in in_turn if len(own)) / len(scans)))


def _outside(times_s: Values, start_s: float, end_s: float) -> Flags:
    return (times_s < start_s - _MARGIN_S) | (times_s > end_s + _MARGIN_S)


def _any_within(times_s: Values, first_s: float, last_s: float) -> bool:
    return bool(np.searchsorted(times_s, first_s) < np.searchsorted(times_s, last_s))


_STRONG_QUANTILE = 0.75
"""Of a dwell's echoes: what is much weaker than these at other times is not the same thing, and hides nothing."""

_OUTSHONE_DB, _WEAKER_SCATTERS = 6.0, 4.0
"""How far below the dwell's median an echo is weak: in decibels at least, and in standard deviations of its echoes."""

_LONGEST_END_S = 1.2
"""What is weak for longer is a dwell whose echo changes, not an end."""

_AT_END_S, _STRONG_SHARE = 0.45, 0.5
"""The last moments, about five scans at 10 Hz, and the share of their scans that is strong, relative to the whole dwell's."""

_FEW = 5
"""Number of scans with an echo of known strength, of fewer than which no median or scatter is taken (a choice)."""


@dataclass(frozen=True, slots=True)
class FirmSpan:
    """The first and last scan in which the reflector stood alone, counted from the first scan given."""

    first: int
    last: int


def firm_span(times_s: Values, snr_db: Values) -> FirmSpan:
    """Leave out weak echoes at both ends of a dwell; nothing is left out where the radar reports no strength.

    Args:
        times_s: (m,) of all scans from the first that shows the dwell to the last, ascending.
        snr_db: (m,) of its strongest return in each; NaN where there is none, or unknown.
    """
    known = snr_db[np.isfinite(snr_db)]
    last = len(times_s) - 1
    if len(known) < _FEW:
        return FirmSpan(0, last)
    median_db = float(np.median(known))
    # standard deviation of normal values over their median absolute deviation
    scatter_db = 1.48 * float(np.median(np.abs(known - median_db)))
    strong = np.nan_to_num(snr_db, nan=-np.inf) >= median_db - max(_OUTSHONE_DB, _WEAKER_SCATTERS * scatter_db)
    first = _first_firm(times_s - times_s[0], strong)
    return FirmSpan(first, last - _first_firm((times_s[-1] - times_s)[::-1], strong[::-1]))


def _first_firm(since_s: Values, strong: Flags) -> int:
    """Return the first strong scan after which as many are strong as usual; 0 if there is none near the end."""
    for row in np.flatnonzero(strong & (since_s <= _LONGEST_END_S)).tolist():
        after = (since_s >= since_s[row]) & (since_s <= since_s[row] + _AT_END_S)
        if strong[after].mean() >= _STRONG_SHARE * strong.mean():
            return int(row)
    return 0
