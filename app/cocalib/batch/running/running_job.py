"""Run one job and keep its result; what goes wrong is an outcome, too."""

import socket
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from msgspec.structs import replace

from calib_core.errors import CalibrationError
from cocalib.batch.inputs import all_reached, inputs_of, state_of
from cocalib.batch.job import Job
from cocalib.batch.outcome import Outcome, OutcomeRun, outcome_text
from cocalib.batch.results_folder import LOG_FILE, OUTCOME_FILE, ResultsFolder, listed_files
from cocalib.batch.running.attempting import Failure
from cocalib.batch.running.outcome_of import failed, outcome_of
from cocalib.batch.running.steps import run_steps


def run_job(job: Job, results: Path) -> Outcome:
    """Run a job and keep its result under its digest.

    Two outcomes are not kept: that an input is no longer what the digest was made of, and that the result cannot be written.

    Args:
        job: to be run.
        results: the folder of results.
    """
    begin_s, started = time.monotonic(), datetime.now(UTC).isoformat(timespec="seconds")

    def run() -> OutcomeRun:
        return OutcomeRun(socket.gethostname(), started, round(time.monotonic() - begin_s, 3))

    inputs = inputs_of(job.row)
    state = state_of(inputs)
    if job.state in ("", state):
        result = run_steps(job.row)
        outcome = outcome_of(job, result)
        if not all_reached(inputs):
            outcome = replace(outcome, is_final=False)
        if state_of(inputs) == state:
            log = "\n\n".join(result.log)
            files = {**result.files, **({LOG_FILE: log.encode(errors="backslashreplace")} if log else {})}
            return _kept(replace(outcome, run=run()), files, job, results)
    return replace(failed(job, _changed(job)), run=run())


def _kept(outcome: Outcome, files: Mapping[str, bytes], job: Job, results: Path) -> Outcome:
    """Write the result; return its outcome with the files listed, or that it cannot be written."""
    try:
        with ResultsFolder(results).writing(job.digest) as folder:
            for name, data in files.items():
                path = folder / name
                path.parent.mkdir(exist_ok=True)
                path.write_bytes(data)
            outcome = replace(outcome, files=listed_files(folder))
            (folder / OUTCOME_FILE).write_text(outcome_text(outcome), encoding="utf-8")
    except (OSError, CalibrationError) as error:
        return replace(failed(job, _unwritten(results, error)), run=outcome.run)
    return outcome


def _changed(job: Job) -> Failure:
    return Failure(
        f"{job.row.name}: an input changed after the batch was started, so nothing is kept",
        "run the batch again once the files are complete",
    )


def _unwritten(results: Path, error: OSError | CalibrationError) -> Failure:
    return Failure(
        f"{results}: the result cannot be written: {getattr(error, 'strerror', None) or error}",
        "make room, or name another folder with --out, and run the batch again: what is done is kept",
    )
