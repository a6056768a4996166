"""A job as every engine runs it: once, whatever other drivers do, and with an outcome, whatever goes wrong."""

import socket
from datetime import UTC, datetime
from pathlib import Path

from calib_core.errors import CalibrationError, InputError
from cocalib.batch.job import Job
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, OutcomeRun, outcome_text
from cocalib.batch.results_folder import OUTCOME_FILE, ResultsFolder
from cocalib.batch.running import run_job
from cocalib.platform.error_boundary import error_boundary


def run_once(job: Job, results: Path) -> Outcome:
    """Return what came of a job; it is run only if nobody has run it yet.

    Args:
        job: to be run.
        results: the folder of results.

    Raises:
        InputError: the folder of results is not there, or cannot be written.
    """
    if not results.is_dir():
        raise InputError(
            f"{results}: a worker does not reach this folder of results; "
            "put it, and the recordings, on a file system that all workers share under the same path"
        )
    kept = ResultsFolder(results).outcome(job.digest)
    if kept is not None:
        return kept
    lines: list[str] = []
    with error_boundary(f"a job of a batch, {job.row.name}", lines.append):
        return run_job(job, results)
    return failed_outcome(job, results, reason=lines[0])


def failed_outcome(job: Job, results: Path, *, reason: str, hint: str = "") -> Outcome:
    """Write that a job failed because the program did, or its worker.

    Args:
        job: without an outcome.
        results: the folder of results.
        reason: what happened.
        hint: what to do about it.

    Raises:
        InputError: the result cannot be written.
    """
    row = job.row
    outcome = Outcome(
        OUTCOME_SCHEMA,
        job.digest,
        row.vehicle,
        row.session,
        "failed",
        reason=reason,
        hint=hint,
        is_final=False,
        vehicle_type=row.vehicle_type,
        radar_serial=row.radar_serial,
        camera_serial=row.camera_serial,
        run=OutcomeRun(socket.gethostname(), datetime.now(UTC).isoformat(timespec="seconds"), 0.0),
    )
    try:
        with ResultsFolder(results).writing(job.digest) as unfinished:
            (unfinished / OUTCOME_FILE).write_text(outcome_text(outcome), encoding="utf-8")
    except (OSError, CalibrationError) as error:
        raise InputError(
            f"{results}: the result of {row.name} cannot be written ({getattr(error, 'strerror', None) or error}); "
            "make room or choose another folder, and start the batch again: what is done is kept"
        ) from error
    return outcome
