"""Watch a recording in stretches of half a minute: what each shows, a baseline from them, and what has changed since one."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from calib_core.arrays import TimesNs, Vector3
from calib_core.boxes.moving import changed_boxes
from calib_core.camera import Camera
from calib_core.errors import InputError, MessageError, NoAnswerError
from calib_core.evaluation.counted_returns import Bearings, BoxTable, box_table
from calib_core.evaluation.moving_returns import TargetOptions, moving_returns
from calib_core.measurements import NS_PER_S, Boxes, RadarScans, TimeNs
from calib_core.watching.baseline import BASELINE_SCHEMA, Baseline, encoded
from calib_core.watching.still_image import BACKGROUND_FRAMES, background, camera_turn
from calib_core.watching.still_returns import radar_turn, still_places
from calib_core.watching.traffic import TrafficModel, TrafficRows, Watched, learned, rows_of_stretch
from calib_core.watching.witnesses import SeenTurn, Turn, Verdict, verdict_of

_STRETCH_NS = 30 * NS_PER_S
_SHORTEST_NS = 5 * NS_PER_S
_AROUND_NS = 2 * NS_PER_S
_KEPT_NS = 600 * NS_PER_S
"""How much traffic is kept: memory stays flat, however long the recording is."""
_STEP_NS = 2 * NS_PER_S
_WINDOWS_NS = tuple(s * NS_PER_S for s in (6, 12, 24, 48))
_TRAFFIC_SIGMAS = 5.0
_CLOCK_KNOWN_S = 0.02
"""Standard deviation of a change of the clocks' offset that is stated: traffic crosses in both directions."""
_IMAGE_SIGMAS, _IMAGE_RAD = 4.0, np.deg2rad(0.03)
_RETURNS_SIGMAS, _RETURNS_RAD = 5.0, np.deg2rad(0.2)
_MOST_FRAMES = 160
"""Of a stretch, that are searched for what moves: five a second."""
_AT_ONCE = 2.0
"""Times the smallest turn that counts: a single stretch then shows it."""
_AVERAGED = 4
"""Stretches of image and still returns that a turn is averaged over."""
_BACKGROUNDS = 4
_BASELINE_RAD = np.deg2rad(0.1)
"""A camera that turns by more within a baseline gives none."""
_BASELINE_STRETCHES = 20


class WatchedRecording(Protocol):
    """The part of a Recording that is watched."""

    @property
    def name(self) -> str:
        """For messages."""

    @property
    def image_times(self) -> TimesNs:
        """The stamps of the frames, ascending."""

    @property
    def radar_times(self) -> TimesNs:
        """The stamps of the scans, ascending."""

    def image(self, index: int) -> np.ndarray:
        """Return a frame: uint8 (h, w, 3)."""

    def radar_scans(self, start: TimeNs | None = None, end: TimeNs | None = None) -> RadarScans:
        """Decode scans."""


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """What half a minute shows.

    Attributes:
        start: its first stamp.
        end: that of the next one.
        image: uint8 (h, w) grey background; None without enough frames, or if the sensors moved.
        scans: of the radar.
        rows: of matched traffic; None without boxes.
        still: whether the sensors stood still.
    """

    start: TimeNs
    end: TimeNs
    image: np.ndarray | None
    scans: RadarScans
    rows: TrafficRows | None
    still: bool


def stretches(
    recording: WatchedRecording,
    watched: Watched,
    boxes: Boxes | None = None,
    *,
    moving: bool = False,
    grow: Callable[[], bool] | None = None,
) -> Iterator[Stretch]:
    """Yield what each half minute of a recording shows.

    Args:
        recording: with a radar; images are optional.
        watched: the calibration.
        boxes: around moving objects.
        moving: find boxes around what moves in the images instead, before a background for each stretch.
        grow: waits for more of a recording that is being written, and returns whether there may be more still.
    """
    table = None if boxes is None else box_table(boxes)
    every = [times for times in (recording.image_times, recording.radar_times) if len(times)]
    start = min((int(times[0]) for times in every), default=0)
    bearings: Bearings | None = None
    tracks = 0
    while True:
        last = min((int(t[-1]) for t in (recording.image_times, recording.radar_times) if len(t)), default=-1)
        end = start + _STRETCH_NS
        if end + _AROUND_NS > last and grow is not None:
            if not grow():
                grow = None
            continue
        if last - start < _SHORTEST_NS:
            return
        frames = np.flatnonzero((recording.image_times >= start) & (recording.image_times < end))
        scans = recording.radar_scans(TimeNs(start - _AROUND_NS), TimeNs(end + _AROUND_NS))
        still = not moving_returns([scans], TargetOptions()).sensors_moved
        own = table if table is None else _between(table, start, end)
        if moving:
            own = _moving_table(recording, frames, tracks)
            tracks += 0 if own is None else int(own.tracks.max(initial=-1)) + 1
        rows = None
        if own is not None and len(own.labels):
            rows, bearings = rows_of_stretch(watched, scans, own, span_ns=(start, end), start=bearings)
        image = background(_frames(recording, frames)) if still else None
        yield Stretch(TimeNs(start), TimeNs(end), image, scans.between(TimeNs(start), TimeNs(end - 1)), rows, still)
        start = end


