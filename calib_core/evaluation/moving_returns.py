"""Moving returns: those whose Doppler speed over ground says that their target moves; the radar's own motion is taken out."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Flags, Indices, Points3, Values, Vector2, freeze
from calib_core.measurements import RadarScans
from calib_core.options import option
from calib_core.results import DataWarning

SensorMotion: TypeAlias = Literal["auto", "still", "moving"]

_MOVING_SHARE = 0.1  # of the scans that look as if the sensors moved
_STILL_CELLS = 2.0  # that moving sensors hardly see
_UNKNOWN_SHARE = 0.5  # of returns without a Doppler speed: the radar then measures none


@dataclass(frozen=True, slots=True)
class TargetOptions:
    """How moving targets are found in radar scans."""

    min_speed_mps: float = option(
        0.3, "Least Doppler speed over ground of a moving target's return [m/s].", low=0.01, high=100.0
    )
    sensors: SensorMotion = option(
        "auto", "Whether the sensors stood still or moved; auto finds out from the returns' Doppler speeds."
    )
    spacing_m: float = option(
        0.4, "Distance between neighboring returns of one target, noise apart [m].", low=0.01, high=10.0
    )
    sigma_range_m: float = option(
        0.1, "Standard deviation of a return's range where the message gives none [m].", low=1e-3, high=10.0
    )
    sigma_azimuth_deg: float = option(
        1.0, "Standard deviation of a return's azimuth where the message gives none [deg].", low=1e-3, high=45.0
    )
    sigma_elevation_deg: float = option(
        2.0, "Standard deviation of a return's elevation where the message gives none [deg].", low=1e-3, high=45.0
    )
    max_range_m: float = option(200.0, "Farthest return kept [m].", low=0.1, high=1000.0)


@dataclass(frozen=True, slots=True, eq=False)
class MovingReturns:
    """The returns of a recording that move, or all of them if the radar measures no Doppler speed.

    Attributes:
        scans: every scan, with these returns only.
        rows: (n,) which rows of the scans that were given.
        speeds_mps: (n,) over ground; NaN without Doppler.
        by_doppler: whether the speeds decided.
        sensors_moved: whether the radar's own speed was taken out.
        searched: number of returns that were looked at.
        warnings: about the sensors' motion.
    """

    scans: RadarScans
    rows: Indices
    speeds_mps: Values
    by_doppler: bool
    sensors_moved: bool
    searched: int
    warnings: tuple[DataWarning, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, np.int64, rows=(None,))
        freeze(self, speeds_mps=(len(self.rows),))


@dataclass(frozen=True, slots=True, eq=False)
class _Sifted:
    """The returns of some scans that may be moving, whether or not the sensors do.

    Attributes:
        scans: with those returns only.
        rows: (n,) of the scans that were given.
        as_still: (n,) speed if the sensors stand still.
        as_moving: (n,) speed with the radar's own velocity taken out; NaN where that cannot be found.
        fitted: number of scans in which most returns move alike, as they do if the sensors move.
        unfitted: number of scans in which nearly all returns move, but not alike.
        judged: number of scans with enough returns.
        unknown: number of returns without a speed.
        searched: number of returns.
    """

    scans: RadarScans
    rows: Indices
    as_still: Values
    as_moving: Values
    fitted: int
    unfitted: int
    judged: int
    unknown: int
    searched: int


def moving_returns(windows: Iterable[RadarScans], options: TargetOptions) -> MovingReturns:
    """Keep the returns that move.

    Args:
        windows: the scans in order of time, in one or several pieces; only what may move is kept of each.
        options: the least speed, and whether the sensors moved.
    """
    pieces: list[_Sifted] = []
    offset = 0
    for window in windows:
        pieces.append(_sifted(window, options, offset))
        offset += len(window.points_radar_m)
    scans = RadarScans.joined([piece.scans for piece in pieces])
    rows = np.concatenate([np.zeros(0, dtype=np.int64), *(piece.rows for piece in pieces)])
    searched = sum(piece.searched for piece in pieces)
    if sum(piece.unknown for piece in pieces) > _UNKNOWN_SHARE * searched:
        warning = DataWarning("no-doppler", {"assumed": options.sensors != "still"})
        return MovingReturns(scans, rows, np.full(len(rows), np.nan), False, False, searched, (warning,))
    fitted, unfitted, judged = (
        sum(getattr(piece, name) for piece in pieces) for name in ("fitted", "unfitted", "judged")
    )
    moved = options.sensors == "moving" or (options.sensors == "auto" and fitted > _MOVING_SHARE * max(judged, 1))
    speeds = np.concatenate([np.zeros(0), *(piece.as_moving if moved else piece.as_still for piece in pieces)])
    kept = np.flatnonzero(np.abs(np.nan_to_num(speeds)) >= options.min_speed_mps)
    warnings = _unclear(unfitted, judged) if options.sensors == "auto" and not moved else ()
    return MovingReturns(scans.take(kept), rows[kept], speeds[kept], True, moved, searched, warnings)


def _sifted(scans: RadarScans, options: TargetOptions, offset: int) -> _Sifted:
    usable = _usable(scans, options)
    speeds = np.where(usable, scans.doppler_mps, np.nan)
    unknown = usable & ~np.isfinite(speeds)
    as_moving = np.full(len(speeds), np.nan)
    fitted = unfitted = judged = 0
    for first, last in zip(scans.first_return[:-1].tolist(), scans.first_return[1:].tolist(), strict=True):
        rows = slice(first, last)
        known = np.isfinite(speeds[rows])
        if options.sensors == "still" or known.sum() < LEAST_RETURNS:
            continue
        judged += 1
        weights = cell_weights(scans.points_radar_m[rows][known])
        still = float(weights @ (np.abs(speeds[rows][known]) < options.min_speed_mps))
        if still >= 0.5 * weights.sum():
            as_moving[rows] = speeds[rows]  # most stand still, so the radar does
            continue
        ego = ego_velocity(scans.points_radar_m[rows], speeds[rows], tolerance_mps=options.min_speed_mps)
        if ego is not None:
            as_moving[rows] = ego.speeds_mps
        fitted += ego is not None
        unfitted += ego is None and still < _STILL_CELLS
    fast = [np.abs(np.nan_to_num(some)) >= options.min_speed_mps for some in (speeds, as_moving)]
    kept = np.flatnonzero(unknown | fast[0] | fast[1])
    return _Sifted(
        scans.take(kept), kept + offset, speeds[kept], as_moving[kept], fitted, unfitted, judged, int(unknown.sum()),
        int(usable.sum()),
    )  # fmt: skip


def _usable(scans: RadarScans, options: TargetOptions) -> Flags:
    """Return which returns are somewhere in reach; of the alternative positions of one return, the first."""
    points = scans.points_radar_m
    range_m = np.linalg.norm(points, axis=1)
    with np.errstate(invalid="ignore"):
        usable = np.isfinite(points).all(axis=1) & (range_m > 0) & (range_m <= options.max_range_m)
    if scans.alternative_of is not None:
        numbered = np.flatnonzero(scans.alternative_of >= 0)
        keys = np.stack([scans.scan_of_return()[numbered], scans.alternative_of[numbered]], axis=1)
        first = np.unique(keys, axis=0, return_index=True)[1] if len(keys) else np.zeros(0, dtype=np.int64)
        usable[np.delete(numbered, first)] = False
    return np.asarray(usable)


def _unclear(unfitted: int, judged: int) -> tuple[DataWarning, ...]:
    if unfitted <= 0.5 * max(judged, 1):
        return ()
    return (DataWarning("mostly-moving", {"unfitted": unfitted, "scans": judged}),)


LEAST_RETURNS = 8
"""Fewer returns of a scan do not tell the radar's velocity from that of one target."""

