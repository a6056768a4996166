"""Still returns as a witness: how far a radar that stands still has turned in the world since a baseline.

What returns again and again from one place stands still: a post, a wall, a parked car. The baseline keeps these places with the
spread of their returns. In other scans, the median of the returns near each place says how far its direction has moved, and
all places together give a rotation of the radar, about the vertical alone where it measures no elevation.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, Points3, Values, freeze
from calib_core.measurements import RadarScans
from calib_core.radar import polar_from_cartesian
from calib_core.watching.still_image import Turn

_STILL_MPS = 0.3
_MOST_SCANS = 600
_MOST_PLACES = 80
_FEWEST_PLACES = 4
_PERSISTENT = 0.25  # of the scans that see a place
_CELL_M, _CELL_RAD = 0.5, np.deg2rad(3.0)
_REACH_M, _REACH_RAD, _REACH_SIGMAS = 0.6, np.deg2rad(1.5), 2.5
_SEARCHED_RAD = np.deg2rad(np.arange(-8.0, 8.01, 0.5))
_FEWEST_RETURNS = 5
_LEAST_SPREAD_RAD = np.deg2rad(0.1)  # of elevations, below which the radar measures none
_FLOOR_RAD = np.deg2rad(0.03)
_UNKNOWN_RAD = np.deg2rad(20.0)


@dataclass(frozen=True, slots=True, eq=False)
class StillPlaces:
    """Places that the radar sees again and again, the most persistent first.

    Attributes:
        polar: (n, 3) median range [m], azimuth and elevation [rad].
        spreads_rad: (n, 2) robust standard deviation of the returns' azimuth and elevation.
    """

    polar: Points3
    spreads_rad: np.ndarray

    def __post_init__(self) -> None:
        freeze(self, polar=(None, 3), spreads_rad=(len(self.polar), 2))

    def __len__(self) -> int:
        return len(self.polar)


def still_places(scans: RadarScans) -> StillPlaces:
    """Find the places that at least a quarter of the scans see."""
    polar, scan, count = _still(scans)
    cells = np.round(polar[:, :2] / [_CELL_M, _CELL_RAD]).astype(np.int64)
    _, own = np.unique(cells, axis=0, return_inverse=True) if len(cells) else (None, np.zeros(0, dtype=np.int64))
    own = own.reshape(-1)
    visits = np.unique(own * count + scan) // max(count, 1)
    seen = np.bincount(visits, minlength=int(own.max(initial=-1)) + 1)
    free = np.ones(len(polar), dtype=np.bool_)
    places, spreads = [np.zeros((0, 3))], [np.zeros((0, 2))]
    for cell in np.argsort(-seen, kind="stable").tolist():
        if seen[cell] < 0.5 * _PERSISTENT * count or len(places) > _MOST_PLACES:
            break
        rows = np.flatnonzero(free & (own == cell))
        for _ in range(3):
            middle = np.median(polar[rows], axis=0) if len(rows) else np.full(3, np.inf)
            off = np.abs(polar[:, :2] - middle[:2])
            rows = np.flatnonzero(free & (off[:, 0] < _REACH_M) & (off[:, 1] < 2.0 * _REACH_RAD))
        if len(np.unique(scan[rows])) < _PERSISTENT * count:
            continue
        free[rows] = False
        middle = np.median(polar[rows], axis=0)
        places.append(middle[None])
        spreads.append(1.4826 * np.median(np.abs(polar[rows, 1:] - middle[1:]), axis=0)[None])
    return StillPlaces(np.concatenate(places), np.concatenate(spreads))


def radar_turn(places: StillPlaces, scans: RadarScans) -> Turn | None:
    """Return how the radar turned since its still places were found; None if too few of them are seen again.

    Args:
        places: of the baseline.
        scans: of some later time, in which the radar stood still.
    """
    polar, _, _ = _still(scans)
    if len(places) < _FEWEST_PLACES or not len(polar):
        return None
    found = [_moved(places, polar, turn, narrow=True) for turn in _SEARCHED_RAD]
    votes = np.array([counts.sum() for _, counts in found])
    turn = float(
        _SEARCHED_RAD[np.flatnonzero(votes == votes.max())[np.abs(_SEARCHED_RAD[votes == votes.max()]).argmin()]]
    )
    for _ in range(4):
        moved, counts = _moved(places, polar, turn)
        kept = np.flatnonzero(counts >= _FEWEST_RETURNS)
        if len(kept) < _FEWEST_PLACES:
            return None
        turn = float(np.median(moved[kept, 0]))
    return _turn(places, moved, kept)


def _still(scans: RadarScans) -> tuple[Points3, Indices, int]:
    """Return range, azimuth and elevation (n, 3) of still returns, the scan of each, and the number of scans looked at."""
    step = max(1, len(scans) // _MOST_SCANS)
    of_return = scans.scan_of_return()
    with np.errstate(invalid="ignore"):
        still = ~(np.abs(scans.doppler_mps) > _STILL_MPS)
    kept = np.flatnonzero(still & (of_return % step == 0) & np.isfinite(scans.points_radar_m).all(axis=1))
    return polar_from_cartesian(scans.points_radar_m[kept]), of_return[kept] // step, -(-len(scans) // step)


def _moved(places: StillPlaces, polar: Points3, turn: float, *, narrow: bool = False) -> tuple[np.ndarray, Values]:
    """Return by how much azimuth and elevation of each place have moved (n, 2), and from how many returns (n,).

    Args:
        places: of the baseline.
        polar: (m, 3) of still returns, any order.
        turn: near which they are looked for.
        narrow: look near that turn only, as for a vote.
    """
    order = np.argsort(polar[:, 0], kind="stable")
    ranged = polar[order]
    low, high = (np.searchsorted(ranged[:, 0], places.polar[:, 0] + reach) for reach in (-_REACH_M, _REACH_M))
    reach = _REACH_RAD / (2.0 if narrow else 1.0) + (0.0 if narrow else _REACH_SIGMAS) * places.spreads_rad[:, 0]
    moved, counts = np.zeros((len(places), 2)), np.zeros(len(places))
    for place in range(len(places)):
        near = ranged[low[place] : high[place], 1:] - places.polar[place, 1:]
        near = near[np.abs(near[:, 0] - turn) < reach[place]]
        counts[place] = len(near)
        if len(near) and not narrow:
            moved[place] = np.median(near, axis=0)
    return moved, counts


def _turn(places: StillPlaces, moved: np.ndarray, kept: Indices) -> Turn:
    """Fit a rotation of the radar to how far its places have moved; what scatters between places is the noise."""
    azimuth, elevation = places.polar[kept, 1], places.polar[kept, 2]
    none = np.zeros(len(kept))
    flat = bool(np.median(places.spreads_rad[kept, 1]) < _LEAST_SPREAD_RAD)
    slope = np.tan(elevation)
    by_azimuth = np.stack([-slope * np.cos(azimuth), -slope * np.sin(azimuth), np.ones(len(kept))], axis=1)
    by_elevation = np.stack([np.sin(azimuth), -np.cos(azimuth), none], axis=1)
    design, values = ([by_azimuth], [moved[kept, 0]]) if flat else ([by_azimuth, by_elevation], [*moved[kept].T])
    information, gradient = np.eye(3) / _UNKNOWN_RAD**2, np.zeros(3)
    for rows, value in zip(design, values, strict=True):
        off = value - np.median(value)
        sigma = max(1.4826 * float(np.median(np.abs(off))), _FLOOR_RAD)
        weight = np.maximum(1.0 - (off / (4.685 * sigma)) ** 2, 0.0) ** 2 / (1.6 * sigma**2)
        information += rows.T @ (weight[:, None] * rows)
        gradient += rows.T @ (weight * value)
    covariance = np.linalg.inv(information)
    return Turn(
        covariance @ gradient,
        covariance + _FLOOR_RAD**2 * np.eye(3),
        len(kept) / len(places),
        (not flat, not flat, True),
    )
