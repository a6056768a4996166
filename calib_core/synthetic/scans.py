"""What the radar measures: every object in front of it at each moment, as the echoes of a scan."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from calib_core.arrays import Points3, Vector3
from calib_core.geometry import rotation_exp
from calib_core.measurements import NS_PER_S, RadarScan, TimeNs
from calib_core.synthetic.radar_returns import Antenna, Targets, measure, second_azimuths
from calib_core.synthetic.scene.person import PersonState, body_hides, capsules
from calib_core.synthetic.scene.scenes import USUAL_EDGE_M
from calib_core.synthetic.scene.stage import Stage, child_rng
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
_FADING_M = 0.9
"""How often over range the wrong one of two azimuths is taken for the better one."""
_COMPANION_DBSM = 18.0


def labelled_scans(stage: Stage, antenna: Antenna) -> Iterator[tuple[RadarScan, tuple[str, ...]]]:
    """Yield the scans of one antenna, each with the track that each of its returns comes from; "" for anything else."""
    number = 20 * stage.antennas.index(antenna)
    rng = child_rng(stage.options, 9 + number)
    phase = float(child_rng(stage.options, 10 + number).uniform(0.0, 2.0 * np.pi))
    for moment_s, stamp in zip(antenna.times.moment_s, antenna.times.header_ns, strict=True):
        targets = targets_at(stage, float(moment_s)).within(antenna.min_range_m, antenna.max_range_m)
        measured = measure(
            rng,
            targets,
            profile=antenna.profile,
            time=TimeNs(int(stamp)),
            calibration_phase=phase,
            defects=stage.options.defects,
        )
        certain = stage.options.defects.second_azimuth == "none"
        tracks = tuple(targets.tracks[i] if i >= 0 else "" for i in measured.target.tolist())
        yield measured.scan if certain else with_wrong_azimuths(stage, measured.scan), tracks


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
    """Give the returns at some ranges the second azimuth as their first one: a pattern of reflections, not chance."""
    points, share = scan.points_radar_m, stage.options.defects.second_azimuth_share
    phase = float(child_rng(stage.options, 12).uniform())
    wrong = (np.linalg.norm(points, axis=1) / _FADING_M + phase) % 1.0 < share
    taken = np.where(wrong[:, None], second_azimuths(points), points)
    return replace(scan, points_radar_m=taken.astype(np.float32).astype(np.float64))


_Place: TypeAlias = Vector3 | tuple[float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class _Echo:
    """Positions of objects just before and just after a moment, and their echo."""

    before_m: Points3
    after_m: Points3
    rcs_dbsm: Sequence[float]
    fading_db: float
    bias: Points3
    track: str = ""


def _still(places_m: Sequence[_Place], rcs_dbsm: Sequence[float], fading_db: float, bias: Points3) -> _Echo:
    """Return the echo of objects that stand still."""
    places = np.array(places_m, dtype=np.float64).reshape(-1, 3)
    return _Echo(places, places, rcs_dbsm, fading_db, bias)


def targets_at(stage: Stage, time_s: float) -> Targets:
    """List the objects in front of the radar at a time: clutter, reflectors and their ghosts, people's limbs."""
    story, moments_s = stage.story, (time_s - _STEP_S, time_s, time_s + _STEP_S)
    before, now, after = (story.at(moment_s) for moment_s in moments_s)
    flickers = [flicker.scatterer for flicker in stage.flickers if flicker.shows(time_s)]
    echoes = [
        _still([thing.position_m for thing in things], [thing.rcs_dbsm for thing in things], 2.0, bias)
        for things, bias in ((stage.clutter, stage.clutter_bias), (flickers, np.zeros((len(flickers), 3))))
    ]
    echoes += _reflector_echoes(stage, before, now, after)
    people = [story.people_at(moment_s, person=stage.options.person) for moment_s in moments_s]
    count = len(people[0]) if len(people[0]) == len(people[2]) else int(stage.options.person)
    echoes += [_actor_echo(stage, *actors) for actors in zip(people[0][:count], people[2][:count], strict=True)]
    traffic = [_actor_echo(stage, *actors) for actors in zip(before.traffic, after.traffic, strict=True)]
    echoes += _with_passing_errors(stage, traffic, time_s)
    from_world = stage.rig.radar_from_world
    start = from_world @ np.concatenate([echo.before_m for echo in echoes])
    end = from_world @ np.concatenate([echo.after_m for echo in echoes])
    speed = (np.linalg.norm(end, axis=1) - np.linalg.norm(start, axis=1)) / (2.0 * _STEP_S)
    world = np.concatenate([0.5 * (echo.before_m + echo.after_m) for echo in echoes])
    hidden = np.zeros(len(world), dtype=np.bool_)
    eye_m = from_world.inverse().translation_m
    for actor in (*people[1], *now.traffic):
        state = actor.state
        if isinstance(state, VehicleState):
            hidden |= hidden_by(state, eye_m, world)
        else:
            hidden |= body_hides(state, np.zeros(3), world, half_width_m=_SHOULDER_M, clearance_m=0.45)
    return Targets(
        0.5 * (start + end),
        speed,
        np.concatenate([np.asarray(echo.rcs_dbsm, dtype=np.float64) for echo in echoes]),
        np.concatenate([np.full(len(echo.rcs_dbsm), echo.fading_db) for echo in echoes]),
        np.concatenate([echo.bias for echo in echoes]),
        hidden,
        tuple(echo.track for echo in echoes for _ in echo.rcs_dbsm),
    )


