"""Pairing: each click and the radar scans around it give one pair, or a reason why there is none.

Choices: where a person said which return a click belongs to, its pair has that return and no other.

Novelty: what appears with a placement and leaves with it is the reflector; what stands there at other times is background.
The windows of the other clicks show the scene without this placement. Where more of the recording is given, windows without
any click show it too, which helps most while there are few clicks.

Companions: an object that stands behind the reflector at every placement, such as the cart that carries it. It appears and
leaves with the reflector, and it may echo more, so neither amplitude nor novelty tells which of the two was clicked. Both get
nearly the same score, and the geometry of all pairs decides. The nearer one is preferred a little: what stands in front of a
reflector hides it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from calib_core.arrays import Flags, Indices, Points3, Values, Vector3, freeze
from calib_core.association.alternatives import alternative_rows
from calib_core.association.clustering import (
    CLUSTER_SCALE,
    Cluster,
    candidates_of,
    cluster_at,
    cluster_scale,
    clusters_of,
    clusters_wanted,
    nearest_cluster,
    window_around,
)
from calib_core.association.gating import static_returns
from calib_core.association.placement_groups import linked_clicks
from calib_core.measurements import NS_PER_S, Candidate, Pair, RadarScans, ReflectorClick, TimeNs, Unpaired
from calib_core.options import CalibrationOptions, LocatingOptions, NoiseOptions
from calib_core.radar import direction_cosines, polar_from_cartesian


class RadarSource(Protocol):
    """Where radar scans come from: the part of a recording that pairing needs."""

    def radar_scans_around(self, times: Sequence[TimeNs], half_window_s: float, /) -> RadarScans:
        """Return the scans within the half window of any of the times, each once, in order of time."""


@dataclass(frozen=True, slots=True)
class Pairing:
    """The clicks with and without a radar position, in order of image time.

    Attributes:
        pairs: clicks with at least one radar position.
        unpaired: the others, each with its reason.
    """

    pairs: tuple[Pair, ...]
    unpaired: tuple[Unpaired, ...]


def scans_around(source: RadarSource, clicks: Sequence[ReflectorClick], options: CalibrationOptions) -> RadarScans:
    """Read the scans that can matter to some clicks.

    Raises:
        CalibrationError: the recording cannot be read at the clicks.
    """
    return source.radar_scans_around(sorted({click.image_time for click in clicks}), half_window_s(options))


def half_window_s(options: CalibrationOptions) -> float:
    """Return how far from a click radar scans can matter [s].

    A window is centred on a scan up to `max_time_gap_s` away; the paper's may begin at a whole second instead.
    """
    longest_s = max(options.locating.window_s, options.paper.window_s)
    return longest_s / 2 + options.locating.max_time_gap_s + 1.0


def pair_clicks(
    clicks: Sequence[ReflectorClick],
    scans: RadarScans,
    options: CalibrationOptions,
    *,
    background: RadarScans | None = None,
) -> Pairing:
    """Pair every click with the candidate positions in the window around the nearest scan (paper section III).

    Excluded and untouched clicks are paired too; the caller keeps them out of the solution. Untouched ones leave the pairs
    of the others as they are.

    Args:
        clicks: in any order; they are sorted by time, then id.
        scans: at least those around the clicks; more of them change nothing.
        options: gating, window and assumed noise.
        background: scans of the same recording, such as all of it: what they show far from every click stood there before
            and after. It helps most while there are fewer than four clicks.
    """
    measured = [click for click in clicks if click.mark != "untouched"]
    pairing = _pairing(measured, scans, options, background)
    if len(measured) == len(clicks):
        return pairing
    every = _pairing(clicks, scans, options, background)
    untouched = {click.id for click in clicks if click.mark == "untouched"}
    pairs = [*pairing.pairs, *(pair for pair in every.pairs if pair.id in untouched)]
    unpaired = [*pairing.unpaired, *(one for one in every.unpaired if one.id in untouched)]
    rank = {click.id: index for index, click in enumerate(sorted(clicks))}
    return Pairing(
        tuple(sorted(pairs, key=lambda pair: rank[pair.id])), tuple(sorted(unpaired, key=lambda one: rank[one.id]))
    )


def _pairing(
    clicks: Sequence[ReflectorClick], scans: RadarScans, options: CalibrationOptions, background: RadarScans | None
) -> Pairing:
    """Pair clicks that may all influence one another."""
    static = static_returns(scans, options.gating)
    reachable: list[ReflectorClick] = []
    unpaired: list[Unpaired] = []
    for click in with_shared_choices(sorted(clicks), options):
        problem = _gap_problem(click, static, options.locating.max_time_gap_s)
        if problem is None:
            reachable.append(click)
        else:
            unpaired.append(problem)
    windows = [window_around(static, click.image_time, window_s=options.locating.window_s) for click in reachable]
    elsewhere: tuple[RadarScans, ...] = ()
    if background is not None:
        still = static_returns(background, options.gating)
        elsewhere = background_windows(still, windows, window_s=options.locating.window_s)
    pairs, empty = _paired(reachable, windows, static, elsewhere, options)
    shared = _windows_of_placements(reachable, windows, pairs, static, options)
    if shared is not windows:
        pairs, empty = _paired(reachable, shared, static, elsewhere, options)
    unpaired += [_without_return(click, window, options) for click, window in empty]
    rank = {click.id: index for index, click in enumerate(sorted(clicks))}
    return Pairing(balanced_pairs(pairs), tuple(sorted(unpaired, key=lambda one: rank[one.id])))


def _paired(
    clicks: Sequence[ReflectorClick],
    windows: Sequence[RadarScans],
    static: RadarScans,
    elsewhere: Sequence[RadarScans],
    options: CalibrationOptions,
) -> tuple[list[Pair], list[tuple[ReflectorClick, RadarScans]]]:
    """Make the pairs of clicks and their windows; also return the clicks whose window is empty."""
    distinct = list({id(window): window for window in windows}.values())  # clicks of one placement share a window
    most, scale = clusters_wanted(options.locating, distinct), cluster_scale(distinct)
    clusters, background = (
        [clusters_of(window, most=most, scale=scale) for window in some] for some in (distinct, elsewhere)
    )
    scores = scores_of(distinct, clusters, scale=scale, background=background)
    row = {id(window): i for i, window in enumerate(distinct)}
    pairs, empty = [], []
    for click, window in zip(clicks, windows, strict=True):
        found = clusters[row[id(window)]]
        candidates = candidates_of(found, scores[row[id(window)]], options.locating, options.noise) if found else ()
        set_aside: tuple[Candidate, ...] = ()
        if click.chosen is not None:
            at = np.array(click.chosen.position_m)
            fixed = chosen_candidate(at, window, found, scale=scale, locating=options.locating, noise=options.noise)
            set_aside, candidates = candidates, () if fixed is None else (fixed,)
        if not candidates:
            empty.append((click, window))
            continue
        pairs.append(
            Pair(
                id=click.id,
                pixel_px=np.array([click.u_px, click.v_px]),
                candidates=candidates,
                sigma_px=click.sigma_px,
                image_time=click.image_time,
                radar_time=TimeNs(int(static.times_ns[static.nearest(click.image_time)])),
                mark=click.mark,
                chosen=click.chosen,
                set_aside=set_aside,
            )
        )
    return pairs, empty


def _windows_of_placements(
    clicks: Sequence[ReflectorClick],
    windows: list[RadarScans],
    pairs: Sequence[Pair],
    static: RadarScans,
    options: CalibrationOptions,
) -> list[RadarScans]:
    """Give the clicks of one placement the scans of all their windows; the same list if each has a placement of its own."""
    excluded = {click.id for click in clicks if not click.counts}
    used = [pair for pair in pairs if pair.id not in excluded]
    groups = [rows for rows in linked_clicks(used, options) if len(rows) > 1]
    if not groups:
        return windows
    row = {click.id: i for i, click in enumerate(clicks)}
    shared = list(windows)
    for rows in groups:
        members = [row[used[i].id] for i in rows]
        pooled = _union([windows[i] for i in members], static)
        for i in members:
            shared[i] = pooled
    return shared


def _union(windows: Sequence[RadarScans], static: RadarScans) -> RadarScans:
    """Collect the scans that lie in any of some windows, each once."""
    inside = np.zeros(len(static), dtype=np.bool_)
    for window in windows:
        inside |= (static.times_ns >= window.times_ns[0]) & (static.times_ns <= window.times_ns[-1])
    return RadarScans.from_scans([static.scan(i) for i in np.flatnonzero(inside).tolist()])


def _gap_problem(click: ReflectorClick, scans: RadarScans, max_gap_s: float) -> Unpaired | None:
    if not len(scans):
        return Unpaired("no-scan", {}, id=click.id)
    gap_s = abs(click.image_time - int(scans.times_ns[scans.nearest(click.image_time)])) / NS_PER_S
    if gap_s <= max_gap_s:
        return None
    return Unpaired("no-scan", {"gap_s": gap_s, "allowed_s": max_gap_s}, id=click.id)


def _without_return(click: ReflectorClick, window: RadarScans, options: CalibrationOptions) -> Unpaired:
    return _nothing_static(click, window, options) if click.chosen is None else no_chosen_return(click)


def _nothing_static(click: ReflectorClick, window: RadarScans, options: CalibrationOptions) -> Unpaired:
    gate = options.gating
    window_facts = {"scans": len(window), "within_s": options.locating.window_s}
    if not np.isfinite(window.points_radar_m).all(axis=1).any():
        return Unpaired("no-static-return", window_facts, id=click.id)
    return Unpaired(
        "no-static-return",
        {
            **window_facts,
            "fastest_mps": gate.max_speed_mps,
            "nearest_m": gate.min_range_m,
            "farthest_m": gate.max_range_m,
        },
        id=click.id,
    )


CHOICE_GONE = "chosen-return-missing"
_REACH = 8.0  # standard deviations of a click, from one click of a placement to another


def with_shared_choices(clicks: Sequence[ReflectorClick], options: CalibrationOptions) -> list[ReflectorClick]:
    """Give the other clicks of a placement the return that was chosen for one of them.

    Clicks at one pixel whose windows overlap are clicks of one placement; one with a choice of its own keeps it.

    Args:
        clicks: in any order; the result has the same.
        options: window and assumed click noise.
    """
    chosen = [click for click in clicks if click.chosen is not None]
    if not chosen:
        return list(clicks)
    times = np.array([click.image_time for click in chosen], dtype=np.int64)
    pixels = np.array([(click.u_px, click.v_px) for click in chosen])
    shared = []
    for click in clicks:
        if click.chosen is None:
            sigma_px = options.noise.sigma_px if click.sigma_px is None else click.sigma_px
            apart_ns = np.abs(times - click.image_time)
            near = (np.hypot(*(pixels - (click.u_px, click.v_px)).T) <= _REACH * sigma_px) & (
                apart_ns <= options.locating.window_s * NS_PER_S
            )
            if near.any():
                click = replace(click, chosen=chosen[int(np.where(near, apart_ns, apart_ns.max() + 1).argmin())].chosen)
        shared.append(click)
    return shared


def chosen_candidate(
    position_radar_m: Vector3,
    window: RadarScans,
    clusters: Sequence[Cluster],
    *,
    scale: Vector3,
    locating: LocatingOptions,
    noise: NoiseOptions,
) -> Candidate | None:
    """Return the candidate at a chosen position (3,) [m], with a score of 1; None if the window has no return there.

    Args:
        position_radar_m: as the radar reports it.
        window: the static returns around the click.
        clusters: of that window.
        scale: (3,) one step of distance in range [m], u and w.
        locating: how clusters become candidates.
        noise: the assumed noise.
    """
    cluster = nearest_cluster(clusters, position_radar_m, scale=scale) or cluster_at(
        window, position_radar_m, scale=scale
    )
    if cluster is None:
        return None
    score: Values = np.ones(1)
    alone = replace(cluster, alternative_of=-1)
    return candidates_of((alone,), score, locating, noise)[0]


def no_chosen_return(click: ReflectorClick) -> Unpaired:
    """Say that the return chosen for a click is not there."""
    position = np.zeros(3) if click.chosen is None else np.array(click.chosen.position_m)
    range_m, azimuth, _ = polar_from_cartesian(position[None])[0]
    return Unpaired(CHOICE_GONE, {"range_m": float(range_m), "azimuth_deg": float(np.rad2deg(azimuth))}, id=click.id)


_LEAST_SCORE = 0.05  # relative to the best of the pair
_LEAST_PAIRS = 4  # with one offset: fewer share one by chance (a choice)
_LEAST_SHARE = 0.6  # of the pairs
_SAME_OFFSET_M = 0.25  # a choice: a few range bins wide, and less than the least offset
_LEAST_OFFSET_M, _MOST_OFFSET_M = 0.3, 4.0  # a choice: nearer ones are the reflector's own, farther ones no cart
_MOST_ASIDE = 4.0  # steps in u: behind the reflector, not next to it
_NEARER = 1.5  # how much more plausible the nearer one is, in each pair


@dataclass(frozen=True, slots=True, eq=False)
class Companion:
    """Two returns that stand at the same distance from each other in most pairs.

    Attributes:
        offset_m: range of the farther one minus that of the nearer one.
        near: (n,) the nearer candidate of each pair; -1 where the two were not found.
        far: (n,) the farther one.
    """

    offset_m: float
    near: Indices
    far: Indices

    def __post_init__(self) -> None:
        freeze(self, np.int64, near=(len(self.near),), far=(len(self.near),))


@dataclass(frozen=True, slots=True)
class _Offset:
    """The range from a nearer candidate to a farther one of the same pair."""

    offset_m: float
    near: int
    far: int


def find_companion(pairs: Sequence[Pair]) -> Companion | None:
    """Find the offset in range at which most pairs have a second plausible candidate; None if there is none.

    Args:
        pairs: with all their candidates, as the radar gave them or as a calibration kept them.
    """
    found = [_offsets(pair.candidates) for pair in pairs]
    offsets = np.array([one.offset_m for own in found for one in own])
    owner = np.array([i for i, own in enumerate(found) for _ in own], dtype=np.int64)
    if not len(offsets):
        return None
    close = np.abs(offsets[:, None] - offsets) <= _SAME_OFFSET_M
    counts = [len(np.unique(owner[row])) for row in close]
    most = int(np.argmax(counts))
    if counts[most] < max(_LEAST_PAIRS, _LEAST_SHARE * len(pairs)):
        return None
    offset_m = float(np.median(offsets[close[most]]))
    near, far = np.full(len(pairs), -1), np.full(len(pairs), -1)
    for i, own in enumerate(found):
        best = min(own, key=lambda one: abs(one.offset_m - offset_m), default=None)
        if best is not None and abs(best.offset_m - offset_m) <= _SAME_OFFSET_M:
            near[i], far[i] = best.near, best.far
    return Companion(offset_m, near, far)


def _offsets(candidates: Sequence[Candidate]) -> list[_Offset]:
    """Return the offsets between the best candidate and every other plausible one behind or in front of it."""
    cosines = direction_cosines(np.array([candidate.position_radar_m for candidate in candidates]))
    scores = np.array([candidate.score for candidate in candidates])
    best = int(np.argmax(scores))
    rows = []
    for k in np.flatnonzero(scores >= _LEAST_SCORE * scores[best]).tolist():
        behind_m, aside = cosines[k, :2] - cosines[best, :2]
        if _LEAST_OFFSET_M <= abs(behind_m) <= _MOST_OFFSET_M and abs(aside) <= _MOST_ASIDE * CLUSTER_SCALE[1]:
            near, far = (best, k) if behind_m > 0 else (k, best)
            rows.append(_Offset(abs(float(behind_m)), near, far))
    return rows


def balanced_pairs(pairs: Sequence[Pair]) -> tuple[Pair, ...]:
    """Give the reflector and its companion, if there is one, nearly the same score in every pair.

    Args:
        pairs: one per click; the scores of the two keep their sum.
    """
    companion = find_companion(pairs)
    if companion is None:
        return tuple(pairs)
    return tuple(
        pair if near < 0 else replace(pair, candidates=_balanced(pair.candidates, near, far))
        for pair, near, far in zip(pairs, companion.near.tolist(), companion.far.tolist(), strict=True)
    )


def _balanced(candidates: tuple[Candidate, ...], near: int, far: int) -> tuple[Candidate, ...]:
    """Divide the scores of two candidates between them; the alternatives of each share what it gets as before."""
    alternatives = alternative_rows([candidate.alternative_of for candidate in candidates])
    both = sum(candidates[k].score for k in {*alternatives[near].tolist(), *alternatives[far].tolist()})
    scores: dict[int, float] = {}
    for k, share in ((far, 1.0 / (1.0 + _NEARER)), (near, _NEARER / (1.0 + _NEARER))):
        rows = alternatives[k].tolist()
        own = sum(candidates[row].score for row in rows)
        scores |= {row: both * share * candidates[row].score / own for row in rows}
    balanced = [replace(candidate, score=scores.get(k, candidate.score)) for k, candidate in enumerate(candidates)]
    return tuple(sorted(balanced, key=lambda one: -one.score))


_SAME_PLACE = 1.5  # steps within which a cluster of another window is the same object
_FLOOR = 1e-6  # least factor on a score: 16 windows or more that all show a place count alike
_LISTED_FIRST = 3.0  # how much likelier the position that the radar lists first is than another of the same return
_PSEUDO_EMPTY = 0.5  # windows, so that a few windows that all show a place do not rule it out
_MOST_BACKGROUND = 16  # number of windows without clicks: clustering more takes longer (a choice)
_LEAST_SCANS = 2


def background_windows(static: RadarScans, windows: Sequence[RadarScans], *, window_s: float) -> tuple[RadarScans, ...]:
    """Cut windows from the parts of a recording that are clear of every click by a window's length.

    At most 16 are taken, spread evenly; around the clicks alone there are none.

    Args:
        static: the static returns of all given scans.
        windows: those of the clicks.
        window_s: their length [s].
    """
    if not len(static) or not windows:
        return ()
    length_ns = round(window_s * NS_PER_S)
    starts = np.arange(int(static.times_ns[0]), int(static.times_ns[-1]) - length_ns + 1, length_ns)
    clear = np.ones(len(starts), dtype=np.bool_)
    for window in windows:
        near = starts + 2 * length_ns > window.times_ns[0]
        clear &= ~(near & (starts < window.times_ns[-1] + length_ns))
    shown = np.searchsorted(static.times_ns, starts + length_ns) - np.searchsorted(static.times_ns, starts)
    free = starts[clear & (shown >= _LEAST_SCANS)]
    chosen = free[np.linspace(0, len(free) - 1, min(len(free), _MOST_BACKGROUND)).round().astype(np.int64)]
    return tuple(static.between(TimeNs(start), TimeNs(start + length_ns - 1)) for start in chosen.tolist())


def scores_of(
    windows: Sequence[RadarScans],
    clusters: Sequence[tuple[Cluster, ...]],
    *,
    scale: Vector3 = CLUSTER_SCALE,
    background: Sequence[tuple[Cluster, ...]] = (),
) -> tuple[Values, ...]:
    """Score every cluster of every window: amplitude x persistence x novelty, (k,) per window, each summing to 1.

    Novelty is the share of the other windows in which the place is empty. Windows that overlap show the same placement and
    are not compared. What has alternatives was there before only if all of them were, and they share its score, of which the
    one that the radar lists first gets most.

    Args:
        windows: those of the clicks.
        clusters: of each window.
        scale: (3,) one step of distance in range [m], u and w.
        background: the clusters of windows without clicks.
    """
    everything = (*clusters, *background)
    places = np.array([cluster.centre for own in everything for cluster in own]).reshape(-1, 3) / scale
    persistence = np.array([cluster.persistence for own in everything for cluster in own])
    first = np.concatenate([[0], np.cumsum([len(own) for own in everything])]).astype(np.int64)
    spans = np.array([(window.times_ns[0], window.times_ns[-1]) for window in windows], dtype=np.int64).reshape(-1, 2)
    scores = []
    for i, own in enumerate(clusters):
        others = np.ones(len(everything), dtype=np.bool_)
        others[: len(windows)] = (spans[:, 0] > spans[i, 1]) | (spans[:, 1] < spans[i, 0])
        plain = np.array([cluster.amplitude * cluster.persistence**2 for cluster in own])
        alternatives = alternative_rows([cluster.alternative_of for cluster in own])
        score = plain * _novelty(places[first[i] : first[i + 1]], places, persistence, first, others, alternatives)
        likely = np.array([1.0 + (_LISTED_FIRST - 1.0) * cluster.listed_first for cluster in own])
        score *= likely / np.array([likely[rows].sum() for rows in alternatives])
        scores.append(score / score.sum() if len(score) else score)
    return tuple(scores)


def _novelty(
    own: Points3,
    places: Points3,
    persistence: Values,
    first: Indices,
    others: Flags,
    alternatives: Sequence[Indices],
) -> Values:
    """Return the novelty (k,) of each place of one window, 1 if no other window shows it.

    Args:
        own: (k, 3) in steps.
        places: (n, 3) of all windows, concatenated.
        persistence: (n,).
        first: (m + 1,) window j owns the rows first[j] to first[j + 1].
        others: (m,) the windows to compare with.
        alternatives: for each of the k places, the rows of its alternatives, its own included.
    """
    if not len(own) or not others.any():
        return np.ones(len(own))
    filled = np.flatnonzero(np.diff(first) > 0)
    squared = sum(
        ((mine[:, None] - theirs) ** 2 for mine, theirs in zip(own.T, places.T, strict=True)), start=np.zeros(1)
    )
    seen = np.maximum.reduceat((squared <= _SAME_PLACE**2) * persistence, first[filled], axis=1)
    if any(len(rows) > 1 for rows in alternatives):
        seen = np.array([seen[rows].min(axis=0) for rows in alternatives])
    empty = others.sum() - seen[:, others[filled]].sum(axis=1)
    share = (np.maximum(empty, 0.0) + _PSEUDO_EMPTY) / (others.sum() + _PSEUDO_EMPTY)
    # a choice of the power: what is seen in half of the other windows loses a factor of 16
    return np.asarray(np.maximum(share**4, _FLOOR))
