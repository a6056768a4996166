"""The engine Dask: jobs run in the worker processes of a cluster, one that is started here or one that exists."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from app.batch.job import Job
from app.batch.outcome import Outcome
from app.batch.running import run_job
from calib_core.errors import InputError

__all__ = ["DaskCluster"]

_RETRIES = 1


@dataclass(frozen=True, slots=True)
class DaskCluster:
    """Runs jobs with Dask.

    Attributes:
        workers: processes on this machine; None if there is a scheduler.
        scheduler: address of a scheduler that exists; None to start a cluster on this machine.
    """

    workers: int | None = None
    scheduler: str | None = None

    def run(self, jobs: Sequence[Job], results: Path) -> Iterator[Outcome]:
        """Run each job once; Dask gives the job of a worker that died to another one.

        Raises:
            InputError: Dask is not installed.
        """
        try:
            from distributed import Client, LocalCluster, as_completed
        except ImportError:
            raise InputError("Dask is not installed; install cocalib[fleet], or use --engine none") from None
        if not jobs:
            return
        where: str | LocalCluster = self.scheduler or LocalCluster(
            n_workers=self.workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
        )
        with Client(where) as client:
            futures = [client.submit(run_job, job, results, key=job.digest, retries=_RETRIES) for job in jobs]
            for future in as_completed(futures):
                yield future.result()
