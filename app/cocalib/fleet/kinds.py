"""The mounting scatter of each vehicle type, and which vehicles are off their kind."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.fleet import (
    Mounting,
    MountingScatter,
    OffKind,
    SessionPose,
    mounting_scatter,
    mountings_of,
    off_kind,
    off_kinds,
)
from calib_core.measurements import TimeNs, Unsolvable
from cocalib.fleet.records import FleetRecord, SessionRecord, VehicleRecord

_COUNTED = ("good", "usable")


@dataclass(frozen=True, slots=True)
class NotCounted:
    """A session or mounting that the scatter does not rest on.

    Attributes:
        vehicle: its name.
        session: names of the sessions.
        reason: why, without a full stop.
    """

    vehicle: str
    session: str
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class Kind:
    """One vehicle type.

    Attributes:
        vehicle_type: its name.
        vehicles: how many there are.
        scatter: of their mountings, or why it cannot be told.
        not_counted: what it does not rest on.
        judged: the present mounting of each vehicle compared with the other vehicles', by vehicle; without an entry where
            there are too few others, or no pose.
    """

    vehicle_type: str
    vehicles: int
    scatter: MountingScatter | Unsolvable
    not_counted: tuple[NotCounted, ...] = ()
    judged: Mapping[str, OffKind] = field(default_factory=dict)

    @property
    def sigma(self) -> tuple[float, ...] | None:
        """Standard deviations of the mountings: camera forward, left, up [cm]; roll, pitch, yaw [deg]; None if unknown."""
        if isinstance(self.scatter, Unsolvable):
            return None
        return _shown_sigma(self.scatter.scatter)

    @property
    def shared_tape(self) -> str:
        """What a measurement that several vehicles state means, without a full stop; "" if none does."""
        return _tape_words(self.scatter)

    @property
    def reason(self) -> str:
        """Why the scatter cannot be told, and what to do, without a full stop; "" if it can."""
        return f"{self.scatter.reason}; {self.scatter.hint}" if isinstance(self.scatter, Unsolvable) else ""


def kinds_of(fleet: FleetRecord) -> tuple[Kind, ...]:
    """Return every vehicle type with its scatter, by name."""
    return tuple(_kind(fleet, name) for name in fleet.types)


def _tape_words(scatter: MountingScatter | Unsolvable) -> str:
    if isinstance(scatter, Unsolvable) or scatter.shared_tape is None:
        return ""
    return scatter.shared_tape.words


def _shown_sigma(covariance: Matrix66) -> tuple[float, ...]:
    """Return standard deviations in cm and deg of a covariance (6, 6) of mounting coordinates."""
    sigma = np.sqrt(np.diag(covariance))
    return tuple([*(100.0 * sigma[:3]).tolist(), *np.degrees(sigma[3:]).tolist()])


def _kind(fleet: FleetRecord, vehicle_type: str) -> Kind:
    vehicles = fleet.of_type(vehicle_type)
    scatter, not_counted = _scatter(vehicles, vehicle_type)
    judged: dict[str, OffKind] = {}
    if isinstance(scatter, MountingScatter):
        known = {(one.mounting.vehicle, one.mounting.sessions): one for one in off_kinds(scatter)}
        for vehicle in vehicles:
            present = _present_mounting(vehicle)
            if present is None:
                continue
            found = known.get((vehicle.name, present.sessions)) or off_kind(present, scatter)
            if isinstance(found, OffKind):
                judged[vehicle.name] = found
    return Kind(vehicle_type, len(vehicles), scatter, not_counted, judged)


def _scatter(
    vehicles: tuple[VehicleRecord, ...], vehicle_type: str
) -> tuple[MountingScatter | Unsolvable, tuple[NotCounted, ...]]:
    """Return the scatter of some vehicles, and what it does not rest on."""
    poses: list[SessionPose] = []
    not_counted = []
    for vehicle in vehicles:
        for place, record in enumerate(vehicle.sessions):
            reason = _why_not(record)
            if reason is None and record.pose is not None:
                poses.append(_ordered(record.pose, place))
            else:
                not_counted.append(NotCounted(vehicle.name, record.name, reason or ""))
    scatter = mounting_scatter(mountings_of(poses), vehicle_type=vehicle_type)
    if isinstance(scatter, MountingScatter):
        not_counted += [
            NotCounted(one.mounting.vehicle, ", ".join(one.mounting.sessions), one.reason) for one in scatter.left_out
        ]
    return scatter, tuple(not_counted)


def _why_not(record: SessionRecord) -> str | None:
    """Return why a session says nothing about the type's mounting; None if it does."""
    outcome = record.outcome
    if record.pose is not None:
        return None if outcome.verdict in _COUNTED else f"the verdict is {outcome.verdict or 'missing'}"
    if record.pose_problem:
        return record.pose_problem
    return f"{outcome.status}: {outcome.reason}" if outcome.reason else outcome.status


def _present_mounting(vehicle: VehicleRecord) -> Mounting | None:
    """Return a vehicle's last mounting; None without a pose."""
    found = mountings_of(_ordered(pose, place) for place, pose in enumerate(vehicle.compared))
    return found[-1] if found else None


def _ordered(pose: SessionPose, place: int) -> SessionPose:
    """Return a pose whose time is its place among the vehicle's sessions: these are in order, with or without stamps."""
    return dataclasses.replace(pose, time_ns=TimeNs(place))
