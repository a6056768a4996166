"""A simulated session without pictures: radar scans, truth and example clicks."""

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Points2, Points3
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.synthetic.clicking import SimulatedClick, clicks_of
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.radar_returns import Antenna, Targets, measure, second_azimuths, second_is_true
from calib_core.synthetic.scene.person import PersonState, capsules
from calib_core.synthetic.scene.scenes import USUAL_EDGE_M
from calib_core.synthetic.scene.stage import SimulatedPlacement, Stage, child_rng, placements_of, set_stage
from calib_core.synthetic.scene.story import Moment, Resting
from calib_core.synthetic.scene.surroundings import cart_position
from calib_core.synthetic.scene.traffic import Actor, VehicleState, echo_places, hidden_by

_REFLECTOR_DBSM = 12.0
"""Of a reflector of the usual size."""
_CARRIED_DBSM = 0.0
_SHOULDER_M = 0.24
_STEP_S = 0.01
_SIDE_RAD = np.deg2rad(60.0)
_SIDE_WEAKER_DB = 10.0
_SIDE_LATER_S = 0.013


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedScans:
    """Scans and example clicks with their truth.

    Attributes:
        stage: everything decided before the sensors measure.
        scans: the radar's scans of all antennas, by header stamps.
        clicked: the example clicks with their truth; by default one per placement at its best frame, with click noise.
        placements: the truth, in order of time.
    """

    stage: Stage
    scans: RadarScans
    clicked: tuple[SimulatedClick, ...]
    placements: tuple[SimulatedPlacement, ...]

    @property
    def clicks(self) -> tuple[ReflectorClick, ...]:
        """The example clicks; ids "c1", "c2", ..."""
        return tuple(one.click for one in self.clicked)

    @property
    def camera(self) -> Camera:
        """The intrinsics."""
        return self.stage.rig.camera

    @property
    def published_camera(self) -> Camera:
        """The intrinsics that an estimator is given; wrong if the options say so."""
        return self.stage.published_camera

    @property
    def camera_from_radar(self) -> RigidTransform:
        """The true pose."""
        return self.stage.rig.camera_from_radar

    @property
    def other_camera(self) -> "SimulatedScans | None":
        """The same scans with the clicks in the pictures of the second camera; None if there is none."""
        stage = self.stage.of_other_camera
        if stage is None:
            return None
        placements = placements_of(stage)
        return SimulatedScans(stage, self.scans, clicks_of(stage, placements), placements)

    @property
    def points_radar_m(self) -> Points3:
        """The true position of each placement: (n, 3)."""
        return np.array([placement.position_radar_m for placement in self.placements]).reshape(-1, 3)

    @property
    def pixels_px(self) -> Points2:
        """The true pixel of each placement: (n, 2)."""
        return np.array([placement.pixel_px for placement in self.placements]).reshape(-1, 2)


def simulate_scans(options: SimulationOptions | None = None) -> SimulatedScans:
    """Simulate a session without rendering pictures: tenths of a second instead of a minute.

    Args:
        options: what to simulate; None takes the defaults.
    """
    stage = set_stage(options or SimulationOptions())
    placements = placements_of(stage)
    return SimulatedScans(
        stage, RadarScans.from_scans(list(radar_scans(stage))), clicks_of(stage, placements), placements
    )


def radar_scans(stage: Stage) -> Iterator[RadarScan]:
    """Yield the radar's scans of all antennas, by header stamps."""
    streams = [antenna_scans(stage, antenna) for antenna in stage.antennas]
    return heapq.merge(*streams, key=lambda scan: scan.time)


def antenna_scans(stage: Stage, antenna: Antenna) -> Iterator[RadarScan]:
    """Yield the scans of one antenna."""
    return (scan for scan, _ in labelled_scans(stage, antenna))


def labelled_scans(stage: Stage, antenna: Antenna) -> Iterator[tuple[RadarScan, tuple[str, ...]]]:
    """Yield the scans of one antenna, each with the track that each of its returns comes from; "" for anything else."""
    number = 20 * stage.antennas.index(antenna)
    rng = child_rng(stage.options, 9 + number)
    phase = float(child_rng(stage.options, 10 + number).uniform(0.0, 2.0 * np.pi))
    for moment_s, stamp in zip(antenna.times.moment_s, antenna.times.header_ns, strict=True):
        targets = targets_at(stage, float(moment_s))
        if antenna.name:
            targets = targets.within(antenna.min_range_m, antenna.max_range_m)
        found = measure(
            rng,
            targets,
            profile=antenna.profile,
            time=TimeNs(int(stamp)),
            angle_bins=stage.options.angle_bins,
            calibration_phase=phase,
            defects=stage.options.defects,
        )
        defects = stage.options.defects
        certain = defects.second_azimuth == "none" or defects.ideal_topic
        tracks = tuple(targets.tracks[i] if i >= 0 else "" for i in found.target.tolist())
        yield found.scan if certain else with_wrong_azimuths(stage, found.scan), tracks


