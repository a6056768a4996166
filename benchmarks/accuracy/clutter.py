"""Objects other than the reflector in the radar's view: which placements get a wrong position?"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.figures import MET, MISSED, Measured, at_least, at_most, column, fewest, share, summed_up
from benchmarks.accuracy.rows import Figures, Kept, Part, Row, Section
from calib_core.calibration import calibrate
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions
from calib_core.paper.algorithm_1 import pair_as_printed, static_returns_as_printed
from calib_core.radar import direction_cosines
from calib_core.results import Calibration
from calib_core.synthetic import AISLE, FIELD, RADAR_PROFILES, PairsLayout, RadarProfile, Rig, random_rig
from calib_core.synthetic.options import RadarName
from calib_core.synthetic.pairs import draw_positions, study_camera
from calib_core.synthetic.returns import Targets, measure

__all__ = ["ROWS", "SCENES", "Scene", "measure_clutter", "section"]

_TRIALS = 150
_PLACEMENTS = 20
_SCANS, _PERIOD_S = 30, 0.1
_BETWEEN_S = 20.0
_REFLECTOR_DBSM = 12.0
_OBJECTS_M = 10.0  # near enough that even the weakest is detected
_FAR = 4.5  # standard deviations of a placement's own error
_MASKED_BINS, _MASKED_COSINE = 2.5, 1.2
_AIM, _PAPER = 0.5, 96.0  # percent


@dataclass(frozen=True, slots=True)
class Scene:
    """What the radar sees in addition to the reflector.

    Attributes:
        name: for the table.
        layout: where placements and objects are.
        objects: how many static objects.
        rcs_dbsm: their least and largest radar cross-section; the reflector has 12 dBsm.
        person: somebody stands next to the reflector and moves a little.
        strays: false static returns per scan.
        radar: the simulated radar.
    """

    name: str
    layout: PairsLayout = FIELD
    objects: int = 0
    rcs_dbsm: tuple[float, float] = (0.0, 0.0)
    person: bool = False
    strays: float = 0.0
    radar: RadarName = "awr1843"


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
    profile = RADAR_PROFILES[scene.radar]
    rig = random_rig(rng, camera=study_camera())
    things = _things(rng, scene, rig)
    places = _visible_places(rng, scene, rig, things, profile)
    scans = _scans(rng, scene, things, places, profile)
    pixels = rig.camera.project(rig.camera_from_radar @ places) + 2.0 * rng.standard_normal((_PLACEMENTS, 2))
    clicks = [
        ReflectorClick(_middle(i), f"c{i:02d}", float(pixels[i, 0]), float(pixels[i, 1])) for i in range(_PLACEMENTS)
    ]
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


def _things(rng: np.random.Generator, scene: Scene, rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Draw static objects: positions (k, 3) in the radar frame and cross-sections (k,)."""
    layout = replace(scene.layout, max_range_m=_OBJECTS_M, max_height_m=1.6, separation_m=0.4)
    if not scene.objects:
        return np.zeros((0, 3)), np.zeros(0)
    return draw_positions(rng, count=scene.objects, rig=rig, layout=layout), rng.uniform(*scene.rcs_dbsm, scene.objects)


def _visible_places(
    rng: np.random.Generator, scene: Scene, rig: Rig, things: tuple[np.ndarray, np.ndarray], profile: RadarProfile
) -> np.ndarray:
    """Draw placements whose echo is a separate return: one that merges with an object's in a radar cell cannot be found."""
    kept: list[np.ndarray] = []
    objects = direction_cosines(things[0]) if len(things[0]) else np.zeros((0, 3))
    while len(kept) < _PLACEMENTS:
        place = draw_positions(rng, count=1, rig=rig, layout=scene.layout)
        own = direction_cosines(place)[0]
        masked = (np.abs(objects[:, 0] - own[0]) < _MASKED_BINS * profile.range_bin_m) & (
            np.abs(objects[:, 1] - own[1]) < _MASKED_COSINE * profile.resolution_azimuth
        )
        apart = all(np.linalg.norm(place[0] - other) > scene.layout.separation_m for other in kept)
        if apart and not masked.any():
            kept.append(place[0])
    return np.array(kept)


