"""Counted returns: what Acc is computed from, the same for every calibration that is judged.

Sightings are what the radar sees of each moving target in each annotated frame. Which boxes of successive frames are around one
object is what their source says, or how they move.

Matching: which box is around which target. The calibration that is judged has no say in it. Radar and camera see a target at a
bearing each. Whatever the pose, the two differ by one angle that all targets share, and by the parallax, which falls with the
range. Both are found from all targets and boxes together: the angle is the one under which most sightings meet a box. Each
target is then given the box track that it meets best over the life that both share, the longest agreement first, and in each
frame a target has at most one box and a box at most one target. What the radar follows in parts, such as the two ends of a car,
joins the part that is matched.

Where the boxes have cuboids, nothing has to move and no frame has to follow another: a return belongs to the cuboid it is in.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Indices, Points3, TimesNs, Values, Vector3, freeze
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.evaluation.moving_returns import TargetOptions
from calib_core.evaluation.target_tracking import TargetTrack, sigma_polar
from calib_core.measurements import NS_PER_S, Box, Boxes, Cuboid, RadarScans, ReturnLabels


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """The returns of targets in the scans that belong to annotated frames, in order of frames, then targets.

    Attributes:
        names: of the targets.
        frames: (s,) frame of each sighting.
        targets: (s,) index of its target.
        azimuth_rad: (s,) of the mean of its returns.
        range_m: (s,) likewise.
        of_return: (n,) the sighting of each return, ascending.
        points_radar_m: (n, 3) the returns.
        snr_db: (n,) of the returns; NaN where the radar reports none.
    """

    names: tuple[str, ...]
    frames: Indices
    targets: Indices
    azimuth_rad: Values
    range_m: Values
    of_return: Indices
    points_radar_m: Points3
    snr_db: Values

    def __post_init__(self) -> None:
        freeze(self, np.int64, frames=(None,), targets=(None,), of_return=(None,))
        count, returns = len(self.frames), len(self.of_return)
        freeze(self, azimuth_rad=(count,), range_m=(count,), points_radar_m=(returns, 3), snr_db=(returns,))


@dataclass(frozen=True, slots=True)
class Bearings:
    """How a target's bearing in the image follows from the radar's azimuth: azimuth + turn + parallax / range.

    Attributes:
        turn_rad: of the camera against the radar, about the vertical; positive to the left.
        parallax_m: distance between the sensors, across.
    """

    turn_rad: float
    parallax_m: float

    def of(self, sightings: Sightings) -> Values:
        """Return the bearing (s,) at which the camera sees each sighting [rad], positive to the left."""
        return _wrapped(sightings.azimuth_rad + self.turn_rad + self.parallax_m / np.maximum(sightings.range_m, 0.5))


@dataclass(frozen=True, slots=True, eq=False)
class BoxTable:
    """The boxes of a recording as columns, in order of the frames.

    Attributes:
        times_ns: (f,) stamps of the annotated frames.
        frames: (b,) which of them each box is in.
        boxes_px: (b, 4) left, top, right, bottom.
        labels: (b,) the classes.
        tracks: (b,) equal numbers are one object in several frames.
        names: (b,) what their source calls the objects; "" if it does not follow them.
        cuboids: (b, 5) middle ahead and to the left of the camera, length, width [m], heading [rad]; NaN without one.
    """

    times_ns: TimesNs
    frames: Indices
    boxes_px: np.ndarray
    labels: tuple[str, ...]
    tracks: Indices
    names: tuple[str, ...]
    cuboids: np.ndarray

    def __post_init__(self) -> None:
        count = len(self.labels)
        freeze(self, np.int64, times_ns=(None,), frames=(count,), tracks=(count,))
        freeze(self, boxes_px=(count, 4), cuboids=(count, 5))


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """The box of each sighting, and whether the sighting counts.

    Attributes:
        boxes: (s,) row of the table; -1 for none.
        counts: (s,) whether it has a box, or would be in the image: what the camera cannot see has no box.
        bearings: how the two sensors see the same target; None if nothing shows it, and everything counts.
    """

    boxes: Indices
    counts: Flags
    bearings: Bearings | None

    def __post_init__(self) -> None:
        freeze(self, np.int64, boxes=(None,))
        freeze(self, np.bool_, counts=(len(self.boxes),))


@dataclass(frozen=True, slots=True, eq=False)
class CountedReturns:
    """The returns of targets in the annotated frames, with the boxes of those targets.

    Attributes:
        image_times: (f,) stamps of the frames that have a scan.
        radar_times: (f,) stamps of those scans.
        box_counts: (f,) number of boxes in each.
        frames: (n,) the frame of each return, ascending.
        points_radar_m: (n, 3) as the radar reports them.
        boxes_px: (n, 4) left, top, right, bottom of its target's box; NaN without one.
        labels: (n,) the class of that box; "" without one.
        targets: (n,) names of the targets.
        found_targets: number of targets in these frames.
        matched_targets: number of those that have a box in at least one frame.
        bearings: how the two sensors see the same target; None if nothing shows it.
        rule: which returns count and how they were matched, in one sentence.
        source: of the boxes.
        by_cuboid: whether the targets are whatever has a cuboid, not what the radar followed.
    """

    image_times: TimesNs
    radar_times: TimesNs
    box_counts: Indices
    frames: Indices
    points_radar_m: Points3
    boxes_px: np.ndarray
    labels: tuple[str, ...]
    targets: tuple[str, ...]
    found_targets: int
    matched_targets: int
    bearings: Bearings | None
    rule: str
    source: str
    by_cuboid: bool = False

    def __post_init__(self) -> None:
        n, count = len(self.labels), len(self.image_times)
        freeze(self, np.int64, image_times=(count,), radar_times=(count,), box_counts=(count,), frames=(n,))
        freeze(self, points_radar_m=(n, 3), boxes_px=(n, 4))


def counted_returns(
    camera: Camera,
    scans: RadarScans,
    boxes: Boxes,
    found: Sequence[TargetTrack] | ReturnLabels | None,
    *,
    classes: Sequence[str] = (),
    max_gap_s: float | None = None,
) -> CountedReturns:
    """Say which returns count and which box each belongs to; no pose enters.

    Args:
        camera: the lens.
        scans: of the recording; followed targets need only their stamps.
        boxes: of the same recording.
        found: the targets that the radar followed, or the true origin of each return, which then decides; None takes the returns
            in the boxes' cuboids.
        classes: count only targets whose boxes are of these classes; all if empty.
        max_gap_s: longest time between a frame and its scan; None takes half the period of the scans.

    Raises:
        InputError: no frame has a scan near enough, no class matches, or the labels are of other scans.
    """
    _require_classes(boxes, classes)
    scans_of_frames = frame_scans(boxes.times_ns, scans.times_ns, max_gap_s=max_gap_s)
    _require_common_time(boxes, scans, scans_of_frames, max_gap_s)
    table = box_table(boxes)
    if isinstance(found, ReturnLabels):
        sightings = labelled_sightings(scans, found, boxes.times_ns, scans_of_frames)
        matches = match_by_name(sightings, table, camera)
    elif found is None:
        sightings, matches = returns_in_cuboids(scans, table, scans_of_frames, camera)
    else:
        sightings = tracked_sightings(found, scans_of_frames)
        matches = match_by_bearing(sightings, table, camera)
    labels = np.array(["", *table.labels], dtype=object)[matches.boxes + 1]
    wanted = matches.counts & (np.isin(labels, ["", *classes]) if classes else np.ones(len(labels), dtype=np.bool_))
    sides = np.concatenate([np.full((1, 4), np.nan), table.boxes_px])[matches.boxes + 1]
    own = wanted[sightings.of_return]
    of_return = sightings.of_return[own]
    kept = np.flatnonzero(scans_of_frames >= 0)
    number = np.searchsorted(kept, np.arange(len(scans_of_frames)))
    boxed = np.unique(sightings.targets[wanted & (matches.boxes >= 0)])
    return CountedReturns(
        image_times=boxes.times_ns[kept],
        radar_times=scans.times_ns[scans_of_frames[kept]],
        box_counts=np.bincount(table.frames, minlength=len(boxes))[kept],
        frames=number[sightings.frames[of_return]],
        points_radar_m=sightings.points_radar_m[own],
        boxes_px=sides[of_return],
        labels=tuple(labels[of_return].tolist()),
        targets=tuple(sightings.names[target] for target in sightings.targets[of_return].tolist()),
        found_targets=len(np.unique(sightings.targets[wanted])),
        matched_targets=len(boxed),
        bearings=matches.bearings,
        rule=_rule(
            found,
            longest_gap_s(scans.times_ns) if max_gap_s is None else max_gap_s,
            float(np.isnan(sides[of_return]).any(axis=1).mean()) if len(of_return) else 0.0,
        ),
        source=boxes.source,
        by_cuboid=found is None,
    )


def renamed_classes(boxes: Boxes, names: dict[str, str]) -> Boxes:
    """Return the boxes with classes renamed.

    Args:
        boxes: with the classes of their source.
        names: from the source's class to ours, such as {"pedestrian": "person"}.

    Raises:
        InputError: no box is of a class that is to be renamed.
    """
    for name in names:
        if name not in boxes.labels:
            raise InputError(
                f"{boxes.source}: no box is of the class '{name}' to be renamed; there are: {_name_list(boxes)}"
            )
    frames = tuple(
        replace(frame, boxes=tuple(replace(box, label=names.get(box.label, box.label)) for box in frame.boxes))
        for frame in boxes
    )
    return replace(boxes, frames=frames)


def _rule(found: Sequence[TargetTrack] | ReturnLabels | None, gap_s: float, boxless: float) -> str:
    in_time = (
        f"each annotated frame with the scan nearest to it by the recorded stamps, at most {1000.0 * gap_s:.3g} ms away"
    )
    if found is None:
        return (
            f"{in_time}; each return counts that is inside a cuboid, seen from above and grown by twice the radar's noise, for "
            "the box of that cuboid; how the camera is turned and placed against the radar is found from all cuboids and returns "
            "together, without the calibration"
        )
    if isinstance(found, ReturnLabels):
        return f"{in_time}; the labels say which returns belong to which box; those of targets without a box count as outside"
    return (
        f"{in_time}; returns of moving targets that the radar followed over three scans or more; each target has one box "
        "track over its life, chosen by bearing and time without the calibration; returns of targets in view without a box "
        f"count as outside, here {100.0 * boxless:.1f} % of the returns. Acc by the radar's own targets mostly reads lower than "
        "by the true origin of each return; how much lower, this recording cannot tell (of 37 simulated ones, half by more than "
        "4 points, one by 36, and three read higher by up to 2)"
    )


def _require_classes(boxes: Boxes, classes: Sequence[str]) -> None:
    unknown = [name for name in classes if name not in boxes.labels]
    if unknown and len(unknown) == len(classes):
        raise InputError(
            f"{boxes.source}: no box is of the class '{unknown[0]}'; there are: {_name_list(boxes)}; name one of these, or map "
            f"a class to it, as in --class-map pedestrian={unknown[0]}"
        )


def _name_list(boxes: Boxes) -> str:
    return ", ".join(f"'{label}'" for label in boxes.labels) or "no boxes at all"


def _require_common_time(boxes: Boxes, scans: RadarScans, scans_of_frames: Indices, max_gap_s: float | None) -> None:
    if not len(boxes):
        raise InputError(f"{boxes.source}: has no annotated frame; give a file with boxes")
    if not len(scans):
        raise InputError(f"{boxes.source}: the recording has no radar scan to judge with")
    if (scans_of_frames >= 0).any():
        return
    first, last = (int(boxes.times_ns[i]) / NS_PER_S for i in (0, -1))
    begin, end = (int(scans.times_ns[i]) / NS_PER_S for i in (0, -1))
    nearest = scans.times_ns[[scans.nearest(frame.image_time) for frame in boxes]]
    gap_s = float(np.abs(nearest - boxes.times_ns).min()) / NS_PER_S
    allowed_s = longest_gap_s(scans.times_ns) if max_gap_s is None else max_gap_s
    raise InputError(
        f"{boxes.source}: no annotated frame is within {allowed_s:.3g} s of a radar scan, the nearest is {gap_s:.3g} s away: the "
        f"frames run from {first:.3f} to {last:.3f} s, the scans from {begin:.3f} to {end:.3f} s; give the boxes of this "
        "recording, or check that both sensors have one clock"
    )


_USUAL_GAP_S = 0.05  # of a single scan


def longest_gap_s(radar_times: TimesNs) -> float:
    """Return half the median period of the scans [s]: a frame farther than this from every scan has none."""
    periods = np.diff(radar_times)
    periods = periods[periods > 0]
    return float(np.median(periods)) / 2.0 / NS_PER_S if len(periods) else _USUAL_GAP_S


def frame_scans(image_times: TimesNs, radar_times: TimesNs, *, max_gap_s: float | None = None) -> Indices:
    """Return the index of the scan that is nearest to each frame (n,), of two equally near the earlier one; -1 for none.

    Args:
        image_times: (n,) stamps of the frames.
        radar_times: (m,) stamps of the scans, ascending.
        max_gap_s: longest time between a frame and its scan; None takes half the period of the scans.
    """
    if not len(radar_times):
        return np.full(len(image_times), -1, dtype=np.int64)
    limit_ns = round((longest_gap_s(radar_times) if max_gap_s is None else max_gap_s) * NS_PER_S)
    after = np.searchsorted(radar_times, image_times)
    before = np.maximum(after - 1, 0)
    after = np.minimum(after, len(radar_times) - 1)
    to_before, to_after = np.abs(image_times - radar_times[before]), np.abs(radar_times[after] - image_times)
    nearest = np.where(to_before <= to_after, before, after)
    return np.asarray(np.where(np.minimum(to_before, to_after) <= limit_ns, nearest, -1))


def tracked_sightings(targets: Sequence[TargetTrack], scans_of_frames: Indices) -> Sightings:
    """Collect the returns of followed targets at the annotated frames.

    Args:
        targets: what the radar followed.
        scans_of_frames: (f,) the scan of each frame; -1 for none.
    """
    none = np.zeros(0, dtype=np.int64)
    scans = np.concatenate([none, *(target.scan_of_row for target in targets)])
    owner = np.repeat(np.arange(len(targets)), [len(target.rows) for target in targets])
    points = np.concatenate([np.zeros((0, 3)), *(target.points_radar_m for target in targets)])
    snr_db = np.concatenate([np.zeros(0), *(target.snr_db for target in targets)])
    order = np.argsort(scans, kind="stable")
    low, high = (np.searchsorted(scans[order], scans_of_frames, side=side) for side in ("left", "right"))
    frames, places = _spans(low, np.where(scans_of_frames >= 0, high, low))
    rows = order[places]
    return _sightings(tuple(target.id for target in targets), frames, owner[rows], points[rows], snr_db[rows])


def _spans(low: Indices, high: Indices) -> tuple[Indices, Indices]:
    """Return the numbers of several spans one after the other (n,), and before them which span each is in (n,)."""
    counts = high - low
    own = np.repeat(np.arange(len(counts)), counts)
    return own, np.repeat(low - np.cumsum(counts) + counts, counts) + np.arange(len(own))


def labelled_sightings(
    scans: RadarScans, labels: ReturnLabels, image_times: TimesNs, scans_of_frames: Indices
) -> Sightings:
    """Collect the returns that labels give to objects, at the annotated frames.

    Args:
        scans: those around the frames.
        labels: of scans of the same recording.
        image_times: (f,) stamps of the frames, for messages.
        scans_of_frames: (f,) the scan of each frame; -1 for none.

    Raises:
        InputError: a scan has no labels, or another number of returns than they have.
    """
    known = {int(scan.radar_time): scan.tracks for scan in labels.scans}
    numbers: dict[str, int] = {}
    frames: list[int] = []
    owner: list[int] = []
    points = [np.zeros((0, 3))]
    for frame, scan in enumerate(scans_of_frames.tolist()):
        if scan < 0:
            continue
        tracks = _tracks_of(scans, scan, known, labels.source, int(image_times[frame]))
        own = [row for row, track in enumerate(tracks) if track]
        frames += [frame] * len(own)
        owner += [numbers.setdefault(tracks[row], len(numbers)) for row in own]
        points.append(scans.points_radar_m[int(scans.first_return[scan]) + np.array(own, dtype=np.int64)])
    owners = np.array(owner, dtype=np.int64)
    return _sightings(tuple(numbers), np.array(frames, dtype=np.int64), owners, np.concatenate(points))


def _tracks_of(
    scans: RadarScans, scan: int, known: dict[int, tuple[str, ...]], source: str, image_time: int
) -> tuple[str, ...]:
    """Return the labels of a scan's returns.

    Raises:
        InputError: there are none, or another number.
    """
    time = int(scans.times_ns[scan])
    tracks = known.get(time)
    count = int(scans.first_return[scan + 1] - scans.first_return[scan])
    if tracks is None:
        raise InputError(
            f"{source}: has no labels for the scan at {time / NS_PER_S:.3f} s, which belongs to the frame at "
            f"{image_time / NS_PER_S:.3f} s; give the labels of this recording"
        )
    if len(tracks) != count:
        raise InputError(
            f"{source}: labels {len(tracks)} returns of the scan at {time / NS_PER_S:.3f} s, which has {count}; give the labels "
            "of this recording, read with the same options"
        )
    return tracks


def _sightings(
    names: tuple[str, ...], frames: Indices, targets: Indices, points: Points3, snr_db: Values | None = None
) -> Sightings:
    snr_db = np.full(len(points), np.nan) if snr_db is None else snr_db
    order = np.lexsort((targets, frames))
    order = order[np.isfinite(points).all(axis=1)[order]]
    frames, targets, points, snr_db = frames[order], targets[order], points[order], snr_db[order]
    keys = frames * max(len(names), 1) + targets
    first, of_return = np.unique(keys, return_index=True, return_inverse=True)[1:]
    sizes = np.maximum(np.bincount(of_return, minlength=len(first)), 1)
    means = np.stack(
        [np.bincount(of_return, weights=axis, minlength=len(first)) / sizes for axis in points.T], axis=1
    ).reshape(-1, 3)
    azimuth, range_m = np.arctan2(means[:, 1], means[:, 0]), np.linalg.norm(means, axis=1)
    return Sightings(names, frames[first], targets[first], azimuth, range_m, of_return, points, snr_db)


_LONGEST_STEP = 0.8  # widths or heights from where a box is expected, for a box of the same object
_LONGEST_GAP = 3  # frames that an object may be missed in
_NEW_SHARE = 0.3  # of the newest step in the mean step of a box
_SIDES = ("left_px", "top_px", "right_px", "bottom_px")


def box_table(boxes: Boxes) -> BoxTable:
    """Lay boxes out as columns, and follow the objects whose source does not.

    Args:
        boxes: with the tracks of their source where it states them; other boxes are linked by how they move.
    """
    frames = np.array([i for i, frame in enumerate(boxes) for _ in frame.boxes], dtype=np.int64)
    every = [box for frame in boxes for box in frame.boxes]
    sides = np.array([[getattr(box, side) for side in _SIDES] for box in every]).reshape(-1, 4)
    labels, names = tuple(box.label for box in every), tuple(box.track for box in every)
    cuboids = np.array([_from_above(box.cuboid) for box in every]).reshape(-1, 5)
    return BoxTable(boxes.times_ns, frames, sides, labels, _tracks(frames, every, sides), names, cuboids)


def _from_above(cuboid: Cuboid | None) -> tuple[float, ...]:
    if cuboid is None:
        return (np.nan,) * 5
    right_m, _, ahead_m = cuboid.centre_camera_m
    return ahead_m, -right_m, cuboid.length_m, cuboid.width_m, cuboid.heading_rad


@dataclass(slots=True)
class _Object:
    """An object while it is followed: its last box, and how that moves per frame."""

    row: int
    frame: int
    step_px: np.ndarray

    def expected(self, sides: np.ndarray, frame: int) -> np.ndarray:
        """Return where its box (4,) would be in a later frame."""
        return np.asarray(sides[self.row] + self.step_px * (frame - self.frame))

    def seen(self, row: int, sides: np.ndarray, frame: int) -> None:
        """Take its box of a later frame."""
        step_px = (sides[row] - sides[self.row]) / (frame - self.frame)
        self.step_px = (1.0 - _NEW_SHARE) * self.step_px + _NEW_SHARE * step_px
        self.row, self.frame = row, frame


def _tracks(frames: Indices, every: list[Box], sides: np.ndarray) -> Indices:
    """Return the number of the object of each box (b,)."""
    named = {name: number for number, name in enumerate(dict.fromkeys(box.track for box in every if box.track))}
    tracks = np.array([named.get(box.track, -1) for box in every], dtype=np.int64)
    count = len(named)
    followed: list[_Object] = []
    unnamed = np.flatnonzero(tracks < 0)
    starts = np.flatnonzero(np.diff(frames[unnamed], prepend=-1))
    for rows in np.split(unnamed, starts)[1:]:
        frame = int(frames[rows[0]])
        followed = [one for one in followed if frame - one.frame <= _LONGEST_GAP]
        linked = _linked(followed, rows.tolist(), frame, every, sides)
        for row in rows.tolist():
            known = linked.get(row)
            if known is None:
                followed.append(_Object(row, frame, np.zeros(4)))
                tracks[row], count = count, count + 1
            else:
                tracks[row] = tracks[known.row]
                known.seen(row, sides, frame)
    return tracks


def _linked(
    followed: list[_Object], now: list[int], frame: int, every: list[Box], sides: np.ndarray
) -> dict[int, _Object]:
    """Return for boxes of this frame the object that they continue: the nearest to where it is expected."""
    if not followed:
        return {}
    steps = _steps(np.array([one.expected(sides, frame) for one in followed]), sides[now])
    same = np.array([[every[one.row].label == every[row].label for row in now] for one in followed])
    steps = np.where(same, steps, np.inf)
    linked: dict[int, _Object] = {}
    taken: set[int] = set()
    for flat in np.argsort(steps, axis=None, kind="stable").tolist():
        i, j = divmod(flat, len(now))
        if steps[i, j] > _LONGEST_STEP:
            break
        if i not in taken and now[j] not in linked:
            linked[now[j]] = followed[i]
            taken.add(i)
    return linked


def _steps(expected: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Return how far boxes (b, 4) are from expected ones (a, 4), in widths and heights, sizes included: (a, b)."""
    size = np.maximum(
        np.maximum((expected[:, 2:] - expected[:, :2])[:, None], (found[:, 2:] - found[:, :2])[None]), 1.0
    )
    apart = (found[None] - expected[:, None]).reshape(len(expected), len(found), 2, 2)
    return np.asarray(np.sqrt(((apart / size[:, :, None]) ** 2).sum(axis=3).mean(axis=2)))


