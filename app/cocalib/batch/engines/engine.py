"""What an engine is: it runs jobs somewhere and returns their outcomes as they come."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

from cocalib.batch.job import Job
from cocalib.batch.outcome import Outcome

_Found = TypeVar("_Found")


class Engine(Protocol):
    """Runs jobs. Results lie in a folder that all workers reach; outcomes come back in any order."""

    def run(self, jobs: Sequence[Job], results: Path) -> Iterator[Outcome]:
        """Run each job once; a worker that dies costs its job one more run.

        Args:
            jobs: to be run; no two have the same digest.
            results: the folder of results.

        Raises:
            InputError: the engine cannot be used, or the results cannot be written.
        """
        ...

    def run_all(
        self, function: Callable[..., _Found], arguments: Sequence[tuple[Any, ...]]
    ) -> Iterator[tuple[int, _Found]]:
        """Call a function with each of the arguments; yield the number of the arguments and what it returned.

        Args:
            function: of a module, so that every worker can import it.
            arguments: of each call.

        Raises:
            InputError: the engine cannot be used, or workers died of a call.
        """
        ...
