"""Placement detection: where and when the reflector stood still, found from the radar alone.

A placement is a strong static return that appears, stays in one place for seconds, and disappears. What is there all the
time is clutter. What appears and disappears together with something stronger is its multipath ghost or what carries it, and
what is much weaker is the person waiting next to it. Two reflectors that stand at the same time are as strong as each other
and are moved in turn. The timeline shows the placements, and the N and P keys step through them.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Vector3, frozen_array
from calib_core.association.dwells import Dwell, find_dwells
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


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """One dwell of the reflector.

    Attributes:
        start: stamp of the first scan that shows it.
        end: stamp of the last.
        position_radar_m: (3,) median of its returns.
        score: 0 to 1: product of its presence, its novelty and its strength among the placements.
        snr_db: mean of its returns; NaN if the radar reports none.
    """

    start: TimeNs
    end: TimeNs
    position_radar_m: Vector3
    score: float
    snr_db: float = float("nan")

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_radar_m", frozen_array(self.position_radar_m, (3,)))


def find_placements(scans: RadarScans, options: GatingOptions, *, min_dwell_s: float = 2.0) -> tuple[Placement, ...]:
    """Find the intervals during which a reflector stood still, sorted by start. They overlap if two stood at once.

    Takes O(n log n) time for n returns.

    Args:
        scans: of a whole recording; novelty is judged against the rest of it. A reflector that stays at one place for
            more than half of the recording is taken for part of the scene.
        options: which returns are static and in range.
        min_dwell_s: the shortest placement [s].
    """
    dwells = find_dwells(scans, options, min_dwell_s=min_dwell_s)
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
        if strong and not any(_belong_together(dwell, other) for other in rivals):
            found.append(dwell)
    return found[len(kept) :]


def _likeliest(dwell: Dwell, dwells: Sequence[Dwell]) -> Dwell:
    """Return the alternative of a dwell that the radar lists first in most scans; most dwells have none."""
    if not len(dwell.keys):
        return dwell
    alternatives = [other for other in dwells if _overlap_s(dwell, other) > 0.0 and dwell.is_alternative_of(other)]
    return max([dwell, *alternatives], key=lambda one: (round(one.listed_first), one.weight))


def _heaviest_first(dwells: Sequence[Dwell]) -> list[Dwell]:
    return sorted(dwells, key=lambda dwell: (-dwell.weight, dwell.start, dwell.end))


def _overlap_s(one: Dwell, other: Dwell) -> float:
    return (min(one.end, other.end) - max(one.start, other.start)) / NS_PER_S


def _belong_together(one: Dwell, other: Dwell) -> bool:
    """Return whether two simultaneous dwells are one return, or come and go together as far as the scans show."""
    together = [
        abs(first - second) < _SAME_MOMENT_S * NS_PER_S
        for first, second, shown in (
            (one.start, other.start, one.begins or other.begins),
            (one.end, other.end, one.ends or other.ends),
        )
        if shown
    ]
    one_return = _near(one, other, _SAME_RETURN) or one.is_alternative_of(other)
    return one_return or (bool(together) and all(together))


def _near(one: Dwell, other: Dwell, reaches: float) -> bool:
    apart = direction_cosines(one.position_radar_m) - direction_cosines(other.position_radar_m)
    return bool((np.abs(apart) <= reaches * one.reach).all())


def _without_breaks(dwells: Sequence[Dwell]) -> list[Dwell]:
    """Join the dwells of one place that a short break separates; the longest says where it is."""
    joined: list[Dwell] = []
    for dwell in sorted(dwells, key=lambda dwell: (dwell.start, dwell.end)):
        for i, other in enumerate(joined):
            if _near(dwell, other, _NOT_MOVED) and -_overlap_s(dwell, other) < _LONGEST_BREAK_S:
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
    )
