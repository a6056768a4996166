"""Which session or vehicle is meant by a name on the command line, and how two of them differ."""

import dataclasses
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal, TypeAlias

from calib_core.errors import InputError
from calib_core.fleet import SessionPose, Transition, transition
from cocalib.fleet.records import FleetRecord, SessionRecord, VehicleRecord

_Outcome: TypeAlias = Literal["differs", "same", "cannot-tell"]


@dataclass(frozen=True, slots=True, eq=False)
class ComparedSessions:
    """How two sessions differ.

    Attributes:
        a: the first session.
        b: the second session.
        change: from the first to the second.
        outcome: "differs" beyond both error bars, "same" to within narrow ones, else "cannot-tell".
        words: the outcome with its figures, without a full stop.
    """

    a: SessionPose
    b: SessionPose
    change: Transition
    outcome: _Outcome
    words: str


def vehicle_named(fleet: FleetRecord, name: str) -> VehicleRecord:
    """Return the vehicle with a name.

    Raises:
        InputError: there is none, or none of its results can be read.
    """
    for vehicle in fleet.vehicles:
        if vehicle.name == name:
            return vehicle
    for one in fleet.unread:
        if one.session is not None and one.session[0] == name:
            raise InputError(f"vehicle {name!r}: session {one.session[1]!r}: {one.place}: {one.reason}")
    near = get_close_matches(name, [one.name for one in fleet.vehicles], n=3)
    raise InputError(
        f"no vehicle {name!r} among {len(fleet.vehicles)}; "
        + (f"did you mean {' or '.join(near)}?" if near else "cocalib batch status lists them")
    )


def compare_sessions(fleet: FleetRecord, a: str, b: str) -> ComparedSessions:
    """Compare two sessions, or the last calibrated sessions of two vehicles of one type.

    Args:
        fleet: all results.
        a: VEHICLE/SESSION, or VEHICLE.
        b: likewise.

    Raises:
        InputError: there is no such session, it has no pose, or the two vehicles are of different types.
    """
    first, second = _chosen(fleet, a), _chosen(fleet, b)
    types = [vehicle.vehicle_type for vehicle, _ in (first, second)]
    if first[0].name != second[0].name and None not in types and types[0] != types[1]:
        raise InputError(f"{a} is of type {types[0]} and {b} of type {types[1]}; compare vehicles of one type")
    if first[1] is second[1]:
        raise InputError(f"{a} and {b} are the same session; name two, as cocalib batch history lists them")
    pose_a, pose_b = _pose(first[1], a), _pose(second[1], b)
    if first[0].name != second[0].name:
        return _of_two_vehicles(pose_a, pose_b)
    change = transition(pose_a, pose_b)
    outcome: _Outcome = "differs" if change.is_remount else "same" if change.is_unchanged else "cannot-tell"
    return ComparedSessions(pose_a, pose_b, change, outcome, change.words)


def _of_two_vehicles(a: SessionPose, b: SessionPose) -> ComparedSessions:
    """Say how the mountings of two vehicles differ: neither was remounted because of that."""
    change = transition(_under_full_name(a), _under_full_name(b))
    figures = change.words.partition(": ")[2]
    if change.is_remount:
        words = f"{a.vehicle} and {b.vehicle} are mounted differently: {figures}"
        return ComparedSessions(a, b, change, "differs", words)
    if change.is_unchanged:
        return ComparedSessions(a, b, change, "same", f"{a.vehicle} and {b.vehicle} are mounted alike: {figures}")
    words = f"cannot tell whether {a.vehicle} and {b.vehicle} are mounted alike: {figures}"
    return ComparedSessions(a, b, change, "cannot-tell", words)


def _under_full_name(pose: SessionPose) -> SessionPose:
    """Return a pose whose session names its vehicle, too; that two vehicles have two radars goes without saying."""
    return dataclasses.replace(pose, session=f"{pose.vehicle}/{pose.session}", radar_serial=None, camera_serial=None)


def _chosen(fleet: FleetRecord, name: str) -> tuple[VehicleRecord, SessionRecord]:
    """Return what VEHICLE/SESSION or VEHICLE names; either name may contain a slash."""
    found = []
    for vehicle in fleet.vehicles:
        if vehicle.name == name:
            found.append((vehicle, _last_compared(vehicle)))
        elif name.startswith(f"{vehicle.name}/"):
            rest = name.removeprefix(f"{vehicle.name}/")
            found += [(vehicle, record) for record in vehicle.sessions if record.name == rest]
    if len(found) == 1:
        return found[0]
    if found:
        raise InputError(f"{name!r} names {len(found)} sessions; rename one of the vehicles in the manifest")
    for vehicle in fleet.vehicles:
        if name.startswith(f"{vehicle.name}/"):
            known = ", ".join(record.name for record in vehicle.sessions)
            raise InputError(f"no session {name!r}; {vehicle.name} has {known}")
    known_vehicle = vehicle_named(fleet, name)
    return known_vehicle, known_vehicle.last


def _last_compared(vehicle: VehicleRecord) -> SessionRecord:
    """Return the last session with a pose to compare; without one, the last that may say why."""
    compared = (one for one in reversed(vehicle.sessions) if one.compared_pose is not None)
    return next(compared, vehicle.calibrated or vehicle.last)


def _pose(record: SessionRecord, name: str) -> SessionPose:
    """Return the pose of a session.

    Raises:
        InputError: it has none, or its own data contradict it.
    """
    outcome, pose = record.outcome, record.compared_pose
    if pose is None and record.pose is not None:
        raise InputError(
            f"{name}: the data of {record.name} contradict its pose, so that it says nothing of the mounting; "
            "choose another session"
        )
    if pose is None:
        why = record.pose_problem or f"{outcome.status}{f': {outcome.reason}' if outcome.reason else ''}"
        raise InputError(f"{name}: {record.name} has no pose to compare ({why}); choose another session")
    return pose
