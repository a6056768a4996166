"""Traffic as a witness: how far the middles of boxes are from the returns in them, and what that says of a turn since a baseline.

A row is the mean over a second of one passage in one direction: the bearing of the middle of a box minus the middle of the
extent of all returns in it, or its elevation minus the mean of the strongest returns. Where on a body the radar sees it is
unknown: one random value for each passage and direction, with a variance that the baseline teaches by class, beside that of a
single second. Baseline and window share the pose's errors, the clocks' and the classes' body heights, so these cancel in the
change.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from calib_core.arrays import Flags, Indices, Points3, TimesNs, Values, Vector3, freeze
from calib_core.camera import Camera
from calib_core.evaluation.counted_returns import (
    Bearings,
    BoxTable,
    Matches,
    Sightings,
    boxes_in_bearing,
    frame_scans,
    match_by_bearing,
    tracked_sightings,
)
from calib_core.evaluation.target_tracking import find_targets
from calib_core.geometry import RigidTransform
from calib_core.json_forms import Count
from calib_core.measurements import NS_PER_S, RadarScans
from calib_core.radar import RadarErrors
from calib_core.watching.still_returns import Finite
from calib_core.watching.witnesses import Turn

BEARING, ELEVATION = 0, 1

_SECOND_NS = NS_PER_S
_BORDER_PX = 3.0
_FARTHEST_M = 80.0
_STRONGEST_DB = 3.0
_MISTAKEN_RAD = np.deg2rad(4.0)  # from the median of a second: a return of something else
_RATE_FRAMES = 5
_RATE_SPAN_S = 3.0
_FEWEST = 2
_PASSAGE_NS = 20 * NS_PER_S
"""The longest passage: where on a body the radar sees it changes as it turns, so an object that stays passes again."""
_MOST_PASSAGES = 1 << 32


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """What is watched: a calibration's pose, lens and corrections.

    Attributes:
        camera_from_radar: the pose.
        camera: the lens.
        radar_errors: that the calibration takes out of the returns.
    """

    camera_from_radar: RigidTransform
    camera: Camera
    radar_errors: RadarErrors


@dataclass(frozen=True, slots=True, eq=False)
class TrafficRows:
    """What matched targets and boxes say: n rows, each the mean of a second of one passage in one direction.

    Attributes:
        times_ns: (n,) middle of each.
        directions: (n,) 0 for bearing (to the right), 1 for elevation (downwards).
        residuals_rad: (n,) of the box minus the returns.
        design: (n, 4) by how much a turn about the camera's x, y and z moves the returns, and the box moves in a second [rad/s].
        heights_rad: (n,) angular height of the box; 0 in bearing.
        ranges_m: (n,).
        counts: (n,) number of frames.
        passages: (n,) equal numbers are one object that passes, for at most twenty seconds.
        labels: (n,) its class.
    """

    times_ns: TimesNs
    directions: Indices
    residuals_rad: Values
    design: np.ndarray
    heights_rad: Values
    ranges_m: Values
    counts: Values
    passages: Indices
    labels: np.ndarray

    def __len__(self) -> int:
        return len(self.times_ns)

    def some(self, kept: Flags | Indices) -> "TrafficRows":
        """Return some of the rows."""
        return TrafficRows(*(getattr(self, field.name)[kept] for field in fields(self)))

    @classmethod
    def joined(cls, parts: "Sequence[TrafficRows]") -> "TrafficRows":
        """Put rows after one another; at least one part."""
        return cls(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(cls)))


@dataclass(frozen=True, slots=True, eq=False)
class _Frames:
    """Matched boxes, one row a frame: what is averaged over a second."""

    times_ns: TimesNs
    residuals_rad: np.ndarray
    design: np.ndarray
    heights_rad: Values
    ranges_m: Values
    tracks: Indices
    labels: np.ndarray
    whole: Flags


def _frames(
    watched: Watched, sightings: Sightings, matches: Matches, table: BoxTable, scan_times_ns: TimesNs
) -> _Frames:
    """Return the boxes with a target: its sightings, and the stamp of the scan of each annotated frame (f,)."""
    of_box = boxes_in_bearing(matches, sightings, table, watched.camera)[sightings.of_return]
    matched = np.flatnonzero(of_box >= 0)
    points = watched.camera_from_radar @ watched.radar_errors.corrected(sightings.points_radar_m[matched])
    camera, ahead = watched.camera, points[:, 2] > 1.0
    matched, points = matched[ahead], points[ahead]
    boxes, own = np.unique(of_box[matched], return_inverse=True)
    centres, angles = _seen(points, sightings.snr_db[matched], own, len(boxes))
    sides = table.boxes_px[boxes]
    size = np.array([camera.width_px, camera.height_px]) - 1.0 - _BORDER_PX
    inside = (sides[:, :2] > _BORDER_PX) & (sides[:, 2:] < size)
    kept = inside[:, 0] & (np.linalg.norm(centres, axis=1) < _FARTHEST_M)
    boxes, sides, centres, angles, whole = boxes[kept], sides[kept], centres[kept], angles[kept], inside[kept, 1]
    columns = (sides[:, 0] + sides[:, 2]) / 2.0
    middle, top, bottom = (
        _angles(camera.rays(np.stack([columns, row], axis=1)))
        for row in ((sides[:, 1] + sides[:, 3]) / 2.0, sides[:, 1], sides[:, 3])
    )
    frames = table.frames[boxes]
    rates = _rates(table, camera)[boxes]
    late_s = (table.times_ns[frames] - scan_times_ns[frames]) / NS_PER_S
    residuals = middle - angles - rates * late_s[:, None]
    design = np.concatenate([_by_turn(centres), -rates[:, :, None]], axis=2)
    known = np.isfinite(residuals).all(axis=1) & np.isfinite(design).all(axis=(1, 2))
    return _Frames(
        table.times_ns[frames][known],
        residuals[known],
        design[known],
        (bottom - top)[known, 1],
        np.linalg.norm(centres, axis=1)[known],
        table.tracks[boxes][known],
        np.array(table.labels, dtype=object)[boxes][known],
        whole[known],
    )


def _angles(points: Points3) -> np.ndarray:
    """Return bearing to the right and elevation downwards (n, 2) [rad] of points in the camera frame."""
    return np.stack(
        [np.arctan2(points[:, 0], points[:, 2]), np.arctan2(points[:, 1], np.hypot(points[:, 0], points[:, 2]))], axis=1
    )


def _seen(points: Points3, snr_db: Values, own: Indices, count: int) -> tuple[Points3, np.ndarray]:
    """Return the mean (m, 3) of the returns in each box, and where the radar sees it (m, 2) [rad].

    A near car is wider than its strongest part, so its bearing is the middle of its extent. The ground below a person pulls a
    mean of all returns down, so the elevation is that of the strongest returns.
    """
    angles = _angles(points)
    low, high, top = np.full(count, np.inf), np.full(count, -np.inf), np.full(count, -np.inf)
    np.minimum.at(low, own, angles[:, 0])
    np.maximum.at(high, own, angles[:, 0])
    levels = np.nan_to_num(snr_db)
    np.maximum.at(top, own, levels)
    strong = (levels >= top[own] - _STRONGEST_DB).astype(np.float64)
    elevation = np.bincount(own, strong * angles[:, 1], minlength=count) / np.bincount(own, strong, minlength=count)
    sizes = np.bincount(own, minlength=count)
    centres = np.stack([np.bincount(own, axis, minlength=count) / sizes for axis in points.T], axis=1).reshape(-1, 3)
    return centres, np.stack([(low + high) / 2.0, elevation], axis=1)


def _by_turn(points: Points3) -> np.ndarray:
    """Return by how much a turn about the camera's x, y and z moves points (n, 2, 3), in bearing and elevation."""
    x, y, z = points.T
    flat, squared = np.hypot(x, z), (points**2).sum(axis=1)
    none = np.zeros(len(points))
    bearing = np.stack([z / flat**2, none, -x / flat**2], axis=1)
    elevation = np.stack([-y * x / flat / squared, flat / squared, -y * z / flat / squared], axis=1)
    moved = [np.cross(axis, points) for axis in np.eye(3)]
    return np.stack(
        [np.stack([(way * step).sum(axis=1) for step in moved], axis=1) for way in (bearing, elevation)], axis=1
    )


