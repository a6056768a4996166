"""Drive a batch: skip what is done, run the rest on an engine, and tell how far it is and how long it will take."""

import os
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

from calib_core.errors import InputError, OptionError
from cocalib.batch.dask_scheduler import DaskScheduler, checked_address
from cocalib.batch.engine import Engine, InProcess
from cocalib.batch.job import Job
from cocalib.batch.outcome import Outcome
from cocalib.batch.results_folder import ResultsFolder
from cocalib.batch.running_job import failed_outcome, run_once
from cocalib.batch.worker_processes import WorkerProcesses

_SMALL = 8
"""Fewer jobs than this are not worth the seconds that workers take to start."""
_FEWEST_TIMED = 3
"""Finished jobs from which the time left can be told."""
_DIED = "every worker that ran this job died of it or was killed"
_DIED_HINT = (
    "the most frequent cause is memory: run it with fewer --workers, or with --workers 1 to see it; "
    "delete its folder in results/ to try it again"
)


@dataclass(frozen=True, slots=True)
class BatchProgress:
    """How far a batch is.

    Attributes:
        done: jobs with an outcome, those of earlier runs included.
        count: of all jobs.
        latest: what came last; None at the beginning.
        left_s: how long the rest will take if it goes on like that [s]; None while too few have finished to tell.
    """

    done: int
    count: int
    latest: Outcome | None = None
    left_s: float | None = None


def drive(
    jobs: Sequence[Job],
    engine: Engine,
    results: ResultsFolder,
    progress: Callable[[BatchProgress], None] = lambda _: None,
    clock_s: Callable[[], float] = time.monotonic,
) -> tuple[Outcome, ...]:
    """Return an outcome for each job, in their order; only jobs without one are run, and equal ones once.

    Args:
        jobs: of the manifest.
        engine: runs them.
        results: where results lie.
        progress: called at the beginning and after each job.
        clock_s: tells the time [s].

    Raises:
        InputError: the engine cannot be used, or a result cannot be written.
        CalibrationError: a result has something else than regular files; it was neither read nor changed.
    """
    results.remove_leftovers()
    times = Counter(job.digest for job in jobs)
    found = {digest: kept for digest in times if (kept := results.outcome(digest)) is not None}
    done = sum(times[digest] for digest in found)
    progress(BatchProgress(done, len(jobs), left_s=0.0 if done == len(jobs) else None))
    left = tuple({job.digest: job for job in jobs if job.digest not in found}.values())
    begin_s = clock_s()
    folder = results.path.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    calls = [(job, folder) for job in left]

    def died(number: int) -> Outcome:
        return failed_outcome(left[number], folder, reason=_DIED, hint=_DIED_HINT)

    try:
        with closing(engine.run_all(run_once, calls, died)) as outcomes:
            for finished, (_, outcome) in enumerate(outcomes, start=1):
                found[outcome.digest] = outcome
                done += times[outcome.digest]
                left_s = _left_s(clock_s() - begin_s, finished, len(left) - finished)
                progress(BatchProgress(done, len(jobs), outcome, left_s))
    finally:
        results.remove_leftovers()
    return tuple(found[job.digest] for job in jobs)


def chosen_engine(
    count: int,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> Engine:
    """Return what runs the jobs.

    Args:
        count: of the jobs.
        workers: processes on this machine; 1 for this process; None for one per processor, if there are many jobs.
        scheduler: address of a scheduler of Dask; None to use this machine.
        tell: called, once, if worker processes of this machine died.

    Raises:
        InputError: the flags do not go together.
        OptionError: there cannot be so many workers.
    """
    if workers is not None and scheduler is not None:
        raise InputError(
            f"--workers {workers} and --scheduler {scheduler}: give one of them; the scheduler has its own workers"
        )
    if scheduler is not None:
        return DaskScheduler(checked_address(scheduler))
    if workers is not None and workers < 1:
        raise OptionError(f"--workers {workers}: there must be at least 1")
    chosen = workers or ((os.cpu_count() or 1) if count >= _SMALL else 1)
    return WorkerProcesses(chosen, tell) if chosen > 1 else InProcess()


def _left_s(passed_s: float, finished: int, left: int) -> float | None:
    """Tell the time left [s] from the jobs that finished since the beginning; None while they are too few."""
    if left == 0:
        return 0.0
    return passed_s / finished * left if finished >= _FEWEST_TIMED else None
