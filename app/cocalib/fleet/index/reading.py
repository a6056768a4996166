"""Read a fleet from its index without changing anything, also while a batch is running."""

import sqlite3
from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from calib_core.errors import InputError
from cocalib.batch.outcome import read_outcome
from cocalib.batch.plan import Plan, read_plans
from cocalib.fleet.index.filling import fill, has_places, known_results, set_places
from cocalib.fleet.index.result_reading import finished_results
from cocalib.fleet.index.stored_pose import pose_of, transition_of
from cocalib.fleet.index.tables import create_tables, damaged, has_tables, index_path, read_only, require_version
from cocalib.fleet.records import FleetRecord, SessionRecord, UnreadResult, VehicleRecord


def read_fleet(folder: Path) -> FleetRecord:
    """Return what the results of a folder say.

    Results that the index does not have yet, as while another batch runs or after a driver was killed, are read from the folder
    itself; the index is not changed.

    Args:
        folder: holds the results and the index.

    Raises:
        InputError: there are no results that can be read, or the index is of another version or damaged.
    """
    finished = finished_results(folder)
    if not finished:
        raise InputError(f"{folder}: no results; give the folder that cocalib batch wrote to, which holds results/")
    path, plan = index_path(folder), read_plans(folder)
    try:
        indexed = path.is_file()
        fleet = _of_index(folder, path, finished, plan) if indexed else _of_results(folder, finished, plan)
    except sqlite3.OperationalError:  # a killed writer left a journal, or the drive has no locks
        fleet = _of_results(folder, finished, plan)
    except (sqlite3.DatabaseError, ValueError) as error:  # msgspec's and json's errors are ValueErrors
        raise damaged(path, error) from error
    if not fleet.vehicles:
        first = fleet.unread[0]
        more = f" ({len(fleet.unread)} such results)" if len(fleet.unread) > 1 else ""
        raise InputError(f"{folder}: no result can be read: {first.place}: {first.reason}{more}")
    return _with_plan(fleet, plan)


def _with_plan(fleet: FleetRecord, plan: Plan) -> FleetRecord:
    """Add which sessions the manifests name and have no result, and the other way round."""
    found = {(vehicle.name, one.name) for vehicle in fleet.vehicles for one in vehicle.sessions}
    missing = tuple(name for name in plan.sessions if name not in found)
    unlisted = tuple(sorted(name for name in found if name not in plan.sessions)) if plan.sessions else ()
    return replace(fleet, missing=missing, unlisted=unlisted, manifests=plan.manifests)


def _of_index(folder: Path, path: Path, finished: Mapping[str, str | UnreadResult], plan: Plan) -> FleetRecord:
    with closing(read_only(path)) as connection:
        connection.execute("BEGIN")  # one state of the tables for all that follows
        if not has_tables(connection):  # its writer is just beginning
            return _of_results(folder, finished, plan)
        require_version(connection, path)
        if dict(known_results(connection)) == dict(finished) and has_places(connection, plan.sessions):
            return _loaded(connection)
        with closing(sqlite3.connect(":memory:", isolation_level=None)) as copy:
            copy.execute("PRAGMA foreign_keys = ON")
            connection.execute("COMMIT")
            connection.backup(copy)
            set_places(copy, plan.sessions)
            unread = fill(copy, folder, finished, plan.sessions)
            return replace(_loaded(copy), unread=unread)


def _of_results(folder: Path, finished: Mapping[str, str | UnreadResult], plan: Plan) -> FleetRecord:
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as memory:
        create_tables(memory)
        unread = fill(memory, folder, finished, plan.sessions)
        return replace(_loaded(memory), unread=unread)


def _loaded(connection: sqlite3.Connection) -> FleetRecord:
    connection.row_factory = sqlite3.Row
    poses = {row["digest"]: row for row in connection.execute("SELECT * FROM poses")}
    superseded = []
    by_vehicle: dict[str, list[SessionRecord]] = {}
    query = "SELECT * FROM sessions ORDER BY vehicle, superseded, position, session, started, digest"
    for row in connection.execute(query):
        outcome = read_outcome(row["outcome"])
        stored = poses.get(outcome.digest)
        pose = None if stored is None else pose_of(stored, outcome)
        record = SessionRecord(outcome, row["place"], pose, row["pose_problem"])
        if row["superseded"]:
            superseded.append(record)
        else:
            by_vehicle.setdefault(outcome.vehicle, []).append(record)
    changes = {row["after"]: row for row in connection.execute("SELECT * FROM transitions")}
    vehicles = (_vehicle(name, by_vehicle[name], changes) for name in sorted(by_vehicle))
    return FleetRecord(tuple(vehicles), tuple(superseded))


def _vehicle(name: str, sessions: list[SessionRecord], changes: dict[str, sqlite3.Row]) -> VehicleRecord:
    poses = {one.outcome.digest: one.pose for one in sessions}
    steps = []
    for one in sessions:
        row = changes.get(one.outcome.digest)
        before, after = (None, None) if row is None else (poses[row["before"]], one.pose)
        if row is not None and before is not None and after is not None:
            steps.append(transition_of(row, before, after))
    return VehicleRecord(name, tuple(sessions), tuple(steps))
