"""The engine Dask: jobs run in the worker processes of a cluster, one that is started here or one that exists."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from calib_core.errors import InputError
from cocalib.batch.engines.dask_calls import Call, Died, finished_calls
from cocalib.batch.engines.dask_connection import connected
from cocalib.batch.engines.one_job import failed_outcome
from cocalib.batch.engines.worker_side import call, run_in_worker
from cocalib.batch.job import Job
from cocalib.batch.outcome import Outcome
from cocalib.platform.resources import version

_Found = TypeVar("_Found")
_DIED = "every worker that ran this job died of it or was killed"
_DIED_HINT = (
    "the most frequent cause is memory: run it with fewer --workers, or with --engine none to see it; "
    "delete its folder in results/ to try it again"
)


@dataclass(frozen=True, slots=True)
class DaskCluster:
    """Runs jobs with Dask.

    Attributes:
        workers: processes on this machine; None if there is a scheduler, or for one per processor.
        scheduler: address of a scheduler that exists; None to start a cluster on this machine.
    """

    workers: int | None = None
    scheduler: str | None = None

    def run(self, jobs: Sequence[Job], results: Path) -> Iterator[Outcome]:
        """Run each job once; Dask gives the job of a worker that died to another one.

        A job is given up when its workers died again and again, also while nothing else ran; the others go on.

        Raises:
            InputError: Dask is not installed, the scheduler cannot be used, or a worker cannot do any job.
        """
        if not jobs:
            return
        shared = results.resolve()
        shared.mkdir(parents=True, exist_ok=True)
        calls = [Call(number, run_in_worker, (job, shared, version())) for number, job in enumerate(jobs)]
        with connected(self.workers, self.scheduler) as cluster:
            for number, found in finished_calls(cluster, calls):
                job = jobs[number]
                yield failed_outcome(job, shared, reason=_DIED, hint=_DIED_HINT) if found is Died.AGAIN else found

    def run_all(
        self, function: Callable[..., _Found], arguments: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, _Found]]:
        """Call a function with each of the arguments; its exceptions are raised here.

        Raises:
            InputError: Dask is not installed, the scheduler cannot be used, or workers died of a call.
        """
        if not arguments:
            return
        calls = [Call(number, call, (function, *given)) for number, given in enumerate(arguments)]
        with connected(self.workers, self.scheduler) as cluster:
            for number, found in finished_calls(cluster, calls):
                if found is Died.AGAIN:
                    raise InputError(f"call {number} of {function.__name__}: {_DIED}; use fewer workers")
                yield number, found
