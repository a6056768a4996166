"""Clustering: the static returns around one click are grouped into a few candidate positions.

The radar's errors are about constant in range and in the direction cosines u = y / r, w = z / r, so clusters are formed
in these coordinates. A window is never averaged as a whole: an object near the reflector would pull the mean off both.
Averaging within a cluster does not reduce the errors of angle bins, clutter and calibration; hence the noise floor.

The scale of a cluster is how far apart two returns of one object may lie, from the scatter that a recording shows. An object
that stands still is reported in nearly every scan, so the nearest return of the next scan is most often the same object. The
differences between two such returns show the scatter of a single one, whatever the radar and the scene. Where positions lie
on the radar's bins, an object between two bins alternates between them, which the median does not show.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from calib_core.arrays import Flags, Points3, Values, Vector3, freeze
from calib_core.association.alternatives import cluster_alternatives, first_rows, return_keys
from calib_core.measurements import NS_PER_S, Candidate, RadarScans, TimeNs
from calib_core.options import LocatingOptions, NoiseOptions
from calib_core.radar import covariance_from_sigma_polar, direction_cosines, sigma_polar_of

CLUSTER_SCALE = np.array([0.06, np.deg2rad(1.2), np.deg2rad(2.5)])
"""The least step of distance in range [m], u and w: about a range bin, an angle bin, and an elevation error.

