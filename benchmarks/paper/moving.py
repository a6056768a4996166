"""Acc of people and of cars: PPM+D1's calibration judged by the boxes of what moves."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.paper.settings import Settings, options_of
from calib_core.arrays import TimesNs
from calib_core.evaluation import BoxFigures
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.results import Calibration
from calib_core.synthetic import PRESETS, PresetName, simulate
from calib_core.synthetic.annotations import true_boxes, true_labels
from cocalib.evaluation.evaluating import evaluate_recording

__all__ = ["MOVING", "Judged", "acc_of"]

MOVING: dict[PresetName, str] = {
    "people": "people walking",
    "robot": "a robot car in the aisle",
    "cars-near": "cars, 5 to 20 m",
    "cars-far": "cars, 20 to 60 m",
}


@dataclass(frozen=True, slots=True)
class _Radar:
    """The radar of a simulated recording, as an evaluation reads it."""

    scans: RadarScans

    @property
    def radar_times(self) -> TimesNs:
        return self.scans.times_ns

    def radar_windows(self) -> Iterator[RadarScans]:
        yield self.scans

    def radar_scans_around(self, times: Sequence[TimeNs], half_window_s: float, /) -> RadarScans:
        half_ns = round(half_window_s * NS_PER_S)
        near = np.zeros(len(self.scans), dtype=np.bool_)
        for time in times:
            near |= np.abs(self.scans.times_ns - int(time)) <= half_ns
        return RadarScans.from_scans([self.scans.scan(int(i)) for i in np.flatnonzero(near)])


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """One calibration judged by the boxes of one recording.

    Attributes:
        by_targets: the radar's own targets decide which returns belong to an object, as on a real recording.
        by_labels: the simulation's labels decide.
    """

    by_targets: BoxFigures
    by_labels: BoxFigures


def acc_of(preset: PresetName, calibration: Calibration, seed: int, settings: Settings) -> Judged:
    """Judge a calibration of D1 on a recording of moving targets with the same rig; the boxes are true ones."""
    d1 = options_of("d1", seed, settings)
    options = replace(PRESETS[preset], seed=seed, width_px=d1.width_px, height_px=d1.height_px, rig=d1.rig)
    errors = {
        "constant_azimuth_deg": settings.constant_azimuth_deg,
        "constant_elevation_deg": settings.constant_elevation_deg,
    }
    options = replace(options, defects=replace(options.defects, **errors), angle_bins=False)
    recording = simulate(options)
    radar = _Radar(RadarScans.from_scans(list(recording.scans())))
    boxes = true_boxes(recording)
    by_targets = evaluate_recording(calibration, radar, boxes=boxes).boxes
    by_labels = evaluate_recording(calibration, radar, boxes=boxes, labels=true_labels(recording)).boxes
    assert by_targets is not None, "boxes were given"
    assert by_labels is not None, "boxes were given"
    return Judged(by_targets, by_labels)
