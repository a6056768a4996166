"""What overlay videos and Rerun show of a recording with its calibration: returns seen by the camera, pairs, boxes, figures."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Flags, Indices, Points2, TimesNs, Values, freeze
from calib_core.errors import InputError
from calib_core.evaluation.figures import Evaluation
from calib_core.measurements import NS_PER_S, Box, Boxes, RadarScans, ReflectorClick, TimeNs
from calib_core.recordings import Recording
from calib_core.results import Calibration, PairResult
from cocalib.colours import ramp_colours
from cocalib.evaluation.evaluating import check_clicks, evidence_in, judged

ReturnQuantity: TypeAlias = Literal["range", "speed"]

_NEAREST_WITHIN_S = 0.3
_BLOCK_FRAMES = 64
_SAMPLED_SCANS = 60
_SAMPLE_HALF_WINDOW_S = 1e-3
_MOST, _BEYOND = 0.98, 1.1
_NEAREST_M, _SLOWEST_MPS = 2.0, 1.0
_STILL_MPS = 0.3
_NONE: Indices = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class SeenReturns:
    """Scans with the pixel of each return.

    Attributes:
        scans: the scans.
        pixels_px: (n, 2) of their returns, as the radar reports them, through the lens; NaN where the camera does not see one.
    """

    scans: RadarScans
    pixels_px: Points2

    def __post_init__(self) -> None:
        freeze(self, pixels_px=(len(self.scans.points_radar_m), 2))

    @property
    def seen(self) -> Flags:
        """Which returns the camera sees: (n,)."""
        return np.isfinite(self.pixels_px[:, 0])

    def near(self, time: TimeNs) -> Indices:
        """Return the rows of the seen returns of the scan nearest to a time; none if none is near."""
        nearest = self._nearest(time)
        return _NONE if nearest is None else self._rows(nearest, nearest + 1)

    def trail(self, time: TimeNs, scans: int) -> Indices:
        """Return the rows of the seen returns of so many scans before the one nearest to a time, that one left out."""
        nearest = self._nearest(time)
        return _NONE if nearest is None else self._rows(max(0, nearest - scans), nearest)

    def _nearest(self, time: TimeNs) -> int | None:
        """Return the scan nearest to a time; None if none is near."""
        if not len(self.scans):
            return None
        nearest = self.scans.nearest(time)
        return nearest if abs(int(self.scans.times_ns[nearest]) - time) <= _NEAREST_WITHIN_S * NS_PER_S else None

    def _rows(self, first_scan: int, end_scan: int) -> Indices:
        first, end = (int(self.scans.first_return[scan]) for scan in (first_scan, end_scan))
        return first + np.flatnonzero(self.seen[first:end])


@dataclass(frozen=True, slots=True, eq=False)
class FrameBlock:
    """Some frames that follow each other, with the scans around them.

    Attributes:
        first: index of the first frame.
        times_ns: (m,) stamps of the frames.
        scans: from before the first frame, trails included, to after the last.
    """

    first: int
    times_ns: TimesNs
    scans: RadarScans


def frame_blocks(recording: Recording, *, trail_s: float = 0.0) -> Iterator[FrameBlock]:
    """Yield all frames in order, a bounded number at a time, with the scans around them.

    Args:
        recording: with a radar and a camera.
        trail_s: how long before a frame its scans begin.
    """
    margin = round(_NEAREST_WITHIN_S * NS_PER_S)
    for first in range(0, len(recording.image_times), _BLOCK_FRAMES):
        times = recording.image_times[first : first + _BLOCK_FRAMES]
        start = TimeNs(int(times[0]) - margin - round(trail_s * NS_PER_S))
        yield FrameBlock(first, times, recording.radar_scans(start, TimeNs(int(times[-1]) + margin)))


def seen_in(calibration: Calibration, scans: RadarScans) -> SeenReturns:
    """Project all returns of some scans with a calibration."""
    points_camera = calibration.camera_from_radar @ calibration.radar_errors.corrected(scans.points_radar_m)
    pixels_px = np.full((len(points_camera), 2), np.nan)
    known = np.isfinite(points_camera).all(axis=1)
    known[known] = calibration.camera.sees(points_camera[known])
    pixels_px[known] = calibration.camera.project(points_camera[known])
    return SeenReturns(scans, pixels_px)


@dataclass(frozen=True, slots=True)
class ReturnColours:
    """What the colours of returns mean, throughout a recording.

    Attributes:
        quantity: range, or radial speed.
        low: at the first colour [m or m/s].
        high: at the last.
    """

    quantity: ReturnQuantity
    low: float
    high: float

    def of(self, scans: RadarScans, rows: Indices | slice = slice(None)) -> np.ndarray:
        """Return the colours of returns: (n, 3) uint8, red first, for a dark background."""
        signed = self.quantity == "speed"
        values = _values(self.quantity, scans, rows)
        return np.rint(ramp_colours(values, self.low, self.high, light=False, signed=signed)).astype(np.uint8)

    @property
    def ends(self) -> tuple[str, str]:
        """What the first and the last colour mean, with units."""
        if self.quantity == "speed":
            return f"{self.low:+.0f} m/s", f"{self.high:+.0f} m/s"
        return f"{self.low:g} m", f"{self.high:g} m"


def _return_colours(recording: Recording, quantity: ReturnQuantity) -> ReturnColours:
    """Choose the ends of the colours from scans spread over the recording: they hold 98 % of its returns, or of what moves.

    Args:
        recording: with a radar.
        quantity: to colour by.

    Raises:
        InputError: the radar reports no speeds, and returns are to be coloured by speed.
    """
    times = recording.radar_times
    sampled = times[np.linspace(0, len(times) - 1, min(_SAMPLED_SCANS, len(times))).astype(np.int64)]
    scans = recording.radar_scans_around([TimeNs(int(time)) for time in sampled], _SAMPLE_HALF_WINDOW_S)
    values = _values(quantity, scans, slice(None))
    known = np.abs(values[np.isfinite(values)])
    if quantity == "speed":
        if not len(known):
            raise InputError(
                f"{recording.name}: the radar reports no speeds ({recording.radar_topic}); use --colour range"
            )
        moving = known[known > _STILL_MPS]
        fastest_mps = float(np.ceil(np.quantile(moving, _MOST))) if len(moving) else _SLOWEST_MPS
        return ReturnColours("speed", -fastest_mps, fastest_mps)
    far_m = float(np.quantile(known, _MOST)) if len(known) else 0.0
    return ReturnColours("range", 0.0, max(_NEAREST_M, float(f"{_BEYOND * far_m:.2g}")))


def _values(quantity: ReturnQuantity, scans: RadarScans, rows: Indices | slice) -> Values:
    if quantity == "speed":
        return np.asarray(scans.doppler_mps[rows])
    return np.asarray(np.linalg.norm(scans.points_radar_m[rows], axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class RecordedView:
    """A recording with a calibration and what is known of it.

    Attributes:
        recording: with a radar and a camera.
        calibration: to project with.
        pairs: clicks in frames of this recording, with their radar positions and residuals under the calibration.
        colours: of the returns.
        boxes: around objects; None without any.
        evaluation: the figures; None if neither clicks nor boxes were given.
        against: another calibration to compare with.
    """

    recording: Recording
    calibration: Calibration
    pairs: tuple[PairResult, ...]
    colours: ReturnColours
    boxes: Boxes | None = None
    evaluation: Evaluation | None = None
    against: Calibration | None = None

    def pairs_by_frame(self) -> dict[TimeNs, tuple[PairResult, ...]]:
        """Return the pairs of each frame that has any."""
        frames: dict[TimeNs, tuple[PairResult, ...]] = {}
        for pair in self.pairs:
            if pair.image_time is not None:
                frames[pair.image_time] = (*frames.get(pair.image_time, ()), pair)
        return frames

    def boxes_by_frame(self) -> dict[TimeNs, tuple[Box, ...]]:
        """Return the boxes of each annotated frame."""
        return {frame.image_time: frame.boxes for frame in self.boxes} if self.boxes else {}

    def acc_by_frame(self) -> dict[TimeNs, float]:
        """Return Acc, 0 to 1, of each frame that counts."""
        figures = self.evaluation.boxes if self.evaluation else None
        counted = [frame for frame in figures.frames if frame.returns] if figures else []
        return {frame.image_time: frame.share for frame in counted}


def recorded_view(
    recording: Recording,
    calibration: Calibration,
    quantity: ReturnQuantity,
    *,
    clicks: Sequence[ReflectorClick] = (),
    boxes: Boxes | None = None,
    against: Calibration | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> RecordedView:
    """Collect what is to be shown.

    Args:
        recording: with a radar and a camera.
        calibration: to project with.
        quantity: what the colours of returns show.
        clicks: in frames of this recording; without any, those that the calibration was made from, if they are of its frames.
        boxes: around objects.
        against: another calibration.
        progress: of the evaluation.

    Raises:
        InputError: there are no scans, or the images are not those of the calibration's camera.
    """
    if not len(recording.radar_times):
        raise InputError(f"{recording.name}: {recording.radar_topic} has no scans; choose another with --radar-topic")
    for one in (calibration, against) if against else (calibration,):
        _require_same_size(recording, one)
    pairs = check_clicks(recording, clicks, calibration, calibration.options) if clicks else ()
    evaluation = None
    if clicks or boxes:
        evidence = evidence_in(recording, calibration.camera, clicks=clicks, boxes=boxes, progress=progress)
        evaluation = judged(calibration, evidence, held_out=False, progress=progress)
    return RecordedView(
        recording,
        calibration,
        pairs or _own_pairs(recording, calibration),
        _return_colours(recording, quantity),
        boxes=boxes,
        evaluation=evaluation,
        against=against,
    )


def box_words(box: Box) -> str:
    """Return what is written at a box: its class and its track, the class only once."""
    return (
        box.track if box.label and box.track.startswith(box.label) else " ".join(filter(None, (box.label, box.track)))
    )


def _own_pairs(recording: Recording, calibration: Calibration) -> tuple[PairResult, ...]:
    """Return the calibration's pairs if they are of this recording's frames, else none."""
    pairs = [pair for pair in calibration.pairs if pair.image_time is not None]
    times = np.array([pair.image_time for pair in pairs], dtype=np.int64)
    return tuple(pairs) if len(pairs) and bool(np.isin(times, recording.image_times).all()) else ()


def _require_same_size(recording: Recording, calibration: Calibration) -> None:
    image, camera = recording.image_bytes(0), calibration.camera
    if (image.width_px, image.height_px) != (camera.width_px, camera.height_px):
        raise InputError(
            f"{recording.name}: its images have {image.width_px} x {image.height_px} px, but the calibration's camera has "
            f"{camera.width_px} x {camera.height_px} px; give a calibration of this camera, or other topics"
        )