def side_scans(stage: Stage) -> Iterator[RadarScan]:
    """Yield the scans of a weaker radar next to the first one that looks to the left, by its own header stamps."""
    rng, profile = child_rng(stage.options, 19), stage.antennas[0].profile
    weaker = replace(profile, threshold_db=profile.threshold_db + _SIDE_WEAKER_DB)
    turn = rotation_exp(np.array([0.0, 0.0, -_SIDE_RAD]))
    times = stage.antennas[0].times
    for moment_s, stamp in zip(times.moment_s, times.header_ns, strict=True):
        targets = targets_at(stage, float(moment_s) + _SIDE_LATER_S)
        turned = replace(targets, points_radar_m=targets.points_radar_m @ turn.T)
        yield measure(rng, turned, profile=weaker, time=TimeNs(int(stamp) + round(_SIDE_LATER_S * NS_PER_S))).scan


def with_wrong_azimuths(stage: Stage, scan: RadarScan) -> RadarScan:
    """Give the returns at some ranges the second azimuth as their first one."""
    points, share = scan.points_radar_m, stage.options.defects.second_azimuth_share
    phase = float(child_rng(stage.options, 12).uniform())
    wrong = second_is_true(np.linalg.norm(points, axis=1), phase, share)
    taken = np.where(wrong[:, None], second_azimuths(points), points)
    return replace(scan, points_radar_m=taken.astype(np.float32).astype(np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class _Echo:
    """Positions of objects just before and just after a moment, and their echo."""

    before_m: Points3
    after_m: Points3
    rcs_dbsm: tuple[float, ...]
    fading_db: float
    bias: Points3
    track: str = ""


def targets_at(stage: Stage, time_s: float) -> Targets:
    """List the objects in front of the radar at a time: clutter, reflectors and their ghosts, people's limbs."""
    story, moments_s = stage.story, (time_s - _STEP_S, time_s, time_s + _STEP_S)
    before, now, after = (story.at(moment_s) for moment_s in moments_s)
    echoes = [_clutter_echo(stage), *_flicker_echoes(stage, time_s), *_reflector_echoes(stage, before, now, after)]
    people = [story.people_at(moment_s, person=stage.options.person) for moment_s in moments_s]
    count = len(people[0]) if len(people[0]) == len(people[2]) else int(stage.options.person)
    echoes += [_actor_echo(stage, *actors) for actors in zip(people[0][:count], people[2][:count], strict=True)]
    traffic = [_actor_echo(stage, *actors) for actors in zip(before.traffic, after.traffic, strict=True)]
    echoes += _with_passing_errors(stage, traffic, time_s)
    from_world = stage.rig.radar_from_world
    start = from_world @ np.concatenate([echo.before_m for echo in echoes])
    end = from_world @ np.concatenate([echo.after_m for echo in echoes])
    middle = 0.5 * (start + end)
    speed = (np.linalg.norm(end, axis=1) - np.linalg.norm(start, axis=1)) / (2.0 * _STEP_S)
    world = np.concatenate([0.5 * (echo.before_m + echo.after_m) for echo in echoes])
    hidden = np.zeros(len(world), dtype=np.bool_)
    eye_m = stage.rig.radar_from_world.inverse().translation_m
    for actor in (*people[1], *now.traffic):
        state = actor.state
        hidden |= hidden_by(state, eye_m, world) if isinstance(state, VehicleState) else _behind(state, world)
    return Targets(
        middle,
        speed,
        np.concatenate([np.asarray(echo.rcs_dbsm, dtype=np.float64) for echo in echoes]),
        np.concatenate([np.full(len(echo.rcs_dbsm), echo.fading_db) for echo in echoes]),
        np.concatenate([echo.bias for echo in echoes]),
        hidden,
        tuple(echo.track for echo in echoes for _ in echo.rcs_dbsm),
    )


def _clutter_echo(stage: Stage) -> _Echo:
    places = np.array([thing.position_m for thing in stage.clutter]).reshape(-1, 3)
    return _Echo(places, places, tuple(thing.rcs_dbsm for thing in stage.clutter), 2.0, stage.clutter_bias)


def _flicker_echoes(stage: Stage, time_s: float) -> list[_Echo]:
    shown = [one.scatterer for one in stage.flickers if one.shows(time_s)]
    if not shown:
        return []
    places = np.array([one.position_m for one in shown])
    return [_Echo(places, places, tuple(one.rcs_dbsm for one in shown), 2.0, np.zeros((len(shown), 3)))]


def _reflector_echoes(stage: Stage, before: Moment, now: Moment, after: Moment) -> list[_Echo]:
    standing = (now.resting, *now.standing) if now.resting is not None else now.standing
    echoes = [echo for resting in standing for echo in _standing_echoes(stage, resting)]
    if now.resting is None and stage.options.person:
        still = np.zeros((1, 3))
        echoes.append(
            _Echo(before.reflector_m[None], after.reflector_m[None], (_CARRIED_DBSM + _larger_db(stage),), 5.0, still)
        )
        if stage.options.surroundings.companion:
            carts = [cart_position(moment.reflector_m, stage.options.surroundings)[None] for moment in (before, after)]
            echoes.append(_Echo(carts[0], carts[1], (stage.options.surroundings.companion_dbsm,), 5.0, still))
    return echoes


def _larger_db(stage: Stage) -> float:
    """Return how much stronger the reflector's echo is than that of one of the usual size."""
    return 40.0 * float(np.log10(stage.options.reflector_edge_m / USUAL_EDGE_M))


def _standing_echoes(stage: Stage, resting: Resting) -> list[_Echo]:
    """List a reflector at rest, its ghost, and the cart behind it."""
    place = resting.position_m[None]
    bias = stage.reflector_bias[resting.index][None]
    echoes = [_Echo(place, place, (_REFLECTOR_DBSM + _larger_db(stage),), 1.0, bias)]
    ghost = stage.ghosts[resting.index]
    if ghost is not None:
        mirrored = np.array([ghost.position_m])
        echoes.append(_Echo(mirrored, mirrored, (ghost.rcs_dbsm,), 4.0, bias))
    if stage.options.surroundings.companion:
        cart = cart_position(resting.position_m, stage.options.surroundings)[None]
        echoes.append(_Echo(cart, cart, (stage.options.surroundings.companion_dbsm,), 1.5, bias))
    return echoes


def _actor_echo(stage: Stage, before: Actor, after: Actor) -> _Echo:
    if isinstance(before.state, VehicleState) and isinstance(after.state, VehicleState):
        return _vehicle_echo(stage, before.state, after.state, before.track)
    assert isinstance(before.state, PersonState), "what is not a vehicle is a person"
    assert isinstance(after.state, PersonState), "and stays one"
    return replace(_person_echo(before.state, after.state), track=before.track)


def _with_passing_errors(stage: Stage, echoes: list[_Echo], time_s: float) -> list[_Echo]:
    """Give moving objects the error that stays the same where an object stands still: it is another one in every scan."""
    rng = np.random.default_rng([stage.options.seed, 21, round(time_s * 1e6)])
    profile = stage.profile
    sigma = np.array([0.004, profile.azimuth_bias_sigma, profile.elevation_bias_sigma])
    return [replace(echo, bias=sigma * rng.standard_normal((len(echo.rcs_dbsm), 3))) for echo in echoes]


def _vehicle_echo(stage: Stage, before: VehicleState, after: VehicleState, track: str) -> _Echo:
    radar_m = stage.rig.radar_from_world.inverse().translation_m[:2]
    facing, start, rcs_dbsm = echo_places(before, radar_m)
    _, end, _ = echo_places(after, radar_m)
    strengths = tuple(rcs_dbsm[facing].tolist())
    return _Echo(start[facing], end[facing], strengths, 5.0, np.zeros((len(strengths), 3)), track)


def _person_echo(before: PersonState, after: PersonState) -> _Echo:
    pairs = [pair for pair in zip(capsules(before), capsules(after), strict=True) if pair[0].rcs_dbsm > -40.0]
    start = np.array([0.5 * (limb.start_m + limb.end_m) for limb, _ in pairs])
    end = np.array([0.5 * (limb.start_m + limb.end_m) for _, limb in pairs])
    return _Echo(start, end, tuple(limb.rcs_dbsm for limb, _ in pairs), 5.0, np.zeros((len(pairs), 3)))


def _behind(person: PersonState, world_m: Points3) -> Flags:
    """Return which points the person's body hides from a radar above the origin."""
    far = np.linalg.norm(world_m[:, :2], axis=1)
    along = world_m[:, :2] / np.maximum(far, 1e-9)[:, None]
    depth = along @ person.place_m
    sideways = np.abs(along[:, 0] * person.y_m - along[:, 1] * person.x_m)
    return (sideways < _SHOULDER_M) & (depth > 0.0) & (depth < far - 0.45)
