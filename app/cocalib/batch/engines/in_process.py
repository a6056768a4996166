"""The engine without workers: one call after the other, in this process."""

from collections.abc import Callable, Generator, Sequence
from typing import Any, TypeVar

from cocalib.batch.engines.engine import own_temporary_folder, workers_died

_Found = TypeVar("_Found")


class InProcess:
    """Runs calls in this process, in order."""

    def run_all(
        self,
        function: Callable[..., _Found],
        arguments: Sequence[tuple[Any, ...]],
        if_died: Callable[[int], _Found] = workers_died,
    ) -> Generator[tuple[int, _Found], None, None]:
        """Call a function with each of the arguments, in order."""
        with own_temporary_folder():
            for number, given in enumerate(arguments):
                yield number, function(*given)
