"""The engine Dask: calls run in the workers of a scheduler that the user started."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from cocalib.batch.engines.dask_calls import Call, Died, finished_calls
from cocalib.batch.engines.dask_connection import connected
from cocalib.batch.engines.engine import workers_died
from cocalib.batch.engines.worker_side import call
from cocalib.platform.resources import version

_Found = TypeVar("_Found")


@dataclass(frozen=True, slots=True)
class DaskScheduler:
    """Runs calls with Dask, which gives the call of a worker that died to another one.

    Attributes:
        address: of the scheduler.
    """

    address: str

    def run_all(
        self,
        function: Callable[..., _Found],
        arguments: Sequence[tuple[Any, ...]],
        if_died: Callable[[int], _Found] = workers_died,
    ) -> Generator[tuple[int, _Found], None, None]:
        """Call a function with each of the arguments; what it raises is raised here.

        A call is given up when its workers died again and again, also while nothing else ran; the others go on.

        Raises:
            InputError: Dask is not installed, the scheduler cannot be used, or a worker cannot do any call.
        """
        if not arguments:
            return
        calls = [Call(number, call, (version(), function, *given)) for number, given in enumerate(arguments)]
        with connected(self.address) as connection:
            for number, found in finished_calls(connection, calls):
                yield number, if_died(number) if found is Died.AGAIN else found
