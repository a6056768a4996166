"""Read a fleet from the results of its sessions: outcomes, the poses of their calibrations, and what the manifests want."""

import errno
import hashlib
import os
from collections.abc import Collection, Iterable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

from calib_core.errors import CalibrationError, InputError
from calib_core.fleet import SessionPose, session_pose, transition
from calib_core.interchange import read_calibration
from calib_core.measurements import TimeNs
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, read_outcome
from cocalib.batch.plan import Plan, read_plans
from cocalib.batch.results_folder import OUTCOME_FILE, RESULTS, ResultsFolder, UnreadResult
from cocalib.fleet.records import FleetRecord, SessionRecord, VehicleRecord

_CALIBRATION = "calibration.json"
_MOST = 2**63


def read_fleet(folder: Path) -> FleetRecord:
    """Return what the results of a folder say; a batch may be writing further ones meanwhile.

    Args:
        folder: holds the results, and what the manifests want.

    Raises:
        InputError: there are no results, or none that can be read.
    """
    plan = read_plans(folder)
    results = ResultsFolder(folder)
    named = {one.digest: name for name, one in plan.sessions.items()}
    by_vehicle: dict[str, list[SessionRecord]] = {}
    unread = []
    for digest in results.digests():
        outcome = _outcome(results, digest)
        if isinstance(outcome, UnreadResult):
            unread.append(replace(outcome, session=named.get(digest)))
        elif outcome is not None:
            by_vehicle.setdefault(outcome.vehicle, []).append(_record(results, outcome, plan))
    if not by_vehicle and not unread:
        raise InputError(f"{folder}: no results; give the folder that cocalib batch wrote to, which holds results/")
    if not by_vehicle:
        more = f" ({len(unread)} such results)" if len(unread) > 1 else ""
        raise InputError(f"{folder}: no result can be read: {unread[0].place}: {unread[0].reason}{more}")
    wanted = {digest for digest in named if digest is not None}
    vehicles, superseded = [], []
    for name in sorted(by_vehicle):
        current, others = current_and_superseded(by_vehicle[name], wanted)
        vehicles.append(_vehicle(name, in_order(current)))
        superseded += others
    found_names = {(vehicle.name, one.name) for vehicle in vehicles for one in vehicle.sessions}
    return FleetRecord(
        vehicles=tuple(vehicles),
        superseded=tuple(superseded),
        unread=(*unread, *plan.unread),
        missing=tuple(name for name in plan.sessions if name not in found_names),
        unlisted=tuple(sorted(name for name in found_names if name not in plan.sessions)) if plan.sessions else (),
        manifests=plan.manifests,
    )


def current_and_superseded(
    records: Iterable[SessionRecord], wanted: Collection[str] = ()
) -> tuple[list[SessionRecord], list[SessionRecord]]:
    """Return the result of each session of one vehicle that counts, in no order, and the others by session and run.

    That is the one that the latest batch wanted; of a session that no batch names, or whose job is not done, the latest one.

    Args:
        records: of one vehicle.
        wanted: digests of the jobs that the latest batches wanted.
    """
    latest: dict[str, SessionRecord] = {}
    others = []
    for record in sorted(records, key=lambda one: (one.outcome.digest in wanted, _run(one))):
        before = latest.get(record.name)
        if before is not None:
            others.append(before)
        latest[record.name] = record
    return list(latest.values()), sorted(others, key=lambda one: (one.name, _run(one)))


def in_order(records: Iterable[SessionRecord]) -> list[SessionRecord]:
    """Return the sessions of one vehicle in order of the recordings' first stamps.

    A session whose recording was never opened has no stamp. It comes right after the one before it in the manifest; one that
    the manifest does not name comes by its name, first.

    Args:
        records: one of each session.
    """
    given = sorted(records, key=lambda one: (one.place is not None, one.place or 0, one.name))
    before = min((at for one in given if (at := one.outcome.recorded_ns) is not None), default=0) - 1
    keyed = []
    for count, record in enumerate(given):
        recorded_ns = record.outcome.recorded_ns
        if recorded_ns is not None:
            before = recorded_ns
        keyed.append((before, recorded_ns is None, count, record))
    return [record for *_, record in sorted(keyed, key=lambda one: one[:3])]


def _run(record: SessionRecord) -> tuple[str, str]:
    outcome = record.outcome
    return outcome.run.started if outcome.run is not None else "", outcome.digest


def _outcome(results: ResultsFolder, digest: str) -> Outcome | UnreadResult | None:
    """Return the outcome of a job, or why it cannot be read; None if there is none."""
    place = (RESULTS, digest, OUTCOME_FILE)
    hint = "if another version wrote it, read it with that one, or delete its folder and run the batch again"
    found = results.read_as(read_outcome, *place, schema=OUTCOME_SCHEMA, hint=hint)
    if not isinstance(found, Outcome):
        return found
    if not -_MOST <= (found.recorded_ns or 0) < _MOST or found.pairs >= _MOST:
        reason = "states a time or a number of pairs that no recording has; run the batch again"
        return UnreadResult("/".join(place), reason)
    if found.digest != digest:
        reason = f"belongs to the job {found.digest}; move it back to its folder, or delete this one"
        return UnreadResult("/".join(place), reason)
    return found


def _record(results: ResultsFolder, outcome: Outcome, plan: Plan) -> SessionRecord:
    """Return a result with the pose of its calibration, or with why it has none."""
    wanted = plan.sessions.get((outcome.vehicle, outcome.session))
    record = SessionRecord(outcome, None if wanted is None else wanted.place)
    listed = {file.name: file.sha256 for file in outcome.files}
    if _CALIBRATION not in listed:
        return record
    try:
        return replace(record, pose=_pose(results, outcome, listed[_CALIBRATION]))
    except OSError as error:
        return replace(record, pose_problem=f"{_CALIBRATION}: {error.strerror or error}")
    except CalibrationError as error:
        return replace(record, pose_problem=str(error).removeprefix(f"{_CALIBRATION}: "))


def _pose(results: ResultsFolder, outcome: Outcome, sha256: str) -> SessionPose:
    """Read the pose of a calibration.

    Raises:
        OSError: the file cannot be read.
        CalibrationError: it is not the file that the outcome lists, no calibration, or one without a pose to compare.
    """
    content = results.result_file(outcome.digest, _CALIBRATION)
    if content is None:
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
    if hashlib.sha256(content).hexdigest() != sha256:
        raise InputError("is not the file that the outcome lists; delete this result and run the batch again")
    return session_pose(
        read_calibration(content, _CALIBRATION).calibration,
        vehicle=outcome.vehicle,
        session=outcome.session,
        time_ns=None if outcome.recorded_ns is None else TimeNs(outcome.recorded_ns),
        radar_serial=outcome.radar_serial,
        camera_serial=outcome.camera_serial,
    )


def _vehicle(name: str, sessions: list[SessionRecord]) -> VehicleRecord:
    """Return a vehicle with what changed from one compared session to the next."""
    poses = [pose for one in sessions if (pose := one.compared_pose) is not None]
    return VehicleRecord(name, tuple(sessions), tuple(transition(*both) for both in pairwise(poses)))