def _rates(table: BoxTable, camera: Camera) -> np.ndarray:
    """Return how fast the middle of each box (b, 2) moves [rad/s], from the same object half a dozen frames before and after."""
    order = np.lexsort((table.frames, table.tracks))
    sides, tracks = table.boxes_px[order], table.tracks[order]
    angles = _angles(camera.rays((sides[:, :2] + sides[:, 2:]) / 2.0))
    times_s = (table.times_ns[table.frames[order]] - table.times_ns[0]) / NS_PER_S
    first, last = (np.searchsorted(tracks, tracks, side=side) for side in ("left", "right"))
    each = np.arange(len(order))
    low, high = np.maximum(each - _RATE_FRAMES, first), np.minimum(each + _RATE_FRAMES, last - 1)
    span_s = times_s[high] - times_s[low]
    rates = (angles[high] - angles[low]) / np.maximum(span_s, 1e-3)[:, None]
    rates[(span_s <= 0.0) | (span_s > _RATE_SPAN_S)] = 0.0
    unsorted = np.empty_like(rates)
    unsorted[order] = rates
    return unsorted


def _seconds(frames: _Frames) -> TrafficRows:
    """Average frames over seconds of a passage, without those far from their median; a second needs two."""
    seconds = frames.times_ns // _SECOND_NS
    keys = np.stack([frames.tracks, seconds], axis=1)
    own = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1) if len(keys) else np.zeros(0, dtype=np.int64)
    order = np.argsort(own, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(own[order])) + 1) if len(order) else []
    found = []
    for rows in groups:
        for direction in (BEARING, ELEVATION):
            usable = rows if direction == BEARING else rows[frames.whole[rows]]
            residuals = frames.residuals_rad[usable, direction]
            if len(usable) < _FEWEST:
                continue
            kept = usable[np.abs(residuals - np.median(residuals)) < _MISTAKEN_RAD]
            if len(kept) >= _FEWEST:
                found.append((direction, kept))
    which = np.array([direction for direction, _ in found], dtype=np.int64)
    return TrafficRows(
        np.array([frames.times_ns[kept].mean() for _, kept in found], dtype=np.int64),
        which,
        np.array([frames.residuals_rad[kept, way].mean() for way, kept in found]),
        np.array([frames.design[kept, way].mean(axis=0) for way, kept in found]).reshape(-1, 4),
        np.where(which == ELEVATION, [frames.heights_rad[kept].mean() for _, kept in found], 0.0),
        np.array([frames.ranges_m[kept].mean() for _, kept in found]),
        np.array([float(len(kept)) for _, kept in found]),
        np.array([_passage(frames, int(kept[0])) for _, kept in found], dtype=np.int64),
        np.array([frames.labels[kept[0]] for _, kept in found], dtype=object),
    )