def _between(table: BoxTable, start: int, end: int) -> BoxTable:
    """Return the boxes of some frames; their tracks stay those of the recording."""
    first, last = np.searchsorted(table.times_ns, [start - _AROUND_NS, end + _AROUND_NS])
    rows = slice(*np.searchsorted(table.frames, [first, last]))
    times_ns, frames = table.times_ns[first:last], table.frames[rows] - first
    sides, tracks, cuboids = table.boxes_px[rows], table.tracks[rows], table.cuboids[rows]
    return BoxTable(times_ns, frames, sides, table.labels[rows], tracks, table.names[rows], cuboids)


def _moving_table(recording: WatchedRecording, frames: np.ndarray, tracks: int) -> BoxTable | None:
    """Return boxes around what moves in some frames, with tracks of their own; None if nothing does, or the camera itself."""
    try:
        boxes = changed_boxes(
            lambda i: recording.image(int(frames[i])), recording.image_times[frames], most_frames=_MOST_FRAMES
        )
    except (InputError, NoAnswerError):
        return None
    table = box_table(boxes)
    return replace(table, tracks=table.tracks + tracks)


def _frames(recording: WatchedRecording, frames: np.ndarray) -> list[np.ndarray]:
    """Return some evenly spread frames that can be read."""
    images = []
    for index in (
        np.unique(np.linspace(0, len(frames) - 1, BACKGROUND_FRAMES).round().astype(int)) if len(frames) else ()
    ):
        try:
            images.append(recording.image(int(frames[index])))
        except MessageError:
            continue
    return [image for image in images if image.shape == images[0].shape]


def baseline_of(found: Sequence[Stretch], *, calibration_sha256: str, recording: str, camera: Camera) -> Baseline:
    """Make a baseline of the stretches of a recording.

    Raises:
        NoAnswerError: they show nothing to compare with, or a camera that turns.
    """
    rows = [one.rows for one in found if one.rows is not None and len(one.rows)]
    images = [one.image for one in found if one.image is not None]
    parts = np.array_split(np.arange(len(images)), min(_BACKGROUNDS, len(images))) if images else []
    backgrounds = [np.median([images[i] for i in part], axis=0).astype(np.uint8) for part in parts]
    turn = camera_turn(backgrounds[0], backgrounds[-1], camera) if len(backgrounds) > 1 else None
    if turn is not None and float(np.linalg.norm(turn.rotation_rad)) > _BASELINE_RAD:
        turned_deg = np.rad2deg(np.linalg.norm(turn.rotation_rad))
        raise NoAnswerError(
            f"{recording}: the camera turned by {turned_deg:.2f}° within it, so nothing can be compared with it; give a "
            "recording in which it stands still"
        )
    still = [one.scans for one in found if one.still and len(one.scans)][:_BASELINE_STRETCHES]
    last = found[-1].scans.times_ns
    places = still_places(RadarScans.joined(still)) if still else None
    if not backgrounds and not rows and not places:
        raise NoAnswerError(
            f"{recording}: nothing to compare with later: no still image, no still returns, no traffic in boxes; record at "
            "least half a minute, and give --boxes"
        )
    return Baseline(
        BASELINE_SCHEMA,
        calibration_sha256,
        recording[:200] or "recording",
        found[0].start,
        TimeNs(int(last[-1])) if len(last) else found[-1].end,
        (camera.width_px, camera.height_px),
        [encoded(image) for image in backgrounds],
        places if places else None,
        learned(TrafficRows.joined(rows)) if rows else None,
    )


