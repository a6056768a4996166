"""Where the returns come from: the radar's own frame, or a body frame into which a driver or converter has moved them.

A radar measures ranges and angles, so its own place shows in what it reports. Two readings are compared, that the returns were
measured at the origin of their frame, and at the mount of the radar in it, by the logarithm of how much likelier the second is:

* bins: ranges and angles of a radar lie on few values about its own place, and on no lattice about another one. The values are
  coded as cells of the numbers' own resolution, with a Dirichlet-multinomial that learns how often they repeat;
* sides: an antenna sees what is in front of it, or it turns and sees everything;
* Doppler: while the vehicle moves, the speeds of what stands still are one velocity along the lines of sight from the radar.

Where no mount is known, or it explains nothing, the place is looked for: two neighboring returns in one bin of range are equally
far from it, so it is on the plane between them.
"""

from dataclasses import dataclass
from math import lgamma
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Points3, Values, Vector3
from calib_core.geometry import RigidTransform, rotation_from_euler
from calib_core.measurements import DataWarning, RadarScans
from calib_core.radar import direction_cosines
from calib_core.recordings.radar.scan_stream import RadarStream

Origin: TypeAlias = Literal["sensor", "body", "unknown"]
"""Whose frame returns are in."""

_SURE = float(np.log(1000.0))
"""A reading that is 1000 times likelier is taken: one recording of a thousand may be judged wrongly."""
_BODY_FRAMES = frozenset(
    {"base_link", "base_footprint", "base", "body", "car", "chassis", "ego", "ego_vehicle", "rear_axle", "vehicle"}
)
_BACK_SHARE = 0.01
"""An antenna is 20 dB weaker to its back."""
_PLACE_M = 0.5
"""Returns of one cell of this width are one place, seen again and again."""
_FLOAT32 = 2.0**-22
"""Of a coordinate: rounding to 32 bits, and the sums of a transform."""
_DECIMALS = range(1, 5)
_MOST_RETURNS = 4000
"""Evenly spread over the sample."""
_STRETCHES, _SCANS_OF_A_STRETCH, _ENOUGH = 4, 100, 2000
"""Of consecutive scans, which are read together, until there are enough returns."""
_REPEATING = np.logspace(-9, 2, 12)
"""Parameters of the Dirichlet distribution to choose from: the smaller, the more often values repeat."""
_STANDING_MPS = 0.1
_MOST_STANDING = 0.1
"""With a larger share of returns without speed, the vehicle stands."""
_FEWEST = 8
"""Returns of a scan, for a velocity and a judgment of it."""
_STEPS = 6
_LEAST_MPS = 0.02
"""A speed is known no better."""
_NEAR_M = 0.3
"""Two returns of one object."""
_PLANE_M, _WIDE_M = 0.003, 0.3
"""How near the place a plane passes, of returns in one bin of range, and of those in others: bins are 3 cm or more wide."""
_FARTHEST_MOUNT_M = 10.0
_PARALLEL = 0.05
"""Planes that are nearly parallel leave a direction open, as bins of angle do: the place nearest to the origin is taken."""
_TRIES = 400
_MOST_PAIRED, _MOST_PAIRS = 2000, 4000
_ELSEWHERE = RigidTransform(np.eye(3), np.array([1.0, 1.0, 0.0]))
"""Where the radar is not, for the bins about the origin to be compared with where no mount is known."""


@dataclass(frozen=True, slots=True)
class OriginFigures:
    """What returns show about one place from which they may have been measured.

    Attributes:
        bins: what bins of range and azimuth explain [nats].
        behind: share of the places that are behind the antenna.
        doppler_mps: how well one velocity a scan explains the speeds; NaN if the vehicle stands, or they are unknown.
    """

    bins: float
    behind: float
    doppler_mps: float