_TOLERANCE_RAD = np.deg2rad(2.5)  # of a target's azimuth, beyond half the width of its box
_TOLERANCE_M = 0.3  # across the line of sight
_MOST_PARALLAX_M = 3.0  # distance between the sensors, across
_STEP_RAD = np.deg2rad(0.5)
_MOST_VOTES = 20_000
_KEPT_VOTES = 0.5
"""Of the votes of the best turn, that keep the turn of the stretch before."""
_ROUNDS = 3
_PART_M = 5.0  # between the ranges of parts of one target, or of a target and its cuboid
_SIGHTINGS_AT_ONCE = 50_000


@dataclass(frozen=True, slots=True, eq=False)
class _Meetings:
    """Every sighting with every box of its frame: m rows.

    Attributes:
        sightings: (m,) ascending.
        boxes: (m,).
        apart_rad: (m,) bearing of the box's middle minus the azimuth.
        inverse_range: (m,) [1/m].
        tolerance_rad: (m,).
    """

    sightings: Indices
    boxes: Indices
    apart_rad: Values
    inverse_range: Values
    tolerance_rad: Values

    def some(self, kept: Flags | Indices) -> "_Meetings":
        return _Meetings(
            self.sightings[kept],
            self.boxes[kept],
            self.apart_rad[kept],
            self.inverse_range[kept],
            self.tolerance_rad[kept],
        )

    def misfits(self, bearings: Bearings) -> Values:
        """Return how far each box is from its sighting (m,), in tolerances."""
        expected = bearings.turn_rad + bearings.parallax_m * self.inverse_range
        return np.asarray(np.abs(_wrapped(self.apart_rad - expected)) / self.tolerance_rad)


