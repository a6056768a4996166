"""Placement groups: clicks of one placement share one radar error, so together they are one pair.

Two clicks belong to one placement if they mark the same pixel and the radar reports the reflector at the same place, at
times near to each other. The camera stands still, so a reflector that does not move keeps its pixel. Counted one by one,
such clicks would make the stated uncertainty too small, and each would be predicted from its own copies.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, Points3, Values
from calib_core.association.alternatives import joined_labels
from calib_core.association.clustering import CLUSTER_SCALE
from calib_core.measurements import NS_PER_S, Candidate, Pair
from calib_core.options import CalibrationOptions
from calib_core.radar import covariance_from_sigma_polar, direction_cosines, polar_from_cartesian

SHARED_SIGMA_PX = 1.0
"""Standard deviation per axis of what all clicks of one placement have in common: the lens, the reflector's look [px]."""

_REACH = 8.0  # standard deviations of a click, from one click of a placement to another
_ONE_MARK = 3.0  # standard deviations of a click, between two clicks of one frame that mark the same point
_MOST_OFF = 3.0  # standard deviations from the placement's median
_NEAR_WINDOWS = 4.0  # windows between two clicks of one dwell
_SAME_DWELL = 0.5  # steps between the positions of one dwell in two windows that do not overlap
_SAME_RETURN = 1.0  # the same in windows that overlap
_SAME_POSITION = 0.1  # standard deviations between two copies of one radar position
_LEAST_DIFFERENCES = 6  # between clicks of one placement, to estimate their noise
_MEDIAN_OF_CHI2 = 1.386  # with two degrees of freedom


@dataclass(frozen=True, slots=True, eq=False)
class PlacementGroup:
    """The clicks of one placement and the pair that they make.

    Attributes:
        pair: of all of them; its id is the first click's. A single click's pair is unchanged.
        clicks: the pairs of the clicks, as given.
        off: (n,) clicks too far from the others of the placement, which the pair does not contain.
    """

    pair: Pair
    clicks: tuple[Pair, ...]
    off: Flags


def placement_groups(pairs: Sequence[Pair], options: CalibrationOptions) -> tuple[PlacementGroup, ...]:
    """Group pairs by placement, in the order of each group's first pair.

    Args:
        pairs: one per click.
        options: window and assumed click noise.
    """
    members = linked_clicks(pairs, options)
    if len(members) == len(pairs):
        return tuple(PlacementGroup(pair, (pair,), np.zeros(1, dtype=np.bool_)) for pair in pairs)
    sigma_px = click_sigmas(pairs, options)
    noise = _excess_noise([(_pixels(pairs, rows), sigma_px[rows]) for rows in members if len(rows) > 1])
    return tuple(_group([pairs[i] for i in rows], sigma_px[rows], noise) for rows in members)


def linked_clicks(pairs: Sequence[Pair], options: CalibrationOptions) -> tuple[Indices, ...]:
    """Find the clicks of each placement: ascending indices, in order of the first. O(n log n) unless most pixels coincide."""
    first, second = _near_pixels(pairs, options)
    if len(first):
        same = _same_placement(pairs, first, second, options.locating.window_s)
        same &= ~_two_reflectors(pairs, first, second, options)
        first, second = first[same], second[same]
    root = np.arange(len(pairs))
    for i, j in sorted(zip(first.tolist(), second.tolist(), strict=True)):
        low, high = sorted((int(root[i]), int(root[j])))
        if low != high:
            root[root == high] = low
    order = np.argsort(root, kind="stable")
    return tuple(np.split(order, np.flatnonzero(np.diff(root[order])) + 1)) if len(pairs) else ()


def _pixels(pairs: Sequence[Pair], rows: Indices | None = None) -> Points2:
    chosen = pairs if rows is None else [pairs[i] for i in rows]
    return np.array([pair.pixel_px for pair in chosen]).reshape(-1, 2)


def click_sigmas(pairs: Sequence[Pair], options: CalibrationOptions) -> Values:
    """Return the standard deviation (n,) [px] of each click: its own, or the options'."""
    return np.array([options.noise.sigma_px if pair.sigma_px is None else pair.sigma_px for pair in pairs])


