"""Judge a calibration on a recording: what `evaluate`, `compare`, the report, the page and the exports all call."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.association.pairing import RadarSource, pair_clicks, scans_around
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.evaluation.box_acc import judged_by_boxes
from calib_core.evaluation.counted_returns import CountedReturns, counted_returns, longest_gap_s
from calib_core.evaluation.figures import BoxFigures, Evaluation
from calib_core.evaluation.moving_returns import TargetOptions
from calib_core.evaluation.residuals import AssociatedPairs, associated_pairs, residual_figures
from calib_core.evaluation.target_tracking import LONGEST_STEP_S, find_targets
from calib_core.measurements import NS_PER_S, Boxes, Pair, RadarScans, ReflectorClick, ReturnLabels, TimeNs, Unpaired
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration, DataWarning, PairResult

_AROUND_S = 3.0
"""Scans before the first and after the last annotated frame, for targets to be followed into the frames."""

_DOUBTFUL = frozenset({"other-lens", "no-target-in-a-box", "turned-from-boxes", "mostly-moving"})
_TURNED_DEG = 1.0
"""Beyond two standard deviations: what boxes are off by, as of returns that are not in the middle of their objects."""
_BEARINGS_DEG = 4.0
_ENOUGH_ACC = 0.25
_ABOUT = {"pitch": 0, "yaw": 1, "roll": 2}


class RadarRecording(RadarSource, Protocol):
    """The part of a Recording that an evaluation needs: its radar, and none of its images."""

    @property
    def radar_times(self) -> TimesNs:
        """The stamps of the scans, ascending."""

    def radar_windows(self) -> Iterator[RadarScans]:
        """Yield all scans in order of time, a bounded number of returns at a time."""


@dataclass(frozen=True, slots=True)
class EvidenceOptions:
    """How a recording is searched for what speaks for or against calibrations.

    Attributes:
        classes: count only targets whose boxes are of these classes; all if empty.
        max_gap_s: longest time between a frame and its scan; None takes half the period of the scans.
        targets: how moving targets are found.
        solving: options of the solves that associate clicks and returns.
    """

    classes: tuple[str, ...] = ()
    max_gap_s: float | None = None
    targets: TargetOptions = field(default_factory=TargetOptions)
    solving: CalibrationOptions = field(default_factory=CalibrationOptions)


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What a recording says, before any calibration is judged by it.

    Attributes:
        clicks: with their returns; None without clicks.
        unpaired: clicks without a radar position.
        returns: of moving targets, with their boxes; None without boxes.
        warnings: about the recording.
    """

    clicks: AssociatedPairs | None
    unpaired: tuple[Unpaired, ...]
    returns: CountedReturns | None
    warnings: tuple[DataWarning, ...]


def evidence_in(
    recording: RadarRecording,
    camera: Camera,
    *,
    clicks: Sequence[ReflectorClick] = (),
    boxes: Boxes | None = None,
    labels: ReturnLabels | None = None,
    progress: Callable[[int, int], None] | None = None,
    options: EvidenceOptions | None = None,
) -> Evidence:
    """Find what speaks for or against calibrations in a recording; the pose of none has a say in it, and no image is decoded.

    Args:
        recording: with a radar.
        camera: the lens.
        clicks: on the reflector.
        boxes: around moving objects.
        labels: the true origin of each return, of a simulation; they then decide instead of the radar's own targets.
        progress: called with the scans done and their number.
        options: of the search; None takes the defaults.

    Raises:
        InputError: boxes or labels are of another recording or another camera, or no class matches.
    """
    options = options or EvidenceOptions()
    pairs, unpaired = _pairs(recording, clicks, camera, options.solving)
    lost = _lost_click_warnings(unpaired) if pairs is None and clicks else ()
    if boxes is None:
        return Evidence(pairs, unpaired, None, lost)
    _require_camera(boxes, camera)
    lost = (*lost, *_box_warnings(boxes, options.classes))
    if labels is not None or _have_cuboids(boxes):
        reach_s = options.max_gap_s or longest_gap_s(recording.radar_times)
        scans = recording.radar_scans_around(boxes.times_ns.tolist(), reach_s + 1e-3)
        returns = counted_returns(
            camera, scans, boxes, labels, classes=options.classes, max_gap_s=options.max_gap_s or reach_s
        )
        return Evidence(pairs, unpaired, returns, (*lost, *_warnings_on(returns)))
    if too_sparse := _too_sparse(recording.radar_times, boxes):
        return Evidence(pairs, unpaired, None, (*lost, *too_sparse))
    targets = find_targets(_windows(recording, boxes), options.targets, progress=progress)
    stamps = RadarScans(targets.moving.scans.times_ns, np.zeros(len(targets.moving.scans) + 1, dtype=np.int64))
    returns = counted_returns(
        camera, stamps, boxes, targets.tracks, classes=options.classes, max_gap_s=options.max_gap_s
    )
    return Evidence(pairs, unpaired, returns, (*lost, *targets.moving.warnings, *_warnings_on(returns)))