_LEAST_CELLS = 6  # that agree: a near car fills a few with many returns
_CELL_M = 3.0
_LEAST_DIRECTIONS = 5  # that differ: one or two targets fit any velocity of the radar
_DIRECTION_RAD = np.deg2rad(5.0)
_AGREEING_SHARE = 0.5
_TRIALS = 60


@dataclass(frozen=True, slots=True, eq=False)
class EgoVelocity:
    """The velocity of the radar over ground in one scan.

    Attributes:
        velocity_mps: (2,) forward and to the left.
        speeds_mps: (n,) Doppler speed of each return over ground: 0 for what stands still.
    """

    velocity_mps: Vector2
    speeds_mps: Values

    def __post_init__(self) -> None:
        freeze(self, velocity_mps=(2,), speeds_mps=(None,))


def ego_velocity(points_radar_m: Points3, doppler_mps: Values, *, tolerance_mps: float) -> EgoVelocity | None:
    """Find the velocity that most of a scan agrees on, if they all stand still; None if they do not tell.

    What stands still in direction d has the Doppler speed -d v. RANSAC over two returns at a time, then least squares.

    Args:
        points_radar_m: (n, 3).
        doppler_mps: (n,) positive moving away; NaN where unknown.
        tolerance_mps: largest difference of a return that agrees.
    """
    known = np.isfinite(doppler_mps) & np.isfinite(points_radar_m).all(axis=1)
    range_m = np.linalg.norm(points_radar_m, axis=1)
    known &= range_m > 0
    if known.sum() < LEAST_RETURNS:
        return None
    directions, speeds = points_radar_m[known, :2] / range_m[known, None], doppler_mps[known]
    weights = cell_weights(points_radar_m[known])
    agreeing = _most_agreeing(directions, speeds, weights, tolerance_mps)
    cells = float(weights[agreeing].sum())
    if cells < max(_LEAST_CELLS, _AGREEING_SHARE * weights.sum()) or not _spread(directions[agreeing]):
        return None
    velocity = np.linalg.lstsq(-directions[agreeing], speeds[agreeing], rcond=None)[0]
    over_ground = np.full(len(doppler_mps), np.nan)
    over_ground[known] = speeds + directions @ velocity
    return EgoVelocity(velocity, over_ground)


