"""Tracking: clusters of moving returns become targets that are followed from scan to scan, without any calibration.

The moving returns of each scan are grouped by distances that are scaled by the radar's noise.
A Kalman filter with constant velocity per target, clusters assigned to all targets at once by the least sum of squared
distances within a gate. A target is born of a cluster that belongs to none, and ends when it is not seen for a while.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from calib_core.arrays import Indices, Points3, TimesNs, Values, freeze
from calib_core.errors import InputError
from calib_core.evaluation.moving_returns import MovingReturns, TargetOptions, moving_returns
from calib_core.measurements import NS_PER_S, RadarScans
from calib_core.radar import cartesian_jacobian, polar_from_cartesian

_REACH = 3.0  # standard deviations between two neighboring returns of one target
_RETURNS_AT_ONCE = 20_000
_SCANS_APART = 4.0  # reaches between two scans, laid out along a fourth axis


@dataclass(frozen=True, slots=True, eq=False)
class TargetClusters:
    """The clusters of all scans, in order of the scans.

    Attributes:
        scans: (c,) index of the scan of each.
        positions_m: (c, 3) mean of its returns.
        covariances_m2: (c, 2, 2) of that position in x and y, as of one return of the target.
        doppler_mps: (c,) mean Doppler speed; NaN without.
        of_return: (n,) the cluster of each return.
    """

    scans: Indices
    positions_m: Points3
    covariances_m2: np.ndarray
    doppler_mps: Values
    of_return: Indices

    def __post_init__(self) -> None:
        count = len(self.scans)
        freeze(self, np.int64, scans=(None,), of_return=(None,))
        freeze(self, positions_m=(count, 3), covariances_m2=(count, 2, 2), doppler_mps=(count,))


def target_clusters(scans: RadarScans, options: TargetOptions) -> TargetClusters:
    """Group the returns of each scan: two belong together if a chain of neighbors connects them.

    Args:
        scans: moving returns only.
        options: the spacing of a target's returns, and the noise where the message gives none.
    """
    polar = polar_from_cartesian(scans.points_radar_m)
    sigma = sigma_polar(scans, options)
    of_return = _labels(scans, polar, sigma, options.spacing_m)
    count = int(of_return.max(initial=-1)) + 1
    sizes = np.bincount(of_return, minlength=count).astype(np.float64)
    positions = np.stack(
        [np.bincount(of_return, weights=axis, minlength=count) for axis in scans.points_radar_m.T], axis=1
    )
    first = np.unique(of_return, return_index=True)[1]
    jacobian = cartesian_jacobian(polar[first])[:, :2] * sigma[first, None, :]
    own_m2 = jacobian @ np.swapaxes(jacobian, 1, 2) + options.spacing_m**2 * np.eye(2)
    doppler = np.bincount(of_return, weights=scans.doppler_mps, minlength=count) / np.maximum(sizes, 1.0)
    return TargetClusters(
        scans.scan_of_return()[first], positions / np.maximum(sizes, 1.0)[:, None], own_m2, doppler, of_return
    )


def sigma_polar(scans: RadarScans, options: TargetOptions) -> Points3:
    """Return the standard deviations (n, 3) of range [m], azimuth and elevation [rad]: those stated, else the usual ones."""
    usual = np.array(
        [options.sigma_range_m, np.deg2rad(options.sigma_azimuth_deg), np.deg2rad(options.sigma_elevation_deg)]
    )
    stated = scans.sigma_polar
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(stated) & (stated > 0), stated, usual)


def _labels(scans: RadarScans, polar: Points3, sigma: Points3, spacing_m: float) -> Indices:
    """Return the cluster (n,) of each return, numbered in order of their first returns."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = len(polar)
    if not n:
        return np.zeros(0, dtype=np.int64)
    found = [np.zeros((0, 2), dtype=np.int64), *_linked(scans, polar, sigma, spacing_m)]
    links = np.concatenate(found)
    graph = coo_array((np.ones(len(links), dtype=np.int8), (links[:, 0], links[:, 1])), shape=(n, n))
    labels = connected_components(graph, directed=False)[1]
    first = np.unique(labels, return_index=True)[1]
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first, kind="stable")] = np.arange(len(first))
    return np.asarray(rank[labels])


