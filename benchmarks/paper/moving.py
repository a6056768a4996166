"""Acc of people, a robot car and cars, and what could make Acc of cars as low as the paper's."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.paper.rows import by_mounting, calibrated, with_gross_errors
from benchmarks.paper.settings import Settings, other_rig, session, under
from calib_core.camera import Camera
from calib_core.evaluation.box_acc import judged_by_boxes
from calib_core.evaluation.counted_returns import counted_returns
from calib_core.evaluation.figures import BoxFigures
from calib_core.evaluation.target_tracking import TargetTrack, find_targets
from calib_core.geometry import RigidTransform
from calib_core.measurements import NS_PER_S, Box, Boxes, RadarScans, ReturnLabels, TimeNs
from calib_core.synthetic.annotations import true_boxes, true_labels
from calib_core.synthetic.presets import PRESETS, PresetName
from calib_core.synthetic.recording import SimulatedRecording, simulate

MOVING: Mapping[PresetName, tuple[str, str]] = {
    "people": ("people walking on the rooftop", "89 %"),
    "robot": ("a robot car in the aisle, camera on the other rig", ""),
    "cars-near": ("cars, 5 to 20 m, imaging radar", "66 %, no range stated"),
    "cars-far": ("cars, 20 to 60 m, imaging radar", "the same"),
}
"""What moves, and the paper's Acc."""
_SHRUNK, _LATE_S = 0.75, 0.2
_SIDE_SHARE, _SIDE_M = 0.2, 1.5


@dataclass(frozen=True, slots=True)
class Acc:
    """Acc of one kind of target for one seed, in shares; frames of 0 % are kept but in `dropped`.

    Attributes:
        ppm: of the paper's method, by the radar's own targets.
        dropped: the same without frames of 0 %, as the authors' published script counts.
        labelled: the same by the simulation's labels.
        pmm: of the mounting, by the radar's own targets.
    """

    ppm: float
    dropped: float
    labelled: float
    pmm: float


def recording_of(preset: PresetName, seed: int, settings: Settings, **changed: object) -> SimulatedRecording:
    """Simulate what moves before the sensors of D1, or of DR+D3 in the aisle: the camera's view that is judged."""
    options = under(PRESETS[preset], seed, settings)
    if preset == "robot":
        options = replace(options, other_camera=PRESETS["paper-d3"].other_camera)
    recording = simulate(replace(options, **changed))  # type: ignore[arg-type]
    return recording.other_camera or recording


def poses_of(preset: PresetName, seed: int, settings: Settings) -> tuple[Camera, RigidTransform, RigidTransform]:
    """Return the lens of a recording, and the poses by PPM and by PMM that it is judged with."""
    if preset == "robot":
        other = other_rig(session("d3", seed, settings))
        ppm = with_gross_errors(other, settings.gross_pairs, settings.gross_m).unwrap()
        return ppm.camera, ppm.camera_from_radar, by_mounting(other, other_rig=True)
    first = session("d1", seed, settings)
    ppm = calibrated(first).unwrap()
    return ppm.camera, ppm.camera_from_radar, by_mounting(first)


def judged_by_both(
    preset: PresetName, seed: int, settings: Settings, *, labelled: bool = False
) -> tuple[BoxFigures, BoxFigures]:
    """Return the figures of PPM and PMM on true boxes, by the radar's own targets or by labels."""
    camera, ppm, pmm = poses_of(preset, seed, settings)
    scans, boxes, labels = _seen(recording_of(preset, seed, settings))
    returns = counted_returns(camera, scans, boxes, labels if labelled else find_targets([scans]).tracks)
    return judged_by_boxes(ppm, camera, returns), judged_by_boxes(pmm, camera, returns)


def acc_of(preset: PresetName, seed: int, settings: Settings) -> Acc:
    """Judge PPM and PMM on what moves."""
    own, mounted = judged_by_both(preset, seed, settings)
    labelled, _ = judged_by_both(preset, seed, settings, labelled=True)
    figures = (own.acc, own.acc_without_zero_frames, labelled.acc, mounted.acc)
    return Acc(*(float("nan") if one is None else one for one in figures))


def assumptions_of(seed: int, settings: Settings) -> dict[str, float]:
    """Return Acc of cars at 20 to 60 m with one assumption changed, by labels except where the labels are what changes."""
    camera, ppm, _ = poses_of("cars-far", seed, settings)
    scans, boxes, labels = _seen(recording_of("cars-far", seed, settings))
    farther = replace(PRESETS["cars-far"].traffic, nearest_m=60.0, farthest_m=100.0)
    changed: Mapping[str, tuple[RadarScans, Boxes, ReturnLabels | Sequence[TargetTrack]]] = {
        f"box size: {100 * _SHRUNK:.0f} % of the car's width and height, as of a tight detector": (
            scans,
            _shrunk(boxes),
            labels,
        ),
        "range: 60 to 100 m instead of 20 to 60": _seen(recording_of("cars-far", seed, settings, traffic=farther)),
        f"speed times latency: boxes {_LATE_S:g} s later than the returns": (scans, _late(boxes), labels),
        f"side returns: {100 * _SIDE_SHARE:.0f} % of the returns {_SIDE_M:g} m beside the car": (
            _beside(scans, labels, seed),
            boxes,
            labels,
        ),
        "the radar's resolution of a car: an AWR1843 instead of an imaging radar": _seen(
            recording_of("cars-far", seed, settings, radar="awr1843")
        ),
        "labels: the radar's own targets instead": (scans, boxes, find_targets([scans]).tracks),
    }
    return {
        what: judged_by_boxes(ppm, camera, counted_returns(camera, *seen)).acc or 0.0 for what, seen in changed.items()
    }


def _seen(recording: SimulatedRecording) -> tuple[RadarScans, Boxes, ReturnLabels]:
    return recording.scans, true_boxes(recording), true_labels(recording)


def _shrunk(boxes: Boxes) -> Boxes:
    frames = (replace(frame, boxes=tuple(map(_smaller, frame.boxes))) for frame in boxes)
    return replace(boxes, frames=tuple(frames))


def _smaller(box: Box) -> Box:
    x, y = (0.5 * (1.0 - _SHRUNK) * size for size in (box.right_px - box.left_px, box.bottom_px - box.top_px))
    left, right, top, bottom = box.left_px + x, box.right_px - x, box.top_px + y, box.bottom_px - y
    return replace(box, left_px=left, right_px=right, top_px=top, bottom_px=bottom)


def _late(boxes: Boxes) -> Boxes:
    """Stamp the boxes as if they had been seen earlier: their contents are late."""
    late_ns = round(_LATE_S * NS_PER_S)
    frames = tuple(replace(frame, image_time=TimeNs(frame.image_time - late_ns)) for frame in boxes)
    return replace(boxes, frames=frames)


def _beside(scans: RadarScans, labels: ReturnLabels, seed: int) -> RadarScans:
    """Move some of the cars' returns to their sides, as a reflection from what stands there would."""
    rng = np.random.default_rng([seed, 66])
    of_scan = {int(one.radar_time): one.tracks for one in labels.scans}
    found = []
    for number in range(len(scans)):
        scan = scans.scan(number)
        cars = np.array([bool(track) for track in of_scan[int(scan.time)]], dtype=np.bool_)
        moved = cars & (rng.uniform(size=len(cars)) < _SIDE_SHARE)
        shift = np.outer(moved * rng.choice([-_SIDE_M, _SIDE_M], len(cars)), [0.0, 1.0, 0.0])
        found.append(replace(scan, points_radar_m=scan.points_radar_m + shift))
    return RadarScans.from_scans(found)
