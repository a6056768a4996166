"""Target clusters: the moving returns of each scan, grouped by distances that are scaled by the radar's noise."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, Points3, Values, frozen_array
from calib_core.evaluation.targets.moving_returns import TargetOptions
from calib_core.measurements import RadarScans
from calib_core.radar import cartesian_jacobian, polar_from_cartesian

_REACH = 3.0  # standard deviations between two neighbouring returns of one target
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
        for name in ("scans", "of_return"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (None,), dtype=np.int64))
        object.__setattr__(self, "positions_m", frozen_array(self.positions_m, (count, 3)))
        object.__setattr__(self, "covariances_m2", frozen_array(self.covariances_m2, (count, 2, 2)))
        object.__setattr__(self, "doppler_mps", frozen_array(self.doppler_mps, (count,)))


def target_clusters(scans: RadarScans, options: TargetOptions) -> TargetClusters:
    """Group the returns of each scan: two belong together if a chain of neighbours connects them.

    Args:
        scans: moving returns only.
        options: the spacing of a target's returns, and the noise where the message gives none.
    """
    polar = polar_from_cartesian(scans.points_radar_m)
    sigma = _sigma_polar(scans, options)
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


def _sigma_polar(scans: RadarScans, options: TargetOptions) -> Points3:
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
