"""A simulated session without pictures: radar scans, truth and example clicks."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Flags, Points2, Points3, Vector2, Vector3, frozen_array
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.person import PersonState, capsules
from calib_core.synthetic.returns import Targets, measure
from calib_core.synthetic.stage import Stage, child_rng, set_stage
from calib_core.synthetic.story import Moment, Resting

__all__ = [
    "SimulatedPlacement",
    "SimulatedScans",
    "clicks_of",
    "placements_of",
    "radar_scans",
    "simulate_scans",
    "targets_at",
]

_REFLECTOR_DBSM = 12.0
_CARRIED_DBSM = 0.0
_SHOULDER_M = 0.24
_STEP_S = 0.01
_CLEARANCE_M = 0.16
"""How far a limb must be from the line of sight for all of the reflector to be visible."""


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedPlacement:
    """The truth about one placement.

    Attributes:
        id: "placement-01" and so on.
        start: when the reflector is released, on the camera's clock.
        end: when it is picked up again.
        position_radar_m: (3,) its apex, which is its phase centre.
        pixel_px: (2,) where the camera sees that apex.
        best_image_time: stamp of the frame nearest to the middle of the dwell with nobody in front.
    """

    id: str
    start: TimeNs
    end: TimeNs
    position_radar_m: Vector3
    pixel_px: Vector2
    best_image_time: TimeNs

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_radar_m", frozen_array(self.position_radar_m, (3,)))
        object.__setattr__(self, "pixel_px", frozen_array(self.pixel_px, (2,)))


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedScans:
    """Scans and example clicks with their truth.

    Attributes:
        stage: everything decided before the sensors measure.
        scans: the radar's scans, by header stamps.
        clicks: one per placement at its best frame, with click noise; ids "c1", "c2", ...
        placements: the truth, in order of time.
    """

    stage: Stage
    scans: RadarScans
    clicks: tuple[ReflectorClick, ...]
    placements: tuple[SimulatedPlacement, ...]

    @property
    def camera(self) -> Camera:
        """The intrinsics."""
        return self.stage.rig.camera

    @property
    def camera_from_radar(self) -> RigidTransform:
        """The true pose."""
        return self.stage.rig.camera_from_radar

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


def clicks_of(stage: Stage, placements: tuple[SimulatedPlacement, ...]) -> tuple[ReflectorClick, ...]:
    """Click each placement once, with click noise."""
    noise = stage.options.click_sigma_px * child_rng(stage.options, 8).standard_normal((len(placements), 2))
    pixels = [placement.pixel_px + error for placement, error in zip(placements, noise, strict=True)]
    return tuple(
        ReflectorClick(placement.best_image_time, f"c{i + 1}", round(float(pixel[0]), 2), round(float(pixel[1]), 2))
        for i, (placement, pixel) in enumerate(zip(placements, pixels, strict=True))
    )


def placements_of(stage: Stage) -> tuple[SimulatedPlacement, ...]:
    """Return the truth about every placement."""
    start_ns = stage.options.start_s * NS_PER_S
    found = []
    for resting in stage.story.restings:
        point = (stage.rig.radar_from_world @ resting.position_m[None])[0]
        pixel = stage.rig.camera.project(stage.rig.camera_from_radar @ point[None])[0]
        found.append(
            SimulatedPlacement(
                f"placement-{resting.index + 1:02d}",
                TimeNs(start_ns + round(resting.start_s * NS_PER_S)),
                TimeNs(start_ns + round(resting.end_s * NS_PER_S)),
                point,
                pixel,
                _best_frame(stage, resting),
            )
        )
    return tuple(found)


def _best_frame(stage: Stage, resting: Resting) -> TimeNs:
    """Find the frame nearest to the middle of a placement in which the whole reflector is visible.

    Raises:
        ValueError: no frame shows it; the frame rate is too low for the dwell.
    """
    moments = stage.frame_times.moment_s
    inside = np.flatnonzero((moments > resting.start_s) & (moments < resting.end_s))
    middle_s = 0.5 * (resting.start_s + resting.end_s)
    for i in inside[np.argsort(np.abs(moments[inside] - middle_s), kind="stable")].tolist():
        person = stage.story.at(float(moments[i])).person
        if not stage.options.person or _shows(stage, person, resting.position_m):
            return TimeNs(int(stage.frame_times.header_ns[i]))
    raise ValueError(f"no frame shows placement {resting.index + 1}: raise the frame rate or the dwell time")


def _shows(stage: Stage, person: PersonState, position_m: Vector3) -> bool:
    """Return whether no limb is near the line of sight from the camera to the reflector."""
    eye = stage.rig.camera_position_world_m
    sight = np.linspace(0.02, 0.98, 60)[:, None] * (position_m - eye) + eye
    for limb in capsules(person):
        steps = np.linspace(0.0, 1.0, 4)[:, None] * (limb.end_m - limb.start_m) + limb.start_m
        gap = np.linalg.norm(sight[:, None] - steps[None], axis=2).min()
        if gap < max(limb.start_radius_m, limb.end_radius_m) + _CLEARANCE_M:
            return False
    return True


def radar_scans(stage: Stage) -> Iterator[RadarScan]:
    """Yield the radar's scans."""
    rng = child_rng(stage.options, 9)
    phase = float(child_rng(stage.options, 10).uniform(0.0, 2.0 * np.pi))
    for moment_s, stamp in zip(stage.scan_times.moment_s, stage.scan_times.header_ns, strict=True):
        yield measure(
            rng,
            targets_at(stage, float(moment_s)),
            profile=stage.profile,
            time=TimeNs(int(stamp)),
            angle_bins=stage.options.angle_bins,
            calibration_phase=phase,
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Echo:
    """Positions of objects just before and just after a moment, and their echo."""

    before_m: Points3
    after_m: Points3
    rcs_dbsm: tuple[float, ...]
    fading_db: float
    bias: Points3


def targets_at(stage: Stage, time_s: float) -> Targets:
    """List the objects in front of the radar at a time: clutter, reflector and its ghost, the person's limbs."""
    before, now, after = (stage.story.at(time_s + step) for step in (-_STEP_S, 0.0, _STEP_S))
    echoes = [_clutter_echo(stage), *_reflector_echoes(stage, before, now, after)]
    if stage.options.person:
        echoes.append(_person_echo(before.person, after.person))
    from_world = stage.rig.radar_from_world
    start = from_world @ np.concatenate([echo.before_m for echo in echoes])
    end = from_world @ np.concatenate([echo.after_m for echo in echoes])
    middle = 0.5 * (start + end)
    speed = (np.linalg.norm(end, axis=1) - np.linalg.norm(start, axis=1)) / (2.0 * _STEP_S)
    world = np.concatenate([0.5 * (echo.before_m + echo.after_m) for echo in echoes])
    hidden = _behind(now.person, world) if stage.options.person else np.zeros(len(world), dtype=np.bool_)
    return Targets(
        middle,
        speed,
        np.concatenate([np.asarray(echo.rcs_dbsm, dtype=np.float64) for echo in echoes]),
        np.concatenate([np.full(len(echo.rcs_dbsm), echo.fading_db) for echo in echoes]),
        np.concatenate([echo.bias for echo in echoes]),
        hidden,
    )


def _clutter_echo(stage: Stage) -> _Echo:
    places = np.array([[thing.x_m, thing.y_m, thing.z_m] for thing in stage.clutter]).reshape(-1, 3)
    return _Echo(places, places, tuple(thing.rcs_dbsm for thing in stage.clutter), 2.0, stage.clutter_bias)


def _reflector_echoes(stage: Stage, before: Moment, now: Moment, after: Moment) -> list[_Echo]:
    if now.resting is None:
        if not stage.options.person:
            return []
        still = np.zeros((1, 3))
        return [_Echo(before.reflector_m[None], after.reflector_m[None], (_CARRIED_DBSM,), 5.0, still)]
    place = now.resting.position_m[None]
    bias = stage.reflector_bias[now.resting.index][None]
    echoes = [_Echo(place, place, (_REFLECTOR_DBSM,), 1.0, bias)]
    ghost = stage.ghosts[now.resting.index]
    if ghost is not None:
        mirrored = np.array([[ghost.x_m, ghost.y_m, ghost.z_m]])
        echoes.append(_Echo(mirrored, mirrored, (ghost.rcs_dbsm,), 4.0, bias))
    return echoes


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