def match_by_bearing(
    sightings: Sightings, table: BoxTable, camera: Camera, *, start: Bearings | None = None
) -> Matches:
    """Match targets and box tracks over their common lives.

    Args:
        sightings: of the targets that the radar followed.
        table: the boxes.
        camera: the lens alone; no pose enters.
        start: how the two sensors saw the same target in the stretch before; taken unless another turn is clearly better.
    """
    meetings = _meetings(sightings, table, camera)
    if not len(meetings.sightings):
        return _matches(sightings, np.full(len(sightings.frames), -1), None, camera)
    bearings = _first_bearings(meetings, start)
    chosen = _choose_meetings(meetings, sightings, table, bearings)
    for _ in range(_ROUNDS - 1):
        bearings = _refined(meetings.some(chosen), bearings)
        chosen = _choose_meetings(meetings, sightings, table, bearings)
    boxes = np.full(len(sightings.frames), -1)
    boxes[meetings.sightings[chosen]] = meetings.boxes[chosen]
    parts = _parts(meetings, meetings.misfits(bearings), sightings, table, boxes)
    boxes[meetings.sightings[parts]] = meetings.boxes[parts]
    return _matches(sightings, boxes, bearings if len(chosen) else None, camera)


_STANDARD_DEVIATIONS = 2.0  # that a cuboid is grown by
_SEARCHED = ((np.deg2rad(4.0), np.deg2rad(0.25)), (_MOST_PARALLAX_M, 0.25), (_MOST_PARALLAX_M, 0.25))
_AWAY_RAD = np.deg2rad([*range(-90, -15, 5), *range(20, 95, 5)])
_ABOVE_CHANCE = 2.2
_LEAST_IN_CUBOIDS = 20


