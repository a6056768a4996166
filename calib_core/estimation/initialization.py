"""Initialization: a short list of initial poses from minimal two-point and three-point solutions.

Two pairs and a camera centre determine the rotation (Wahba's problem for two directions); three pairs determine the whole
pose up to four solutions (P3P by Grunert's equations). Each draw is scored against all pairs in the radar's own angles,
where its noise is simple, and the best few distinct poses are returned. They need not be exact: every start is refined.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Indices, Points3, Values, Vector3
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.geometry import RigidTransform
from calib_core.radar import cartesian_from_polar

_TWO_POINT_DRAWS, _THREE_POINT_DRAWS, _MOST_SCORED_ROWS, _LEAST_SCORED_PAIRS = 800, 300, 400, 20
"""Number of draws and of what each is scored against. A choice: the product is the time; more draws find a pose among more
wrong pairs, more rows order the draws better."""
_SCORED_AT_ONCE = 8000  # number of residuals whose many intermediate arrays fit into the processor's cache
_FAR = 1e12  # squared standard deviations of an impossible position: finite, so that costs can be added
_ROBUST_RADIUS = 5.0  # standard deviations; larger residuals count as about one outlier each
_DIFFERENT_RAD = 0.15  # closer starts end in the same pose
_LEAST_LENGTH_M = 1e-9  # the direction of a shorter vector is rounding


@dataclass(frozen=True, slots=True, eq=False)
class Hypotheses:
    """Poses drawn from few pairs: camera_from_radar rotations (h, 3, 3) and camera centres (h, 3) in the radar frame."""

    rotations: np.ndarray
    centres_m: Points3

    def __len__(self) -> int:
        return len(self.rotations)

    def pose(self, index: int) -> RigidTransform:
        """Return one of them as a transform."""
        u, _, vt = np.linalg.svd(self.rotations[index])
        rotation = u @ vt
        return RigidTransform(rotation, -rotation @ self.centres_m[index])


def initial_poses(
    measurements: PairMeasurements, *, most: int, rng: "np.random.Generator"
) -> tuple[RigidTransform, ...]:
    """Draw hypotheses, score them against the pairs and return the best distinct ones.

    Args:
        measurements: the pairs.
        most: how many poses to return.
        rng: random generator of the draws.
    """
    rays = measurements.rays
    usable = np.flatnonzero(np.isfinite(rays).all(axis=1))
    if len(usable) < 2:
        return ()
    points_m = cartesian_from_polar(measurements.polar)
    drawn = [two_point_poses(points_m, rays, _draws(measurements, usable, 2, rng), measurements.prior.position_m)]
    if not measurements.prior.measured and len(usable) >= 3:
        drawn.append(three_point_poses(points_m, rays, _draws(measurements, usable, 3, rng)))
    hypotheses = Hypotheses(
        np.concatenate([one.rotations for one in drawn]), np.concatenate([one.centres_m for one in drawn])
    )
    costs = hypothesis_costs(hypotheses, _thinned(measurements, usable))
    return _best_that_differ(hypotheses, costs, most)


@dataclass(frozen=True, slots=True, eq=False)
class _Draws:
    """Which pairs (h, k), and which of their candidate rows (h, k), each hypothesis is made from."""

    pairs: Indices
    rows: Indices


def _draws(measurements: PairMeasurements, usable: Indices, size: int, rng: "np.random.Generator") -> _Draws:
    """Draw groups of distinct pairs, and of each pair a candidate by its score."""
    wanted = _TWO_POINT_DRAWS if size == 2 else _THREE_POINT_DRAWS
    if size == 2 and len(usable) * (len(usable) - 1) // 2 <= wanted and measurements.one_to_one:
        pairs = usable[np.stack(np.triu_indices(len(usable), 1), axis=1)]
    else:
        pairs = usable[rng.integers(0, len(usable), (wanted, size))]
        ordered = np.sort(pairs, axis=1)
        pairs = pairs[(np.diff(ordered, axis=1) > 0).all(axis=1)]
    score = np.exp(measurements.log_score)
    until = np.concatenate([[0.0], np.cumsum(score)])
    low, high = until[measurements.first[pairs]], until[measurements.first[pairs + 1]]
    rows = np.searchsorted(until, low + (high - low) * rng.random(pairs.shape), side="right") - 1
    return _Draws(pairs, np.clip(rows, measurements.first[pairs], measurements.first[pairs + 1] - 1))


def two_point_poses(points_radar_m: Points3, rays: Points3, draws: _Draws, centre_m: Vector3) -> Hypotheses:
    """Rotate two directions from a known camera centre onto two rays (Wahba's problem, both weighted equally)."""
    directions = _unit(points_radar_m[draws.rows] - centre_m)
    seen = rays[draws.pairs]
    radar_frames, camera_frames = _frames(directions), _frames(seen)
    rotations = camera_frames @ np.swapaxes(radar_frames, 1, 2)
    fine = np.isfinite(rotations).all(axis=(1, 2))
    return Hypotheses(rotations[fine], np.tile(centre_m, (int(fine.sum()), 1)))


def _frames(two: np.ndarray) -> np.ndarray:
    """Build right-handed frames (h, 3, 3), as columns, on the sum and the cross product of two directions (h, 2, 3)."""
    first = _unit(two[:, 0] + two[:, 1])
    normal = _unit(np.cross(two[:, 0], two[:, 1]))
    return np.stack([first, normal, np.cross(first, normal)], axis=2)


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > _LEAST_LENGTH_M, length, np.nan))


