"""Choices: where a person said which return a click belongs to, its pair has that return and no other."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calib_core.arrays import Values, Vector3
from calib_core.association.clustering import Cluster, candidates_of, cluster_at, nearest_cluster
from calib_core.measurements import NS_PER_S, Candidate, RadarScans, ReflectorClick, Unpaired
from calib_core.options import CalibrationOptions, LocatingOptions, NoiseOptions
from calib_core.radar import polar_from_cartesian

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
    degrees = abs(np.rad2deg(azimuth))
    side = "left" if azimuth > 0 else "right"
    return Unpaired(
        click.id,
        CHOICE_GONE,
        f"the radar has no static return at the chosen position, {range_m:.1f} m away and {degrees:.1f} deg to the {side}",
        "choose another return for this click, or take the choice back",
    )