def judged(
    calibration: Calibration,
    evidence: Evidence,
    *,
    held_out: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Judge a calibration by what was found in a recording.

    Args:
        calibration: with the lens that the evidence was found with.
        evidence: in the recording.
        held_out: also predict the clicks of each placement from the others.
        progress: called with the steps done and their number.
    """
    residuals = boxes = None
    warnings = list(evidence.warnings)
    if evidence.clicks is not None:
        residuals = residual_figures(
            evidence.clicks, calibration, unpaired=evidence.unpaired, with_held_out=held_out, progress=progress
        )
    if evidence.returns is not None:
        pose, lens = calibration.camera_from_radar, calibration.camera
        boxes = judged_by_boxes(pose, lens, evidence.returns, radar_errors=calibration.radar_errors, progress=progress)
        warnings += _turned_warnings(calibration, evidence.returns, boxes)
    return Evaluation(residuals, boxes, tuple(warnings))


def check_clicks(
    recording: RadarSource, clicks: Sequence[ReflectorClick], reference: Calibration, options: CalibrationOptions
) -> tuple[PairResult, ...]:
    """Evaluate clicks under a calibration that was solved without them; each is marked as excluded.

    Of a click's radar positions, the one reprojected nearest to it is used, which makes the residual slightly too small.

    Raises:
        CalibrationError: the recording cannot be read at the clicks.
    """
    scans = scans_around(recording, clicks, options)
    return tuple(_result_under(pair, reference) for pair in pair_clicks(clicks, scans, options).pairs)


def evaluation_exit_code(evaluation: Evaluation) -> int:
    """Return 0 if a calibration was judged, 1 if there was nothing to judge it by, 3 if there are doubts."""
    residuals, boxes = evaluation.residuals, evaluation.boxes
    if residuals is None and (boxes is None or boxes.acc is None):
        return 1
    return 3 if any(warning.code in _DOUBTFUL for warning in evaluation.warnings) else 0


def _result_under(pair: Pair, reference: Calibration) -> PairResult:
    points_radar_m = np.array([candidate.position_radar_m for candidate in pair.candidates])
    pixels_px = reference.reproject(points_radar_m)
    distances_px = np.linalg.norm(pixels_px - pair.pixel_px, axis=1)
    nearest = int(np.argmin(np.where(np.isfinite(distances_px), distances_px, np.inf)))
    return PairResult(
        pair.id, pair.pixel_px, pixels_px[nearest], points_radar_m[nearest], False, True, image_time=pair.image_time
    )


def _pairs(
    recording: RadarRecording, clicks: Sequence[ReflectorClick], camera: Camera, options: CalibrationOptions
) -> tuple[AssociatedPairs | None, tuple[Unpaired, ...]]:
    counting = [click for click in clicks if click.counts]
    if not counting:
        return None, ()
    pairing = pair_clicks(counting, scans_around(recording, counting, options), options)
    if not pairing.pairs:
        return None, pairing.unpaired
    return associated_pairs(pairing.pairs, camera, options), pairing.unpaired


def _windows(recording: RadarRecording, boxes: Boxes) -> Iterator[RadarScans]:
    """Yield the scans of the annotated part of a recording, a bounded number of returns at a time."""
    if not len(boxes):
        return
    around_ns = round(_AROUND_S * NS_PER_S)
    start, end = int(boxes.times_ns[0]) - around_ns, int(boxes.times_ns[-1]) + around_ns
    overlap = bool(((recording.radar_times >= start) & (recording.radar_times <= end)).any())
    for window in recording.radar_windows():
        if not overlap or (int(window.times_ns[-1]) >= start and int(window.times_ns[0]) <= end):
            yield window.between(TimeNs(start), TimeNs(end)) if overlap else window


def _require_camera(boxes: Boxes, camera: Camera) -> None:
    """Refuse boxes of images of another size.

    Raises:
        InputError: the sizes differ.
    """
    size = (camera.width_px, camera.height_px)
    if boxes.image_size_px is not None and boxes.image_size_px != size:
        raise InputError(
            f"{boxes.source}: made on images of {boxes.image_size_px[0]} x {boxes.image_size_px[1]} px, but the "
            f"calibration's camera has {size[0]} x {size[1]} px; give the boxes and the calibration of one camera"
        )


def _have_cuboids(boxes: Boxes) -> bool:
    """Return whether most boxes have a cuboid, so that no target has to be followed."""
    with_one = [box.cuboid is not None for frame in boxes for box in frame.boxes]
    return 2 * sum(with_one) > len(with_one)


def _lost_click_warnings(unpaired: Sequence[Unpaired]) -> tuple[DataWarning, ...]:
    """Warn that clicks gave no residual."""
    facts = {"clicks": len(unpaired), "first": unpaired[0]} if unpaired else {}
    return (DataWarning("no-paired-clicks", facts),)


def _box_warnings(boxes: Boxes, classes: Sequence[str]) -> tuple[DataWarning, ...]:
    """Pass on what reading the boxes took for granted or left out, and name the classes that no box has."""
    absent = (f"no box is of the class '{name}'" for name in classes if name not in boxes.labels)
    notes = (*boxes.notes, *absent)
    return tuple(DataWarning("boxes-note", {"source": boxes.source, "note": note}) for note in notes)


def _too_sparse(radar_times: TimesNs, boxes: Boxes) -> tuple[DataWarning, ...]:
    """Warn that between scans, or between frames whose boxes have no tracks, objects move too far to be told apart."""
    named = all(box.track for frame in boxes for box in frame.boxes)
    for what, times in (("scans", radar_times), ("annotated frames", boxes.times_ns[:0] if named else boxes.times_ns)):
        apart_s = float(np.median(np.diff(times))) / NS_PER_S if len(times) > 1 else 0.0
        if apart_s > LONGEST_STEP_S:
            return (DataWarning("sparse-frames", {"frames": what, "apart_s": apart_s, "longest_s": LONGEST_STEP_S}),)
    return ()


def _warnings_on(returns: CountedReturns) -> tuple[DataWarning, ...]:
    if not len(returns.frames):
        far = {"max_range_m": TargetOptions().max_range_m}
        return (DataWarning("no-target-in-a-box") if returns.by_cuboid else DataWarning("no-targets", far),)
    if not returns.matched_targets:
        return (DataWarning("no-target-in-a-box", {"targets": returns.found_targets}),)
    return ()


def _turned_warnings(calibration: Calibration, returns: CountedReturns, boxes: BoxFigures) -> list[DataWarning]:
    """Warn if targets and boxes agree on another direction than the calibration: by Acc, or by bearings where Acc is too low."""
    ends = {
        curve.axis: (curve.best_deg, curve.low_deg, curve.high_deg) for curve in boxes.sensitivity if not curve.is_flat
    }
    tops = {curve.axis: max(curve.acc) for curve in boxes.sensitivity if curve.axis in ends}
    highest = max(tops, key=lambda axis: tops[axis], default=None)
    if highest is not None and tops[highest] >= _ENOUGH_ACC:
        turned, low, high = ends[highest]
        sigma_deg = np.rad2deg(np.sqrt(np.nan_to_num(np.diag(calibration.covariance)[3:])))[_ABOUT[highest]]
        within = np.hypot(turned - low if turned > 0 else high - turned, 2.0 * sigma_deg)
        if abs(turned) <= _TURNED_DEG + within:
            return []
        return [
            DataWarning("turned-from-boxes", {"axis": highest, "turned_deg": turned, "low_deg": low, "high_deg": high})
        ]
    if returns.bearings is None:
        return []
    ahead = calibration.camera_from_radar.rotation @ np.array([1.0, 0.0, 0.0])
    expected = -float(np.arctan2(ahead[0], ahead[2]))
    off = float(np.rad2deg((expected - returns.bearings.turn_rad + np.pi) % (2.0 * np.pi) - np.pi))
    return [DataWarning("turned-from-boxes", {"axis": "yaw", "turned_deg": off})] if abs(off) >= _BEARINGS_DEG else []
