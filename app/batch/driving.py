"""Drive a batch: skip what is done, run the rest on an engine, and tell how far it is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from app.batch.engines.engine import Engine
from app.batch.job import Job
from app.batch.outcome import Outcome
from app.batch.results_folder import ResultsFolder

__all__ = ["BatchProgress", "drive"]


@dataclass(frozen=True, slots=True)
class BatchProgress:
    """How far a batch is.

    Attributes:
        done: jobs with an outcome, those of earlier runs included.
        count: of all jobs.
        latest: what came last; None at the beginning.
    """

    done: int
    count: int
    latest: Outcome | None = None


def drive(
    jobs: Sequence[Job],
    engine: Engine,
    results: ResultsFolder,
    progress: Callable[[BatchProgress], None] = lambda _: None,
) -> tuple[Outcome, ...]:
    """Return an outcome for each job, in their order; only jobs without one are run.

    Args:
        jobs: of the manifest, or of a shard of it.
        engine: runs them.
        results: where results lie.
        progress: called at the beginning and after each job.
    """
    found = {job.digest: kept for job in jobs if (kept := results.outcome(job.digest)) is not None}
    progress(BatchProgress(len(found), len(jobs)))
    left = [job for job in jobs if job.digest not in found]
    for outcome in engine.run(left, results.path):
        found[outcome.digest] = outcome
        progress(BatchProgress(len(found), len(jobs), outcome))
    return tuple(found[job.digest] for job in jobs)
