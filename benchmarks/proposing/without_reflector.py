"""Recordings in which no reflector stands: simulated drives, and the real ones next to the checkout."""

import os
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from benchmarks.accuracy.rows import Figures
from benchmarks.proposing.cases import Case
from benchmarks.proposing.drawn import drawn_from
from calib_core.association.placements import Placement, find_placements
from calib_core.camera import Camera
from calib_core.errors import CalibrationError, OptionError
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing import FrameSource, dwell_views, proposals_of
from calib_core.proposing.automatic import automatic_clicks
from calib_core.recordings import open_recording
from calib_core.synthetic.options import SimulationOptions, Surroundings, Traffic
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.synthetic.scene.story import Moment, Story

__all__ = ["drive_of", "measure_drive", "measure_real", "real_recordings", "without_reflector"]

_PARKED = Surroundings(parked_cars=4, fence=True, strong_target_dbsm=29.0)
_SWAYING = Surroundings(flickering_targets=20)
_BEHIND_SENSORS_M = np.array([-1.4, 0.9, 0.19])
_DRIVES = (
    SimulationOptions(scene="field", placements=0, surroundings=_PARKED, traffic=Traffic(walkers=4)),
    SimulationOptions(scene="road", radar="imaging", placements=0, traffic=Traffic(cars=3)),
    SimulationOptions(scene="rooftop", placements=0, surroundings=_SWAYING, traffic=Traffic(walkers=2)),
    SimulationOptions(scene="aisle", placements=0, traffic=Traffic(walkers=2, robots=2)),
    SimulationOptions(scene="field", placements=10, surroundings=replace(_PARKED, passers_by=4)),
)
"""Parked cars and a fence, a road, trees that sway, an aisle with robots, and a person who goes from place to place and stands
there as with a reflector, but has none."""


class EmptyHanded(Story):
    """A story without its reflectors, which stay behind the sensors."""

    __slots__ = ()

    def at(self, time_s: float) -> Moment:
        """Return the people at a time."""
        return replace(super().at(time_s), reflector_m=_BEHIND_SENSORS_M, resting=None, standing=())


def drive_of(seed: int) -> Case:
    """Return a drive; any five seeds in a row have each kind once."""
    options = _DRIVES[seed % len(_DRIVES)]
    radar = options.radar if seed // len(_DRIVES) % 2 else "imaging"
    return Case(replace(options, seed=seed, radar=radar, camera_rate_hz=2.0))


def measure_drive(folder: Path, seed: int) -> Figures:
    """Draw a drive and measure it; no figures if its traffic does not fit into the scene."""
    case = drive_of(seed)
    try:
        recording = without_reflector(simulate(case.options))
    except OptionError:
        return {}
    drawn = drawn_from(recording, case, folder / "drives")
    return _measured(drawn.placements, drawn.frames, drawn.recording.camera)


def without_reflector(recording: SimulatedRecording) -> SimulatedRecording:
    """Return a recording in which the person carries nothing."""
    story = recording.stage.story
    empty_handed = EmptyHanded(*(getattr(story, field.name) for field in fields(story)))
    return replace(recording, stage=replace(recording.stage, story=empty_handed))


def _measured(placements: Sequence[Placement], frames: FrameSource, camera: Camera) -> Figures:
    views = dwell_views(placements, frames, camera)
    proposals = proposals_of(views, camera, CalibrationOptions())
    outcome = automatic_clicks(proposals, len(views))
    sure = max((one.confidence for one in proposals.ranked), default=0.0)
    return {
        "placements": float(len(placements)),
        "proposed": float(len(proposals.ranked)),
        "surest": sure,
        "accepted": float(not isinstance(outcome, Unsolvable)),
        "agreement": 0.0 if proposals.agreement is None else proposals.agreement.share,
    }


def real_recordings() -> tuple[Path, ...]:
    """Return the recordings next to the checkout, or in the folder that COCALIB_SHARED_DATA names."""
    next_to_checkout = Path(__file__).resolve().parents[3] / "shared" / "data"
    folder = Path(os.environ.get("COCALIB_SHARED_DATA", next_to_checkout))
    files = [path for suffix in ("bag", "db3", "mcap") for path in folder.rglob(f"*.{suffix}")]
    return tuple(sorted(files))


def measure_real(path: Path) -> Figures | str:
    """Measure a real recording; text if it has no radar or no images to be proposed in."""
    try:
        with open_recording(path) as recording:
            camera = recording.camera()
            if camera is None:
                return "says nothing about the lens"
            placements = find_placements(recording.radar_scans(), CalibrationOptions().gating)
            return _measured(placements, recording, camera)
    except CalibrationError as error:
        return str(error).splitlines()[0]