def _linked(scans: RadarScans, polar: Points3, sigma: Points3, spacing_m: float) -> Iterator[np.ndarray]:
    """Yield the links (k, 2) between returns of one scan, some thousand returns at a time."""
    from scipy.spatial import cKDTree

    scan = scans.scan_of_return()
    across_m = polar[:, :1] * np.array([0.0, 1.0, 1.0]) + np.array([1.0, 0.0, 0.0])
    sigma_m = sigma * across_m
    cuts = np.searchsorted(scans.first_return, np.arange(0, len(polar) + _RETURNS_AT_ONCE, _RETURNS_AT_ONCE))
    edges = np.unique(scans.first_return[np.minimum(cuts, len(scans))])
    for low, high in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        part = slice(low, high)
        widest_m = _REACH * float(np.sqrt(spacing_m**2 + 2.0 * (sigma_m[part] ** 2).max()))
        apart_m = _SCANS_APART * widest_m * (scan[part] - scan[low])
        tree = cKDTree(np.column_stack([scans.points_radar_m[part], apart_m]))
        near = tree.query_pairs(widest_m, output_type="ndarray").reshape(-1, 2) + low
        i, j = near[:, 0], near[:, 1]
        step = polar[i] - polar[j]
        step[:, 1] = (step[:, 1] + np.pi) % (2.0 * np.pi) - np.pi
        step[:, 1:] *= 0.5 * (polar[i, :1] + polar[j, :1])
        squared = (step**2 / (spacing_m**2 + sigma_m[i] ** 2 + sigma_m[j] ** 2)).sum(axis=1)
        yield near[squared <= _REACH**2]


@dataclass(frozen=True, slots=True, eq=False)
class TargetTrack:
    """A moving target that the radar followed: found from the returns alone, without any calibration.

    Attributes:
        id: unique within a recording, such as "target-3".
        times_ns: (k,) stamps of the scans that saw it, ascending.
        scans: (k,) their indices.
        positions_m: (k, 3) mean of its returns in each.
        rows: (n,) its returns, as rows of the recording's RadarScans, ascending.
        scan_of_row: (n,) index of the scan of each.
        points_radar_m: (n, 3) of its returns, as the radar reports them.
        snr_db: (n,) of its returns; NaN where the radar reports none.
    """

    id: str
    times_ns: TimesNs
    scans: Indices
    positions_m: Points3
    rows: Indices
    scan_of_row: Indices
    points_radar_m: Points3
    snr_db: Values

    def __post_init__(self) -> None:
        sightings, returns = len(self.scans), len(self.rows)
        freeze(self, np.int64, times_ns=(sightings,), scans=(sightings,), rows=(returns,), scan_of_row=(returns,))
        freeze(self, positions_m=(sightings, 3), points_radar_m=(returns, 3), snr_db=(returns,))


_GATE = 14.156413609126675  # the 99.73 % quantile of chi2 with 3 degrees of freedom
_DOPPLER_SIGMA_MPS = 0.7  # of a cluster's mean Doppler speed: limbs and wheels move for themselves
_ACCELERATION_MPS2 = 2.0  # standard deviation of a target's acceleration
_FIRST_SPEED_MPS = 3.0  # standard deviation of a new target's velocity, where Doppler does not tell
_COAST_S = 1.0  # longest time that a target stays alive without being seen
_COAST_SCANS = 3  # or as many scans, if that is longer
_MERGE_S = 0.5  # longest time unseen of a target that merges with another
_LEAST_SIGHTINGS = 3
LONGEST_STEP_S = _COAST_S / _LEAST_SIGHTINGS
"""Time between two scans beyond which a target is given up before it is seen often enough."""
_LEAST_TRAVEL_M = 1.0  # of a target without Doppler speeds
_LEAST_TRAVEL_SIGMAS = 6.0
_TOLD_EVERY = 200  # scans


@dataclass(frozen=True, slots=True, eq=False)
class FoundTargets:
    """The moving targets of a recording.

    Attributes:
        tracks: in order of their first scans.
        moving: the returns that they were found in.
    """

    tracks: tuple[TargetTrack, ...]
    moving: MovingReturns


