"""The truth about a simulated fleet: how each vehicle is mounted in each session, and what is wrong with some."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.fleet.simulated_session import RECORDING, Fault, Mounting, VehicleErrors, recording_of
from calib_core.arrays import Vector3, frozen_array
from calib_core.synthetic import SimulationOptions

__all__ = ["REMOUNTS", "TAPE_SIGMA_M", "FleetPlan", "PlannedSession", "Remount", "plan_fleet"]

TAPE_SIGMA_M = 0.01
"""Standard deviation of the camera position that each session measures with a tape, per axis [m]."""


@dataclass(frozen=True, slots=True)
class Remount:
    """How far a camera is turned [deg] and moved [m] when it is mounted again, each in a random direction."""

    deg: float
    m: float


REMOUNTS = (Remount(5.0, 0.0), Remount(0.0, 0.1), Remount(4.0, 0.05))
"""One for each vehicle that is remounted: put back crooked, put elsewhere, and both."""

_WRONG_RADARS: tuple[Fault, ...] = ("mirrored radar", "radar of another type")
_SPOILT: tuple[Fault, ...] = ("broken recording", "no clicks")
_TYPE_POSITION_M, _TYPE_ANGLES_DEG = (-0.02, 0.03, 0.11), (1.2, -0.8, 0.5)
_SCATTER_DEG, _SCATTER_M = 0.3, 0.005


@dataclass(frozen=True, slots=True, eq=False)
class PlannedSession:
    """One session of a vehicle and its truth.

    Attributes:
        vehicle: its name.
        session: its name.
        radar_serial: of the radar.
        camera_serial: of the camera.
        mounting: in this session.
        tape_m: (3,) the camera position in the radar frame as measured with a tape [m].
        remounted: the camera was mounted again since the session before.
        fault: what is wrong; None if nothing is.
        simulation: the options of its recording.
    """

    vehicle: str
    session: str
    radar_serial: str
    camera_serial: str
    mounting: Mounting
    tape_m: Vector3
    remounted: bool
    fault: Fault | None
    simulation: SimulationOptions

    def __post_init__(self) -> None:
        object.__setattr__(self, "tape_m", frozen_array(self.tape_m, (3,)))

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


def plan_fleet(
    vehicles: int,
    sessions: int,
    seed: int,
    *,
    recording: SimulationOptions = RECORDING,
    remounts: Sequence[Remount] = REMOUNTS,
    sound: bool = False,
) -> FleetPlan:
    """Draw a fleet: three vehicles are remounted once, two have a wrong radar, one session is broken, one has no clicks.

    Args:
        vehicles: how many; with at least 7, all these are on vehicles of their own, with fewer some are missing.
        sessions: of each vehicle, a month apart.
        seed: of the random generator; each vehicle has a stream of its own.
        recording: what all recordings have in common.
        remounts: up to three, one for each vehicle that is remounted.
        sound: leave out remounts and faults.
    """
    mean = Mounting(np.array(_TYPE_ANGLES_DEG), np.array(_TYPE_POSITION_M))
    special = [] if sound else np.random.default_rng([seed, 0]).permutation(vehicles).tolist()
    changes = dict(zip(special[:3], remounts, strict=False)) if sessions > 1 else {}
    radars = dict(zip(special[3:5], _WRONG_RADARS, strict=False))
    spoilt = dict(zip(special[5:7], _SPOILT, strict=False))
    planned: list[PlannedSession] = []
    for number in range(vehicles):
        rng = np.random.default_rng([seed, 1 + number])
        mounting = mean.moved(_SCATTER_DEG * rng.standard_normal(3), _SCATTER_M * rng.standard_normal(3))
        errors = VehicleErrors.drawn(rng, width_px=recording.width_px)
        remount = changes.get(number)
        change = None if remount is None else int(rng.integers(1, sessions))
        spoilt_session = int(rng.integers(sessions))
        for index in range(sessions):
            if remount is not None and index == change:
                mounting = mounting.moved(remount.deg * _direction(rng), remount.m * _direction(rng))
            fault: Fault | None = radars.get(number)
            if index == spoilt_session:
                fault = spoilt.get(number, fault)
            planned.append(
                PlannedSession(
                    f"v{number + 1:03d}",
                    f"s{index + 1}",
                    f"R{number + 1:03d}",
                    f"C{number + 1:03d}",
                    mounting,
                    mounting.position_m + TAPE_SIGMA_M * rng.standard_normal(3),
                    index == change,
                    fault,
                    recording_of(mounting, errors, recording, rng, index=index, fault=fault),
                )
            )
    return FleetPlan("van", mean, tuple(planned))


def _direction(rng: np.random.Generator) -> Vector3:
    drawn = rng.standard_normal(3)
    return np.asarray(drawn / np.linalg.norm(drawn))