def _passage(frames: _Frames, row: int) -> int:
    """Return the number of a passage: of the object, and of the twenty seconds that it is seen in."""
    return int(frames.tracks[row]) * _MOST_PASSAGES + int(frames.times_ns[row]) // _PASSAGE_NS


_TURN_PRIOR_RAD, _CLOCK_PRIOR_S, _BODY_PRIOR = np.deg2rad(20.0), 0.3, 0.15
"""Of the baseline's pose, its clocks, and where on a body the radar sees it, as a share of the box's height."""
_CHANGE_PRIOR_RAD = np.deg2rad(20.0)
_CLOCK_CHANGE_PRIOR_S = 0.1
_OWN = 4  # unknowns of the baseline beside one for each class
_FEWEST_TO_LEARN = 6
_ROUNDS = 3
_USUAL_SIGMAS, _MISTAKEN_SIGMAS = 2.0, 5.0
"""What is farther off counts less (Huber: 99 % efficient where errors are normal), and teaches no variance."""
_UNKNOWN_CLASS = 4.0  # times the largest variance of a class that the baseline has
_MOST_OF_A_PASSAGE = 8.0
_USUAL_PASSAGE, _EXPECTED = 0.5, 2.0
"""What is expected of the factor of passages before any is seen (that of a second is 1), with the weight of how many."""