def _reflector_echoes(stage: Stage, before: Moment, now: Moment, after: Moment) -> list[_Echo]:
    larger_db = 40.0 * float(np.log10(stage.options.reflector_edge_m / USUAL_EDGE_M))
    standing = (now.resting, *now.standing) if now.resting is not None else now.standing
    echoes = [echo for resting in standing for echo in _standing_echoes(stage, resting, _REFLECTOR_DBSM + larger_db)]
    if now.resting is None and stage.options.person:
        start_m, end_m = before.reflector_m, after.reflector_m
        moved = [(start_m, end_m, _CARRIED_DBSM + larger_db)]
        if stage.options.surroundings.companion:
            moved.append((cart_position(start_m), cart_position(end_m), _COMPANION_DBSM))
        echoes += [_Echo(one[None], other[None], (level,), 5.0, np.zeros((1, 3))) for one, other, level in moved]
    return echoes


def _standing_echoes(stage: Stage, resting: Resting, rcs_dbsm: float) -> list[_Echo]:
    """List a reflector at rest, its ghost, and the cart behind it."""
    bias, ghost = stage.reflector_bias[resting.index][None], stage.ghosts[resting.index]
    echoes = [_still([resting.position_m], [rcs_dbsm], 1.0, bias)]
    if ghost is not None:
        echoes.append(_still([ghost.position_m], [ghost.rcs_dbsm], 4.0, bias))
    if stage.options.surroundings.companion:
        echoes.append(_still([cart_position(resting.position_m)], [_COMPANION_DBSM], 1.5, bias))
    return echoes


def _with_passing_errors(stage: Stage, echoes: list[_Echo], time_s: float) -> list[_Echo]:
    """Give moving objects the error that stays the same where an object stands still: it is another one in every scan."""
    rng = np.random.default_rng([stage.options.seed, 21, round(time_s * 1e6)])
    profile = stage.profile
    sigma = np.array([0.004, profile.azimuth_bias_sigma, profile.elevation_bias_sigma])
    return [replace(echo, bias=sigma * rng.standard_normal((len(echo.rcs_dbsm), 3))) for echo in echoes]


def _actor_echo(stage: Stage, before: Actor, after: Actor) -> _Echo:
    """Return the echo of a vehicle's places that face the radar, or of a person's limbs."""
    if isinstance(before.state, VehicleState) and isinstance(after.state, VehicleState):
        radar_m = stage.rig.radar_from_world.inverse().translation_m[:2]
        facing, start, levels = echo_places(before.state, radar_m)
        start, end, rcs_dbsm = start[facing], echo_places(after.state, radar_m)[1][facing], levels[facing].tolist()
    else:
        assert isinstance(before.state, PersonState), "what is not a vehicle is a person"
        assert isinstance(after.state, PersonState), "and stays one"
        limbs = [[limb for limb in capsules(state) if limb.rcs_dbsm > -40.0] for state in (before.state, after.state)]
        start, end = (np.array([0.5 * (limb.start_m + limb.end_m) for limb in side]) for side in limbs)
        rcs_dbsm = [limb.rcs_dbsm for limb in limbs[0]]
    return _Echo(start, end, rcs_dbsm, 5.0, np.zeros((len(start), 3)), before.track)
