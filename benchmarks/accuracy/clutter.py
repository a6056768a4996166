"""Objects other than the reflector in the radar's view: which placements get a wrong position?"""

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.rows import Figures
from benchmarks.accuracy.scenes import SCANS, Scene, draw_windows
from benchmarks.simulated_pairs import AISLE
from calib_core.calibration import calibrate
from calib_core.options import CalibrationOptions
from calib_core.paper.algorithm_1 import pair_as_printed, static_returns_as_printed
from calib_core.radar import direction_cosines
from calib_core.results import Calibration
from calib_core.synthetic.radar_returns import RadarProfile

_FAR = 4.5  # standard deviations of a placement's own error


SCENES = (
    Scene("field, 4 weak objects", objects=4, rcs_dbsm=(4.0, 5.0)),
    Scene("field, 3 objects", objects=3, rcs_dbsm=(3.0, 9.0)),
    Scene("field, 3 objects and a person", objects=3, rcs_dbsm=(3.0, 9.0), person=True, strays=0.1),
    Scene("field, 6 objects stronger than the reflector", objects=6, rcs_dbsm=(14.0, 22.0)),
    Scene("aisle, 14 objects", layout=AISLE, objects=14, rcs_dbsm=(0.0, 9.0)),
    Scene("aisle, 14 objects stronger than the reflector", layout=AISLE, objects=14, rcs_dbsm=(14.0, 22.0)),
    Scene("field, imaging radar, 10 objects", objects=10, rcs_dbsm=(3.0, 18.0), radar="imaging"),
)


def measure_clutter(scene: Scene, trial: int) -> Figures:
    """Simulate the windows around the clicks of one session and solve it, starting from the returns."""
    rng = np.random.default_rng([2025, trial])
    profile, windows = scene.profile, draw_windows(scene, rng)
    rig, places, clicks, scans = windows.rig, windows.places, windows.clicks, windows.scans
    options = CalibrationOptions(solving=tape_measured(0.01))
    outcome = calibrate(clicks, scans, rig.camera, options)
    found = {pair.id: pair for pair in outcome.pairs} if isinstance(outcome, Calibration) else {}
    ours = [found[click.id].point_radar_m if click.id in found else None for click in clicks]
    static = static_returns_as_printed(scans, options.paper)
    printed = [pair_as_printed(click, static, options) for click in clicks]
    paper = [pair.candidates[0].position_radar_m if hasattr(pair, "candidates") else None for pair in printed]
    return {
        "wrong": float(_wrong(ours, places, profile).sum()),
        "paper_wrong": float(_wrong(paper, places, profile).sum()),
    }


def _wrong(positions: list[np.ndarray | None], places: np.ndarray, profile: RadarProfile) -> np.ndarray:
    """Flag positions that are missing, or farther off than the radar's own error for a placement explains."""
    quantised = np.array([profile.range_bin_m, 2.0 / profile.angle_bins if profile.angle_bins else 0.0, 0.0]) / np.sqrt(
        12.0
    )
    lasting = np.array([0.0, profile.azimuth_bias_sigma, profile.elevation_bias_sigma])
    smooth = np.array([0.0, profile.calibration_azimuth, profile.calibration_elevation]) / np.sqrt(2.0)
    single = np.array([profile.range_sigma_m, profile.azimuth_sigma, profile.elevation_sigma]) / np.sqrt(SCANS)
    sigma = np.sqrt(quantised**2 + lasting**2 + smooth**2 + single**2)
    wrong = np.ones(len(places), dtype=np.bool_)
    for i, position in enumerate(positions):
        if position is not None and np.isfinite(position).all():
            off = (direction_cosines(position[None]) - direction_cosines(places[i : i + 1]))[0] / sigma
            wrong[i] = bool(np.linalg.norm(off) > _FAR)
    return wrong