def starting_variances(rows: TrafficRows) -> tuple[Values, Values]:
    """Return the variances of a second and of a passage (n,) that factors of a class are about [rad^2]."""
    near = np.where(rows.directions == BEARING, 0.12, 0.25) / rows.ranges_m
    single = np.deg2rad(np.where(rows.directions == BEARING, 0.5, 0.8)) ** 2 + near**2
    return single * (1.0 / np.maximum(rows.counts / 3.0, 1.0) + 0.3), 0.5 * single


@dataclass(frozen=True, slots=True, eq=False)
class TurnFromTraffic(Turn):
    """What the traffic of some seconds says of a turn of the camera against the radar since the baseline.

    Attributes:
        passages: that say it.
        least_z: (3,) smallest turn over its standard deviation about each axis, without whichever single passage; 0 if that
            changes the sign, or if there are fewer than three.
        worst_sigma_rad: (3,) largest standard deviation without whichever single passage; infinite if there are fewer than three.
        late_s: by how much later the images are stamped against the scans than in the baseline, and its standard deviation.
    """

    passages: int
    least_z: Vector3
    worst_sigma_rad: Vector3
    late_s: tuple[float, float]

    def __post_init__(self) -> None:
        Turn.__post_init__(self)
        freeze(self, least_z=(3,), worst_sigma_rad=(3,))


class TrafficModel(Struct, frozen=True, forbid_unknown_fields=True):
    """How boxes and returns differ in traffic, by class; the unknowns are turn, clock, and the body height of each class.

    Attributes:
        labels: the classes (m).
        factors: (m, 2, 2) of the starting variances, by class and direction: of a second, of a passage.
        middle: (4 + m,) what its own rows say.
        information: (4 + m, 4 + m) of its rows.
        gradient: (4 + m,).
        passages: number of passages of each class (m).
        seconds: of traffic.
    """

    labels: Annotated[list[Annotated[str, Meta(max_length=200)]], Meta(max_length=200)]
    factors: list[list[list[Finite]]]
    middle: list[Finite]
    information: list[list[Finite]]
    gradient: list[Finite]
    passages: list[Count]
    seconds: Annotated[float, Meta(ge=0.0, le=1e9)]

    def __post_init__(self) -> None:
        count = len(self.labels)
        size = _OWN + count
        parts = (self.factors, self.middle, self.information, self.gradient, self.passages)
        shapes = [(count, 2, 2) if count else (0,), (size,), (size, size), (size,), (count,)]
        if [np.shape(part) for part in parts] != shapes or len(set(self.labels)) != count:
            raise ValueError("its parts must be of one size, and each label there once; write the baseline again")
        least = np.linalg.eigvalsh(self.information).min()
        if np.min(self.factors, initial=1.0) <= 0.0 or least < -1e-6 * abs(np.trace(self.information)):
            raise ValueError("factors and information must be positive; write the baseline again from its recording")

    def turn(self, rows: TrafficRows) -> TurnFromTraffic | None:
        """Return what rows say of a turn since the baseline; None without any."""
        if not len(rows):
            return None
        labels = (*self.labels, *sorted(set(rows.labels.tolist()) - set(self.labels)))
        classes = _classes(rows, labels)
        size = _OWN + len(labels)
        second, passage = _variances(np.array(self.factors).reshape(-1, 2, 2), rows, classes)
        design = np.concatenate([_design(rows, classes, len(labels)), rows.design], axis=1)
        before, towards = _prior(len(labels), change=True), np.zeros(size + _OWN)
        inner = slice(0, len(self.middle))
        before[inner, inner] += self.information
        towards[inner] += self.gradient
        wider = np.ones(len(rows))
        for _ in range(_ROUNDS):
            names, blocks, gradients = _by_passage(rows, design, wider * second, wider * passage)
            total, gradient = before + blocks.sum(axis=0), towards + gradients.sum(axis=0)
            inverse = np.linalg.inv(total)
            wider = _wider(rows.residuals_rad - design @ (inverse @ gradient), second + passage)
        change = slice(size, size + 3)
        middle = inverse @ gradient
        rotation, covariance = middle[change], inverse[change, change]
        late_s = float(middle[size + 3]), float(np.sqrt(inverse[size + 3, size + 3]))
        z = rotation / np.sqrt(np.diag(covariance))
        least, worst = np.zeros(3), np.full(3, np.inf)
        if len(names) >= _FEWEST_PASSAGES:
            without = np.linalg.inv(total - blocks)
            turns = np.einsum("pij,pj->pi", without, gradient - gradients)[:, change]
            sigmas = np.sqrt(np.einsum("pii->pi", without)[:, change])
            least = np.clip((turns / sigmas * np.sign(z)).min(axis=0), 0.0, np.abs(z))
            worst = sigmas.max(axis=0)
        return TurnFromTraffic(rotation, covariance, len(names), least, worst, late_s)


