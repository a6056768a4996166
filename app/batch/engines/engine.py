"""What an engine is: it runs jobs somewhere and returns their outcomes as they come."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

from app.batch.job import Job
from app.batch.outcome import Outcome

__all__ = ["Engine"]


class Engine(Protocol):
    """Runs jobs. Results lie in a folder that all workers reach; outcomes come back in any order."""

    def run(self, jobs: Sequence[Job], results: Path) -> Iterator[Outcome]:
        """Run each job once; a worker that dies costs its job one more run.

        Args:
            jobs: to be run.
            results: the folder of results.
        """
        ...
