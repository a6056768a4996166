"""Matching: which box is around which target. The calibration that is judged has no say in it.

Which boxes of successive frames are around one object is what their source says, or how they move.

Radar and camera see a target at a bearing each. Whatever the pose, the two differ by one angle that all targets share, and
by the parallax, which falls with the range. Both are found from all targets and boxes together: the angle is the one under
which most sightings meet a box. Each target is then given the box track that it meets best over the life that both share,
the longest agreement first, and in each frame a target has at most one box and a box at most one target. What the radar
follows in parts, such as the two ends of a car, joins the part that is matched.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Indices, TimesNs, Values, frozen_array
from calib_core.camera import Camera
from calib_core.evaluation.sightings import Sightings
from calib_core.measurements import Box, Boxes

_LONGEST_STEP = 0.8  # widths or heights from where a box is expected, for a box of the same object
_LONGEST_GAP = 3  # frames that an object may be missed in
_NEW_SHARE = 0.3  # of the newest step in the mean step of a box
_SIDES = ("left_px", "top_px", "right_px", "bottom_px")


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
    """

    times_ns: TimesNs
    frames: Indices
    boxes_px: np.ndarray
    labels: tuple[str, ...]
    tracks: Indices
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        count = len(self.labels)
        object.__setattr__(self, "times_ns", frozen_array(self.times_ns, (None,), dtype=np.int64))
        object.__setattr__(self, "boxes_px", frozen_array(self.boxes_px, (count, 4)))
        for name in ("frames", "tracks"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (count,), dtype=np.int64))


def box_table(boxes: Boxes) -> BoxTable:
    """Lay boxes out as columns, and follow the objects whose source does not.

    Args:
        boxes: with the tracks of their source where it states them; other boxes are linked by how they move.
    """
    frames = np.array([i for i, frame in enumerate(boxes) for _ in frame.boxes], dtype=np.int64)
    every = [box for frame in boxes for box in frame.boxes]
    sides = np.array([[getattr(box, side) for side in _SIDES] for box in every]).reshape(-1, 4)
    labels, names = tuple(box.label for box in every), tuple(box.track for box in every)
    return BoxTable(boxes.times_ns, frames, sides, labels, _tracks(frames, every, sides), names)


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
_ROUNDS = 3
_PART_M = 5.0  # between the ranges of parts of one target


@dataclass(frozen=True, slots=True)
class Bearings:
    """How a target's bearing in the picture follows from the radar's azimuth: azimuth + turn + parallax / range.

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
class Matches:
    """The box of each sighting, and whether the sighting counts.

    Attributes:
        boxes: (s,) row of the table; -1 for none.
        counts: (s,) whether it has a box, or would be in the picture: what the camera cannot see has no box.
        bearings: how the two sensors see the same target; None if nothing shows it, and everything counts.
    """

    boxes: Indices
    counts: Flags
    bearings: Bearings | None

    def __post_init__(self) -> None:
        object.__setattr__(self, "boxes", frozen_array(self.boxes, (None,), dtype=np.int64))
        object.__setattr__(self, "counts", frozen_array(self.counts, (len(self.boxes),), dtype=np.bool_))


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


def match_by_bearing(sightings: Sightings, table: BoxTable, camera: Camera) -> Matches:
    """Match targets and box tracks over their common lives.

    Args:
        sightings: of the targets that the radar followed.
        table: the boxes.
        camera: the lens alone; no pose enters.
    """
    meetings = _meetings(sightings, table, camera)
    if not len(meetings.sightings):
        return _matches(sightings, np.full(len(sightings.frames), -1), None, camera)
    bearings = Bearings(_turn(meetings), 0.0)
    chosen = _chosen(meetings, sightings, table, bearings)
    for _ in range(_ROUNDS - 1):
        bearings = _refined(meetings.some(chosen), bearings)
        chosen = _chosen(meetings, sightings, table, bearings)
    boxes = np.full(len(sightings.frames), -1)
    boxes[meetings.sightings[chosen]] = meetings.boxes[chosen]
    parts = _parts(meetings, meetings.misfits(bearings), sightings, table, boxes)
    boxes[meetings.sightings[parts]] = meetings.boxes[parts]
    return _matches(sightings, boxes, bearings if len(chosen) else None, camera)


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
    low, high = (np.searchsorted(table.frames, sightings.frames, side=side) for side in ("left", "right"))
    counts = high - low
    own = np.repeat(np.arange(len(sightings.frames)), counts)
    boxes = np.repeat(low, counts) + np.arange(len(own)) - np.repeat(np.cumsum(counts) - counts, counts)
    middle, half = _middles(table, camera)
    inverse_range = 1.0 / np.maximum(sightings.range_m[own], 0.5)
    tolerance = _TOLERANCE_RAD + half[boxes] + _TOLERANCE_M * inverse_range
    return _Meetings(own, boxes, _wrapped(middle[boxes] - sightings.azimuth_rad[own]), inverse_range, tolerance)


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


def _chosen(meetings: _Meetings, sightings: Sightings, table: BoxTable, bearings: Bearings) -> Indices:
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