def cell_weights(points_radar_m: Points3) -> Values:
    """Weigh returns (n,) so that each cell of the ground counts once, however many returns a near target gives."""
    cells = np.floor(points_radar_m[:, :2] / _CELL_M)
    own, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)[1:]
    return np.asarray(1.0 / counts[own.reshape(-1)])


def _most_agreeing(directions: np.ndarray, speeds: Values, weights: Values, tolerance_mps: float) -> Flags:
    rng = np.random.default_rng(1)  # the same scan gives the same answer
    first, second = rng.integers(len(speeds), size=(2, _TRIALS))
    a, b = directions[first], directions[second]
    determinant = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    apart = np.abs(determinant) > np.sin(_DIRECTION_RAD)
    if not apart.any():
        return np.zeros(len(speeds), dtype=np.bool_)
    a, b, determinant = a[apart], b[apart], determinant[apart]
    of_a, of_b = -speeds[first[apart]], -speeds[second[apart]]
    velocities = np.stack([of_a * b[:, 1] - of_b * a[:, 1], of_b * a[:, 0] - of_a * b[:, 0]], axis=1)
    velocities /= determinant[:, None]
    within = np.abs(speeds + velocities @ directions.T) <= tolerance_mps
    return np.asarray(within[(within @ weights).argmax()])


def _spread(directions: np.ndarray) -> bool:
    """Return whether returns lie in enough directions that differ."""
    steps = np.round(np.arctan2(directions[:, 1], directions[:, 0]) / _DIRECTION_RAD)
    return len(np.unique(steps)) >= _LEAST_DIRECTIONS
