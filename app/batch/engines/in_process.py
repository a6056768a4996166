"""The engine `none`: one job after the other, in this process."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from app.batch.job import Job
from app.batch.outcome import Outcome
from app.batch.running import run_job

__all__ = ["InProcess"]


class InProcess:
    """Runs jobs in this process."""

    def run(self, jobs: Sequence[Job], results: Path) -> Iterator[Outcome]:
        """Run each job, in order."""
        for job in jobs:
            yield run_job(job, results)
