"""Objects other than the reflector in the radar's view: which placements get a wrong position?"""

from functools import partial

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.figures import MET, MISSED, Measured, at_least, at_most, column, fewest, share, summed_up
from benchmarks.accuracy.rows import Figures, Kept, Part, Row, Section
from benchmarks.accuracy.scenes import PLACEMENTS, SCANS, Scene, draw_windows
from benchmarks.simulated_pairs import AISLE
from calib_core.calibration import calibrate
from calib_core.options import CalibrationOptions
from calib_core.paper.algorithm_1 import pair_as_printed, static_returns_as_printed
from calib_core.radar import direction_cosines
from calib_core.results import Calibration
from calib_core.synthetic.radar_returns import RadarProfile
from calib_core.synthetic.rig import Rig

__all__ = ["ROWS", "SCENES", "measure_clutter", "section"]

_TRIALS = 150
_FAR = 4.5  # standard deviations of a placement's own error
_AIM, _PAPER = 0.5, 96.0  # percent


SCENES = (
    Scene("field, 4 weak objects", objects=4, rcs_dbsm=(4.0, 5.0)),
    Scene("field, 3 objects", objects=3, rcs_dbsm=(3.0, 9.0)),
    Scene("field, 3 objects and a person", objects=3, rcs_dbsm=(3.0, 9.0), person=True, strays=0.1),
    Scene("field, 6 objects stronger than the reflector", objects=6, rcs_dbsm=(14.0, 22.0)),
    Scene("aisle, 14 objects", layout=AISLE, objects=14, rcs_dbsm=(0.0, 9.0)),
    Scene("aisle, 14 objects stronger than the reflector", layout=AISLE, objects=14, rcs_dbsm=(14.0, 22.0)),
    Scene("field, imaging radar, 10 objects", objects=10, rcs_dbsm=(3.0, 18.0), radar="imaging"),
)
_BARE = (
    Scene("field, nothing else"),
    Scene("field, a person and strays", person=True, strays=0.1),
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
    believed = [click.id in found and found[click.id].inlier for click in clicks]
    static = static_returns_as_printed(scans, options.paper)
    printed = [pair_as_printed(click, static, options) for click in clicks]
    paper = [pair.candidates[0].position_radar_m if hasattr(pair, "candidates") else None for pair in printed]
    wrong = _wrong(ours, places, profile)
    pose = outcome.camera_from_radar if isinstance(outcome, Calibration) else None
    return {
        "wrong": float(wrong.sum()),
        "believed": float((wrong & np.array(believed)).sum()),
        "set_aside": float((~wrong & ~np.array(believed)).sum()),
        "paper_wrong": float(_wrong(paper, places, profile).sum()),
        "rotation_rad": None if pose is None else _rotation_rad(rig, pose),
    }


def _rotation_rad(rig: Rig, pose: object) -> float:
    error = rig.camera_from_radar.error_from(pose)  # type: ignore[arg-type]
    return float(np.linalg.norm(error[3:]))


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


def _key(scene: Scene) -> str:
    return "clutter-" + scene.name.replace(", ", "-").replace(" ", "-")


ROWS = tuple(Row(_key(scene), _TRIALS, partial(measure_clutter, scene)) for scene in (*SCENES, *_BARE))


def section(kept: Kept) -> Section:
    """Write the table."""
    cells, verdicts, papers = [], [], []
    for scene in (*SCENES, *_BARE):
        trials = kept.get(_key(scene), ())
        if not trials:
            continue
        ours, paper = (_percent(column(trials, name)) for name in ("wrong", "paper_wrong"))
        promised = scene in SCENES
        verdict = at_most(ours, _AIM)
        verdicts += [verdict]
        papers += [MET if at_least(paper, _PAPER) == MET else MISSED] if promised else []
        rms_deg = np.rad2deg(np.sqrt(np.nanmean(column(trials, "rotation_rad") ** 2)))
        cells.append(
            (
                scene.name,
                str(len(trials) * PLACEMENTS),
                f"{paper.value:.1f} %",
                ours.percent,
                f"{_percent(column(trials, 'believed')).value:.2f} %",
                f"{_percent(column(trials, 'set_aside')).value:.2f} %",
                f"{rms_deg:.2f} deg",
                f"{_AIM:g} %",
                verdict,
            )
        )
    head = (
        "scene",
        "placements",
        "paper's mean wrong",
        "ours wrong",
        "wrong and used",
        "right and set aside",
        "rotation",
        "aim",
        "",
    )
    trial_counts = fewest(kept, [row.key for row in ROWS])
    claims = (
        summed_up("wrong placements at most 0.5 % in seven clutter scenes", verdicts, trial_counts),
        summed_up("where the paper's mean is wrong in 96 % or more", papers, trial_counts),
    )
    return Section(
        "With other objects in the radar's view: which position is chosen?",
        _TEXT,
        (Part("", head, tuple(cells)),),
        claims,
    )


_TEXT = """Starting from radar returns: 20 placements with 3 s of scans around each click, with range and angle bins,
persistent errors, side lobes, misses and false alarms (the imaging radar in the row that says so, an AWR1843 elsewhere). A
placement is wrong if the chosen position is more than 4.5 standard deviations of the radar's own error from the reflector,
or if none is chosen. The reflector has 12 dBsm. Placements whose echo merges with an object's in one radar cell are not
drawn, because no radar reports them separately. "Wrong and used" are those not recognised as outliers; "right and set
aside" those wrongly marked as outliers."""


def _percent(counts: np.ndarray) -> Measured:
    """Return counts of 20 per trial in percent. Placements of one trial are not independent; 0 wrong has an error too."""
    shares = 100.0 * counts / PLACEMENTS
    flags = np.repeat([1.0, 0.0], [int(counts.sum()), int(len(counts) * PLACEMENTS - counts.sum())])
    between = float(2.0 * shares.std(ddof=1) / np.sqrt(len(shares))) if len(shares) > 1 else 100.0
    return Measured(float(shares.mean()), max(between, share(flags).error))
