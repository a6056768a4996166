"""Calls that run on a cluster: no more at once than it has threads, and those that workers died of once more, alone."""

import enum
import secrets
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass
from itertools import islice
from typing import Any

from calib_core.errors import InputError
from cocalib.batch.engines.dask_connection import Connection


class Died(enum.Enum):
    """What comes of a call instead of a result."""

    AGAIN = "its workers died, also when it ran alone"


@dataclass(frozen=True, slots=True)
class Call:
    """A function and its arguments.

    Attributes:
        number: of the call.
        function: that every worker can import.
        arguments: that can be pickled.
    """

    number: int
    function: Callable[..., Any]
    arguments: tuple[Any, ...]


def finished_calls(cluster: Connection, calls: Sequence[Call]) -> Iterator[tuple[int, Any]]:
    """Yield the number and the result of each call as it finishes; what it raises is raised here.

    A worker may be killed for reasons that no call is to blame for. So a call whose workers died as often as the scheduler
    allows is put aside, and runs once more when all others are done and it is alone. If its worker dies then as well, its
    result is `Died.AGAIN`.

    Raises:
        InputError: the scheduler is gone.
    """
    aside: list[Call] = []
    for call, found in _round(cluster, calls, cluster.threads):
        if found is Died.AGAIN:
            aside.append(call)
        else:
            yield call.number, found
    for call, found in _round(cluster, aside, lambda: 1):
        yield call.number, found


def _round(cluster: Connection, calls: Sequence[Call], room: Callable[[], int]) -> Iterator[tuple[Call, Any]]:
    """Run calls, as many at a time as there is room for, and yield them as they finish.

    More than one per thread would make jobs of seconds no faster, but the scheduler counts a worker's death against
    those that only waited for it, and holds them all in memory.
    """
    running, waiting = _Running(cluster), iter(calls)
    for call in islice(waiting, room()):
        running.begin(call)
    while running:
        finished = running.next()
        for call in islice(waiting, max(0, room() - len(running))):
            running.begin(call)
        yield finished


class _Running:
    """The calls that the cluster has."""

    def __init__(self, cluster: Connection) -> None:
        from distributed import as_completed

        self._cluster = cluster
        self._calls: dict[str, Call] = {}
        self._finished = as_completed(loop=cluster.client.loop)
        self._prefix = f"cocalib-{secrets.token_hex(4)}"  # a scheduler remembers calls by their keys

    def __len__(self) -> int:
        return len(self._calls)

    def begin(self, call: Call) -> None:
        key = f"{self._prefix}-{call.number}"
        self._calls[key] = call
        self._finished.add(self._cluster.client.submit(call.function, *call.arguments, key=key, pure=False))

    def next(self) -> tuple[Call, Any]:
        """Wait for a call to finish and return it with its result."""
        from distributed import KilledWorker

        future = next(self._finished)
        call = self._calls.pop(future.key)
        try:
            return call, future.result()
        except KilledWorker:
            return call, Died.AGAIN
        except CancelledError:
            raise InputError(
                f"{self._cluster.name} stopped answering in the middle; what is done is kept: start it again, "
                "and then the same command"
            ) from None
