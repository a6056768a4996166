"""The engine `none`: one job after the other, in this process."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from cocalib.batch.engines.one_job import run_once
from cocalib.batch.job import Job
from cocalib.batch.outcome import Outcome

_Found = TypeVar("_Found")


class InProcess:
    """Runs jobs in this process."""

    def run(self, jobs: Sequence[Job], results: Path) -> Iterator[Outcome]:
        """Run each job, in order."""
        for job in jobs:
            yield run_once(job, results)

    def run_all(
        self, function: Callable[..., _Found], arguments: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, _Found]]:
        """Call a function with each of the arguments, in order."""
        for number, given in enumerate(arguments):
            yield number, function(*given)
