"""Still returns as a witness: how far a radar that stands still has turned in the world since a baseline.

What returns again and again from one place stands still: a post, a wall, a parked car. The baseline keeps these places with the
spread of their returns. In other scans, the median of the returns near each place says how far its direction has moved, and
all places together give a rotation of the radar, about the vertical alone where it measures no elevation.
"""

from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta, Struct

from calib_core.arrays import Indices, Points3, Values
from calib_core.measurements import RadarScans
from calib_core.radar import polar_from_cartesian
from calib_core.watching.witnesses import Turn

Finite = Annotated[float, Meta(ge=-1e12, le=1e15)]
"""A number of a baseline."""
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


class StillPlaces(Struct, frozen=True, forbid_unknown_fields=True):
    """Places that return again and again: range [m], azimuth and elevation [rad], and the spreads of the two angles [rad].

    Attributes:
        polar: (n, 3) medians, the most persistent place first.
        spreads_rad: (n, 2) robust standard deviations.
    """

    polar: Annotated[list[tuple[Finite, Finite, Finite]], Meta(max_length=1000)]
    spreads_rad: Annotated[list[tuple[Finite, Finite]], Meta(max_length=1000)]

    def __post_init__(self) -> None:
        if len(self.spreads_rad) != len(self.polar):
            raise ValueError("each place needs its spreads; write the baseline again from its recording")

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
    return msgspec.convert(
        {"polar": np.concatenate(places).tolist(), "spreads_rad": np.concatenate(spreads).tolist()}, StillPlaces
    )


def radar_turn(places: StillPlaces, scans: RadarScans) -> Turn | None:
    """Return how the radar turned since its still places were found; None if too few of them are seen again.

    Args:
        places: of the baseline.
        scans: of some later time, in which the radar stood still.
    """
    polar, _, _ = _still(scans)
    if len(places) < _FEWEST_PLACES or not len(polar):
        return None
    known = np.column_stack([places.polar, places.spreads_rad])
    found = [_moved(known, polar, turn, narrow=True) for turn in _SEARCHED_RAD]
    votes = np.array([counts.sum() for _, counts in found])
    turn = float(
        _SEARCHED_RAD[np.flatnonzero(votes == votes.max())[np.abs(_SEARCHED_RAD[votes == votes.max()]).argmin()]]
    )
    for _ in range(4):
        moved, counts = _moved(known, polar, turn)
        kept = np.flatnonzero(counts >= _FEWEST_RETURNS)
        if len(kept) < _FEWEST_PLACES:
            return None
        turn = float(np.median(moved[kept, 0]))
    return _turn(known[kept], moved[kept], _step(polar))


def _step(polar: Points3) -> float:
    """Return the distance between neighboring azimuths [rad]: that between bins, where a radar reports them; else very small."""
    sines = np.unique(np.round(np.sin(polar[:, 1]) * np.cos(polar[:, 2]), 3))
    return float(np.median(np.diff(sines))) if len(sines) > 1 else 0.0


def _still(scans: RadarScans) -> tuple[Points3, Indices, int]:
    """Return range, azimuth and elevation (n, 3) of still returns, the scan of each, and the number of scans looked at."""
    step = max(1, len(scans) // _MOST_SCANS)
    of_return = scans.scan_of_return()
    with np.errstate(invalid="ignore"):
        still = ~(np.abs(scans.doppler_mps) > _STILL_MPS)
    kept = np.flatnonzero(still & (of_return % step == 0) & np.isfinite(scans.points_radar_m).all(axis=1))
    return polar_from_cartesian(scans.points_radar_m[kept]), of_return[kept] // step, -(-len(scans) // step)


def _moved(places: np.ndarray, polar: Points3, turn: float, *, narrow: bool = False) -> tuple[np.ndarray, Values]:
    """Return by how much azimuth and elevation of each place have moved (n, 2), and from how many returns (n,).

    Args:
        places: (n, 5) of the baseline, with their spreads.
        polar: (m, 3) of still returns, any order.
        turn: near which they are looked for.
        narrow: look near that turn only, as for a vote.
    """
    order = np.argsort(polar[:, 0], kind="stable")
    ranged = polar[order]
    low, high = (np.searchsorted(ranged[:, 0], places[:, 0] + reach) for reach in (-_REACH_M, _REACH_M))
    reach = _REACH_RAD / (2.0 if narrow else 1.0) + (0.0 if narrow else _REACH_SIGMAS) * places[:, 3]
    moved, counts = np.zeros((len(places), 2)), np.zeros(len(places))
    for place in range(len(places)):
        near = ranged[low[place] : high[place], 1:] - places[place, 1:3]
        near = near[np.abs(near[:, 0] - turn) < reach[place]]
        counts[place] = len(near)
        if len(near) and not narrow:
            moved[place] = np.median(near, axis=0)
    return moved, counts


def _turn(places: np.ndarray, moved: np.ndarray, step_rad: float) -> Turn:
    """Fit a rotation of the radar to how far its places have moved; what scatters between places, and bins, are the noise."""
    azimuth, elevation = places[:, 1], places[:, 2]
    none = np.zeros(len(places))
    flat = bool(np.median(places[:, 4]) < _LEAST_SPREAD_RAD)
    slope = np.tan(elevation)
    by_azimuth = np.stack([-slope * np.cos(azimuth), -slope * np.sin(azimuth), 1.0 + none], axis=1)
    by_elevation = np.stack([np.sin(azimuth), -np.cos(azimuth), none], axis=1)
    design, values = ([by_azimuth], [moved[:, 0]]) if flat else ([by_azimuth, by_elevation], [*moved.T])
    information, gradient = np.eye(3) / _UNKNOWN_RAD**2, np.zeros(3)
    floors = max(_FLOOR_RAD, step_rad / np.sqrt(12.0)), _FLOOR_RAD  # within a bin, a place does not move at all
    for rows, value, floor in zip(design, values, floors, strict=False):
        off = value - np.median(value)
        sigma = max(1.4826 * float(np.median(np.abs(off))), floor)
        weight = np.maximum(1.0 - (off / (4.685 * sigma)) ** 2, 0.0) ** 2 / (1.6 * sigma**2)
        information += rows.T @ (weight[:, None] * rows)
        gradient += rows.T @ (weight * value)
    covariance = np.linalg.inv(information)
    determined = (not flat, not flat, True)
    return Turn(covariance @ gradient, covariance + _FLOOR_RAD**2 * np.eye(3), determined=determined)