`cluster_scale` finds the step of a radar that scatters more.
"""

_REACH = 2.0  # steps from a cluster's centre to its farthest member
_NEIGHBOURS = 1.5  # steps between cells whose masses add up
_MEAN_SHIFTS = 3  # steps toward the mean of what is near: a choice, as each takes all returns
_MOST_CELLS = 400  # number of cells, of which all distances are taken: the lightest are left out to save time
_CLUSTERS_PER_CANDIDATE = 3  # number of clusters scored for each candidate kept: a choice; more take longer
_LEAST_RELATIVE_SCORE = 0.001  # share of the best one's score; less plausible ones only take time (a choice)
_KEPT_SHARE = 0.99  # of the score of a window
_MOST_CACHED = 512  # number of windows, clicked and background: a choice between memory and time


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
        alternative_of: clusters of one window with equal numbers hold alternative positions of the same returns; -1 has no
            alternative.
        listed_first: share of the members that the radar lists first among their alternatives.
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
    alternative_of: int = -1
    listed_first: float = 1.0

    def __post_init__(self) -> None:
        freeze(self, centre=(3,), scatter=(3,), message_sigma=(3,))


def window_around(scans: RadarScans, time: TimeNs, *, window_s: float) -> RadarScans:
    """Cut the window of the given length [s] that is centred on the scan nearest to a time (Algorithm 1: 3 s)."""
    centre = int(scans.times_ns[scans.nearest(time)])
    half_ns = round(window_s * NS_PER_S / 2)
    return scans.between(TimeNs(centre - half_ns), TimeNs(centre + half_ns))


@dataclass(frozen=True, slots=True, eq=False)
class _WindowKey:
    """A window that equals any other of the same content: the key of what is found in it again after each click."""

    window: RadarScans
    digest: bytes

    @classmethod
    def of(cls, window: RadarScans) -> "_WindowKey":
        content = hashlib.blake2b()
        columns = (window.first_return, window.points_radar_m, window.snr_db, window.sigma_polar, window.alternative_of)
        for column in columns:
            if column is not None:
                content.update(np.ascontiguousarray(column).data)
        return cls(window, content.digest())

    def __hash__(self) -> int:
        return hash(self.digest)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _WindowKey) and self.digest == other.digest


def clusters_of(window: RadarScans, *, most: int, scale: Vector3 = CLUSTER_SCALE) -> tuple[Cluster, ...]:
    """Find the clusters of a window, the densest first.

    Results are cached, because the solve after each click looks at all windows again.

    Args:
        window: the static returns around one click.
        most: largest number of clusters.
        scale: (3,) one step of distance in range [m], u and w.
    """
    if not len(window.points_radar_m):
        return ()
    return _found_clusters(_WindowKey.of(window), most, tuple(scale.tolist()))


@lru_cache(maxsize=_MOST_CACHED)
def _found_clusters(key: _WindowKey, most: int, scale: tuple[float, ...]) -> tuple[Cluster, ...]:
    window, step = key.window, np.array(scale)
    steps = direction_cosines(window.points_radar_m) / step
    amplitude = _amplitudes(window.snr_db)
    free = np.ones(len(steps), dtype=bool)
    cells, mass = _cells(steps, amplitude)
    neighbours = ((cells[:, None] - cells[None]) ** 2).sum(axis=2) <= _NEIGHBOURS**2
    clusters: list[Cluster] = []
    cluster_of = np.full(len(steps), -1)
    while len(clusters) < most and mass.any():
        densest = int(np.argmax(np.where(mass > 0, neighbours @ mass, 0.0)))
        around = neighbours[densest] * mass
        centre = _mean_shifted(around @ cells / around.sum(), steps, np.where(free, amplitude, 0.0))
        members = free & _are_near(steps, centre, _REACH)
        mass = np.where(_are_near(cells, centre, _REACH), 0.0, mass)
        mass[densest] = 0.0
        if members.any():
            free &= ~members
            cluster_of[members] = len(clusters)
            clusters.append(_cluster(window, steps, amplitude, members, step))
    if window.alternative_of is None:
        return tuple(clusters)
    alternatives = cluster_alternatives(window, cluster_of, len(clusters))
    inside, first = cluster_of >= 0, first_rows(return_keys(window))
    listed = np.bincount(cluster_of[inside & first], minlength=len(clusters)) / np.bincount(cluster_of[inside])
    labels = zip(clusters, alternatives.tolist(), listed.tolist(), strict=True)
    return tuple(replace(own, alternative_of=of, listed_first=share) for own, of, share in labels)


def nearest_cluster(clusters: Sequence[Cluster], position_radar_m: Vector3, *, scale: Vector3) -> Cluster | None:
    """Return the cluster at a position (3,) [m]; None if there is none within its reach.

    Args:
        clusters: of one window.
        position_radar_m: in the radar frame.
        scale: (3,) one step of distance in range [m], u and w.
    """
    ahead = [cluster for cluster in clusters if cluster.forward * position_radar_m[0] >= 0]
    if not ahead:
        return None
    away = (np.array([one.centre for one in ahead]) - direction_cosines(position_radar_m[None])) / scale
    squared = (away**2).sum(axis=1)
    return ahead[int(squared.argmin())] if squared.min() <= _REACH**2 else None


def cluster_at(window: RadarScans, position_radar_m: Vector3, *, scale: Vector3) -> Cluster | None:
    """Make a cluster of the returns at a position (3,) [m]; None if there are none.

    Args:
        window: the static returns around one click.
        position_radar_m: in the radar frame.
        scale: (3,) one step of distance in range [m], u and w.
    """
    steps = direction_cosines(window.points_radar_m) / scale
    at = direction_cosines(position_radar_m[None])[0] / scale
    members = _are_near(steps, at, _REACH) & (window.points_radar_m[:, 0] * position_radar_m[0] >= 0)
    return _cluster(window, steps, _amplitudes(window.snr_db), members, scale) if members.any() else None


def _amplitudes(snr_db: Values) -> Values:
    """Return amplitudes relative to the strongest return; all equal if the radar reports no SNR."""
    if not np.isfinite(snr_db).any():
        return np.ones(len(snr_db))
    known = np.where(np.isfinite(snr_db), snr_db, np.nanmedian(snr_db))
    # 20 dB are a factor of 10 in amplitude; the weakest returns count as 60 dB below the strongest
    return np.asarray(10.0 ** np.clip((known - known.max()) / 20.0, -3.0, 0.0))


def _cells(steps: Points3, amplitude: Values) -> tuple[Points3, Values]:
    """Bin returns into cells of one step: mean position (k, 3) and mass (k,) of the heaviest cells."""
    _, cell = np.unique(np.floor(steps).astype(np.int64), axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    mass = np.bincount(cell, amplitude)
    means = np.stack([np.bincount(cell, amplitude * axis) for axis in steps.T], axis=1) / mass[:, None]
    heaviest = np.sort(np.argsort(-mass, kind="stable")[:_MOST_CELLS])
    return means[heaviest], mass[heaviest]


def _are_near(steps: Points3, centre: Vector3, reach: float) -> Flags:
    away = steps - centre
    return np.asarray(np.einsum("ij,ij->i", away, away) <= reach**2)


def _mean_shifted(centre: Vector3, steps: Points3, weight: Values) -> Vector3:
    for _ in range(_MEAN_SHIFTS):
        inside = np.where(_are_near(steps, centre, _REACH), weight, 0.0)
        if inside.sum() > 0:
            centre = inside @ steps / inside.sum()
    return centre


def _cluster(window: RadarScans, steps: Points3, amplitude: Values, members: Flags, scale: Vector3) -> Cluster:
    inside, weight = steps[members], amplitude[members]
    centre = weight @ inside / weight.sum()
    scatter = np.sqrt(weight @ (inside - centre) ** 2 / weight.sum())
    scans = len(np.unique(window.scan_of_return()[members]))
    snr_db, own_sigma = window.snr_db[members], window.sigma_polar[members]
    return Cluster(
        centre=centre * scale,
        forward=1.0 if weight @ window.points_radar_m[members, 0] >= 0 else -1.0,
        scatter=scatter * scale,
        message_sigma=own_sigma.mean(axis=0),  # NaN if any return has none
        amplitude=float(weight.mean()),
        snr_db=float(snr_db.mean()),
        returns=int(members.sum()),
        scans=scans,
        persistence=scans / len(window),
    )


def candidates_of(
    clusters: tuple[Cluster, ...], scores: Values, options: LocatingOptions, noise: NoiseOptions
) -> tuple[Candidate, ...]:
    """Turn the best clusters of one window into candidates, the most plausible first.

    As many are kept as hold nearly all of the score: few where one return stands out, many in a busy scene.
    """
    order = np.argsort(-scores, kind="stable")
    before = np.cumsum(scores[order]) - scores[order]
    kept = (before < _KEPT_SHARE) & (scores[order] >= _LEAST_RELATIVE_SCORE * scores[order[0]])
    chosen = order[kept][: options.max_candidates].tolist()
    positions = np.array([_position(clusters[k]) for k in chosen])
    sigmas = np.array([_sigma_polar(clusters[k], at, noise) for k, at in zip(chosen, positions, strict=True)])
    covariances = covariance_from_sigma_polar(positions, sigmas)
    return tuple(
        Candidate(
            position_radar_m=position,
            sigma_polar=sigma_polar,
            covariance_m2=covariance,
            score=float(scores[k]),
            returns=clusters[k].returns,
            scans=clusters[k].scans,
            snr_db=clusters[k].snr_db,
            alternative_of=clusters[k].alternative_of,
        )
        for k, position, sigma_polar, covariance in zip(chosen, positions, sigmas, covariances, strict=True)
    )


def clusters_wanted(options: LocatingOptions, windows: Sequence[RadarScans]) -> int:
    """Return how many clusters to look for, so that novelty can still reorder them; alternatives count once."""
    alternatives = any(window.alternative_of is not None for window in windows)
    return _CLUSTERS_PER_CANDIDATE * options.max_candidates * (2 if alternatives else 1)


def _position(cluster: Cluster) -> Vector3:
    range_m, u, w = cluster.centre
    x_m = range_m * np.sqrt(max(1.0 - u * u - w * w, 0.0)) * cluster.forward
    return np.array([x_m, range_m * u, range_m * w])


def _sigma_polar(cluster: Cluster, position_radar_m: Vector3, noise: NoiseOptions) -> Vector3:
    """Return the standard deviations of a cluster's mean: what the message or the options state, and its own scatter."""
    floor = np.where(
        np.isfinite(cluster.message_sigma), cluster.message_sigma, floor_sigma_polar(position_radar_m, noise)
    )
    scatter = cluster.scatter / _cosines(position_radar_m) / np.sqrt(cluster.scans)
    return np.asarray(np.hypot(floor, scatter))


