"""Read one result from its folder: the outcome, and the pose from calibration.json."""

import errno
import hashlib
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import msgspec

from calib_core.errors import CalibrationError, InputError
from calib_core.fleet import session_pose
from calib_core.interchange import read_calibration
from calib_core.measurements import TimeNs
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, read_outcome
from cocalib.batch.results_folder import OUTCOME_FILE, ResultsFolder
from cocalib.fleet.records import SessionRecord, UnreadResult

_CALIBRATION = "calibration.json"
_MOST = 2**63


def finished_results(folder: Path) -> Mapping[str, str | UnreadResult]:
    """Return the text of every outcome in a folder by its digest; what a job is still writing has a hidden name."""
    place = ResultsFolder(folder).folder_of("")
    if not place.is_dir():
        return {}
    names = sorted(one.name for one in place.iterdir() if not one.name.startswith("."))
    texts = {name: _text(folder, name) for name in names}
    return {name: text for name, text in texts.items() if text is not None}


def outcome_of(text: str, folder: Path, digest: str) -> Outcome | UnreadResult:
    """Return the outcome in the text of its file, or why it cannot be read.

    Args:
        text: of the file.
        folder: holds the results.
        digest: of the job.
    """
    place = _place(folder, digest)
    try:
        found = read_outcome(text)
    except msgspec.DecodeError as error:
        return UnreadResult(place, _not_ours(error))
    if not -_MOST <= (found.recorded_ns or 0) < _MOST or found.pairs >= _MOST:
        return UnreadResult(place, "states a time or a number of pairs that no recording has; run the batch again")
    if found.digest != digest:
        return UnreadResult(place, f"belongs to the job {found.digest}; move it back to its folder, or delete this one")
    return found


def _text(folder: Path, digest: str) -> str | UnreadResult | None:
    """Return the text of an outcome; None if there is no such file."""
    try:
        found = ResultsFolder(folder).result_file(digest, OUTCOME_FILE)
        return None if found is None else found.decode()
    except CalibrationError as error:
        place = _place(folder, digest)
        return UnreadResult(place, str(error).rpartition(f"{place}: ")[2])
    except OSError as error:
        return UnreadResult(_place(folder, digest), f"{error.strerror or error}; check its permissions")
    except UnicodeDecodeError as error:
        return UnreadResult(_place(folder, digest), _not_ours(error))


def _place(folder: Path, digest: str) -> str:
    return (ResultsFolder(folder).folder_of(digest) / OUTCOME_FILE).relative_to(folder).as_posix()


def _not_ours(error: Exception) -> str:
    """Say why an outcome is not of this version."""
    return (
        f"is no {OUTCOME_SCHEMA}: {error}; if another version wrote it, read it with that one, or delete its folder and run "
        "the batch again"
    )


def with_pose(folder: Path, outcome: Outcome, place: int | None) -> SessionRecord:
    """Return a result with the pose of its calibration, or with why it has none.

    Args:
        folder: holds the results.
        outcome: of the result.
        place: of the session in the manifest.
    """
    record = SessionRecord(outcome, place)
    listed = {file.name: file.sha256 for file in outcome.files}
    if _CALIBRATION not in listed:
        return record
    try:
        content = ResultsFolder(folder).result_file(outcome.digest, _CALIBRATION)
        if content is None:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
        if hashlib.sha256(content).hexdigest() != listed[_CALIBRATION]:
            raise InputError("is not the file that the outcome lists; delete this result and run the batch again")
        found = session_pose(
            read_calibration(content, _CALIBRATION).calibration,
            vehicle=outcome.vehicle,
            session=outcome.session,
            time_ns=None if outcome.recorded_ns is None else TimeNs(outcome.recorded_ns),
            radar_serial=outcome.radar_serial,
            camera_serial=outcome.camera_serial,
        )
    except OSError as error:
        return replace(record, pose_problem=f"{_CALIBRATION}: {error.strerror or error}")
    except CalibrationError as error:
        return replace(record, pose_problem=str(error).removeprefix(f"{_CALIBRATION}: "))
    return replace(record, pose=found)
