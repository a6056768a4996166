"""A case as simulated: what the sensors recorded, and the truth that only benchmarks read."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.proposing.cases import Case
from benchmarks.proposing.images import ChangingLight, KeptImages, SimulatedImages
from calib_core.association.placements import Placement, find_placements
from calib_core.measurements import RadarScans
from calib_core.options import CalibrationOptions
from calib_core.proposing import FrameSource
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.synthetic.scene.stage import SimulatedPlacement

__all__ = ["Drawn", "draw", "drawn_from", "true_placement"]

_APART_M = 0.6
_COLUMNS = ("times_ns", "first_return", "points_radar_m", "doppler_mps", "snr_db", "sigma_polar")


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """A case as simulated.

    Attributes:
        case: what was drawn.
        recording: with the truth.
        scans: of the radar.
        frames: of the camera.
        placements: as the radar shows them.
    """

    case: Case
    recording: SimulatedRecording
    scans: RadarScans
    frames: FrameSource
    placements: tuple[Placement, ...]


def draw(case: Case, folder: Path | None) -> Drawn:
    """Simulate a case; frames are rendered when they are asked for.

    Args:
        case: to be simulated.
        folder: where scans and frames are kept, in a folder of the case; None to keep nothing.
    """
    return drawn_from(simulate(case.options), case, folder)


def drawn_from(
    recording: SimulatedRecording, case: Case, folder: Path | None, frames: FrameSource | None = None
) -> Drawn:
    """Take a recording, or frames, that were simulated in another way as those of a case."""
    images = SimulatedImages(recording) if frames is None else frames
    if folder is not None:
        images = KeptImages(images, folder / case.name)
    if case.light:
        images = ChangingLight(images, case.options.seed)
    scans = _scans(recording, None if folder is None else folder / case.name / "scans.npz")
    return Drawn(case, recording, scans, images, find_placements(scans, CalibrationOptions().gating))


def _scans(recording: SimulatedRecording, path: Path | None) -> RadarScans:
    if path is not None and path.is_file():
        with np.load(path, allow_pickle=False) as kept:
            return RadarScans(**{name: kept[name] for name in _COLUMNS})
    scans = recording.scans
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(path, **{name: getattr(scans, name) for name in _COLUMNS})
    return scans


def true_placement(placement: Placement, recording: SimulatedRecording) -> SimulatedPlacement | None:
    """Return what stood at a placement that the radar shows; None if nothing did."""
    middle = (placement.start + placement.end) // 2
    standing = [one for one in recording.placements if one.start <= middle <= one.end]
    apart_m = [float(np.linalg.norm(one.position_radar_m - placement.position_radar_m)) for one in standing]
    return standing[int(np.argmin(apart_m))] if apart_m and min(apart_m) < _APART_M else None
