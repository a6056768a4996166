"""Drive a batch: skip what is done, run the rest on an engine, and tell how far it is and how long it will take."""

import os
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Literal, TypeAlias

from calib_core.errors import InputError, OptionError
from cocalib.batch.engines.dask_cluster import DaskCluster
from cocalib.batch.engines.engine import Engine
from cocalib.batch.engines.in_process import InProcess
from cocalib.batch.job import Job
from cocalib.batch.outcome import Outcome
from cocalib.batch.results_folder import ResultsFolder

EngineName: TypeAlias = Literal["dask", "none"]

_SMALL = 8
"""Fewer jobs than this are not worth the seconds that a cluster takes to start."""
_FEWEST_TIMED = 3
"""Finished jobs from which the time left can be told."""


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
        jobs: of the manifest, or of a shard of it.
        engine: runs them.
        results: where results lie.
        progress: called at the beginning and after each job.
        clock_s: tells the time [s].

    Raises:
        InputError: the engine cannot be used, or a result cannot be written.
    """
    times = Counter(job.digest for job in jobs)
    found = {digest: kept for digest in times if (kept := results.outcome(digest)) is not None}
    done = sum(times[digest] for digest in found)
    progress(BatchProgress(done, len(jobs), left_s=0.0 if done == len(jobs) else None))
    left = {job.digest: job for job in jobs if job.digest not in found}
    begin_s, finished = clock_s(), 0
    for outcome in engine.run(tuple(left.values()), results.path):
        found[outcome.digest] = outcome
        done, finished = done + times[outcome.digest], finished + 1
        left_s = _left_s(clock_s() - begin_s, finished, len(left) - finished)
        progress(BatchProgress(done, len(jobs), outcome, left_s))
    return tuple(found[job.digest] for job in jobs)


def shard_of(jobs: Sequence[Job], k: int, n: int) -> tuple[Job, ...]:
    """Return the k-th of n parts of the jobs: the n parts have all jobs, none has one of another's, all are equally large.

    Which part a job is in depends on the digests of the jobs only. Equal jobs are in one part, and count once.

    Args:
        jobs: of the whole manifest.
        k: number of the part, from 1.
        n: number of parts.

    Raises:
        OptionError: there is no such part.
    """
    if n < 1 or not 1 <= k <= n:
        raise OptionError(f"--shard {k}/{n}: there is no such part; write 1/{max(n, 1)} to {max(n, 1)}/{max(n, 1)}")
    mine = set(sorted({job.digest for job in jobs})[k - 1 :: n])
    return tuple(job for job in jobs if job.digest in mine)


def chosen_engine(
    count: int, *, engine: EngineName | None = None, workers: int | None = None, scheduler: str | None = None
) -> Engine:
    """Return the engine that was asked for; by default a cluster on this machine where that saves time.

    Args:
        count: of the jobs that are to be run.
        engine: by name; None for the one that fits.
        workers: processes on this machine; None if nobody said.
        scheduler: address of a scheduler that exists; None for none.

    Raises:
        InputError: the flags do not go together.
        OptionError: there cannot be so many workers.
    """
    if workers is not None and scheduler is not None:
        raise InputError(
            f"--workers {workers} and --scheduler {scheduler}: give one of them; the scheduler has its own workers"
        )
    if engine == "none" and (workers is not None or scheduler is not None):
        raise InputError("--engine none runs in this process; leave out --workers and --scheduler, or --engine none")
    if workers is not None and workers < 1:
        raise OptionError(f"--workers {workers}: there must be at least 1")
    asked = engine == "dask" or workers is not None or scheduler is not None
    several = count >= _SMALL and (os.cpu_count() or 1) > 1 and find_spec("distributed") is not None
    if asked or (engine is None and several):
        return DaskCluster(workers, scheduler)
    return InProcess()


def _left_s(passed_s: float, finished: int, left: int) -> float | None:
    """Tell the time left [s] from the jobs that finished since the beginning; None while they are too few."""
    if left == 0:
        return 0.0
    return passed_s / finished * left if finished >= _FEWEST_TIMED else None