@dataclass(frozen=True, slots=True, eq=False)
class ReturnsOrigin:
    """Whose frame the returns of a radar are in.

    Attributes:
        frame: their frame_id; "" if they name none.
        by_data: what the returns themselves say.
        stated: what the user says; None if nothing.
        mount: pose of the radar in the body frame; None if it is not known.
        radar_frame: the name of the radar's own frame; "" if it is not known.
        log_ratio: logarithm of how much likelier the body frame is than the sensor's.
        place_m: where their bins say that they were measured, if it is neither the origin nor the mount; None if they do not say.
        figures: about the origin, and about the mount if it is known; none without returns.
    """

    frame: str = ""
    by_data: Origin = "unknown"
    stated: Origin | None = None
    mount: RigidTransform | None = None
    radar_frame: str = ""
    log_ratio: float = 0.0
    place_m: Vector3 | None = None
    figures: tuple[OriginFigures, ...] = ()

    @property
    def by_name(self) -> Origin:
        """What the name of their frame says."""
        return named_origin(self.frame)

    @property
    def moved_by(self) -> RigidTransform | None:
        """The mount, if the returns are in the body frame and are taken back to the radar; None if they are read as they are."""
        agreed = self.by_name if self.by_name == self.by_data else "unknown"
        return self.mount if (self.stated or agreed) == "body" else None

    @property
    def warnings(self) -> tuple[DataWarning, ...]:
        """What the user must know if they may be in another frame than the one they are read in."""
        settled = self.moved_by is not None or self.stated == "sensor"
        if settled or "body" not in (self.by_name, self.by_data, self.stated):
            return ()
        facts = {
            "frame": self.frame,
            "by_name": self.by_name,
            "by_data": self.by_data,
            "mounted": self.mount is not None,
            "stated": self.stated is not None,
            "place_m": () if self.place_m is None else tuple(self.place_m.tolist()),
        }
        return (DataWarning("radar-in-vehicle-frame", facts),)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was done to them, as sentences without their final periods."""
        if self.moved_by is None:
            return ()
        x, y, z, *turn = mount_numbers(self.moved_by)
        place = f"x {x:.3f}, y {y:.3f}, z {z:.3f} m, roll {turn[0]:.2f}, pitch {turn[1]:.2f}, yaw {turn[2]:.2f} deg"
        why = "as stated" if self.stated else "by its name and by the returns themselves"
        return (
            f"the returns are in {self.frame or 'a body frame'}, {why}, and are taken back to the radar at {place}",
        )


def mount_of(numbers: tuple[float, float, float, float, float, float]) -> RigidTransform:
    """Return the pose of a radar in the body frame.

    Args:
        numbers: x, y, z [m], roll, pitch, yaw [deg], as of a URDF's origin.
    """
    return RigidTransform(rotation_from_euler(*np.deg2rad(numbers[3:]).tolist()), np.array(numbers[:3]))


def mount_numbers(mount: RigidTransform) -> tuple[float, float, float, float, float, float]:
    """Return x, y, z [m], roll, pitch, yaw [deg] of a mount."""
    r = mount.rotation
    turn = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(-r[2, 0], np.hypot(r[2, 1], r[2, 2])), np.arctan2(r[1, 0], r[0, 0])
    x, y, z, roll, pitch, yaw = (np.concatenate([mount.translation_m, np.rad2deg(turn)]) + 0.0).tolist()
    return x, y, z, roll, pitch, yaw


def named_origin(frame: str) -> Origin:
    """Return what the name of a frame says."""
    if not frame:
        return "unknown"
    return "body" if frame.lower().rpartition("/")[2] in _BODY_FRAMES else "sensor"


def sampled(stream: RadarStream) -> RadarScans:
    """Decode some stretches of consecutive scans, spread over the recording."""
    each = len(stream.sample(2).points_radar_m) // 2
    long = int(np.clip(_ENOUGH // (_STRETCHES * max(each, 1)), 1, _SCANS_OF_A_STRETCH))
    first = np.linspace(0, max(len(stream.times_ns) - long, 0), _STRETCHES).astype(np.int64)
    wanted = np.unique(first[:, None] + np.arange(long))
    return stream.decoded(wanted[wanted < len(stream.times_ns)])


def origin_of(
    scans: RadarScans,
    frame: str,
    mount: RigidTransform | None = None,
    *,
    radar_frame: str = "",
    stated: Origin | None = None,
) -> ReturnsOrigin:
    """Judge a sample of scans.

    Args:
        scans: as the messages give them.
        frame: frame_id of the returns.
        mount: pose of the radar in the body frame; None if it is not known.
        radar_frame: the name of the radar's own frame; "" if it is not known.
        stated: what the user says.
    """
    there = np.flatnonzero(np.isfinite(scans.points_radar_m).all(axis=1))
    seen = scans.take(there[:: -(-len(there) // _MOST_RETURNS) or 1])
    points = seen.points_radar_m
    if not len(points):
        return ReturnsOrigin(frame, "unknown", stated, mount, radar_frame)
    step_m = _resolution_m(points)
    figures = [_figures(seen, points, step_m)]
    if mount is not None:
        figures.append(_figures(seen, mount.inverse() @ points, step_m))
        log_ratio = _log_ratio(seen, figures[0], figures[1])
    else:
        log_ratio = min(_bins(_ELSEWHERE @ points, step_m) - figures[0].bins, 0.0)
    place_m = None
    # Bins that explain a nat a return about the origin are the radar's own: no other place is looked for.
    if abs(log_ratio) < _SURE or (mount is None and log_ratio > -len(points)):
        place_m, by_place = _measured_at(points, step_m)
        place_m, log_ratio = (place_m, by_place) if by_place > _SURE else (None, log_ratio)
    by_data: Origin = "unknown" if abs(log_ratio) < _SURE else "body" if log_ratio > 0.0 else "sensor"
    return ReturnsOrigin(frame, by_data, stated, mount, radar_frame, log_ratio, place_m, tuple(figures))


def _figures(scans: RadarScans, points: Points3, step_m: float) -> OriginFigures:
    """Measure returns about a place, given their positions (n, 3) from there."""
    places = np.unique(np.round(points / _PLACE_M), axis=0)
    behind = float((places[:, 0] < 0.0).mean())
    return OriginFigures(_bins(points, step_m), behind, _misfit_mps(scans, points))


def _log_ratio(scans: RadarScans, origin: OriginFigures, mount: OriginFigures) -> float:
    places = len(np.unique(np.round(scans.points_radar_m / _PLACE_M), axis=0))
    ratio = mount.bins - origin.bins + places * (_sides(mount.behind) - _sides(origin.behind))
    if np.isfinite([origin.doppler_mps, mount.doppler_mps]).all():
        ratio += int(np.isfinite(scans.doppler_mps).sum()) * float(np.log(origin.doppler_mps / mount.doppler_mps))
    return ratio


def _sides(behind: float) -> float:
    """Return the logarithm of the likelihood of a place, given the share of places behind: of an antenna or one that turns."""
    return max(behind * np.log(_BACK_SHARE) + (1.0 - behind) * np.log(1.0 - _BACK_SHARE), np.log(0.5))


def _resolution_m(points: Points3) -> float:
    """Return the step of the coordinates [m]: of their decimals, or else of 32-bit numbers."""
    rounding_m = _FLOAT32 * max(float(np.abs(points).max()), 1.0)
    decimal = (10.0**-places for places in _DECIMALS if np.abs(points - np.round(points, places)).max() <= rounding_m)
    return next(decimal, rounding_m)


def _bins(points: Points3, step_m: float) -> float:
    """Return what bins of range, and of azimuth or its sine, explain beyond those of x and y [nats]; 0 if they explain less."""
    _, first = np.unique(np.round(points / step_m), axis=0, return_index=True)  # repeated ones repeat about any place
    x, y = points[first, :2].T
    range_m, u, _ = direction_cosines(points[first]).T
    angles = np.median(range_m) * np.array([np.arctan2(y, x), u])
    polar = _repeats(range_m, step_m) + max(_repeats(values, step_m) for values in angles)
    return max(polar - _repeats(x, step_m) - _repeats(y, step_m), 0.0)


def _measured_at(points: Points3, step_m: float) -> tuple[Vector3, float]:
    """Return the place (3,) from which the most pairs of neighboring returns are equally far, and the logarithm of how much
    likelier than by chance that is, less the same of the origin.

    Of a place that a few pairs make, all others meet by chance: of the planes within `_WIDE_M`, a share of `_PLANE_M / _WIDE_M`.
    """
    from scipy.spatial import cKDTree

    _, first = np.unique(np.round(points / step_m), axis=0, return_index=True)
    points = points[first[:: max(1, len(first) // _MOST_PAIRED)]]
    axes = np.flatnonzero(np.ptp(points, axis=0) > _PLANE_M)  # a radar without elevation has two
    pairs = cKDTree(points).query_pairs(_NEAR_M, output_type="ndarray")
    pairs = pairs[:: max(1, len(pairs) // _MOST_PAIRS)]
    apart = (points[pairs[:, 1]] - points[pairs[:, 0]])[:, axes]
    long_m = np.linalg.norm(apart, axis=1)
    wide = long_m > 10.0 * _PLANE_M
    pairs, normals = pairs[wide], apart[wide] / long_m[wide, None]
    grid = min(_repeats(points[:, axis], step_m) for axis in (0, 1)) > len(points)  # of both x and y: a nat a return
    if len(pairs) < _FEWEST or len(axes) < 2 or grid or step_m > _PLANE_M:
        return np.zeros(3), 0.0
    middles = 0.5 * (points[pairs[:, 0]] + points[pairs[:, 1]])[:, axes]
    offsets = (normals * middles).sum(axis=1)
    some = np.random.default_rng(0).integers(len(pairs), size=(_TRIES, len(axes)))
    places = (np.linalg.pinv(normals[some], _PARALLEL) @ offsets[some][:, :, None])[:, :, 0]
    places = np.concatenate([np.zeros((1, len(axes))), places[np.linalg.norm(places, axis=1) < _FARTHEST_MOUNT_M]])
    off_m = np.abs(places @ normals.T - offsets)
    off_m[np.linalg.norm(places[:, None] - middles, axis=2) < 5.0 * _NEAR_M] = np.inf  # near it all pairs are alike
    each = max(len(pairs) / len(np.unique(pairs)), 1.0)  # the pairs of a cluster repeat each other
    made_by = np.where(np.arange(len(places)) > 0, len(axes), 0)
    hits = np.maximum((off_m < _PLANE_M).sum(axis=1) - made_by, 0) / each
    chance = np.maximum((off_m < _WIDE_M).sum(axis=1) * _PLANE_M / _WIDE_M, 1.0) / each
    gains = np.where(hits > chance, hits * np.log(np.maximum(hits, chance) / chance) - (hits - chance), 0.0)
    best, place_m = int(gains.argmax()), np.zeros(3)
    place_m[axes] = places[best]
    return place_m, float(gains[best] - gains[0] - np.log(_TRIES))


def _repeats(values: Values, step: float) -> float:
    """Return by how much the best Dirichlet-multinomial code of values in cells of a step beats one of equal cells [nats]."""
    cells, count = max(float(np.ptp(values)) / step, 2.0), len(values)
    times, how_many = np.unique(np.unique(np.round(values / step), return_counts=True)[1], return_counts=True)
    lengths = [
        lgamma(a * cells + count)
        - lgamma(a * cells)
        - sum(n * (lgamma(time + a) - lgamma(a)) for time, n in zip(times.tolist(), how_many.tolist(), strict=True))
        for a in _REPEATING.tolist()
    ]
    return max(count * float(np.log(cells)) - min(lengths), 0.0)


def _misfit_mps(scans: RadarScans, points: Points3) -> float:
    """Return how well one velocity a scan explains the speeds [m/s]: the median over the scans of a moving vehicle; else NaN.

    A velocity is fitted with weights that fall with the misfit (Cauchy's), so that what moves by itself counts little.
    """
    lines = points[:, :2] / np.maximum(np.linalg.norm(points, axis=1, keepdims=True), _LEAST_MPS)
    misfits = []
    for first, last in zip(scans.first_return[:-1].tolist(), scans.first_return[1:].tolist(), strict=True):
        known = np.flatnonzero(np.isfinite(scans.doppler_mps[first:last])) + first
        speeds, along = scans.doppler_mps[known], lines[known]
        if len(known) < _FEWEST or (np.abs(speeds) < _STANDING_MPS).mean() > _MOST_STANDING:
            continue
        off, weights = np.zeros(0), np.ones(len(known))
        for _ in range(_STEPS):
            velocity = np.linalg.lstsq(along * weights[:, None], speeds * weights, rcond=None)[0]
            off = np.abs(speeds - along @ velocity)
            weights = 1.0 / np.hypot(1.0, off / max(float(np.median(off)), _LEAST_MPS))
        misfits.append(max(float(np.median(off)), _LEAST_MPS))
    return float(np.median(misfits)) if 2 * len(misfits) > len(scans) else float("nan")