def candidate_at(position_radar_m: Vector3, noise: NoiseOptions, *, score: float = 1.0) -> Candidate:
    """Make a candidate of a position alone, with the assumed noise.

    Args:
        position_radar_m: (3,) in the radar frame [m].
        noise: the assumed standard deviations.
        score: plausibility before any pose is known, 0 to 1.
    """
    position = np.asarray(position_radar_m, dtype=np.float64)
    sigma_polar = sigma_polar_of(noise)
    return Candidate(position, sigma_polar, covariance_from_sigma_polar(position, sigma_polar), score)


def floor_sigma_polar(position_radar_m: Vector3, noise: NoiseOptions) -> Vector3:
    """Return the assumed sigma of range [m], azimuth and elevation [rad] of a measured placement.

    The options refer to a placement straight ahead; an array's error is constant in u and w, so to the side it grows as
    1 / cos(azimuth) and 1 / cos(elevation).
    """
    return np.asarray(sigma_polar_of(noise) / _cosines(position_radar_m))


def _cosines(position_radar_m: Vector3) -> Vector3:
    """Return d(range, u, w) / d(range, azimuth, elevation) on the diagonal, at least 0.2."""
    x, y, _ = position_radar_m
    across = float(np.hypot(x, y))
    range_m = max(float(np.linalg.norm(position_radar_m)), 1e-9)  # [m]: at the origin, no division by 0
    # factor of at most 5 on the angles' sigma, about 78 deg off the axis; beyond, 1 / cos grows without limit (a choice)
    return np.asarray(np.maximum([1.0, abs(x) / range_m, across / range_m], 0.2))