def returns_in_cuboids(
    scans: RadarScans, table: BoxTable, scans_of_frames: Indices, camera: Camera
) -> tuple[Sightings, Matches]:
    """Collect the returns inside cuboids at the annotated frames, all as seen from above; no pose enters.

    How the camera is turned and placed against the radar is what puts most returns into cuboids. If a camera that is turned away
    puts nearly as many there, nothing is known, and there are none.

    Args:
        scans: around the frames.
        table: the boxes with their cuboids.
        scans_of_frames: (f,) the scan of each frame; -1 for none.
        camera: the lens.
    """
    known = np.maximum(scans_of_frames, 0)
    low, high = scans.first_return[known], scans.first_return[known + 1]
    frames, rows = _spans(low, np.where(scans_of_frames >= 0, high, low))
    kept = np.isfinite(scans.points_radar_m[rows]).all(axis=1)
    frames, rows = frames[kept], rows[kept]
    points = scans.points_radar_m[rows]
    sigma, range_m = sigma_polar(scans, TargetOptions())[rows], np.hypot(*points[:, :2].T)
    each = np.arange(len(rows))
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    single = Sightings((), frames, each, azimuth, range_m, each, points, scans.snr_db[rows])
    meetings = _meetings(single, table, camera)
    meetings = meetings.some(np.isfinite(table.cuboids[meetings.boxes, 0]))
    grown_m = (_STANDARD_DEVIATIONS * np.hypot(sigma[:, 0], range_m * sigma[:, 1]))[meetings.sightings]
    planar, cuboids = points[meetings.sightings, :2], table.cuboids[meetings.boxes]
    none = _sightings((), each[:0], each[:0], points[:0]), Matches(each[:0], np.zeros(0, dtype=np.bool_), None)
    if not len(planar):
        return none
    place = _radar_placement(meetings, planar, cuboids, grown_m)
    outside_m = _outside_m(place, planar, cuboids)
    inside = np.flatnonzero(outside_m <= grown_m)
    away = [
        np.unique(meetings.sightings[_outside_m(place + turn * np.eye(3)[0], planar, cuboids) <= grown_m])
        for turn in _AWAY_RAD
    ]
    if len(np.unique(meetings.sightings[inside])) < max(_LEAST_IN_CUBOIDS, _ABOVE_CHANCE * max(map(len, away))):
        return none
    order = inside[np.lexsort((outside_m[inside], meetings.sightings[inside]))]
    own = order[np.unique(meetings.sightings[order], return_index=True)[1]]
    rows, boxes = meetings.sightings[own], meetings.boxes[own]
    names = [""] * (int(table.tracks.max()) + 1)
    for box in np.unique(boxes).tolist():
        names[table.tracks[box]] = table.names[box] or f"{table.labels[box] or 'object'}-{table.tracks[box]}"
    sightings = _sightings(tuple(names), frames[rows], table.tracks[boxes], points[rows])
    key = len(names) * frames[rows] + table.tracks[boxes]
    of_sighting = boxes[np.unique(key, return_index=True)[1]]
    return sightings, Matches(
        of_sighting, np.ones(len(of_sighting), dtype=np.bool_), Bearings(float(place[0]), float(place[2]))
    )


