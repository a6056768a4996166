"""Novelty: what appears with a placement and leaves with it is the reflector; what stands there at other times is background.

The windows of the other clicks show the scene without this placement. Where more of the recording is given, windows without
any click show it too, which helps most while there are few clicks.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Flags, Indices, Points3, Values, Vector3
from calib_core.association.alternatives import alternative_rows
from calib_core.association.clustering import CLUSTER_SCALE, Cluster
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs

_SAME_PLACE = 1.5  # steps within which a cluster of another window is the same object
_FLOOR = 1e-6
_PSEUDO_EMPTY = 0.5  # windows, so that a few windows that all show a place do not rule it out
_MOST_BACKGROUND = 16
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
    are not compared. What has alternatives was there before only if all of them were, and they share its score.

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
        score /= np.array([len(rows) for rows in alternatives])
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
    return np.asarray(np.maximum(share**4, _FLOOR))