def _near_pixels(pairs: Sequence[Pair], options: CalibrationOptions) -> tuple[Indices, Indices]:
    """Return the indices of all two clicks whose pixels are within reach; a sweep over the columns finds them."""
    pixels, reach_px = _pixels(pairs), _REACH * click_sigmas(pairs, options)
    order = np.argsort(pixels[:, 0], kind="stable")
    pixels, reach_px = pixels[order], reach_px[order]
    found = [np.zeros((0, 2), dtype=np.int64)]
    widest_px = float(reach_px.max(initial=0.0))
    for step in range(1, len(order)):
        right = pixels[step:] - pixels[:-step]
        if not (right[:, 0] <= widest_px).any():
            break
        reach = np.minimum(reach_px[step:], reach_px[:-step])
        near = np.flatnonzero((right**2).sum(axis=1) <= reach**2)
        found.append(np.stack([order[near], order[near + step]], axis=1))
    both = np.sort(np.concatenate(found), axis=1)
    return both[:, 0], both[:, 1]


def _same_placement(pairs: Sequence[Pair], first: Indices, second: Indices, window_s: float) -> Flags:
    """Return which clicks (k,) at one pixel also share the radar's return, by their times and their best candidates."""
    best = np.array([pair.candidates[0].position_radar_m for pair in pairs])
    sigma = np.array([pair.candidates[0].sigma_polar for pair in pairs])
    with np.errstate(invalid="ignore"):  # the paper's candidates have no sigmas
        off = (polar_from_cartesian(best[first]) - polar_from_cartesian(best[second])) / sigma[first]
        copies = (best[first] == best[second]).all(axis=1) | ((off**2).sum(axis=1) <= _SAME_POSITION**2)
    apart_s = _seconds_apart(pairs, first, second)
    places = direction_cosines(best) / CLUSTER_SCALE
    steps = np.linalg.norm(places[first] - places[second], axis=1)
    near = copies | ((steps <= _SAME_DWELL) & (apart_s <= _NEAR_WINDOWS * window_s))
    overlapping = np.flatnonzero(~near & (apart_s <= window_s))
    for k in overlapping.tolist():
        near[k] = _share_return(pairs[first[k]], pairs[second[k]])
    return np.asarray(near)


def _two_reflectors(pairs: Sequence[Pair], first: Indices, second: Indices, options: CalibrationOptions) -> Flags:
    """Return which clicks (k,) are two marks of one frame: whoever sets two marks there sees two reflectors."""
    apart_px = np.linalg.norm(_pixels(pairs)[first] - _pixels(pairs)[second], axis=1)
    sigma_px = click_sigmas(pairs, options)
    in_one_frame = _seconds_apart(pairs, first, second) == 0.0
    return np.asarray(in_one_frame & (apart_px > _ONE_MARK * np.maximum(sigma_px[first], sigma_px[second])))


def _seconds_apart(pairs: Sequence[Pair], first: Indices, second: Indices) -> Values:
    """Return the seconds (k,) between the images of two pairs; infinite if one has no time."""
    times = np.array([pair.image_time or 0 for pair in pairs], dtype=np.int64)
    known = np.array([pair.image_time is not None for pair in pairs])
    apart_s = np.abs(times[first] - times[second]) / NS_PER_S
    return np.where(known[first] & known[second], apart_s, np.inf)


def _share_return(one: Pair, other: Pair) -> bool:
    """Return whether the best candidate of either pair is a candidate of the other."""
    a, b = (steps_of_sigma(pair.candidates) for pair in (one, other))
    nearest = [((places - best) ** 2).sum(axis=1).min() for places, best in ((a, b[0]), (b, a[0]))]
    return bool(min(nearest) <= _SAME_RETURN**2)


def steps_of_sigma(candidates: Sequence[Candidate]) -> Points3:
    """Return the radar positions of candidates (n, 3) in steps of the scale of a cluster: range and direction cosines."""
    return direction_cosines(np.array([candidate.position_radar_m for candidate in candidates])) / CLUSTER_SCALE


def _excess_noise(groups: Sequence[tuple[Points2, Values]]) -> float:
    """Return the factor, at least 1, on the assumed click noise that the differences within placements show."""
    squared: list[float] = []
    for pixels, sigma_px in groups:
        i, j = np.triu_indices(len(pixels), 1)
        squared += (((pixels[i] - pixels[j]) ** 2).sum(axis=1) / (sigma_px[i] ** 2 + sigma_px[j] ** 2)).tolist()
    if len(squared) < _LEAST_DIFFERENCES:
        return 1.0
    return float(max(np.sqrt(np.median(squared) / _MEDIAN_OF_CHI2), 1.0))