def _radar_placement(meetings: _Meetings, planar: np.ndarray, cuboids: np.ndarray, grown_m: Values) -> Vector3:
    """Return the turn of the camera [rad] and the radar's place ahead and to the left of it [m] with most returns in cuboids."""
    first = np.flatnonzero(np.diff(meetings.sightings, prepend=-1))
    place = np.array([_turn(meetings), 0.0, 0.0])
    most = np.array([np.inf, _MOST_PARALLAX_M, _MOST_PARALLAX_M])
    for axis, (reach, step) in [*enumerate(_SEARCHED)] * _ROUNDS:
        tried = place + np.arange(-reach, reach + step / 2, step)[:, None] * np.eye(3)[axis]
        tried = np.clip(tried, -most, most)
        agreement = [np.maximum(1.0 - _outside_m(one, planar, cuboids) / grown_m, 0.0) for one in tried]
        votes = np.array([np.maximum.reduceat(one, first).sum() for one in agreement])
        best = np.flatnonzero(votes >= votes.max() - 1e-9)
        place = tried[best[len(best) // 2]]
    return np.asarray(place)


def _outside_m(place: np.ndarray, planar: np.ndarray, cuboids: np.ndarray) -> Values:
    """Return how far returns (m, 2) are outside cuboids (m, 5), seen from above (m,) [m]; 0 inside.

    Args:
        place: of the radar, as `_radar_placement` finds it.
        planar: x and y of the returns in the radar frame.
        cuboids: as in a BoxTable.
    """
    turn_rad, ahead_m, left_m = place
    off = (planar[:, 0] + 1j * planar[:, 1]) * np.exp(1j * turn_rad) + (ahead_m + 1j * left_m)
    off = (off - (cuboids[:, 0] + 1j * cuboids[:, 1])) * np.exp(-1j * cuboids[:, 4])
    along_m = np.maximum(np.abs(off.real) - 0.5 * cuboids[:, 2], 0.0)
    return np.asarray(np.hypot(along_m, np.maximum(np.abs(off.imag) - 0.5 * cuboids[:, 3], 0.0)))


def match_by_name(sightings: Sightings, table: BoxTable, camera: Camera) -> Matches:
    """Match sightings and boxes of the same name, as labels of a simulation give them."""
    meetings = _meetings(sightings, table, camera)
    same = [
        bool(table.names[box]) and sightings.names[target] == table.names[box]
        for target, box in zip(sightings.targets[meetings.sightings].tolist(), meetings.boxes.tolist(), strict=True)
    ]
    own = meetings.some(np.array(same, dtype=np.bool_))
    boxes = np.full(len(sightings.frames), -1)
    boxes[own.sightings] = own.boxes
    bearings = None
    if len(own.boxes):
        bearings = _refined(own, Bearings(_middle(own.apart_rad), 0.0))
    return _matches(sightings, boxes, bearings, camera)


def _matches(sightings: Sightings, boxes: Indices, bearings: Bearings | None, camera: Camera) -> Matches:
    if bearings is None:
        return Matches(boxes, np.ones(len(boxes), dtype=np.bool_), None)
    row = (camera.height_px - 1) / 2.0
    left_rad, right_rad = _bearings(camera, np.array([[0.0, row], [camera.width_px - 1.0, row]]))
    seen_rad = bearings.of(sightings)
    return Matches(boxes, (boxes >= 0) | ((seen_rad <= left_rad) & (seen_rad >= right_rad)), bearings)


def _meetings(sightings: Sightings, table: BoxTable, camera: Camera) -> _Meetings:
    return _met(*_in_one_frame(sightings, table), sightings, table, camera)


def _met(own: Indices, boxes: Indices, sightings: Sightings, table: BoxTable, camera: Camera) -> _Meetings:
    """Return some sightings, each with a box."""
    middle, half = _middles(table, camera)
    inverse_range = 1.0 / np.maximum(sightings.range_m[own], 0.5)
    tolerance = _TOLERANCE_RAD + half[boxes] + _TOLERANCE_M * inverse_range
    return _Meetings(own, boxes, _wrapped(middle[boxes] - sightings.azimuth_rad[own]), inverse_range, tolerance)


def _in_one_frame(sightings: Sightings, table: BoxTable) -> tuple[Indices, Indices]:
    """Return every sighting with every box of its frame, but for boxes whose cuboid is at another range: (m,) of each."""
    low, high = (np.searchsorted(table.frames, sightings.frames, side=side) for side in ("left", "right"))
    range_m, reach_m = np.hypot(*table.cuboids[:, :2].T), _PART_M + 0.5 * np.hypot(*table.cuboids[:, 2:4].T)
    found = [(np.zeros(0, dtype=np.int64),) * 2]
    for start in range(0, len(low), _SIGHTINGS_AT_ONCE):
        part = slice(start, start + _SIGHTINGS_AT_ONCE)
        own, boxes = _spans(low[part], high[part])
        own += start
        near = ~(np.abs(sightings.range_m[own] - range_m[boxes]) > reach_m[boxes])
        found.append((own[near], boxes[near]))
    owns, others = zip(*found, strict=True)
    return np.concatenate(owns), np.concatenate(others)


def boxes_in_bearing(matches: Matches, sightings: Sightings, table: BoxTable, camera: Camera) -> Indices:
    """Return the box of each sighting (s,) where its bearing is the one that all share, else -1.

    A match holds for the lives of a target and a box; for a while one of them may be somebody else's.
    """
    if matches.bearings is None:
        return matches.boxes
    boxes = matches.boxes.copy()
    matched = np.flatnonzero(boxes >= 0)
    misfits = _met(matched, boxes[matched], sightings, table, camera).misfits(matches.bearings)
    boxes[matched[misfits > 1.0]] = -1
    return boxes


def _middles(table: BoxTable, camera: Camera) -> tuple[Values, Values]:
    """Return the bearing of each box's middle (b,) and half the angle that it covers (b,) [rad]."""
    last = np.array([camera.width_px - 1.0, camera.height_px - 1.0])
    left, top, right, bottom = table.boxes_px.T
    row = (top + bottom) / 2.0
    edges = [_bearings(camera, np.clip(np.stack([column, row], axis=1), 0.0, last)) for column in (left, right)]
    return (edges[0] + edges[1]) / 2.0, np.abs(edges[0] - edges[1]) / 2.0


def _bearings(camera: Camera, pixels_px: np.ndarray) -> Values:
    """Return the bearing (n,) of pixels (n, 2) [rad], positive to the left; where the lens has none, that of its axis."""
    rays = camera.rays(pixels_px)
    return np.nan_to_num(-np.arctan2(rays[:, 0], rays[:, 2]))


def _first_bearings(meetings: _Meetings, start: Bearings | None) -> Bearings:
    """Return the bearings of the stretch before, unless another turn has clearly more votes: few targets agree on several."""
    free = Bearings(_turn(meetings), 0.0)
    if start is None:
        return free
    first = np.flatnonzero(np.diff(meetings.sightings, prepend=-1))
    kept, best = (
        np.maximum.reduceat(np.maximum(1.0 - meetings.misfits(one), 0.0), first).sum() for one in (start, free)
    )
    return start if kept > _KEPT_VOTES * best else free


def _turn(meetings: _Meetings) -> float:
    """Return the turn under which the sightings meet boxes best: the most votes on a grid of all turns."""
    count = len(meetings.sightings)
    if count > _MOST_VOTES:
        meetings = meetings.some(np.isin(meetings.sightings, meetings.sightings[:: count // _MOST_VOTES + 1]))
    turns = np.arange(-np.pi, np.pi, _STEP_RAD)
    first = np.flatnonzero(np.diff(meetings.sightings, prepend=-1))
    votes = []
    for turn in turns.tolist():
        agreement = np.maximum(1.0 - meetings.misfits(Bearings(turn, 0.0)), 0.0)
        votes.append(float(np.maximum.reduceat(agreement, first).sum()))
    best = np.flatnonzero(np.array(votes) >= max(votes) - 1e-9)
    return float(turns[best[np.abs(turns[best]).argmin()]])


def _refined(meetings: _Meetings, bearings: Bearings) -> Bearings:
    """Fit turn and parallax to matched sightings, those of narrow boxes first, without the ones that are far off."""
    if not len(meetings.sightings):
        return bearings
    kept = meetings.some(meetings.misfits(bearings) <= 1.0)
    if not len(kept.sightings):
        return bearings
    turn = bearings.turn_rad
    rest = _wrapped(kept.apart_rad - turn)
    weight = 1.0 / kept.tolerance_rad
    prior = np.array([[0.0, 1.0 / _MOST_PARALLAX_M]])
    design = np.concatenate([np.stack([np.ones(len(rest)), kept.inverse_range], axis=1) * weight[:, None], prior])
    more, parallax = np.linalg.lstsq(design, np.append(rest * weight, 0.0), rcond=None)[0].tolist()
    return Bearings(
        float(_wrapped(np.array(turn + more))), float(np.clip(parallax, -_MOST_PARALLAX_M, _MOST_PARALLAX_M))
    )


def _choose_meetings(meetings: _Meetings, sightings: Sightings, table: BoxTable, bearings: Bearings) -> Indices:
    """Return the meetings that become matches: pairs of a target and a box track, those that agree longest first."""
    misfits = meetings.misfits(bearings)
    targets, tracks = sightings.targets[meetings.sightings], table.tracks[meetings.boxes]
    _, pair = np.unique(targets * (int(tracks.max(initial=0)) + 1) + tracks, return_inverse=True)
    agreement = np.bincount(pair, weights=np.maximum(1.0 - misfits, 0.0))
    order = np.argsort(pair, kind="stable")
    ends = np.searchsorted(pair[order], np.arange(len(agreement) + 1))
    taken_sightings = np.zeros(len(sightings.frames), dtype=np.bool_)
    taken_boxes = np.zeros(len(table.frames), dtype=np.bool_)
    chosen = [np.zeros(0, dtype=np.int64)]
    for one in np.argsort(-agreement, kind="stable").tolist():
        rows = order[ends[one] : ends[one + 1]]
        if agreement[one] <= 0.0:
            break
        free = rows[~taken_sightings[meetings.sightings[rows]] & ~taken_boxes[meetings.boxes[rows]]]
        if 2 * len(free) < len(rows) or np.median(misfits[rows]) > 1.0:
            continue
        taken_sightings[meetings.sightings[free]] = True
        taken_boxes[meetings.boxes[free]] = True
        chosen.append(free)
    return np.sort(np.concatenate(chosen))


def _parts(meetings: _Meetings, misfits: Values, sightings: Sightings, table: BoxTable, boxes: Indices) -> Indices:
    """Return the meetings of targets that are parts of a matched one: all along at its range, in the bearing of its box.

    A car is often followed as two or three targets. This too is decided by times, ranges and bearings alone.
    """
    range_of_box = np.full(len(table.frames), np.nan)
    matched = np.flatnonzero(boxes >= 0)
    range_of_box[boxes[matched]] = sightings.range_m[matched]
    targets, tracks = sightings.targets[meetings.sightings], table.tracks[meetings.boxes]
    free = ~np.isin(targets, sightings.targets[matched])
    with np.errstate(invalid="ignore"):
        near = np.abs(sightings.range_m[meetings.sightings] - range_of_box[meetings.boxes]) <= _PART_M
    near &= free & (misfits <= 1.0)
    lives = np.bincount(sightings.targets, minlength=int(sightings.targets.max(initial=0)) + 1)
    keys = targets * (int(tracks.max(initial=0)) + 1) + tracks
    pair, shared = np.unique(keys[near], return_inverse=True, return_counts=True)[1:]
    rows, taken, kept = np.flatnonzero(near), set[int](), [np.zeros(0, dtype=np.int64)]
    for one in np.argsort(-shared, kind="stable").tolist():
        target = int(targets[rows[pair == one][0]])
        if target not in taken and 2 * shared[one] >= lives[target]:
            taken.add(target)
            kept.append(rows[pair == one])
    return np.concatenate(kept)


def _middle(angles_rad: Values) -> float:
    """Return the median of angles that lie near one another, wherever on the circle."""
    centre = float(np.arctan2(np.sin(angles_rad).mean(), np.cos(angles_rad).mean()))
    return centre + float(np.median(_wrapped(angles_rad - centre)))


def _wrapped(angles_rad: np.ndarray) -> np.ndarray:
    return np.asarray((angles_rad + np.pi) % (2.0 * np.pi) - np.pi)
