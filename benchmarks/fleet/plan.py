"""The truth about a simulated fleet: how each vehicle is mounted in each session, and what is wrong with some."""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Vector3, frozen_array
from calib_core.geometry import rotation_exp, rotation_log
from calib_core.synthetic import RadarDefects, SimulationOptions
from calib_core.synthetic.rig import RigOptions

__all__ = ["CAMERA_POSITION_M", "Fault", "FleetPlan", "Mounting", "PlannedSession", "plan_fleet"]

Fault: TypeAlias = Literal["mirrored radar", "radar of another type", "broken recording", "no clicks"]

CAMERA_POSITION_M = (-0.02, 0.03, 0.11)
"""Where the drawing has the camera in the radar frame [m]."""
_TYPE_ANGLES_DEG = (1.2, -0.8, 0.5)
_SCATTER_DEG, _SCATTER_M = 0.3, 0.005
_REMOUNTED_DEG, _REMOUNTED_M = 2.0, 0.03
_AZIMUTH_SCALE, _ELEVATION_SCALE = 0.005, 0.01
_REMOUNTS = 3
_START_S, _MONTH_S = 1_760_000_000, 30 * 86_400
_SIMULATION = SimulationOptions(
    scene="field",
    radar="imaging",
    placements=10,
    dwell_s=3.5,
    heights=True,
    person=False,
    width_px=320,
    height_px=200,
    camera_rate_hz=1.0,
    radar_rate_hz=4.0,
    click_sigma_px=0.25,
)


@dataclass(frozen=True, slots=True, eq=False)
class Mounting:
    """How a camera is mounted.

    Attributes:
        angles_deg: (3,) its rotation away from looking where the radar looks, in the camera frame [deg].
        position_m: (3,) of its centre in the radar frame [m].
    """

    angles_deg: Vector3
    position_m: Vector3

    def __post_init__(self) -> None:
        for name in ("angles_deg", "position_m"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (3,)))

    def moved(self, angles_deg: Vector3, position_m: Vector3) -> "Mounting":
        """Turn the camera by a rotation vector in its own frame and move it."""
        turned = rotation_exp(np.deg2rad(angles_deg)) @ rotation_exp(np.deg2rad(self.angles_deg))
        return Mounting(np.rad2deg(rotation_log(turned)), self.position_m + position_m)


@dataclass(frozen=True, slots=True, eq=False)
class PlannedSession:
    """One session of a vehicle and its truth.

    Attributes:
        vehicle: its name.
        session: its name.
        radar_serial: of the radar.
        camera_serial: of the camera.
        mounting: in this session.
        remounted: the camera was mounted again since the session before.
        fault: what is wrong; None if nothing is.
        simulation: the options of its recording.
    """

    vehicle: str
    session: str
    radar_serial: str
    camera_serial: str
    mounting: Mounting
    remounted: bool
    fault: Fault | None
    simulation: SimulationOptions

    @property
    def folder(self) -> str:
        """Where its files are, in the fleet's folder."""
        return f"{self.vehicle}/{self.session}"


@dataclass(frozen=True, slots=True, eq=False)
class FleetPlan:
    """All sessions.

    Attributes:
        vehicle_type: all vehicles are of it.
        mean: mounting of the type.
        sessions: vehicle by vehicle, in order of time.
    """

    vehicle_type: str
    mean: Mounting
    sessions: tuple[PlannedSession, ...]


def plan_fleet(vehicles: int, sessions: int, seed: int) -> FleetPlan:
    """Draw a fleet: up to three vehicles are remounted, two have a wrong radar, one session is broken, one has no clicks.

    Args:
        vehicles: how many, at least 7 for all faults to be on vehicles of their own.
        sessions: of each vehicle, a month apart.
        seed: of the random generator; each vehicle has a stream of its own.
    """
    mean = Mounting(np.array(_TYPE_ANGLES_DEG), np.array(CAMERA_POSITION_M))
    special = [int(number) for number in np.random.default_rng([seed, 0]).permutation(vehicles)]
    remounted = set(special[:_REMOUNTS]) if sessions > 1 else set()
    radars = dict(zip(special[3:5], ("mirrored radar", "radar of another type"), strict=False))
    spoilt = dict(zip(special[5:7], ("broken recording", "no clicks"), strict=False))
    planned: list[PlannedSession] = []
    for number in range(vehicles):
        rng = np.random.default_rng([seed, 1 + number])
        mounting = mean.moved(_SCATTER_DEG * rng.standard_normal(3), _SCATTER_M * rng.standard_normal(3))
        radar = RadarDefects(
            azimuth_scale=1.0 + _AZIMUTH_SCALE * float(rng.standard_normal()),
            elevation_scale=1.0 + _ELEVATION_SCALE * float(rng.standard_normal()),
        )
        change = int(rng.integers(1, sessions)) if number in remounted else None
        spoilt_session = int(rng.integers(sessions))
        for index in range(sessions):
            if index == change:
                mounting = mounting.moved(_REMOUNTED_DEG * _direction(rng), _REMOUNTED_M * _direction(rng))
            fault: Fault | None = radars.get(number)  # type: ignore[assignment]
            if index == spoilt_session:
                fault = spoilt.get(number, fault)  # type: ignore[arg-type]
            planned.append(
                PlannedSession(
                    f"v{number + 1:03d}",
                    f"s{index + 1}",
                    f"R{number + 1:03d}",
                    f"C{number + 1:03d}",
                    mounting,
                    index == change,
                    fault,
                    _simulation(mounting, radar, fault, index, int(rng.integers(2**31))),
                )
            )
    return FleetPlan("van", mean, tuple(planned))


def _simulation(
    mounting: Mounting, radar: RadarDefects, fault: Fault | None, index: int, seed: int
) -> SimulationOptions:
    if fault == "mirrored radar":
        radar = replace(radar, mirrored=True)
    if fault == "radar of another type":
        radar = replace(radar, azimuth_scale=1.35, elevation_scale=0.7)
    x, y, z = (float(value) for value in mounting.position_m)
    roll, pitch, yaw = (float(value) for value in mounting.angles_deg)
    rig = RigOptions(
        camera_offset_m=(x, y, z),
        camera_offset_sigma_m=0.0,
        camera_angles_deg=(roll, pitch, yaw),
        camera_angle_sigma_deg=0.0,
    )
    return replace(_SIMULATION, rig=rig, defects=radar, seed=seed, start_s=_START_S + index * _MONTH_S)


def _direction(rng: np.random.Generator) -> Vector3:
    drawn = rng.standard_normal(3)
    return np.asarray(drawn / np.linalg.norm(drawn))