@dataclass(slots=True, eq=False)
class _Target:
    """A target while it is followed."""

    state: np.ndarray  # x, y [m], their speeds [m/s]
    covariance: np.ndarray
    time_ns: int  # of the state
    seen_ns: int
    clusters: list[int] = field(default_factory=list)
    ended: bool = False


def find_targets(
    windows: Iterable[RadarScans],
    options: TargetOptions | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> FoundTargets:
    """Find and follow the moving targets; the scans may come in pieces, of which only moving returns are kept.

    Args:
        windows: the scans in order of time.
        options: None takes the defaults.
        progress: called with the scans done and their number.

    Raises:
        InputError: the sensors are said to move, but the radar measures no Doppler speeds.
    """
    options = options or TargetOptions()
    moving = moving_returns(windows, options)
    if not moving.by_doppler and options.sensors == "moving" and moving.searched:
        raise InputError(
            "the radar reports no Doppler speeds, so what moves cannot be told from moving sensors; evaluate a recording in "
            "which the sensors stand still, or one with Doppler speeds"
        )
    clusters = target_clusters(moving.scans, options)
    followed = _followed(clusters, moving.scans, progress)
    if not moving.by_doppler:
        followed = [target for target in followed if _travels(target, clusters)]
    order = np.argsort(clusters.of_return, kind="stable")
    ends = np.searchsorted(clusters.of_return[order], np.arange(len(clusters.scans) + 1))
    tracks = tuple(
        _track(f"target-{number}", np.array(target.clusters), clusters, moving, order, ends)
        for number, target in enumerate(followed, start=1)
    )
    return FoundTargets(tracks, moving)


def _followed(
    clusters: TargetClusters, scans: RadarScans, progress: Callable[[int, int], None] | None
) -> list[_Target]:
    """Follow the clusters through the scans; return the targets with enough sightings, in order of their first."""
    ends = np.searchsorted(clusters.scans, np.arange(len(scans) + 1))
    period_ns = float(np.median(np.diff(scans.times_ns))) if len(scans) > 1 else 0.0
    coast_ns = max(_COAST_S * NS_PER_S, _COAST_SCANS * period_ns)
    alive: list[_Target] = []
    born: list[_Target] = []
    for scan, time_ns in enumerate(scans.times_ns.tolist()):
        if progress is not None and scan % _TOLD_EVERY == 0:
            progress(scan, len(scans))
        rows = np.arange(ends[scan], ends[scan + 1])
        if not len(rows):
            continue
        alive = [one for one in alive if not one.ended and time_ns - one.seen_ns <= coast_ns]
        taken = _assign(alive, rows, clusters, time_ns)
        new = [_new(clusters, int(row), time_ns) for row in rows if int(row) not in taken]
        alive += new
        born += new
    return [target for target in born if len(target.clusters) >= _LEAST_SIGHTINGS]


def _assign(alive: list[_Target], rows: Indices, clusters: TargetClusters, time_ns: int) -> set[int]:
    """Predict every target, give each at most one cluster, update it; return the clusters given away."""
    from scipy.optimize import linear_sum_assignment

    if not alive:
        return set()
    for target in alive:
        _predict(target, time_ns)
    states = np.array([target.state[:2] for target in alive])
    covariances = np.array([target.covariance[:2, :2] for target in alive])
    innovations = covariances[:, None] + clusters.covariances_m2[rows][None]
    steps = clusters.positions_m[rows, :2][None] - states[:, None]
    squared = np.einsum("tci,tcij,tcj->tc", steps, np.linalg.inv(innovations), steps)
    squared += _doppler_squared(alive, clusters, rows)
    cost = np.where(squared <= _GATE, squared, 100.0 * _GATE)
    owners = {int(j): int(i) for i, j in zip(*linear_sum_assignment(cost), strict=True) if squared[i, j] <= _GATE}
    given: set[int] = set()
    for j, i in owners.items():
        rivals = [alive[k] for k in np.flatnonzero(squared[:, j] <= _GATE) if k not in owners.values()]
        if _merged(alive[i], rivals, time_ns):
            for target in (alive[i], *rivals):
                target.ended = True
            continue
        _update(alive[i], innovations[i, j], steps[i, j])
        alive[i].clusters.append(int(rows[j]))
        alive[i].seen_ns = time_ns
        given.add(int(rows[j]))
    return given


def _merged(target: _Target, rivals: list[_Target], time_ns: int) -> bool:
    """Return whether targets become one cluster here: afterwards nobody can say which one is which, so they end."""
    known = [rival for rival in rivals if len(rival.clusters) >= _LEAST_SIGHTINGS]
    recent = any(time_ns - one.seen_ns <= _MERGE_S * NS_PER_S for one in known)
    return recent and len(target.clusters) >= _LEAST_SIGHTINGS


def _doppler_squared(alive: list[_Target], clusters: TargetClusters, rows: Indices) -> np.ndarray:
    """Return the squared distance (t, c) of each cluster's Doppler speed from each target's; 0 where unknown."""
    along = clusters.positions_m[rows, :2]
    along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    expected = np.array([target.state[2:] for target in alive]) @ along.T
    velocity_m2 = np.array([target.covariance[2:, 2:] for target in alive])
    variance = np.einsum("ci,tij,cj->tc", along, velocity_m2, along) + _DOPPLER_SIGMA_MPS**2
    return np.asarray(np.nan_to_num((clusters.doppler_mps[rows] - expected) ** 2 / variance))


def _new(clusters: TargetClusters, row: int, time_ns: int) -> _Target:
    """Start a target; Doppler gives its velocity along the line of sight."""
    position = clusters.positions_m[row, :2]
    state, covariance = np.zeros(4), np.zeros((4, 4))
    state[:2], covariance[:2, :2] = position, clusters.covariances_m2[row]
    covariance[2:, 2:] = _FIRST_SPEED_MPS**2 * np.eye(2)
    away_mps, distance_m = float(clusters.doppler_mps[row]), float(np.linalg.norm(position))
    if np.isfinite(away_mps) and distance_m > 0:
        along = position / distance_m
        state[2:] = away_mps * along
        covariance[2:, 2:] -= 0.9 * _FIRST_SPEED_MPS**2 * np.outer(along, along)
    return _Target(state, covariance, time_ns, time_ns, [row])


def _predict(target: _Target, time_ns: int) -> None:
    step_s = (time_ns - target.time_ns) / NS_PER_S
    if step_s <= 0.0:
        return
    transition = np.eye(4)
    transition[0, 2] = transition[1, 3] = step_s
    gain = np.array([[0.5 * step_s**2, 0.0], [0.0, 0.5 * step_s**2], [step_s, 0.0], [0.0, step_s]])
    target.state = transition @ target.state
    target.covariance = transition @ target.covariance @ transition.T + _ACCELERATION_MPS2**2 * gain @ gain.T
    target.time_ns = time_ns


def _update(target: _Target, innovation_m2: np.ndarray, step_m: np.ndarray) -> None:
    gain = np.linalg.solve(innovation_m2, target.covariance[:2]).T
    target.state = target.state + gain @ step_m
    covariance = target.covariance - gain @ target.covariance[:2]
    target.covariance = 0.5 * (covariance + covariance.T)


def _travels(target: _Target, clusters: TargetClusters) -> bool:
    """Return whether a target gets so far from where it is first seen that noise does not explain it."""
    rows = np.array(target.clusters)
    third = max(1, len(rows) // 3)
    start, end = (clusters.positions_m[part, :2].mean(axis=0) for part in (rows[:third], rows[-third:]))
    sigma_m = float(np.sqrt(np.trace(clusters.covariances_m2[rows[0]]) / third))
    return bool(np.linalg.norm(end - start) >= max(_LEAST_TRAVEL_M, _LEAST_TRAVEL_SIGMAS * sigma_m))


def _track(
    name: str, own: Indices, clusters: TargetClusters, moving: MovingReturns, order: Indices, ends: Indices
) -> TargetTrack:
    """Collect the returns of a target's clusters (c,), given all returns in order of their clusters."""
    kept = np.sort(np.concatenate([order[ends[cluster] : ends[cluster + 1]] for cluster in own]))
    scans = clusters.scans[own]
    return TargetTrack(
        id=name,
        times_ns=moving.scans.times_ns[scans],
        scans=scans,
        positions_m=clusters.positions_m[own],
        rows=moving.rows[kept],
        scan_of_row=moving.scans.scan_of_return()[kept],
        points_radar_m=moving.scans.points_radar_m[kept],
        snr_db=moving.scans.snr_db[kept],
    )
