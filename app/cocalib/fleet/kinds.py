"""The mounting scatter of each vehicle type, which vehicles are off their kind, and the prior of the next one."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from calib_core.arrays import Matrix66
from calib_core.errors import InputError
from calib_core.fleet import (
    Mounting,
    MountingScatter,
    OffKind,
    SessionPose,
    fleet_prior_of,
    mounting_scatter,
    mountings_of,
    off_kind,
    off_kinds,
)
from calib_core.fleet.mounting_coordinates import coordinate_jacobian
from calib_core.fleet_prior import FleetPrior
from calib_core.measurements import TimeNs, Unsolvable
from cocalib.batch.outcome import Outcome
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


@dataclass(frozen=True, slots=True, eq=False)
class PriorOfType:
    """The prior of a type's next vehicle, and what it does not rest on.

    Attributes:
        prior: to write.
        not_counted: what was left out, and why.
        shared_tape: what a measurement that several vehicles state means, without a full stop; "" if none does.
    """

    prior: FleetPrior
    not_counted: tuple[NotCounted, ...]
    shared_tape: str = ""


def kinds_of(fleet: FleetRecord) -> tuple[Kind, ...]:
    """Return every vehicle type with its scatter, by name."""
    return tuple(_kind(fleet, name) for name in fleet.types)


def prior_of_type(fleet: FleetRecord, vehicle_type: str, without: Sequence[str] = ()) -> PriorOfType | Unsolvable:
    """Return the prior that the vehicles of a type give the next one.

    Args:
        fleet: all results.
        vehicle_type: its name.
        without: names of vehicles that it must not rest on, such as the one it is for.

    Raises:
        InputError: there is no such type, or no such vehicle of it.
    """
    if vehicle_type not in fleet.types:
        known = (
            f"the types are {', '.join(fleet.types)}" if fleet.types else "the manifest names no type of any vehicle"
        )
        raise InputError(f"no vehicle of type {vehicle_type!r}; {known}")
    vehicles = fleet.of_type(vehicle_type)
    names = [one.name for one in vehicles]
    for name in without:
        if name not in names:
            raise InputError(
                f"--without {name}: no vehicle of type {vehicle_type} has this name; there are {', '.join(names)}"
            )
    scatter, not_counted = _scatter(tuple(one for one in vehicles if one.name not in without), vehicle_type)
    return (
        scatter
        if isinstance(scatter, Unsolvable)
        else PriorOfType(fleet_prior_of(scatter), not_counted, _tape_words(scatter))
    )


def _tape_words(scatter: MountingScatter | Unsolvable) -> str:
    if isinstance(scatter, Unsolvable) or scatter.shared_tape is None:
        return ""
    return scatter.shared_tape.words


def prior_sigma(prior: FleetPrior) -> tuple[float, ...]:
    """Return the standard deviations of a prior: camera forward, left, up [cm]; roll, pitch, yaw [deg]."""
    pose = prior.camera_from_radar
    jacobian = coordinate_jacobian(pose, pose)
    return _shown_sigma(jacobian @ prior.covariance @ jacobian.T)


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
    if record.pose is not None and outcome.fleet_prior is not None:
        return _why_data_do_not_count(outcome)
    if record.pose is not None:
        return None if outcome.verdict in _COUNTED else f"the verdict is {outcome.verdict or 'missing'}"
    if record.pose_problem:
        return record.pose_problem
    return f"{outcome.status}: {outcome.reason}" if outcome.reason else outcome.status


def _why_data_do_not_count(outcome: Outcome) -> str | None:
    """Return why a session that was solved with a prior says nothing; None if its data would be good enough without it.

    The verdict on the answer says nothing of that: a prior makes it better, and the warning of an unusual mounting makes it
    weak. To leave those out would make the scatter smaller than it is; the scatter has its own test.
    """
    if outcome.alone_verdict in _COUNTED:
        return None
    figures = ""
    if outcome.alone_sigma_deg is not None and outcome.alone_sigma_cm is not None:
        figures = f" (sigma {outcome.alone_sigma_deg:.2g} deg, {outcome.alone_sigma_cm:.2g} cm)"
    return (
        f"solved with a fleet's prior; the verdict on its data alone is {outcome.alone_verdict or 'missing'}{figures}"
    )


def _present_mounting(vehicle: VehicleRecord) -> Mounting | None:
    """Return a vehicle's last mounting; None without a pose."""
    found = mountings_of(_ordered(pose, place) for place, pose in enumerate(vehicle.compared))
    return found[-1] if found else None


def _ordered(pose: SessionPose, place: int) -> SessionPose:
    """Return a pose whose time is its place among the vehicle's sessions: these are in order, with or without stamps."""
    return dataclasses.replace(pose, time_ns=TimeNs(place))