_LARGEST = 5.0  # times CLUSTER_SCALE
_STEPS_PER_SIGMA = 1.75  # a cluster reaches two steps, so three and a half standard deviations
_STEPS_PER_BIN = 0.6  # steps, so that a cluster holds two neighbouring bins
_WITHIN = 8.0  # steps from a return to the same object's in the next scan
_MOST_SCANS = 200  # number of scans compared with the next one, of all windows: a median of these is enough (a choice)
_LEAST_SCANS = 4  # scans of each window, where many windows share that number
_LEAST_DIFFERENCES = 30  # number of differences, below which a median is not trusted (a choice)
_MEDIAN_OF_DIFFERENCE = 0.954  # of two normal values, in their standard deviation
_ROUNDING = 0.01  # steps
_LEAST_SPREAD = 0.05  # steps: a radar without elevation shows no scatter there, but rounding
_LEAST_UNCHANGED = 0.2  # share of the differences, for values on a lattice
_LEAST_CHANGES = 10  # number of differences that a bin's width is the lower quartile of (a choice)


def cluster_scale(windows: Sequence[RadarScans]) -> Vector3:
    """Return one step of distance (3,) in range [m], u and w: CLUSTER_SCALE, or more for a radar that scatters more.

    Args:
        windows: the static returns of some parts of a recording, or of all of it.
    """
    most = max(_MOST_SCANS // max(len(windows), 1), _LEAST_SCANS)
    differences = np.concatenate(
        [np.zeros((0, 3)), *(_kept_differences(_WindowKey.of(window), most) for window in windows)]
    )
    if len(differences) < _LEAST_DIFFERENCES:
        return CLUSTER_SCALE
    scatter = np.median(differences, axis=0) / _MEDIAN_OF_DIFFERENCE
    bins = np.array([_bin_width(axis) for axis in differences.T])
    steps = np.maximum(_STEPS_PER_SIGMA * scatter, _STEPS_PER_BIN * bins)
    return np.asarray(CLUSTER_SCALE * np.clip(steps, 1.0, _LARGEST))


def report_spread(scans: RadarScans) -> Vector3 | None:
    """Return how far apart two reports of one return can lie (3,) in range [m], u and w; None if the scans do not show it.

    That is three and a half standard deviations of a single report, or a bin where positions lie on bins.

    Args:
        scans: consecutive ones; what moves between them does not count.
    """
    differences = _differences(scans, _MOST_SCANS)
    if len(differences) < _LEAST_DIFFERENCES:
        return None
    scatter = np.median(differences, axis=0) / _MEDIAN_OF_DIFFERENCE
    bins = np.array([_bin_width(axis) for axis in differences.T])
    return np.asarray(CLUSTER_SCALE * np.maximum(np.maximum(2.0 * _STEPS_PER_SIGMA * scatter, bins), _LEAST_SPREAD))


@lru_cache(maxsize=_MOST_CACHED)
def _kept_differences(key: _WindowKey, most: int) -> Points3:
    return _differences(key.window, most)


def _differences(static: RadarScans, most: int) -> Points3:
    """Return the differences (n, 3), in steps, between returns of neighbouring scans that are each other's nearest.

    Args:
        static: the static returns of some scans.
        most: how many scans to compare with the next one.
    """
    filled = np.flatnonzero(np.diff(static.first_return) > 0)
    earlier = filled[:-1][np.diff(filled) == 1]
    chosen = earlier[np.linspace(0, len(earlier) - 1, min(len(earlier), most)).round().astype(np.int64)]
    steps, first = direction_cosines(static.points_radar_m) / CLUSTER_SCALE, static.first_return
    found = [np.zeros((0, 3))]
    for k in chosen.tolist():
        now, later = steps[first[k] : first[k + 1]], steps[first[k + 1] : first[k + 2]]
        squared = sum(((a[:, None] - b) ** 2 for a, b in zip(now.T, later.T, strict=True)), start=np.zeros(1))
        after = squared.argmin(axis=1)
        here = np.arange(len(now))
        mutual = (squared.argmin(axis=0)[after] == here) & (squared[here, after] <= _WITHIN**2)
        found.append(np.abs(now[mutual] - later[after[mutual]]))
    return np.concatenate(found)


def _bin_width(differences: Values) -> float:
    """Return the width of the radar's bins: the usual smallest change of values that mostly do not change at all; else 0."""
    changed = differences[differences > _ROUNDING]
    unchanged = len(differences) - len(changed)
    if unchanged < _LEAST_UNCHANGED * len(differences) or len(changed) < _LEAST_CHANGES:
        return 0.0
    return float(np.quantile(changed, 0.25))  # quantile: larger changes are of several bins (a choice)