def three_point_poses(points_radar_m: Points3, rays: Points3, draws: _Draws) -> Hypotheses:
    """Solve Grunert's three-point problem for every draw; up to four poses each.

    With s the distances along the rays, v = s3 / s1 solves a quartic; u = s2 / s1 and s1 follow.
    """
    points, seen = points_radar_m[draws.rows], rays[draws.pairs]
    distances, owner = _grunert_distances(points, seen)
    points, corners = points[owner], distances[:, :, None] * seen[owner]
    radar_frames = _frames(points[:, 1:] - points[:, :1])
    camera_frames = _frames(corners[:, 1:] - corners[:, :1])
    rotations = camera_frames @ np.swapaxes(radar_frames, 1, 2)
    centres = points.mean(axis=1) - (corners.mean(axis=1)[:, None, :] @ rotations)[:, 0]
    fine = np.isfinite(rotations).all(axis=(1, 2)) & np.isfinite(centres).all(axis=1)
    return Hypotheses(rotations[fine], centres[fine])


def _grunert_distances(points: np.ndarray, rays: np.ndarray) -> tuple[Points3, Indices]:
    """Return the distances (k, 3) of the three points along their rays, and the draw each solution belongs to (k,).

    The coefficients are those of Grunert's quartic in v (Haralick et al., 1994).
    """
    a2, b2, c2 = (((points[:, i] - points[:, j]) ** 2).sum(axis=1) for i, j in ((1, 2), (0, 2), (0, 1)))
    cos_a, cos_b, cos_c = ((rays[:, i] * rays[:, j]).sum(axis=1) for i, j in ((1, 2), (0, 2), (0, 1)))
    with np.errstate(all="ignore"):
        p, q, ac = (a2 - c2) / b2, (a2 + c2) / b2, c2 / b2
        quartic = np.stack(
            [
                (p - 1) ** 2 - 4 * ac * cos_a**2,
                4 * (p * (1 - p) * cos_b - (1 - q) * cos_a * cos_c + 2 * ac * cos_a**2 * cos_b),
                2 * (p**2 - 1 + 2 * p**2 * cos_b**2 + 2 * (1 - ac) * cos_a**2 - 4 * q * cos_a * cos_b * cos_c)
                + 4 * (1 - a2 / b2) * cos_c**2,
                4 * (-p * (1 + p) * cos_b + 2 * (a2 / b2) * cos_c**2 * cos_b - (1 - q) * cos_a * cos_c),
                (1 + p) ** 2 - 4 * (a2 / b2) * cos_c**2,
            ],
            axis=1,
        )
        v = _real_roots(quartic)
        p, b2, cos_a, cos_b, cos_c = (column[:, None] for column in (p, b2, cos_a, cos_b, cos_c))
        u = ((p - 1) * v**2 - 2 * p * cos_b * v + 1 + p) / (2 * (cos_c - v * cos_a))
        s1 = np.sqrt(b2 / (1 + v**2 - 2 * v * cos_b))
    distances = np.stack([s1, u * s1, v * s1], axis=2)
    good = np.isfinite(distances).all(axis=2) & (distances > 0).all(axis=2)
    return distances[good], np.nonzero(good)[0]


