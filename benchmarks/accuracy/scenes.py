"""The radar scans and clicks of a session with other objects in view, without a recording."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.simulated_pairs import FIELD, draw_positions, study_camera
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.radar import direction_cosines
from calib_core.synthetic.options import RadarName
from calib_core.synthetic.radar_returns import RADAR_PROFILES, RadarProfile, Targets, measure
from calib_core.synthetic.rig import Rig, random_rig
from calib_core.synthetic.scene.scenes import PairsLayout

PLACEMENTS = 20
SCANS, _PERIOD_S = 30, 0.1
_BETWEEN_S = 20.0
_REFLECTOR_DBSM = 12.0
_OBJECTS_M = 10.0  # near enough that even the weakest is detected
_MASKED_BINS, _MASKED_COSINE = 2.5, 1.2
_BEHIND_M = 1.0


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
        scatter: (range [m], azimuth, elevation as sines) standard deviations of one return; None takes the radar's.
        companion_dbsm: cross-section of an object 1 m behind the reflector, at every placement; None has none.
    """

    name: str
    layout: PairsLayout = FIELD
    objects: int = 0
    rcs_dbsm: tuple[float, float] = (0.0, 0.0)
    person: bool = False
    strays: float = 0.0
    radar: RadarName = "awr1843"
    scatter: tuple[float, float, float] | None = None
    companion_dbsm: float | None = None

    @property
    def profile(self) -> RadarProfile:
        """The simulated radar."""
        profile = RADAR_PROFILES[self.radar]
        if self.scatter is None:
            return profile
        range_m, azimuth, elevation = self.scatter
        return replace(profile, range_sigma_m=range_m, azimuth_sigma=azimuth, elevation_sigma=elevation)


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """The windows around the clicks of one session.

    Attributes:
        rig: the sensors with the true pose.
        places: (20, 3) true reflector positions in the radar frame.
        clicks: one per placement, in the middle of its window.
        scans: three seconds around every click.
    """

    rig: Rig
    places: np.ndarray
    clicks: tuple[ReflectorClick, ...]
    scans: RadarScans


def draw_windows(scene: Scene, rng: np.random.Generator) -> Windows:
    """Simulate what the radar measures around the clicks of one session."""
    profile = scene.profile
    rig = random_rig(rng, camera=study_camera())
    things = _things(rng, scene, rig)
    places = _visible_places(rng, scene, rig, things, profile)
    scans = _scans(rng, scene, things, places, profile)
    pixels = rig.camera.project(rig.camera_from_radar @ places) + 2.0 * rng.standard_normal((PLACEMENTS, 2))
    clicks = tuple(
        ReflectorClick(_middle(i), f"c{i:02d}", float(pixels[i, 0]), float(pixels[i, 1])) for i in range(PLACEMENTS)
    )
    return Windows(rig, places, clicks, scans)


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
    while len(kept) < PLACEMENTS:
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
    return TimeNs(round((_BETWEEN_S * placement + 0.5 * SCANS * _PERIOD_S) * NS_PER_S))


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
        for k in range(SCANS):
            bodies, body_rcs, body_speeds = _passing(rng, scene, person_m)
            if scene.companion_dbsm is not None:
                behind_m = place * (1.0 + _BEHIND_M / np.linalg.norm(place))
                bodies, body_speeds = np.concatenate([bodies, behind_m[None]]), np.append(body_speeds, 0.0)
                body_rcs = np.append(body_rcs, scene.companion_dbsm)
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
            scans.append(measure(rng, targets, profile=profile, time=time, calibration_phase=phase).scan)
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
