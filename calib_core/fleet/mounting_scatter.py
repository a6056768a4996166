"""How the mountings of a vehicle type scatter, estimated from their calibrations, and which of them is unlike its type.

A mounting scatters in where the camera is, as seen from the radar, and in how it is turned; the translation t = -R c of
camera_from_radar mixes the two. With the common mounting R_0, c_0 the six coordinates are

    (c - c_0,  R_0^T log(R R_0^T))    forward, left, up [m]; about forward, left, up [rad].

They do not depend on the camera's axes, and turn with the radar's. The common mounting is the one that most vehicles are near: a
robust start, before anything is estimated.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Matrix66, Values
from calib_core.fleet.deviation import FALSE_RATE, Deviation, deviation
from calib_core.fleet.mountings import Mounting
from calib_core.fleet.random_effects import RandomEffects, random_effects
from calib_core.geometry import RigidTransform, camera_position_jacobian, rotation_exp, rotation_log, skew
from calib_core.measurements import Unsolvable

MIN_MOUNTINGS = 5
"""The fewest mountings that a scatter is estimated from: fewer do not show how differently it spreads along the axes."""

_FEWEST_FITTED = 4
_CANDIDATE = 22.457744484825323  # the 99.9 % quantile of chi2 with 6 degrees of freedom
_FEW = 12  # up to so many, a vehicle may hide itself by widening the scatter: each is tested against the others
_USUAL = 12.591587243743977  # the 95 % quantile


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A mounting that was not counted.

    Attributes:
        mounting: the mounting.
        deviation: from those that were.
        reason: why, with figures and without a full stop.
    """

    mounting: Mounting
    deviation: Deviation
    reason: str


@dataclass(frozen=True, slots=True)
class SharedTape:
    """A measured camera position that several vehicles have in common: copied, or off by the same error.

    Each calibration is drawn to it, so their agreement says nothing of how they are mounted: it counts as one measurement.

    Attributes:
        vehicles: how many have it in common.
        mountings: of how many mountings.
        sigma_m: its standard deviation; the largest if there are several.
        spread_m: by how much they differ, per axis; 0 if they are the same to the last digit.
    """

    vehicles: int
    mountings: int
    sigma_m: float
    spread_m: float = 0.0

    @property
    def words(self) -> str:
        """What it means, without a full stop."""
        if self.spread_m:
            return (
                f"the measured camera positions of {self.vehicles} vehicles differ by ± {100.0 * self.spread_m:.2g} cm, less "
                f"than single measurements with their stated ± {100.0 * self.sigma_m:.2g} cm would: they count as one, and that "
                "is added to the scatter; if each vehicle was measured by itself, state the sigma that this has"
            )
        return (
            f"{self.vehicles} vehicles state a measured camera position that another one states, too: it counts as one "
            f"measurement, so that ± {100.0 * self.sigma_m:.2g} cm are added to the scatter; measure each vehicle by itself"
        )


@dataclass(frozen=True, slots=True, eq=False)
class MountingScatter:
    """The distribution of the mountings of one vehicle type.

    Attributes:
        vehicle_type: its name.
        common: the mounting that the coordinates are relative to.
        effects: mean and scatter in the `coordinates` of a mounting: camera forward, left, up [m], roll, pitch, yaw
            [rad].
        mountings: those that were counted.
        left_out: those that were not.
        shared_tape: what several vehicles' positions have in common; None if each was measured by itself.
    """

    vehicle_type: str
    common: RigidTransform
    effects: RandomEffects
    mountings: tuple[Mounting, ...]
    left_out: tuple[LeftOut, ...] = ()
    shared_tape: SharedTape | None = None

    @property
    def camera_from_radar(self) -> RigidTransform:
        """The mean pose."""
        return pose_from_coordinates(self.effects.mean, self.common)

    @property
    def scatter(self) -> Matrix66:
        """Covariance (6, 6) of the mountings: camera forward, left, up [m], roll, pitch, yaw [rad]."""
        return self.effects.scatter

    def deviation_of(self, mounting: Mounting) -> Deviation:
        """Compare a mounting that was not counted with those that were."""
        return _Measured.of([mounting], self.common).deviation(0, self.effects)

    def without(self, vehicle: str) -> "MountingScatter | Unsolvable":
        """Estimate the scatter again without one vehicle's mountings; others that were left out stay so."""
        rest = tuple(one for one in self.mountings if one.vehicle != vehicle)
        if len(rest) == len(self.mountings):
            return self
        if len(rest) < _FEWEST_FITTED:
            return _too_few(len(rest), 0)
        shared = _shared_tape(rest)
        effects = _widened(_Measured.of(rest, self.common).effects(np.arange(len(rest))), shared)
        others = tuple(one for one in self.left_out if one.mounting.vehicle != vehicle)
        return MountingScatter(self.vehicle_type, self.common, effects, rest, others, shared)


