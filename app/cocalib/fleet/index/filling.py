"""Put results into the tables and take them out: the same tables, in whatever order the results came."""

import sqlite3
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from calib_core.fleet import transition
from cocalib.batch.outcome import Outcome, outcome_text, read_outcome
from cocalib.batch.plan import Wanted
from cocalib.fleet.index.result_reading import outcome_of, with_pose
from cocalib.fleet.index.stored_pose import insert_pose, insert_transition, pose_of
from cocalib.fleet.records import SessionRecord, UnreadResult, is_compared
from cocalib.fleet.session_order import current_and_superseded, in_order

Places = Mapping[tuple[str, str], Wanted]
"""What the manifests want, by vehicle and session."""


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
        _insert(connection, with_pose(folder, found, _place(found, places)), str(text), places)
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
    _insert(connection, with_pose(folder, outcome, _place(outcome, places)), outcome_text(outcome), places)
    _settle(connection, outcome.vehicle)


def has_places(connection: sqlite3.Connection, places: Places) -> bool:
    """Return whether the tables say what the manifests want."""
    return not _moved(connection, places)


def set_places(connection: sqlite3.Connection, places: Places) -> None:
    """State anew what the manifests want."""
    moved = _moved(connection, places)
    connection.executemany("UPDATE sessions SET place = ?, wanted = ? WHERE digest = ?", [one[:3] for one in moved])
    for vehicle in sorted({vehicle for *_, vehicle in moved}):
        _settle(connection, vehicle)


def _moved(connection: sqlite3.Connection, places: Places) -> list[tuple[int | None, bool, str, str]]:
    """Return place, whether it is wanted, digest and vehicle of the results for which that is not as stored."""
    rows = connection.execute("SELECT digest, vehicle, session, place, wanted FROM sessions").fetchall()
    moved = []
    for digest, vehicle, session, place, is_wanted in rows:
        found = places.get((vehicle, session))
        now = (None, False) if found is None else (found.place, found.digest == digest)
        if now != (place, bool(is_wanted)):
            moved.append((*now, digest, vehicle))
    return moved


def _place(outcome: Outcome, places: Places) -> int | None:
    found = places.get((outcome.vehicle, outcome.session))
    return None if found is None else found.place


def _is_wanted(outcome: Outcome, places: Places) -> bool:
    found = places.get((outcome.vehicle, outcome.session))
    return found is not None and found.digest == outcome.digest


def _insert(connection: sqlite3.Connection, record: SessionRecord, text: str, places: Places) -> None:
    outcome = record.outcome
    row: dict[str, Any] = {
        "digest": outcome.digest,
        "vehicle": outcome.vehicle,
        "session": outcome.session,
        "place": record.place,
        "wanted": _is_wanted(outcome, places),
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
        (read_outcome(text), place, wanted)
        for text, place, wanted in connection.execute(
            "SELECT outcome, place, wanted FROM sessions WHERE vehicle = ?", (vehicle,)
        )
    ]
    wanted = {outcome.digest for outcome, _, is_wanted in given if is_wanted}
    latest, superseded = current_and_superseded([(outcome, place) for outcome, place, _ in given], wanted)
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
        if row is not None and is_compared(outcome):
            poses.append((outcome.digest, pose_of(row, outcome)))
    for (before, earlier), (after, later) in pairwise(poses):
        insert_transition(connection, before, after, transition(earlier, later))
