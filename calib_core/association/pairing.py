"""Pairing: each click and the radar scans around it give one pair, or a reason why there is none."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.association.clustering import candidates_of, clusters_of, clusters_wanted, scores_of, window_around
from calib_core.association.gating import static_returns
from calib_core.measurements import NS_PER_S, Pair, RadarScans, ReflectorClick, TimeNs, Unpaired
from calib_core.options import CalibrationOptions

__all__ = ["Pairing", "pair_clicks"]


@dataclass(frozen=True, slots=True)
class Pairing:
    """The clicks with and without a radar position, in order of image time.

    Attributes:
        pairs: clicks with at least one radar position.
        unpaired: the others, each with its reason.
    """

    pairs: tuple[Pair, ...]
    unpaired: tuple[Unpaired, ...]


def pair_clicks(clicks: Sequence[ReflectorClick], scans: RadarScans, options: CalibrationOptions) -> Pairing:
    """Pair every click with the candidate positions in the window around the nearest scan (paper section III).

    Excluded clicks are paired too; the caller keeps them out of the solution.

    Args:
        clicks: in any order; they are sorted by time, then id.
        scans: at least those around the clicks.
        options: gating, window and assumed noise.
    """
    static = static_returns(scans, options.gating)
    reachable: list[ReflectorClick] = []
    unpaired: list[Unpaired] = []
    for click in sorted(clicks):
        problem = _gap_problem(click, static, options.locating.max_time_gap_s)
        if problem is None:
            reachable.append(click)
        else:
            unpaired.append(problem)
    windows = [window_around(static, click.image_time, window_s=options.locating.window_s) for click in reachable]
    clusters = [clusters_of(window, most=clusters_wanted(options.locating)) for window in windows]
    pairs: list[Pair] = []
    for click, window, found, scores in zip(reachable, windows, clusters, scores_of(windows, clusters), strict=True):
        if not found:
            unpaired.append(_nothing_static(click, window, options))
            continue
        pairs.append(
            Pair(
                id=click.id,
                pixel_px=np.array([click.u_px, click.v_px]),
                candidates=candidates_of(found, scores, options.locating, options.noise),
                sigma_px=click.sigma_px,
                image_time=click.image_time,
                radar_time=TimeNs(int(static.times_ns[static.nearest(click.image_time)])),
            )
        )
    rank = {click.id: place for place, click in enumerate(sorted(clicks))}
    return Pairing(tuple(pairs), tuple(sorted(unpaired, key=lambda one: rank[one.id])))


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


def _nothing_static(click: ReflectorClick, window: RadarScans, options: CalibrationOptions) -> Unpaired:
    gate = options.gating
    return Unpaired(
        click.id,
        "no-static-return",
        f"none of the {len(window)} scans within {options.locating.window_s:g} s has a return slower than "
        f"{gate.max_speed_mps:g} m/s between {gate.min_range_m:g} and {gate.max_range_m:g} m",
        "stand clear of the reflector and let it rest for three seconds, or widen the gates",
    )