def _group(clicks: Sequence[Pair], sigma_px: Values, excess: float) -> PlacementGroup:
    """Make one pair of the clicks of a placement: the mean of those that are not off, and the candidates of all.

    The mean of n clicks has the variance shared^2 + own^2 / n. Two clicks that contradict each other are both kept, and
    their own scatter counts.

    Args:
        clicks: of one placement.
        sigma_px: (n,) assumed standard deviations of the clicks.
        excess: the factor on them that clicks of this person show; it only decides what is too far off.
    """
    if len(clicks) == 1:
        return PlacementGroup(clicks[0], tuple(clicks), np.zeros(1, dtype=np.bool_))
    pixels = _pixels(clicks)
    away_px = np.linalg.norm(pixels - np.median(pixels, axis=0), axis=1)
    off = away_px > _MOST_OFF * excess * sigma_px
    scatter_px2 = 0.0
    if 2 * off.sum() >= len(clicks):  # no majority, so nobody can say which one is wrong
        scatter_px2 = float(((pixels - pixels.mean(axis=0)) ** 2).sum()) / 2.0 / (len(clicks) - 1) / len(clicks)
        off = np.zeros(len(clicks), dtype=np.bool_)
    weight = np.where(off, 0.0, sigma_px**-2.0)
    own_px2 = max(1.0 / float(weight.sum()), scatter_px2)
    single_px = float(np.max(sigma_px[~off]))
    pair = replace(
        clicks[0],
        pixel_px=weight @ pixels / weight.sum(),
        sigma_px=float(np.sqrt(max(min(SHARED_SIGMA_PX**2 + own_px2, single_px**2), own_px2))),
        candidates=_pooled_candidates(clicks),
    )
    return PlacementGroup(pair, tuple(clicks), off)


def _pooled_candidates(clicks: Sequence[Pair]) -> tuple[Candidate, ...]:
    """Average the candidates of several clicks that are the same return; clicks of one pooled window have them in common."""
    if all(_equal(click.candidates, clicks[0].candidates) for click in clicks):
        return clicks[0].candidates
    kept: list[list[Candidate]] = []
    for click in _numbered_apart(clicks):
        known = steps_of_sigma([group[0] for group in kept]) if kept else np.zeros((0, 3))
        for one, place in zip(click.candidates, steps_of_sigma(click.candidates), strict=True):
            apart = ((known - place) ** 2).sum(axis=1)
            if len(apart) and apart.min() <= _SAME_RETURN**2:
                kept[int(apart.argmin())].append(one)
            else:
                kept.append([one])
    labels = _pooled_alternatives(kept)
    pooled = [replace(_averaged(group, len(clicks)), alternative_of=of) for group, of in zip(kept, labels, strict=True)]
    return tuple(sorted(pooled, key=lambda one: -one.score))


def _numbered_apart(clicks: Sequence[Pair]) -> list[Pair]:
    """Give the alternatives of different clicks different numbers."""
    apart, taken = [], 0
    for click in clicks:
        of = [candidate.alternative_of for candidate in click.candidates]
        candidates = [
            replace(candidate, alternative_of=candidate.alternative_of + taken)
            if candidate.alternative_of >= 0
            else candidate
            for candidate in click.candidates
        ]
        apart.append(replace(click, candidates=tuple(candidates)))
        taken += max(of) + 1
    return apart


def _pooled_alternatives(pooled: Sequence[Sequence[Candidate]]) -> list[int]:
    """Number sets of copies of one return: equal numbers are alternatives according to at least one click."""
    numbers = [{copy.alternative_of for copy in copies} - {-1} for copies in pooled]
    linked = np.array([[bool(own & other) for other in numbers] for own in numbers])
    np.fill_diagonal(linked, val=False)
    return joined_labels(linked).tolist()


def _equal(some: Sequence[Candidate], others: Sequence[Candidate]) -> bool:
    return len(some) == len(others) and all(
        one.score == other.score and bool((one.position_radar_m == other.position_radar_m).all())
        for one, other in zip(some, others, strict=True)
    )


def _averaged(copies: Sequence[Candidate], clicks: int) -> Candidate:
    first, score = copies[0], min(sum(copy.score for copy in copies) / clicks, 1.0)
    positions = np.array([copy.position_radar_m for copy in copies])
    if (positions == positions[0]).all():
        return replace(first, score=score)
    position = np.average(positions, axis=0, weights=[copy.scans for copy in copies])
    return replace(
        first,
        position_radar_m=position,
        covariance_m2=covariance_from_sigma_polar(position, first.sigma_polar),
        score=score,
    )