@dataclass(frozen=True, slots=True)
class OffKind:
    """A mounting tested against the others of its type.

    Attributes:
        mounting: what was tested.
        deviation: from what the others predict.
        others: how many mountings these are.
        is_off: whether it is beyond the 1-in-10,000 point.
        words: the outcome with figures, without a full stop.
        hint: what to do; "" if it is not off.
    """

    mounting: Mounting
    deviation: Deviation
    others: int
    is_off: bool
    words: str
    hint: str


def mounting_scatter(mountings: Sequence[Mounting], *, vehicle_type: str) -> MountingScatter | Unsolvable:
    """Estimate how the mountings of one vehicle type scatter.

    A mounting that is beyond the 1-in-10,000 point of what the others predict is left out. The estimate starts from the half that
    agrees best, so that a few wrong ones cannot hide each other, takes back whatever that half explains, and then tests
    each one against the others.

    Args:
        mountings: of all vehicles; a remounted vehicle counts once for each mounting.
        vehicle_type: its name.
    """
    count = len(mountings)
    if count < MIN_MOUNTINGS:
        return _too_few(count, 0)
    common = common_mounting([one.camera_from_radar for one in mountings])
    measured = _Measured.of(mountings, common)
    kept = _agreeing(measured)
    if kept.sum() < MIN_MOUNTINGS:
        return _too_few(int(kept.sum()), int((~kept).sum()))
    counted = tuple(one for one, counts in zip(mountings, kept.tolist(), strict=True) if counts)
    shared = _shared_tape(counted)
    effects = _widened(measured.effects(kept), shared)
    left_out = []
    for k in np.flatnonzero(~kept).tolist():
        away = measured.deviation(k, effects)
        reason = f"unlike its type: {away.text}, beyond the 1-in-10,000 point of the other mountings"
        left_out.append(LeftOut(mountings[k], away, reason))
    return MountingScatter(vehicle_type, common, effects, counted, tuple(left_out), shared)


def off_kind(mounting: Mounting, scatter: MountingScatter) -> OffKind | Unsolvable:
    """Test one mounting against the other vehicles of its type: none of its own vehicle's mountings counts among them.

    Args:
        mounting: the mounting.
        scatter: of the type, with or without this vehicle.
    """
    others = scatter.without(mounting.vehicle)
    return others if isinstance(others, Unsolvable) else _judged(mounting, others)


def off_kinds(scatter: MountingScatter) -> tuple[OffKind, ...]:
    """Test every mounting of a fleet, counted or left out, each against the other vehicles; in order of vehicle and session.

    In a fleet of more than 12 mountings, one that is within the 95 % point of all of them, its own included, is not tested again
    without it: its own part in the estimate is too small to hide it.
    In a very small fleet, a vehicle without which fewer than 4 mountings are left is not tested; `off_kind` says so of it.

    Args:
        scatter: of the type.
    """
    rows = [*scatter.mountings, *(one.mounting for one in scatter.left_out)]
    found = []
    for mounting in sorted(rows, key=lambda one: (one.vehicle, one.sessions)):
        sound = len(scatter.mountings) > _FEW and scatter.deviation_of(mounting).squared <= _USUAL
        outcome = _judged(mounting, scatter) if sound else off_kind(mounting, scatter)
        if isinstance(outcome, OffKind):
            found.append(outcome)
    return tuple(found)


def _judged(mounting: Mounting, others: MountingScatter) -> OffKind:
    away, count = others.deviation_of(mounting), len(others.mountings)
    figures = f"squared distance {away.squared:.3g}, 1-in-10,000 point {away.limit:.3g}, {count} other mountings"
    if not away.is_beyond:
        return OffKind(mounting, away, count, False, f"{mounting.vehicle} is of its kind ({figures})", "")
    return OffKind(
        mounting,
        away,
        count,
        True,
        f"{mounting.vehicle} is unlike its type: {away.text} ({figures})",
        "check that radar, camera and intrinsics are this vehicle's and that the type is right",
    )


def _shared_tape(mountings: Sequence[Mounting]) -> SharedTape | None:
    """Return which measured camera positions several vehicles share."""
    stated: dict[tuple[float, ...], set[str]] = {}
    for one in mountings:
        for measured in one.measured:
            stated.setdefault(measured.position_m, set()).add(one.vehicle)
    shared = {position for position, vehicles in stated.items() if len(vehicles) > 1}
    rows = [one for one in mountings if any(measured.position_m in shared for measured in one.measured)]
    if not rows:
        return _too_alike(mountings)
    sigma_m = max(measured.sigma_m for one in rows for measured in one.measured if measured.position_m in shared)
    return SharedTape(len({one.vehicle for one in rows}), len(rows), sigma_m)


