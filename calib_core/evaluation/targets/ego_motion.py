"""Ego motion: the radar's own velocity in one scan, from the Doppler speeds of what stands still."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Points3, Values, Vector2, frozen_array

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
        object.__setattr__(self, "velocity_mps", frozen_array(self.velocity_mps, (2,)))
        object.__setattr__(self, "speeds_mps", frozen_array(self.speeds_mps, (None,)))


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