def _real_roots(quartic: np.ndarray) -> np.ndarray:
    """Return the real parts (h, 4) of the nearly real roots of each quartic, NaN for the rest (Ferrari's method).

    With x = y - a / 4, y^4 + p y^2 + q y + r = (y^2 + p / 2 + m)^2 - 2 m (y - q / (4 m))^2 for a root m of
    8 m^3 + 8 p m^2 + (2 p^2 - 8 r) m - q^2 = 0; the largest of the three loses the fewest digits. The coefficients p, q and r
    are those of the depressed quartic.
    """
    # coefficients are ratios of squared distances: a smaller one is rounding, and the equation a cubic
    leading = np.where(np.abs(quartic[:, 0]) > 1e-12, quartic[:, 0], np.nan)
    a, b, c, d = (quartic[:, 1:].T / leading).astype(np.complex128)
    p = b - 3.0 / 8.0 * a**2
    q = c - a * b / 2.0 + a**3 / 8.0
    r = d - a * c / 4.0 + a**2 * b / 16.0 - 3.0 / 256.0 * a**4
    m = _largest_cubic_root(p, p**2 / 4.0 - r, -(q**2) / 8.0)
    side = np.sqrt(2.0 * m)
    ratio = q / np.where(side == 0, 1.0, side)
    plus, minus = np.sqrt(-2.0 * (p + m + ratio)), np.sqrt(-2.0 * (p + m - ratio))
    roots = np.stack([side + plus, side - plus, minus - side, -minus - side], axis=1) / 2.0 - a[:, None] / 4.0
    # ratio to the real part, a choice: noise turns a double root into two complex ones
    return np.where(np.abs(roots.imag) < 0.02 * np.abs(roots.real) + 1e-9, roots.real, np.nan)