def _variances(factors: np.ndarray, rows: TrafficRows, classes: Indices) -> tuple[Values, Values]:
    """Return the variances of a second and of a passage (n,), those of an unknown class well above all others."""
    widest = factors.max(axis=0, initial=1.0)
    unknown = np.broadcast_to(_UNKNOWN_CLASS * widest, (int(classes.max(initial=-1)) + 1, 2, 2))
    factors = np.concatenate([factors, unknown[len(factors) :]])
    second, passage = starting_variances(rows)
    own = factors[classes, rows.directions] if len(rows) else np.zeros((0, 2))
    return second * own[:, 0], passage * own[:, 1]


_FEWEST_PASSAGES = 3


def learned(rows: TrafficRows) -> TrafficModel:
    """Learn from a baseline's rows: variances by class and direction about its own fit, and what that fit is."""
    labels = sorted(set(rows.labels.tolist()))
    classes = _classes(rows, labels)
    design = _design(rows, classes, len(labels))
    prior = _prior(len(labels), change=False)
    base = starting_variances(rows)
    factors = np.ones((len(labels), 2, 2))
    passages = [len(np.unique(rows.passages[classes == one])) for one in range(len(labels))]
    span_s = float(np.ptp(rows.times_ns)) / NS_PER_S if len(rows) else 0.0
    wider = np.ones(len(rows))
    for _ in range(2 * _ROUNDS):
        second, passage = _variances(factors, rows, classes)
        blocks, gradients = _by_passage(rows, design, wider * second, wider * passage)[1:]
        information, gradient = blocks.sum(axis=0), gradients.sum(axis=0)
        middle = np.linalg.solve(information + prior, gradient)
        residuals = rows.residuals_rad - design @ middle
        usual = np.abs(residuals) < _MISTAKEN_SIGMAS * np.sqrt(second + passage)
        wider = _wider(residuals, second + passage)
        residuals = residuals / np.sqrt(wider)
        factors = np.array([
            [_factors(rows, residuals, base, np.flatnonzero(usual & (classes == one) & (rows.directions == way)))
             for way in (BEARING, ELEVATION)]
            for one in range(len(labels))
        ]).reshape(-1, 2, 2)  # fmt: skip
    statistics = (factors.tolist(), middle.tolist(), information.tolist(), gradient.tolist())
    return TrafficModel(labels, *statistics, passages, span_s)


def _wider(residuals: Values, variances: Values) -> Values:
    """Return by what variances (n,) are to be multiplied, so that what is far off counts less (Huber)."""
    return np.maximum(np.abs(residuals) / np.sqrt(variances) / _USUAL_SIGMAS, 1.0)


def _factors(rows: TrafficRows, residuals: Values, base: tuple[Values, Values], own: Indices) -> tuple[float, float]:
    """Return by what the starting variances of a second and of a passage are to be multiplied."""
    if len(own) < _FEWEST_TO_LEARN:
        return _UNKNOWN_CLASS, _UNKNOWN_CLASS
    second, passage = base[0][own], base[1][own]
    which, counts = np.unique(rows.passages[own], return_inverse=True, return_counts=True)[1:]
    means = np.bincount(which, residuals[own]) / counts
    within = float(((residuals[own] - means[which]) ** 2 / second).sum())
    of_second = (within + _EXPECTED) / (len(own) - len(counts) + _EXPECTED)
    noise = of_second * np.bincount(which, second) / counts**2
    excess = (means**2 - noise) / (np.bincount(which, passage) / counts)
    weights = np.minimum(counts, _MOST_OF_A_PASSAGE) / _MOST_OF_A_PASSAGE
    of_passage = max(float(weights @ excess), 0.0) + _USUAL_PASSAGE * _EXPECTED
    return of_second, of_passage / (float(weights.sum()) + _EXPECTED)


