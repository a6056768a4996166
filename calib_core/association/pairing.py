"""Pairing: each click and the radar scans around it give one pair, or a reason why there is none."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from calib_core.association.choices import chosen_candidate, no_chosen_return, with_shared_choices
from calib_core.association.cluster_scale import cluster_scale
from calib_core.association.clustering import candidates_of, clusters_of, clusters_wanted, window_around
from calib_core.association.companions import balanced_pairs
from calib_core.association.gating import static_returns
from calib_core.association.novelty import background_windows, scores_of
from calib_core.association.placement_groups import linked_clicks
from calib_core.measurements import NS_PER_S, Candidate, Pair, RadarScans, ReflectorClick, TimeNs, Unpaired
from calib_core.options import CalibrationOptions


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
    rank = {click.id: place for place, click in enumerate(sorted(clicks))}
    return Pairing(
        tuple(sorted(pairs, key=lambda one: rank[one.id])), tuple(sorted(unpaired, key=lambda one: rank[one.id]))
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
    elsewhere = () if background is None else _elsewhere(background, windows, options)
    pairs, empty = _paired(reachable, windows, static, elsewhere, options)
    shared = _windows_of_placements(reachable, windows, pairs, static, options)
    if shared is not windows:
        pairs, empty = _paired(reachable, shared, static, elsewhere, options)
    unpaired += [_without_return(click, window, options) for click, window in empty]
    rank = {click.id: place for place, click in enumerate(sorted(clicks))}
    return Pairing(balanced_pairs(pairs), tuple(sorted(unpaired, key=lambda one: rank[one.id])))


def _elsewhere(
    background: RadarScans, windows: Sequence[RadarScans], options: CalibrationOptions
) -> tuple[RadarScans, ...]:
    """Cut windows clear of the clicks from the scans of a recording."""
    return background_windows(static_returns(background, options.gating), windows, window_s=options.locating.window_s)


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
        return Unpaired(
            click.id, "no-scan", "the radar recording has no scan", "choose the radar topic that has returns"
        )
    gap_s = abs(click.image_time - int(scans.times_ns[scans.nearest(click.image_time)])) / NS_PER_S
    if gap_s <= max_gap_s:
        return None
    return Unpaired(
        click.id,
        "no-scan",
        f"the nearest radar scan is {gap_s:.2f} s away; at most {max_gap_s:g} s are allowed",
        "click where both recordings overlap, or check that both clocks agree",
    )


def _without_return(click: ReflectorClick, window: RadarScans, options: CalibrationOptions) -> Unpaired:
    return _nothing_static(click, window, options) if click.chosen is None else no_chosen_return(click)


def _nothing_static(click: ReflectorClick, window: RadarScans, options: CalibrationOptions) -> Unpaired:
    gate = options.gating
    return Unpaired(
        click.id,
        "no-static-return",
        f"none of the {len(window)} scans within {options.locating.window_s:g} s has a return slower than "
        f"{gate.max_speed_mps:g} m/s between {gate.min_range_m:g} and {gate.max_range_m:g} m",
        "stand clear of the reflector and let it rest for three seconds, or widen the gates",
    )
