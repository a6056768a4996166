"""Put results into the tables and take them out: the same tables, in whatever order the results came."""

import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from app.batch.outcome import Outcome, outcome_text, read_outcome
from app.fleet.index.result_reading import outcome_of, with_pose
from app.fleet.index.stored_pose import insert_pose, insert_transition, pose_of
from app.fleet.records import NO_POSE_OF, SessionRecord, UnreadResult
from app.fleet.session_order import current_and_superseded, in_order
from calib_core.fleet import transition

__all__ = ["Places", "fill", "known_results", "put", "set_places"]

Places = Mapping[tuple[str, str], int]
"""Vehicle and session to the place in the manifest, from 0."""


def known_results(connection: sqlite3.Connection) -> Mapping[str, str]:
    """Return the text of every outcome in the index by its digest."""
    return dict(connection.execute("SELECT digest, outcome FROM sessions").fetchall())


def fill(
    connection: sqlite3.Connection, folder: Path, finished: Mapping[str, str | UnreadResult], places: Places
) -> tuple[UnreadResult, ...]:
    """Make the tables hold exactly the finished results of a folder; return those that cannot be read.

    Args:
        connection: within a transaction.
        folder: holds the results.
        finished: the text of each outcome there by its digest.
        places: of the manifest, as far as known.
    """
    unread, changed = [], set()
    known = known_results(connection)
    for digest in sorted(known):
        if finished.get(digest) != known[digest]:
            (vehicle,) = connection.execute("SELECT vehicle FROM sessions WHERE digest = ?", (digest,)).fetchone()
            connection.execute("DELETE FROM sessions WHERE digest = ?", (digest,))
            changed.add(vehicle)
    for digest in sorted(finished):
        text = finished[digest]
        if known.get(digest) == text:
            continue
        found = text if isinstance(text, UnreadResult) else outcome_of(text, folder, digest)
        if isinstance(found, UnreadResult):
            unread.append(found)
            continue
        _insert(connection, with_pose(folder, found, places.get((found.vehicle, found.session))), str(text))
        changed.add(found.vehicle)
    for vehicle in sorted(changed):
        _settle(connection, vehicle)
    return tuple(unread)


def put(connection: sqlite3.Connection, folder: Path, outcome: Outcome, places: Places) -> None:
    """Add a result, or replace the one of the same job.

    Args:
        connection: within a transaction.
        folder: holds the results.
        outcome: of the result.
        places: of the manifest, as far as known.
    """
    connection.execute("DELETE FROM sessions WHERE digest = ?", (outcome.digest,))
    _insert(
        connection, with_pose(folder, outcome, places.get((outcome.vehicle, outcome.session))), outcome_text(outcome)
    )
    _settle(connection, outcome.vehicle)


def set_places(connection: sqlite3.Connection, places: Places) -> None:
    """State the places of all sessions in the manifest anew."""
    rows = connection.execute("SELECT digest, vehicle, session, place FROM sessions").fetchall()
    moved = [(places.get((vehicle, session)), digest, vehicle, place) for digest, vehicle, session, place in rows]
    for wanted, digest, _, place in moved:
        if wanted != place:
            connection.execute("UPDATE sessions SET place = ? WHERE digest = ?", (wanted, digest))
    for vehicle in sorted({vehicle for wanted, _, vehicle, place in moved if wanted != place}):
        _settle(connection, vehicle)


def _insert(connection: sqlite3.Connection, record: SessionRecord, text: str) -> None:
    outcome = record.outcome
    row: dict[str, Any] = {
        "digest": outcome.digest,
        "vehicle": outcome.vehicle,
        "session": outcome.session,
        "place": record.place,
        "status": outcome.status,
        "reason": outcome.reason,
        "verdict": outcome.verdict,
        "vehicle_type": outcome.vehicle_type,
        "radar_serial": outcome.radar_serial,
        "camera_serial": outcome.camera_serial,
        "recorded_ns": outcome.recorded_ns,
        "sigma_deg": outcome.sigma_deg,
        "sigma_cm": outcome.sigma_cm,
        "aed_px": outcome.aed_px,
        "pairs": outcome.pairs,
        "started": None if outcome.run is None else outcome.run.started,
        "pose_problem": record.pose_problem,
        "outcome": text,
    }
    named = ", ".join(f":{name}" for name in row)
    connection.execute(f"INSERT INTO sessions ({', '.join(row)}) VALUES ({named})", row)
    files = [(outcome.digest, file.name, file.sha256) for file in outcome.files]
    connection.executemany("INSERT OR REPLACE INTO files VALUES (?, ?, ?)", files)
    if record.pose is not None:
        insert_pose(connection, outcome.digest, record.pose)


def _settle(connection: sqlite3.Connection, vehicle: str) -> None:
    """Write which results of a vehicle count, in which order, and what changed from one to the next."""
    given = [
        (read_outcome(text), place)
        for text, place in connection.execute("SELECT outcome, place FROM sessions WHERE vehicle = ?", (vehicle,))
    ]
    latest, superseded = current_and_superseded(given)
    ordered = [outcome for outcome, _ in in_order(latest)]
    _mark(connection, ((None, 1, outcome.digest) for outcome, _ in superseded))
    _mark(connection, ((position, 0, outcome.digest) for position, outcome in enumerate(ordered)))
    connection.execute(
        "DELETE FROM transitions WHERE after IN (SELECT digest FROM sessions WHERE vehicle = ?)", (vehicle,)
    )
    _write_transitions(connection, ordered)


def _mark(connection: sqlite3.Connection, rows: Iterable[tuple[int | None, int, str]]) -> None:
    connection.executemany("UPDATE sessions SET position = ?, superseded = ? WHERE digest = ?", rows)


def _write_transitions(connection: sqlite3.Connection, ordered: Sequence[Outcome]) -> None:
    cursor = connection.cursor()
    cursor.row_factory = sqlite3.Row
    poses = []
    for outcome in ordered:
        row = cursor.execute("SELECT * FROM poses WHERE digest = ?", (outcome.digest,)).fetchone()
        if row is not None and outcome.verdict not in NO_POSE_OF:
            poses.append((outcome.digest, pose_of(row, outcome)))
    for (before, earlier), (after, later) in pairwise(poses):
        insert_transition(connection, before, after, transition(earlier, later))