class Watch:
    """Takes one stretch after the other, and says what has changed since the baseline.

    Args:
        baseline: to compare with.
        watched: the calibration.
    """

    def __init__(self, baseline: Baseline, watched: Watched) -> None:
        self._baseline = baseline
        self._watched = watched
        self._backgrounds = baseline.images()
        self._image = _Turns(_IMAGE_SIGMAS, _IMAGE_RAD)
        self._returns = _Turns(_RETURNS_SIGMAS, _RETURNS_RAD)
        self._rows: TrafficRows | None = None
        self._since: list[TimeNs | None] = [None] * 3

    def add(self, stretch: Stretch) -> Verdict:
        """Take a stretch; return what all so far say."""
        if stretch.image is not None:
            self._image.add(stretch.start, self._image_turn(stretch.image))
        if stretch.still and self._baseline.still_returns is not None:
            self._returns.add(stretch.start, radar_turn(self._baseline.still_returns, stretch.scans))
        if stretch.rows is not None and self._baseline.traffic is not None:
            self._take(stretch.rows, self._baseline.traffic, stretch)
        return verdict_of(
            self._image.seen(),
            self._returns.seen(),
            self._traffic(),
            camera_from_radar_rotation=self._watched.camera_from_radar.rotation,
        )

    def _image_turn(self, image: np.ndarray) -> Turn | None:
        """Return the turn since that background of the baseline that says it best."""
        found = [camera_turn(one, image, self._watched.camera) for one in self._backgrounds]
        return min(
            (one for one in found if one is not None),
            key=lambda one: float(np.trace(one.covariance_rad2)),
            default=None,
        )

    def _take(self, rows: TrafficRows, model: TrafficModel, stretch: Stretch) -> None:
        """Keep rows of the last ten minutes, and look for a turn in windows that end in this stretch."""
        kept = rows if self._rows is None else TrafficRows.joined([self._rows, rows])
        self._rows = kept = kept.some(kept.times_ns >= stretch.end - _KEPT_NS)
        for end in range(stretch.start + _STEP_NS, stretch.end + 1, _STEP_NS):
            for window in (*_WINDOWS_NS, _KEPT_NS):
                if window == _KEPT_NS and end < stretch.end:
                    continue
                own = (kept.times_ns >= end - window) & (kept.times_ns < end)
                turn = model.turn(kept.some(own)) if own.any() else None
                for axis in np.flatnonzero(turn.least_z > _TRAFFIC_SIGMAS).tolist() if turn is not None else ():
                    first = TimeNs(max(end - window, int(kept.times_ns.min())))
                    self._since[axis] = self._since[axis] or first

    def _traffic(self) -> SeenTurn | None:
        """Return what traffic says: of a turn the rows since it began, else of all that are kept."""
        rows, model = self._rows, self._baseline.traffic
        if rows is None or model is None or not len(rows):
            return None
        since = min((one for one in self._since if one is not None), default=None)
        own = rows if since is None else rows.some(rows.times_ns >= since)
        turn = model.turn(own)
        if turn is None:
            return None
        least = _TRAFFIC_SIGMAS * turn.worst_sigma_rad
        turned = np.array([one is not None for one in self._since])
        ranges = float(np.median(own.ranges_m))
        late_s = turn.late_s if turn.late_s[1] < _CLOCK_KNOWN_S else None
        return SeenTurn(turn.rotation_rad, turn.covariance_rad2, least, turned, since, ranges, turn.passages, late_s)


class _Turns:
    """The turns of a still sensor, stretch by stretch: one counts if two in a row show it, or it is large."""

    def __init__(self, sigmas: float, least_rad: float) -> None:
        self._sigmas = sigmas
        self._least_rad = least_rad
        self._turns: list[Turn] = []
        self._shown: Vector3 = np.zeros(3)  # the sign of the turn about each axis in the last stretch; 0 for none
        self._begun: list[TimeNs | None] = [None] * 3
        self._since: list[TimeNs | None] = [None] * 3

    def add(self, start: TimeNs, turn: Turn | None) -> None:
        """Take the turn of a stretch; None if it does not say."""
        if turn is None:
            return
        sizes = np.abs(turn.rotation_rad) / self._least(turn)
        signs = np.sign(turn.rotation_rad) * (sizes > 1.0)
        for axis in range(3):
            if not signs[axis]:
                self._begun[axis] = self._since[axis] = None
                continue
            if signs[axis] != self._shown[axis]:
                self._begun[axis], self._since[axis] = start, None
                self._turns = []
            if signs[axis] == self._shown[axis] or sizes[axis] > _AT_ONCE:
                self._since[axis] = self._begun[axis]
        self._shown = signs
        self._turns = [*self._turns[1 - _AVERAGED :], turn]

    def seen(self) -> SeenTurn | None:
        """Return the mean of the last stretches; None without any."""
        if not self._turns:
            return None
        rotation = np.mean([turn.rotation_rad for turn in self._turns], axis=0)
        covariance = np.mean([turn.covariance_rad2 for turn in self._turns], axis=0)  # they share their errors
        turned = np.array([one is not None for one in self._since])
        since = min((one for one in self._since if one is not None), default=None)
        return SeenTurn(rotation, covariance, self._least(self._turns[-1]), turned, since)

    def _least(self, turn: Turn) -> Vector3:
        least = np.maximum(self._sigmas * np.sqrt(np.diag(turn.covariance_rad2)), self._least_rad)
        return np.where(turn.determined, least, np.inf)