def _middle(placement: int) -> TimeNs:
    return TimeNs(round((_BETWEEN_S * placement + 0.5 * _SCANS * _PERIOD_S) * NS_PER_S))


def _scans(
    rng: np.random.Generator,
    scene: Scene,
    things: tuple[np.ndarray, np.ndarray],
    places: np.ndarray,
    profile: RadarProfile,
) -> RadarScans:
    """Measure the three seconds around every click."""
    lasting = np.array([0.0, profile.azimuth_bias_sigma, profile.elevation_bias_sigma])
    thing_bias = lasting * rng.standard_normal(things[0].shape)
    phase = float(rng.uniform(0.0, 2.0 * np.pi))
    scans: list[RadarScan] = []
    for i, place in enumerate(places):
        own_bias = lasting * rng.standard_normal((1, 3))
        person_m = place + np.array([*rng.uniform(-1.2, 1.2, 2), 1.0])
        for k in range(_SCANS):
            bodies, body_rcs, body_speeds = _passing(rng, scene, person_m)
            speeds = np.concatenate([np.zeros(1 + len(things[1])), body_speeds])
            targets = Targets(
                points_radar_m=np.concatenate([place[None], things[0], bodies]),
                velocity_mps=speeds,
                rcs_dbsm=np.concatenate([[_REFLECTOR_DBSM], things[1], body_rcs]),
                fading_db=np.concatenate([[1.0], np.full(len(speeds) - 1, 3.0)]),
                bias=np.concatenate([own_bias, thing_bias, np.zeros((len(bodies), 3))]),
                hidden=np.zeros(len(speeds), dtype=np.bool_),
            )
            time = TimeNs(round((_BETWEEN_S * i + _PERIOD_S * k) * NS_PER_S))
            scans.append(measure(rng, targets, profile=profile, time=time, calibration_phase=phase))
    return RadarScans.from_scans(scans)


def _passing(rng: np.random.Generator, scene: Scene, person_m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw what changes from scan to scan: positions (k, 3), cross-sections (k,), speeds (k,) of limbs and strays."""
    limbs = 3 if scene.person else 0
    strays = int(rng.poisson(scene.strays))
    body = person_m + np.array([0.1, 0.2, 0.4]) * rng.standard_normal((limbs, 3))
    nothing = np.stack(
        [rng.uniform(2.0, 20.0, strays), rng.uniform(-6.0, 6.0, strays), rng.uniform(-1.2, 1.0, strays)], axis=1
    ).reshape(-1, 3)
    return (
        np.concatenate([body, nothing]),
        np.concatenate([rng.uniform(-6.0, 0.0, limbs), rng.uniform(0.0, 12.0, strays)]),
        np.concatenate([0.15 * rng.standard_normal(limbs), np.zeros(strays)]),
    )


def _wrong(positions: list[np.ndarray | None], places: np.ndarray, profile: RadarProfile) -> np.ndarray:
    """Flag positions that are missing, or farther off than the radar's own error for a placement explains."""
    quantised = np.array([profile.range_bin_m, 2.0 / profile.angle_bins if profile.angle_bins else 0.0, 0.0]) / np.sqrt(
        12.0
    )
    lasting = np.array([0.0, profile.azimuth_bias_sigma, profile.elevation_bias_sigma])
    smooth = np.array([0.0, profile.calibration_azimuth, profile.calibration_elevation]) / np.sqrt(2.0)
    single = np.array([profile.range_sigma_m, profile.azimuth_sigma, profile.elevation_sigma]) / np.sqrt(_SCANS)
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
                str(len(trials) * _PLACEMENTS),
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
    shares = 100.0 * counts / _PLACEMENTS
    flags = np.repeat([1.0, 0.0], [int(counts.sum()), int(len(counts) * _PLACEMENTS - counts.sum())])
    between = float(2.0 * shares.std(ddof=1) / np.sqrt(len(shares))) if len(shares) > 1 else 100.0
    return Measured(float(shares.mean()), max(between, share(flags).error))
