"""The table of results: a row for each session that the manifests of a folder name, in results.csv and results.json."""

import csv
import hashlib
import io
import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from calib_core.errors import CalibrationError, InputError
from calib_core.file_tag import kind_of
from calib_core.geometry import quaternion_wxyz_from_matrix
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.results import Calibration
from calib_core.results.verdict import stated_error
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, Status, read_outcome
from cocalib.batch.plan import read_plans
from cocalib.batch.results_folder import OUTCOME_FILE, RESULTS, ResultsFolder
from cocalib.batch.solving import CALIBRATION_FILE
from cocalib.platform.files import writable

RESULTS_SCHEMA: Final = "cocalib/batch-results-1"
CSV_FILE, JSON_FILE = "results.csv", "results.json"
_WITH_POSE = ("good", "usable", "coarse")
_MOST = 2**63
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""With what spreadsheets begin a formula."""


class SessionRow(Struct, frozen=True, kw_only=True):
    """One session; what is not known is null, and empty in results.csv."""

    vehicle: str
    session: str
    recorded: str | None = None
    """First stamp of the recording, ISO 8601, UTC."""
    status: Status | Literal["missing", "unreadable"]
    verdict: str | None = None
    rotation_95_deg: float | None = None
    """What the error of the rotation stays within with 95 %, as in the verdict [deg]."""
    position_95_cm: float | None = None
    """The same of the position; null for a radar without elevation [cm]."""
    aed_px: float | None = None
    pairs: int | None = None
    """How many were used."""
    qw: float | None = None
    qx: float | None = None
    qy: float | None = None
    qz: float | None = None
    x_m: float | None = None
    y_m: float | None = None
    z_m: float | None = None
    """camera_from_radar: p_camera = R(q) p_radar + (x, y, z); null where the data contradict it."""
    reason: str = ""
    """Why there is no calibration, or why it is in doubt."""
    hint: str = ""
    """What to do about it."""
    folder: str
    """Of the result, with calibration.json and report.html, relative to the folder of results."""


class BatchResults(Struct, frozen=True, kw_only=True):
    """The sessions in order of vehicle and time, and the records of manifests that cannot be read."""

    schema: Literal["cocalib/batch-results-1"]
    sessions: tuple[SessionRow, ...]
    unread: tuple[str, ...] = ()

    @property
    def all_solved(self) -> bool:
        """Whether every session has a calibration that is not in doubt."""
        return not self.unread and all(row.status == "solved" for row in self.sessions)


def read_results(folder: Path) -> BatchResults:
    """Return what came of each session, as the latest batches wanted it; a batch may be writing further results meanwhile.

    Args:
        folder: that batch wrote to.

    Raises:
        InputError: no batch wrote to it.
    """
    plan, results = read_plans(folder), ResultsFolder(folder)
    if not (plan.digests or plan.unread):
        raise InputError(f"{folder}: no results; give the folder that cocalib batch wrote to, which holds manifests/")
    rows = [_row(results, vehicle, session, digest) for (vehicle, session), digest in plan.digests.items()]
    rows.sort(key=lambda row: (row.vehicle, row.recorded is None, row.recorded, row.session))
    return BatchResults(schema=RESULTS_SCHEMA, sessions=tuple(rows), unread=plan.unread)


def write_results(folder: Path, table: BatchResults) -> None:
    """Write results.csv and results.json into the folder of results.

    Raises:
        CalibrationError: what has such a name is not a regular file, or not of ours; it was not changed.
        OSError: one cannot be written.
    """
    for name, data in ((CSV_FILE, csv_bytes(table)), (JSON_FILE, json_bytes(table))):
        writable(folder / name, kind_of(data))
        ResultsFolder(folder).write(name, data=data)


def json_bytes(table: BatchResults) -> bytes:
    """Write batch-results-1 JSON."""
    return msgspec.json.format(msgspec.json.encode(table), indent=1) + b"\n"


def csv_bytes(table: BatchResults) -> bytes:
    """Write a row for each session, under the names that JSON has."""
    text = io.StringIO()
    writer = csv.DictWriter(text, SessionRow.__struct_fields__, lineterminator="\n")
    writer.writeheader()
    writer.writerows(
        {name: _cell(value) for name, value in msgspec.structs.asdict(row).items()} for row in table.sessions
    )
    return text.getvalue().encode()


def _cell(value: Any) -> Any:
    """Return a cell of a CSV file; a text that a spreadsheet would take for a formula begins with an apostrophe."""
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value


def _row(results: ResultsFolder, vehicle: str, session: str, digest: str) -> SessionRow:
    """Return the row of a session."""
    row = SessionRow(vehicle=vehicle, session=session, status="missing", folder=f"{RESULTS}/{digest}")
    hint = "if another version wrote it, read it with that one, or delete its folder and run the batch again"
    try:
        outcome = results.read_as(read_outcome, RESULTS, digest, OUTCOME_FILE, schema=OUTCOME_SCHEMA, hint=hint)
        if outcome is None:
            return replace(row, reason="there is no result", hint="run the batch again")
        if (outcome.digest, outcome.vehicle, outcome.session) != (digest, vehicle, session) or outcome.pairs >= _MOST:
            raise InputError(
                f"{row.folder}/{OUTCOME_FILE}: is of another job; delete its folder and run the batch again"
            )
        shared = {name: getattr(outcome, name) for name in ("status", "verdict", "aed_px", "pairs", "reason", "hint")}
        row = replace(row, recorded=_iso_time(outcome.recorded_ns), **shared)
        return _with_pose(row, _calibration(results, outcome)) if outcome.verdict in _WITH_POSE else row
    except CalibrationError as error:
        return replace(row, status="unreadable", reason=str(error), hint="")


def _calibration(results: ResultsFolder, outcome: Outcome) -> Calibration:
    """Read the calibration of a result.

    Raises:
        CalibrationError: it is not the file that the outcome lists, or no calibration.
    """
    place = f"{RESULTS}/{outcome.digest}/{CALIBRATION_FILE}"
    listed = {file.name: file.sha256 for file in outcome.files}
    try:
        content = results.read(RESULTS, outcome.digest, CALIBRATION_FILE) or b""
    except OSError as error:
        raise InputError(f"{place}: {error.strerror or error}; check its permissions") from error
    if hashlib.sha256(content).hexdigest() != listed.get(CALIBRATION_FILE):
        raise InputError(f"{place}: is not the file that the outcome lists; run the batch again")
    return read_calibration(content, place).calibration


def _with_pose(row: SessionRow, calibration: Calibration) -> SessionRow:
    """Add the pose of a calibration and the error that it states."""
    pose, error = calibration.camera_from_radar, stated_error(calibration)
    qw, qx, qy, qz = quaternion_wxyz_from_matrix(pose.rotation).tolist()
    x_m, y_m, z_m = pose.translation_m.tolist()
    stated = {
        "rotation_95_deg": _finite_or_none(error.rotation_deg),
        "position_95_cm": _finite_or_none(error.position_cm),
    }
    return replace(row, **stated, qw=qw, qx=qx, qy=qy, qz=qz, x_m=x_m, y_m=y_m, z_m=z_m)


def _finite_or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _iso_time(recorded_ns: int | None) -> str | None:
    """Return a stamp as ISO 8601 in UTC; None if it is not known, or no calendar has it."""
    if recorded_ns is None:
        return None
    try:
        return f"{datetime.fromtimestamp(recorded_ns // 1_000_000_000, UTC):%Y-%m-%dT%H:%M:%SZ}"
    except (OverflowError, ValueError, OSError):
        return None
