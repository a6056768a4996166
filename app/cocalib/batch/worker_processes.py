"""Worker processes on this machine. Each has a pipe of its own to this process; nothing listens on a port or a socket."""

import multiprocessing
import os
import signal
import sys
import tempfile
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from calib_core.errors import InputError
from cocalib.batch.engine import Call, own_temporary_folder, workers_died

_Found = TypeVar("_Found")
_PROCESSES = multiprocessing.get_context("spawn")  # a forked child would share locks of our threads
_MOST_FAILED_STARTS = 10
_MOST_KILLED_STARTS = 100
"""Whoever kills workers may hit new ones several times in a row, above all on a busy machine."""
_END_S = 5.0
"""A worker whose pipe is closed ends at once."""


@dataclass(frozen=True, slots=True)
class WorkerProcesses:
    """Runs calls on worker processes.

    A worker that dies costs its own call one more run, after all others; one whose workers died twice has its last run alone, as
    workers may be killed for memory that others took.

    Attributes:
        count: of the processes.
        tell: called at the end, once, if workers died.
    """

    count: int
    tell: Callable[[str], None] = field(default=lambda _: None, compare=False)

    def run_all(
        self,
        function: Callable[..., _Found],
        arguments: Sequence[tuple[Any, ...]],
        if_died: Callable[[int], _Found] = workers_died,
    ) -> Generator[tuple[int, _Found], None, None]:
        """Call a function with each of the arguments; no worker is left afterwards.

        Raises:
            InputError: no worker process starts.
        """
        calls = [Call(number, given) for number, given in enumerate(arguments)]
        with own_temporary_folder(), _Workers(function) as workers:
            again: set[int] = set()
            for room in (self.count, self.count, 1):
                died: list[Call] = []
                yield from workers.run(calls, room, died)
                calls = died
                again |= {call.number for call in died}
        if again:
            jobs = "1 job was" if len(again) == 1 else f"{len(again)} jobs were"
            self.tell(f"worker processes died or were killed, often for memory; {jobs} run again")
        for call in calls:
            yield call.number, if_died(call.number)


class _Ready:
    """What a worker says when it has started."""


@dataclass(frozen=True, slots=True)
class _Raised:
    """What a call raised."""

    error: BaseException


class _Worker:
    """A process with our end of its pipe, and the call that it runs."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.pipe, theirs = _PROCESSES.Pipe()
        self.process = _PROCESSES.Process(
            target=_work, args=(theirs, function, tempfile.gettempdir()), name="cocalib-worker", daemon=True
        )
        with _no_interrupt_inherited():
            self.process.start()
        theirs.close()
        self.is_ready = False
        self.call: Call | None = None

    def begin(self, call: Call) -> None:
        self.call = call
        with suppress(OSError):  # it has just died: its pipe says so next
            self.pipe.send(call.arguments)

    def end(self) -> None:
        self.process.kill()
        self.process.join()
        self.pipe.close()


class _Workers:
    """The workers that run one function; they start when there is something for them to do."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function
        self._workers: dict[Connection, _Worker] = {}
        self._failed_starts = self._killed_starts = 0

    def __enter__(self) -> "_Workers":
        return self

    def __exit__(self, *_: object) -> None:
        for worker in self._workers.values():
            worker.end()

    def run(self, calls: Sequence[Call], room: int, died: list[Call]) -> Iterator[tuple[int, Any]]:
        """Run calls, at most `room` at once, and yield the number and the result of each as it finishes.

        Args:
            calls: to be run.
            room: number of workers that are busy at most.
            died: takes the calls whose worker died.

        Raises:
            InputError: no worker starts.
        """
        waiting = deque(calls)
        while waiting or self._busy():
            self._fill(waiting, room)
            for pipe in wait(list(self._workers)):
                assert isinstance(pipe, Connection)
                worker = self._workers[pipe]
                call = worker.call
                try:
                    found = pipe.recv()
                except (EOFError, OSError):
                    self._bury(worker)
                    died += [call] if call is not None else []
                    continue
                worker.is_ready, worker.call = True, None
                if isinstance(found, _Raised):
                    raise found.error
                if call is not None:
                    self._fill(waiting, room)
                    yield call.number, found
                else:
                    self._failed_starts = self._killed_starts = 0

    def _busy(self) -> int:
        return sum(worker.call is not None for worker in self._workers.values())

    def _fill(self, waiting: deque[Call], room: int) -> None:
        """Give workers calls, and start those that are missing."""
        for worker in self._workers.values():
            if waiting and worker.is_ready and worker.call is None and self._busy() < room:
                worker.begin(waiting.popleft())
        for _ in range(min(room, self._busy() + len(waiting)) - len(self._workers)):
            worker = _Worker(self._function)
            self._workers[worker.pipe] = worker

    def _bury(self, worker: _Worker) -> None:
        """Forget a worker that died.

        Raises:
            InputError: so did those before it, all without a call.
        """
        del self._workers[worker.pipe]
        worker.process.join(_END_S)
        was_killed = (worker.process.exitcode or 0) < 0
        worker.end()
        if worker.call is None:
            self._failed_starts += not was_killed
            self._killed_starts += was_killed
            if self._failed_starts >= _MOST_FAILED_STARTS or self._killed_starts >= _MOST_KILLED_STARTS:
                raise InputError("worker processes end as soon as they start; use --workers 1, which needs none")


def _work(pipe: Connection, function: Callable[..., Any], temporary: str) -> None:
    """Run calls until the driver ends; what runs in a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the driver hears Ctrl+C, and kills us
    threading.Thread(target=_end_with_driver, daemon=True).start()
    tempfile.tempdir = temporary
    import cv2

    cv2.setNumThreads(1)  # each processor has a worker of its own
    pipe.send(_Ready())
    while True:
        try:
            arguments = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            found = function(*arguments)
        except BaseException as error:
            pipe.send(_Raised(error))
            raise SystemExit(1) from error
        pipe.send(found)


def _end_with_driver() -> None:
    """End this process, whatever it does, as soon as the driver has ended, however that happened."""
    driver = multiprocessing.parent_process()
    assert driver is not None
    driver.join()
    os._exit(1)


@contextmanager
def _no_interrupt_inherited() -> Iterator[None]:
    """Block SIGINT meanwhile, so that a child begins with it blocked; one that comes is heard afterwards."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