def _classes(rows: TrafficRows, labels: Sequence[str]) -> Indices:
    places = {label: place for place, label in enumerate(labels)}
    return np.array([places[label] for label in rows.labels.tolist()], dtype=np.int64)


def _design(rows: TrafficRows, classes: Indices, count: int) -> np.ndarray:
    """Return by how much the baseline's unknowns move rows (n, 4 + m): turn, clock, body height of each class."""
    body = np.where(classes[:, None] == np.arange(count), rows.heights_rad[:, None], 0.0)
    return np.concatenate([rows.design, body], axis=1)


def _prior(classes: int, *, change: bool) -> np.ndarray:
    sigmas = [*[_TURN_PRIOR_RAD] * 3, _CLOCK_PRIOR_S, *[_BODY_PRIOR] * classes]
    sigmas += [*[_CHANGE_PRIOR_RAD] * 3, _CLOCK_CHANGE_PRIOR_S] if change else []
    return np.diag(np.array(sigmas) ** -2.0)


def _by_passage(
    rows: TrafficRows, design: np.ndarray, second: Values, passage: Values
) -> tuple[Indices, np.ndarray, np.ndarray]:
    """Return the passages (p,), with the information (p, k, k) and gradient (p, k) of each.

    The random value of a passage and direction is integrated out: the covariance of its rows is diag(second) + passage.
    """
    groups, own = np.unique(2 * rows.passages + rows.directions, return_inverse=True)
    count = len(groups)
    weights = 1.0 / second
    weighted = design * weights[:, None]
    sums = np.stack([np.bincount(own, column, minlength=count) for column in weighted.T], axis=1)
    size = np.bincount(own, minlength=count)
    variance = np.bincount(own, passage, minlength=count) / size
    share = 1.0 / (1.0 / variance + np.bincount(own, weights, minlength=count))
    towards = np.bincount(own, weights * rows.residuals_rad, minlength=count)
    names, of_group = np.unique(groups // 2, return_inverse=True)
    blocks = np.zeros((len(names), design.shape[1], design.shape[1]))
    gradients = np.zeros((len(names), design.shape[1]))
    np.add.at(blocks, of_group[own], weighted[:, :, None] * design[:, None, :])
    np.add.at(blocks, of_group, -share[:, None, None] * sums[:, :, None] * sums[:, None, :])
    np.add.at(gradients, of_group[own], weighted * rows.residuals_rad[:, None])
    np.add.at(gradients, of_group, -(share * towards)[:, None] * sums)
    return names, blocks, gradients


def rows_of_stretch(
    watched: Watched,
    scans: RadarScans,
    table: BoxTable,
    *,
    span_ns: tuple[int, int],
    start: Bearings | None = None,
) -> tuple[TrafficRows, Bearings | None]:
    """Follow the targets of a stretch, match them to boxes and average; also return how the sensors saw the same target.

    Args:
        watched: the calibration.
        scans: of the stretch, and of some seconds before and after it.
        table: the boxes; those of the frames in the stretch count.
        span_ns: first stamp of the stretch, and that of the next one.
        start: how the sensors saw the same target in the stretch before.
    """
    tracks = find_targets([scans]).tracks
    scans_of_frames = frame_scans(table.times_ns, scans.times_ns)
    within = (table.times_ns >= span_ns[0]) & (table.times_ns < span_ns[1])
    sightings = tracked_sightings(tracks, np.where(within, scans_of_frames, -1))
    matches = match_by_bearing(sightings, table, watched.camera, start=start)
    scan_times = scans.times_ns[np.maximum(scans_of_frames, 0)] if len(scans) else table.times_ns
    return _seconds(_frames(watched, sightings, matches, table, scan_times)), matches.bearings or start