def _too_alike(mountings: Sequence[Mounting]) -> SharedTape | None:
    """Return what the measured positions have in common if they differ by less than measurements with their sigma would.

    Positions that are measured one by one differ by their errors at least, so that the sum of squares over sigma^2 follows chi2
    if all vehicles are mounted alike. Below its 1-in-10,000 point, of one axis or of all, sigma is not that of single readings.
    """
    from scipy.special import chdtri

    taped = [one for one in mountings if one.measured]
    if len({one.vehicle for one in taped}) < MIN_MOUNTINGS:
        return None
    positions_m = np.array([np.mean([measured.position_m for measured in one.measured], axis=0) for one in taped])
    sigmas_m = np.array(
        [min(measured.sigma_m for measured in one.measured) / len(one.measured) ** 0.5 for one in taped]
    )
    away_m = positions_m - np.average(positions_m, axis=0, weights=sigmas_m**-2.0)
    squares = ((away_m / sigmas_m[:, None]) ** 2).sum(axis=0)
    freedom = len(taped) - 1
    if squares.min() >= chdtri(freedom, 1.0 - FALSE_RATE) and squares.sum() >= chdtri(3 * freedom, 1.0 - FALSE_RATE):
        return None
    sigma_m = max(measured.sigma_m for one in taped for measured in one.measured)
    spread_m = float(np.sqrt((away_m**2).sum() / (3 * freedom)))
    return SharedTape(len({one.vehicle for one in taped}), len(taped), sigma_m, max(spread_m, 1e-9))


def _widened(effects: RandomEffects, shared: SharedTape | None) -> RandomEffects:
    """Add the variance of a copied measurement to the scatter of the positions."""
    if shared is None:
        return effects
    variances = np.repeat([shared.sigma_m**2, 0.0], 3)
    return replace(effects, scatter=effects.scatter + np.diag(variances))


