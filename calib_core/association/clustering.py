"""Clustering: the static returns around one click are grouped into a few candidate positions.

The radar's errors are about constant in range and in the direction cosines u = y / r, w = z / r, so clusters are formed
in these coordinates. A window is never averaged as a whole: an object near the reflector would pull the mean off both.
Averaging within a cluster does not reduce the errors of angle bins, clutter and calibration; hence the noise floor.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from calib_core.arrays import Flags, Indices, Points3, Values, Vector3, frozen_array
from calib_core.measurements import NS_PER_S, Candidate, RadarScans, TimeNs
from calib_core.options import LocatingOptions, NoiseOptions
from calib_core.radar import covariance_from_sigma_polar, direction_cosines

__all__ = ["Cluster", "candidate_at", "candidates_of", "clusters_of", "scores_of", "window_around"]

CLUSTER_SCALE = np.array([0.06, np.deg2rad(1.2), np.deg2rad(2.5)])
"""One step of distance in range [m], u and w: about a range bin, an angle bin, and an elevation error."""

_REACH = 2.0  # steps from a cluster's centre to its farthest member
_SAME_PLACE = 1.5  # steps within which a cluster of another window is the same object
_MEAN_SHIFTS = 3
_MOST_CELLS = 400
_CLUSTERS_PER_CANDIDATE = 4
_NOVELTY_FLOOR = 0.002
_LEAST_RELATIVE_SCORE = 0.001


@dataclass(frozen=True, slots=True, eq=False)
class Cluster:
    """A cluster of returns in one window.

    Attributes:
        centre: (3,) amplitude-weighted mean of (range [m], u, w).
        forward: +1 or -1, the sign of x, which (range, u, w) do not contain.
        scatter: (3,) standard deviation of the members about the centre.
        message_sigma: (3,) mean of the returns' own range [m], azimuth and elevation [rad] sigmas; NaN if they have none.
        amplitude: mean amplitude of the members relative to the strongest return of the window, 0 to 1.
        snr_db: mean SNR of the members; NaN when the radar reports none.
        returns: number of members.
        scans: number of scans they lie in.
        persistence: share of the window's scans they lie in, 0 to 1.
    """

    centre: Vector3
    forward: float
    scatter: Vector3
    message_sigma: Vector3
    amplitude: float
    snr_db: float
    returns: int
    scans: int
    persistence: float

    def __post_init__(self) -> None:
        for name in ("centre", "scatter", "message_sigma"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (3,)))


def window_around(scans: RadarScans, time: TimeNs, *, window_s: float) -> RadarScans:
    """Cut the window of the given length [s] that is centred on the scan nearest to a time (Algorithm 1: 3 s)."""
    centre = int(scans.times_ns[scans.nearest(time)])
    half_ns = round(window_s * NS_PER_S / 2)
    return scans.between(TimeNs(centre - half_ns), TimeNs(centre + half_ns))


@dataclass(frozen=True, slots=True, eq=False)
class _WindowKey:
    """A window that equals any other of the same content: the cache key of `clusters_of`."""

    window: RadarScans
    digest: bytes

    def __hash__(self) -> int:
        return hash(self.digest)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _WindowKey) and self.digest == other.digest


def clusters_of(window: RadarScans, *, most: int) -> tuple[Cluster, ...]:
    """Find the clusters of a window, the densest first.

    Results are cached, because the solve after each click looks at all windows again.

    Args:
        window: the static returns around one click.
        most: largest number of clusters.
    """
    if not len(window.points_radar_m):
        return ()
    content = hashlib.blake2b()
    for column in (window.first_return, window.points_radar_m, window.snr_db, window.sigma_polar):
        content.update(np.ascontiguousarray(column).data)
    return _found_clusters(_WindowKey(window, content.digest()), most)


@lru_cache(maxsize=256)
def _found_clusters(key: _WindowKey, most: int) -> tuple[Cluster, ...]:
    window = key.window
    steps = direction_cosines(window.points_radar_m) / CLUSTER_SCALE
    amplitude = _amplitudes(window.snr_db)
    free = np.ones(len(steps), dtype=bool)
    cells, mass = _cells(steps, amplitude)
    neighbours = ((cells[:, None] - cells[None]) ** 2).sum(axis=2) <= _SAME_PLACE**2
    clusters: list[Cluster] = []
    while len(clusters) < most and mass.any():
        densest = int(np.argmax(np.where(mass > 0, neighbours @ mass, 0.0)))
        around = neighbours[densest] * mass
        centre = _mean_shifted(around @ cells / around.sum(), steps, np.where(free, amplitude, 0.0))
        members = free & _near(steps, centre, _REACH)
        mass = np.where(_near(cells, centre, _REACH), 0.0, mass)
        mass[densest] = 0.0
        if members.any():
            free &= ~members
            clusters.append(_cluster(window, steps, amplitude, members))
    return tuple(clusters)


def _amplitudes(snr_db: Values) -> Values:
    """Return amplitudes relative to the strongest return; all equal if the radar reports no SNR."""
    if not np.isfinite(snr_db).any():
        return np.ones(len(snr_db))
    known = np.where(np.isfinite(snr_db), snr_db, np.nanmedian(snr_db))
    return np.asarray(10.0 ** np.clip((known - known.max()) / 20.0, -3.0, 0.0))


def _cells(steps: Points3, amplitude: Values) -> tuple[Points3, Values]:
    """Bin returns into cells of one step: mean position (k, 3) and mass (k,) of the heaviest cells."""
    _, cell = np.unique(np.floor(steps).astype(np.int64), axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    mass = np.bincount(cell, amplitude)
    means = np.stack([np.bincount(cell, amplitude * axis) for axis in steps.T], axis=1) / mass[:, None]
    heaviest = np.sort(np.argsort(-mass, kind="stable")[:_MOST_CELLS])
    return means[heaviest], mass[heaviest]


def _near(steps: Points3, centre: Vector3, reach: float) -> Flags:
    away = steps - centre
    return np.asarray(np.einsum("ij,ij->i", away, away) <= reach**2)


def _mean_shifted(centre: Vector3, steps: Points3, weight: Values) -> Vector3:
    for _ in range(_MEAN_SHIFTS):
        inside = np.where(_near(steps, centre, _REACH), weight, 0.0)
        if inside.sum() > 0:
            centre = inside @ steps / inside.sum()
    return centre


def _cluster(window: RadarScans, steps: Points3, amplitude: Values, members: Flags) -> Cluster:
    inside, weight = steps[members], amplitude[members]
    centre = weight @ inside / weight.sum()
    scatter = np.sqrt(weight @ (inside - centre) ** 2 / weight.sum())
    scans = len(np.unique(window.scan_of_return()[members]))
    snr_db, own_sigma = window.snr_db[members], window.sigma_polar[members]
    return Cluster(
        centre=centre * CLUSTER_SCALE,
        forward=1.0 if weight @ window.points_radar_m[members, 0] >= 0 else -1.0,
        scatter=scatter * CLUSTER_SCALE,
        message_sigma=own_sigma.mean(axis=0),  # NaN if any return has none
        amplitude=float(weight.mean()),
        snr_db=float(snr_db.mean()),
        returns=int(members.sum()),
        scans=scans,
        persistence=scans / len(window),
    )


def scores_of(windows: Sequence[RadarScans], clusters: Sequence[tuple[Cluster, ...]]) -> tuple[Values, ...]:
    """Score every cluster of every window: amplitude x persistence x novelty, (k,) per window, each summing to 1.

    Novelty is the share of the other windows in which the place is empty; it separates the reflector, which moves, from
    what is always there. Windows that overlap show the same placement and are not compared.
    """
    places = np.array([cluster.centre for own in clusters for cluster in own]).reshape(-1, 3) / CLUSTER_SCALE
    persistence = np.array([cluster.persistence for own in clusters for cluster in own])
    first = np.concatenate([[0], np.cumsum([len(own) for own in clusters])]).astype(np.int64)
    spans = np.array([(window.times_ns[0], window.times_ns[-1]) for window in windows], dtype=np.int64).reshape(-1, 2)
    scores = []
    for i, own in enumerate(clusters):
        others = (spans[:, 0] > spans[i, 1]) | (spans[:, 1] < spans[i, 0])
        plain = np.array([cluster.amplitude * cluster.persistence**2 for cluster in own])
        score = plain * _novelty(places[first[i] : first[i + 1]], places, persistence, first, others)
        scores.append(score / score.sum() if len(score) else score)
    return tuple(scores)


def _novelty(own: Points3, places: Points3, persistence: Values, first: Indices, others: Flags) -> Values:
    """Return the novelty (k,) of each place of one window, 1 if no other window shows it.

    Args:
        own: (k, 3) in steps.
        places: (n, 3) of all windows, concatenated.
        persistence: (n,).
        first: (m + 1,) window j owns the rows first[j] to first[j + 1].
        others: (m,) the windows to compare with.
    """
    if not len(own) or not others.any():
        return np.ones(len(own))
    filled = np.flatnonzero(np.diff(first) > 0)
    same = ((own[:, None] - places[None]) ** 2).sum(axis=2) <= _SAME_PLACE**2
    seen = np.maximum.reduceat(same * persistence, first[filled], axis=1)
    occupied = seen[:, others[filled]].sum(axis=1) / others.sum()
    return np.asarray(np.maximum((1.0 - np.minimum(occupied, 1.0)) ** 4, _NOVELTY_FLOOR))


def candidates_of(
    clusters: tuple[Cluster, ...], scores: Values, options: LocatingOptions, noise: NoiseOptions
) -> tuple[Candidate, ...]:
    """Turn the best clusters of one window into candidates, the most plausible first."""
    order = np.argsort(-scores, kind="stable")[: options.max_candidates]
    return tuple(
        _candidate(clusters[k], float(scores[k]), noise)
        for k in order
        if scores[k] >= _LEAST_RELATIVE_SCORE * scores[order[0]]
    )


def clusters_wanted(options: LocatingOptions) -> int:
    """Return how many clusters to look for, so that novelty can still reorder them."""
    return _CLUSTERS_PER_CANDIDATE * options.max_candidates


def _candidate(cluster: Cluster, score: float, noise: NoiseOptions) -> Candidate:
    range_m, u, w = cluster.centre
    x_m = range_m * np.sqrt(max(1.0 - u * u - w * w, 0.0)) * cluster.forward
    position = np.array([x_m, range_m * u, range_m * w])
    floor = np.where(np.isfinite(cluster.message_sigma), cluster.message_sigma, floor_sigma_polar(position, noise))
    scatter = cluster.scatter / _cosines(position) / np.sqrt(cluster.scans)
    sigma_polar = np.hypot(floor, scatter)
    return Candidate(
        position_radar_m=position,
        sigma_polar=sigma_polar,
        covariance_m2=covariance_from_sigma_polar(position, sigma_polar),
        score=score,
        returns=cluster.returns,
        scans=cluster.scans,
        snr_db=cluster.snr_db,
    )


def candidate_at(position_radar_m: Vector3, noise: NoiseOptions, *, score: float = 1.0) -> Candidate:
    """Make a candidate of a position alone, with the assumed noise.

    Args:
        position_radar_m: (3,) in the radar frame [m].
        noise: the assumed standard deviations.
        score: plausibility before any pose is known, 0 to 1.
    """
    position = np.asarray(position_radar_m, dtype=np.float64)
    sigma_polar = np.array(
        [noise.sigma_range_m, np.deg2rad(noise.sigma_azimuth_deg), np.deg2rad(noise.sigma_elevation_deg)]
    )
    return Candidate(position, sigma_polar, covariance_from_sigma_polar(position, sigma_polar), score)


def floor_sigma_polar(position_radar_m: Vector3, noise: NoiseOptions) -> Vector3:
    """Return the assumed sigma of range [m], azimuth and elevation [rad] of a measured placement.

    The options refer to a placement straight ahead; an array's error is constant in u and w, so to the side it grows as
    1 / cos(azimuth) and 1 / cos(elevation).
    """
    assumed = [noise.sigma_range_m, np.deg2rad(noise.sigma_azimuth_deg), np.deg2rad(noise.sigma_elevation_deg)]
    return np.asarray(np.array(assumed) / _cosines(position_radar_m))


def _cosines(position_radar_m: Vector3) -> Vector3:
    """Return d(range, u, w) / d(range, azimuth, elevation) on the diagonal, at least 0.2."""
    x, y, _ = position_radar_m
    across = float(np.hypot(x, y))
    range_m = max(float(np.linalg.norm(position_radar_m)), 1e-9)
    return np.array([1.0, max(abs(x) / range_m, 0.2), max(across / range_m, 0.2)])
