"""Calls and jobs for engines: they end at once, never end, or end their worker."""

import os
import signal
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

from cocalib.batch.job import Job
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.outcome import Outcome, read_outcome
from cocalib.batch.results_folder import OUTCOME_FILE, ResultsFolder


def quick_jobs(folder: Path, count: int) -> tuple[Job, ...]:
    """Return jobs that fail at once and for good, because their recordings are none, each in words of its own."""
    for number in range(count):
        (folder / f"{number}.bag").write_bytes(b"not a recording")
    rows = [ManifestRow(f"v{number:03d}", "s1", (folder / f"{number}.bag",)) for number in range(count)]
    return tuple(Job(row, f"{number:032x}") for number, row in enumerate(rows))


def written(results: Path, digest: str) -> Outcome:
    """Return the outcome that lies in the results, also one that a rerun does not take."""
    return read_outcome((ResultsFolder(results).folder_of(digest) / OUTCOME_FILE).read_text(encoding="utf-8"))


def squared(number: int) -> int:
    """Return the square."""
    return number * number


def failing(*given: object) -> int:
    """Raise what a function may raise."""
    raise ValueError(f"not {given[0]}")


def temporary_file(_: int) -> str:
    """Leave a temporary file, as a call that is killed does; return its path."""
    descriptor, path = tempfile.mkstemp()
    os.close(descriptor)
    return path


def dying(folder: str, name: str, times: int) -> str:
    """Kill this worker the first so many times, then return the name; each run leaves a file."""
    before = attempts(Path(folder), name)
    (Path(folder) / f"{name}.{before}").touch()
    if before < times:
        os.kill(os.getpid(), signal.SIGKILL)
    return name


def dying_job(job: Job, results: Path) -> Outcome:
    """Kill this worker whenever it runs the job of vehicle v001, as one that needs too much memory does."""
    from cocalib.batch.running_job import run_once

    (results / f"{job.row.vehicle}.{attempts(results, job.row.vehicle)}").touch()
    if job.row.vehicle == "v001":
        os.kill(os.getpid(), signal.SIGKILL)
    return run_once(job, results)


def dying_start(*given: Any) -> None:
    """Work as a worker does, except that the first two are killed while they start; DYING_START names where they leave a file."""
    from cocalib.batch.worker_processes import _work

    dying(os.environ["DYING_START"], "start", 2)
    _work(*given)


def attempts(folder: Path, name: str) -> int:
    """Return how often a call was begun."""
    return len(list(folder.glob(f"{name}.*")))


def endless(number: int) -> int:
    """Say on stdout that it runs, and never return; 0 returns at once."""
    if number:
        sys.stdout.write(f"running {number}\n")
        sys.stdout.flush()
        threading.Event().wait()
    return number