def _largest_cubic_root(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return the root of m^3 + a m^2 + b m + c that is largest in magnitude, for each row.

    The coefficients are those of Cardano's formula.
    """
    p, q = b - a**2 / 3.0, 2.0 / 27.0 * a**3 - a * b / 3.0 + c
    radical = np.sqrt(q**2 / 4.0 + p**3 / 27.0)
    radical = np.where((np.conj(q) * radical).real > 0.0, -radical, radical)  # the sign without cancellation
    cube = (-q / 2.0 + radical) ** (1.0 / 3.0)
    cubes = cube * np.exp(2j * np.pi / 3.0 * np.arange(3))[:, None]
    roots = cubes - p / (3.0 * np.where(cubes == 0, 1.0, cubes)) - a / 3.0
    return np.asarray(np.take_along_axis(roots, np.abs(roots).argmax(axis=0)[None], axis=0)[0])


def _thinned(measurements: PairMeasurements, usable: Indices) -> PairMeasurements:
    """Keep evenly spread pairs, so that scoring costs the same for 1,000 pairs as for 200."""
    per_pair = len(measurements.polar) / len(measurements)
    most = max(int(_MOST_SCORED_ROWS / per_pair), _LEAST_SCORED_PAIRS)
    if len(usable) > most:
        usable = usable[np.linspace(0, len(usable) - 1, most).round().astype(np.int64)]
    return measurements if len(usable) == len(measurements) else measurements.some(usable)


def hypothesis_costs(hypotheses: Hypotheses, measurements: PairMeasurements) -> Values:
    """Score hypotheses (h,) by robust angular residuals: each ray, in radar axes, against the direction to its point.

    The residual is split into the radar's azimuth and elevation, whitened, and bounded (Geman-McClure).
    """
    variance = (
        measurements.sigma_polar[:, 1:] ** 2
        + (measurements.sigma_px[measurements.owner, None] / _focal(measurements)) ** 2
    )
    scored = _Scored(
        cartesian_from_polar(measurements.polar).T.copy(),
        measurements.rays[measurements.owner].T.copy(),
        1.0 / variance.T,
    )
    at_once = max(_SCORED_AT_ONCE // len(measurements.polar), 1)
    costs = np.empty(len(hypotheses))
    for start in range(0, len(hypotheses), at_once):
        some = slice(start, start + at_once)
        squared = scored.squared(hypotheses.rotations[some], hypotheses.centres_m[some])
        bounded = _ROBUST_RADIUS**2 * squared / (squared + _ROBUST_RADIUS**2) - 2.0 * measurements.log_score
        per_pair = bounded
        if not measurements.one_to_one:
            per_pair = np.minimum.reduceat(bounded, measurements.first[:-1], axis=1)
        costs[some] = np.minimum(per_pair, _ROBUST_RADIUS**2).sum(axis=1)
    away_m = hypotheses.centres_m - measurements.prior.position_m
    prior = (away_m**2).sum(axis=1) / measurements.prior.sigma_m**2
    return np.asarray(costs + np.minimum(prior, 2 * _ROBUST_RADIUS**2))


@dataclass(frozen=True, slots=True, eq=False)
class _Scored:
    """The data that hypotheses are scored against, as planes: contiguous rows make the scoring fast."""

    points_m: np.ndarray
    """(3, m) radar positions"""
    rays: np.ndarray
    """(3, m) rays of their clicks"""
    precision: np.ndarray
    """(2, m) one over the variance of azimuth and elevation [rad^-2]"""

    def squared(self, rotations: np.ndarray, centres_m: Points3) -> np.ndarray:
        """Return the squared whitened angular residuals (h, m), large where a point lies behind its ray."""
        x, y, z = self.points_m[:, None, :] - centres_m.T[:, :, None]
        flat2 = np.maximum(x * x + y * y, _LEAST_LENGTH_M**2)
        length2 = flat2 + z * z
        turned_x, turned_y, turned_z = np.moveaxis(rotations, 2, 0) @ self.rays  # R^T ray
        along = x * turned_x + y * turned_y + z * turned_z
        to_left = x * turned_y - y * turned_x
        upwards = turned_z * length2 - z * along
        squared = to_left**2 / flat2 * self.precision[0] + upwards**2 / (length2 * flat2) * self.precision[1]
        return np.where(along > 0, squared, _FAR)  # NaN counts as behind


def _focal(measurements: PairMeasurements) -> float:
    return float(np.sqrt(measurements.camera.matrix_px[0, 0] * measurements.camera.matrix_px[1, 1]))


def _best_that_differ(hypotheses: Hypotheses, costs: Values, most: int) -> tuple[RigidTransform, ...]:
    """Repeatedly take the cheapest hypothesis and drop all that are close to it."""
    left = np.where(np.isfinite(costs), costs, np.inf)
    chosen: list[int] = []
    while len(chosen) < most and np.isfinite(left).any():
        best = int(np.argmin(left))
        chosen.append(best)
        left[_distances(hypotheses, best) <= _DIFFERENT_RAD] = np.inf
        left[best] = np.inf
    return tuple(hypotheses.pose(index) for index in chosen)


def _distances(hypotheses: Hypotheses, index: int) -> Values:
    """Return rotation angle [rad] plus a fifth of the distance between the centres [m], from one hypothesis to all (h,)."""
    traces = np.einsum("hij,ij->h", hypotheses.rotations, hypotheses.rotations[index])
    apart_m = np.linalg.norm(hypotheses.centres_m - hypotheses.centres_m[index], axis=1)
    # [rad/m] a camera that moves across by 1 m sees a placement 5 m away turn by 0.2 rad
    return np.asarray(np.arccos(np.clip((traces - 1.0) / 2.0, -1.0, 1.0)) + 0.2 * apart_m)