def _too_few(count: int, left_out: int) -> Unsolvable:
    without = f" after {left_out} that are off their kind were left out" if left_out else ""
    return Unsolvable(
        "too-few-vehicles",
        f"{count} of at least {MIN_MOUNTINGS} required mountings{without}: too few to tell how they scatter",
        "calibrate more vehicles of this type",
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Measured:
    """Mountings in the `coordinates` of a mounting.

    Attributes:
        vectors: (n, 6).
        covariances: (n, 6, 6).
        stated: (n, 6, 6) what of these rests on stated sigmas.
        freedoms: degrees of freedom of the noise levels.
    """

    vectors: np.ndarray
    covariances: np.ndarray
    stated: np.ndarray
    freedoms: tuple[float, ...]

    @classmethod
    def of(cls, mountings: Sequence[Mounting], common: RigidTransform) -> "_Measured":
        """Return mountings relative to a common one."""
        jacobians = np.array([coordinate_jacobian(one.camera_from_radar, common) for one in mountings])
        turned = jacobians.swapaxes(1, 2)
        return cls(
            np.array([coordinates(one.camera_from_radar, common) for one in mountings]),
            jacobians @ np.array([one.covariance for one in mountings]) @ turned,
            jacobians @ np.array([one.stated for one in mountings]) @ turned,
            tuple(one.freedom for one in mountings),
        )

    def effects(self, kept: np.ndarray) -> RandomEffects:
        """Estimate the distribution of those that are kept: flags (n,) or places (k,)."""
        return random_effects(self.vectors[kept], self.covariances[kept], self.stated[kept])

    def deviation(self, k: int, effects: RandomEffects) -> Deviation:
        """Compare one with the distribution of others."""
        return deviation(effects, self.vectors[k], self.covariances[k], freedom=self.freedoms[k])


def _agreeing(measured: _Measured) -> np.ndarray:
    """Return which mountings (n,) agree with each other."""
    count = len(measured.vectors)
    squared = robust_distances(measured.vectors, measured.covariances)
    fewest = max(_FEWEST_FITTED, count // 2 + 1)
    kept = squared <= max(_CANDIDATE, float(np.sort(squared)[fewest - 1]))
    while not kept.all():
        effects = measured.effects(kept)
        taken = [k for k in np.flatnonzero(~kept).tolist() if not measured.deviation(k, effects).is_beyond]
        if not taken:
            break
        kept[taken] = True
    while kept.sum() > fewest:
        worst = _worst(measured, np.flatnonzero(kept))
        if worst is None:
            break
        kept[worst] = False
    return kept


def _worst(measured: _Measured, kept: np.ndarray) -> int | None:
    """Return which of the kept ones is farthest beyond what the others of them predict; None if none is."""
    effects = measured.effects(kept)
    worst: int | None = None
    least = 1.0
    for place, k in enumerate(kept.tolist()):
        if len(kept) > _FEW and measured.deviation(k, effects).squared <= _USUAL:
            continue
        away = measured.deviation(k, measured.effects(np.delete(kept, place)))
        if away.is_beyond and away.probability < least:
            worst, least = k, away.probability
    return worst


_SMALL_RAD = 1e-4
_STEPS = 30
_MEDIAN_CHI2_3 = 2.365973884375338
_LEAST_SPREAD = 1e-6  # m and rad
_BLOCKS = (slice(0, 3), slice(3, 6))


def coordinates(camera_from_radar: RigidTransform, common: RigidTransform) -> Values:
    """Return the six coordinates of a mounting (6,) [m, rad].

    Args:
        camera_from_radar: the mounting.
        common: the mounting it is relative to.
    """
    moved_m = camera_from_radar.inverse().translation_m - common.inverse().translation_m
    turned_rad = common.rotation.T @ rotation_log(camera_from_radar.rotation @ common.rotation.T)
    return np.concatenate([moved_m, turned_rad])


def pose_from_coordinates(values: Values, common: RigidTransform) -> RigidTransform:
    """Return the mounting with these coordinates (6,) [m, rad]: the inverse of `coordinates`."""
    position_m = common.inverse().translation_m + values[:3]
    rotation = rotation_exp(common.rotation @ values[3:]) @ common.rotation
    return RigidTransform(rotation, -rotation @ position_m)


def coordinate_jacobian(camera_from_radar: RigidTransform, common: RigidTransform) -> Matrix66:
    """Return d coordinates / d (dt, dtheta) (6, 6) for an error of the mounting's pose, `Calibration.covariance`'s convention."""
    turned_rad = rotation_log(camera_from_radar.rotation @ common.rotation.T)
    jacobian = np.zeros((6, 6))
    jacobian[:3] = camera_position_jacobian(camera_from_radar)
    jacobian[3:, 3:] = common.rotation.T @ _log_jacobian(turned_rad)
    return jacobian


def common_mounting(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Return the geometric median of poses: positions and rotations each in units of their median distance.

    Args:
        poses: camera_from_radar of at least one vehicle.
    """
    centre = _central(poses)
    for _ in range(2):  # coordinates are straight lines only near their origin
        vectors = np.array([coordinates(one, centre) for one in poses])
        centre = pose_from_coordinates(_geometric_median(vectors), centre)
    return centre


def robust_distances(vectors: np.ndarray, covariances: np.ndarray) -> Values:
    """Return squared distances (n,) from the origin: the scatter by the median length of positions and of rotations.

    Args:
        vectors: (n, 6) coordinates relative to the common mounting.
        covariances: (n, 6, 6) of each.
    """
    total = covariances + np.diag(np.repeat(_spreads(vectors) ** 2 / _MEDIAN_CHI2_3, 3))
    return np.asarray(np.einsum("ni,ni->n", vectors, np.linalg.solve(total, vectors[..., None])[..., 0]))


def _central(poses: Sequence[RigidTransform]) -> RigidTransform:
    """Return the one of the poses with the smallest sum of distances to the others, in radians plus metres."""
    rotations = np.array([one.rotation for one in poses])
    positions_m = np.array([one.inverse().translation_m for one in poses])
    flat = rotations.reshape(len(poses), 9)
    angles_rad = np.arccos(np.clip((flat @ flat.T - 1.0) / 2.0, -1.0, 1.0))
    distances_m = np.linalg.norm(positions_m[:, None] - positions_m[None], axis=2)
    return poses[int(np.argmin((angles_rad + distances_m).sum(axis=1)))]


def _spreads(vectors: np.ndarray) -> np.ndarray:
    lengths = np.array([np.median(np.linalg.norm(vectors[:, block], axis=1)) for block in _BLOCKS])
    return np.maximum(lengths, _LEAST_SPREAD)


def _geometric_median(vectors: np.ndarray) -> Values:
    """Return the point (6,) with the smallest sum of distances to vectors (n, 6), by Weiszfeld's iteration."""
    median = np.zeros(6)
    for _ in range(_STEPS):
        away = vectors - median
        scaled = away / np.repeat(_spreads(away), 3)
        weights = 1.0 / np.maximum(np.linalg.norm(scaled, axis=1), 1e-3)
        median = weights @ vectors / weights.sum()
    return np.asarray(median)


def _log_jacobian(vector_rad: np.ndarray) -> np.ndarray:
    """Return d log(Exp(d) Exp(v)) / d d (3, 3): the inverse of the left Jacobian of the rotations."""
    angle, cross = float(np.linalg.norm(vector_rad)), skew(vector_rad)
    if angle < _SMALL_RAD:
        return np.asarray(np.eye(3) - 0.5 * cross + cross @ cross / 12.0)
    half = angle / 2.0
    factor = (1.0 - half * np.cos(half) / np.sin(half)) / angle**2
    return np.asarray(np.eye(3) - 0.5 * cross + factor * cross @ cross)
