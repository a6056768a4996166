"""Calls on a Dask cluster that the user started: no more at once than it has threads, on workers that run this version."""

import asyncio
import enum
import logging
import secrets
import ssl
import sys
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit

from calib_core.errors import InputError
from cocalib.batch.engine import Call, workers_died
from cocalib.platform.loopback import is_loopback
from cocalib.platform.resources import version

if TYPE_CHECKING:
    from distributed import Client

_Found = TypeVar("_Found")
_PATIENCE_S = 5
_COUNTED_EVERY_S = 1.0
_LOGGERS = ("distributed", "distributed.client", "distributed.worker", "tornado", "tornado.application", "asyncio")
_SETTINGS: dict[str, Any] = {
    "distributed.comm.timeouts.connect": f"{_PATIENCE_S}s",
}
_RESTART_S = 90
"""How long workers that were killed may take to start again on a busy machine."""


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
        calls = [Call(number, (version(), function, *given)) for number, given in enumerate(arguments)]
        with _connected(self.address) as connection:
            for number, found in _finished_calls(connection, calls):
                yield number, if_died(number) if found is _Died.AGAIN else found


class _Connection:
    """A client of a scheduler.

    Attributes:
        client: of Dask.
        name: of the scheduler, for people.
    """

    def __init__(self, client: "Client", name: str) -> None:
        self.client, self.name = client, name
        self._threads, self._counted_s = 0, -_COUNTED_EVERY_S

    def threads(self) -> int:
        """Return how many calls can run at once; workers come and go, so that is counted every few seconds.

        Raises:
            InputError: the scheduler is gone.
        """
        if time.monotonic() - self._counted_s >= _COUNTED_EVERY_S:
            try:
                self._threads = sum(self.client.nthreads().values())
            except OSError:
                raise InputError(
                    f"{self.name} stopped answering; what is done is kept: start the same command again"
                ) from None
            self._counted_s = time.monotonic()
        return max(1, self._threads)


@contextmanager
def _connected(address: str) -> Iterator[_Connection]:
    """Connect to a scheduler and check its workers.

    Args:
        address: of the scheduler.

    Raises:
        InputError: Dask is not installed, or the scheduler cannot be used.
    """
    try:
        import dask
        from distributed import Client
    except ImportError:
        raise InputError("Dask is not installed; install cocalib[cluster], or leave out --scheduler") from None
    with _quiet(), dask.config.set(_SETTINGS):
        try:
            asyncio.run(_greet(address))
            client = Client(address, timeout=_PATIENCE_S, set_as_default=False)
        except (ssl.SSLError, TypeError, RuntimeError, FileNotFoundError) as error:
            raise InputError(
                f"--scheduler {address}: no connection with TLS, because certificates are missing or refused ({error}); name "
                "their files in DASK_DISTRIBUTED__COMM__TLS__CA_FILE, DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT and "
                "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY"
            ) from error
        except (OSError, TimeoutError) as error:
            raise InputError(
                f"--scheduler {address}: no Dask scheduler answers there within {_PATIENCE_S} s; start one with "
                "`dask scheduler --host 127.0.0.1`, or leave the option out to use this machine only"
            ) from error
        with client:
            _check_workers(client, address, _PATIENCE_S)
            yield _Connection(client, f"the scheduler at {address}")


async def _greet(address: str) -> None:
    """Connect and disconnect in time; a client would wait forever for something that accepts and says nothing."""
    from distributed import Security
    from distributed.comm.core import connect

    arguments = Security().get_connection_args("client")
    greeting = await asyncio.wait_for(connect(address, timeout=_PATIENCE_S, **arguments), _PATIENCE_S)
    await greeting.close()


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask from logging what comes back as an outcome or an error."""
    loggers = [logging.getLogger(name) for name in _LOGGERS]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


class _Died(enum.Enum):
    """What comes of a call instead of a result."""

    AGAIN = "its workers died, also when it ran alone"


def _finished_calls(cluster: _Connection, calls: Sequence[Call]) -> Iterator[tuple[int, Any]]:
    """Yield the number and the result of each call as it finishes; what it raises is raised here.

    A worker may be killed for reasons that no call is to blame for. So a call whose workers died as often as the scheduler
    allows is put aside, and runs once more when all others are done and it is alone. If its worker dies then as well, its
    result is `_Died.AGAIN`.

    Raises:
        InputError: the scheduler is gone.
    """
    aside: list[Call] = []
    for call, found in _round(cluster, calls, cluster.threads):
        if found is _Died.AGAIN:
            aside.append(call)
        else:
            yield call.number, found
    for call, found in _round(cluster, aside, lambda: 1):
        yield call.number, found


def _round(cluster: _Connection, calls: Sequence[Call], room: Callable[[], int]) -> Iterator[tuple[Call, Any]]:
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

    def __init__(self, cluster: _Connection) -> None:
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
        self._finished.add(self._cluster.client.submit(_call_in_worker, *call.arguments, key=key, pure=False))

    def next(self) -> tuple[Call, Any]:
        """Wait for a call to finish and return it with its result."""
        from distributed import KilledWorker

        future = next(self._finished)
        call = self._calls.pop(future.key)
        try:
            return call, future.result()
        except KilledWorker:
            return call, _Died.AGAIN
        except CancelledError:
            raise InputError(
                f"{self._cluster.name} stopped answering in the middle; what is done is kept: start it again, "
                "and then the same command"
            ) from None


def checked_address(address: str) -> str:
    """Return the address of a scheduler if it is safe to connect to.

    Args:
        address: such as tcp://127.0.0.1:8786 or tls://scheduler.example:8786.

    Raises:
        InputError: it is no such address, or others on the network could send this process code to run.
    """
    try:
        parts = urlsplit(address)
        scheme, host, port = parts.scheme, parts.hostname, parts.port
    except ValueError:
        scheme, host, port = "", None, None
    if scheme not in ("tcp", "tls") or not host or not port or parts.path or parts.query or parts.username:
        raise InputError(
            f"--scheduler {address}: not an address of a Dask scheduler; "
            "write tcp://127.0.0.1:8786 for one on this machine, or tls://HOST:8786"
        )
    if scheme == "tcp" and not is_loopback(host):
        raise InputError(
            f"--scheduler {address}: another machine without TLS is refused, because whoever can reach an open Dask port "
            "can run code on every machine of the cluster; start the scheduler and its workers with certificates and write "
            f"tls://{host}:{port}, or start a batch of its own on each machine"
        )
    return address


def _check_workers(client: "Client", address: str, patience_s: float) -> None:
    """Check that there are workers, and that they run this version of Dask and of cocalib.

    Args:
        client: connected to the scheduler.
        address: of the scheduler.
        patience_s: how long to wait for the first worker before saying that it goes on [s].

    Raises:
        InputError: what is wrong, and what to do.
    """
    if not _has_worker(client, patience_s):
        print(f"{address} has no workers; waiting {_RESTART_S} s more for one to start", file=sys.stderr, flush=True)
        if not _has_worker(client, _RESTART_S):
            raise InputError(
                f"--scheduler {address}: it has no workers; start some with `dask worker {address} --nthreads 1 "
                "--death-timeout 60`"
            )
    versions: Any = client.get_versions()
    trouble = dask_trouble(versions) or version_trouble(version(), client.run(_worker_version, on_error="return"))
    if trouble:
        raise InputError(f"--scheduler {address}: {trouble}")


def _has_worker(client: "Client", patience_s: float) -> bool:
    try:
        client.wait_for_workers(1, timeout=patience_s)
    except TimeoutError:
        return False
    return True


def dask_trouble(versions: Mapping[str, Any]) -> str:
    """Say which versions of Dask do not go together; "" if they are all the same.

    Args:
        versions: as `Client.get_versions` returns them.
    """

    def of(part: Mapping[str, Any]) -> str:
        return str(part["packages"]["distributed"])

    here = of(versions["client"])
    others = {"the scheduler": of(versions["scheduler"])}
    others |= {f"the worker at {address}": of(part) for address, part in sorted(versions["workers"].items())}
    for name, found in others.items():
        if found != here:
            return f"{name} runs Dask {found} and this process {here}; install the same version in both places"
    return ""


def version_trouble(here: str, found: Mapping[str, Any]) -> str:
    """Say which worker runs another cocalib, or none; "" if all run this one.

    Args:
        here: the version of this process.
        found: the version of each worker by its address, or the exception that asking raised. A worker that went away
            meanwhile (OSError) is no trouble: each job asks its worker again.
    """
    for address, there in sorted(found.items()):
        if isinstance(there, OSError):
            continue
        if isinstance(there, BaseException):
            return (
                f"the worker at {address} has no cocalib ({type(there).__name__}: {there}); "
                f"install cocalib[cluster] {here} where it runs"
            )
        if there != here:
            return (
                f"the worker at {address} runs cocalib {there} and this is cocalib {here}, whose results differ; "
                "install the same version in both places"
            )
    return ""


def _worker_version() -> str:
    """Return the version that this worker runs."""
    return version()


def _call_in_worker(expected: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function with one thread of OpenCV, since each processor has a worker of its own.

    Args:
        expected: the version that the driver runs.
        function: to be called.
        arguments: of the call.

    Raises:
        InputError: this worker runs another version.
    """
    if version() != expected:
        raise InputError(
            f"a worker runs cocalib {version()} and this is cocalib {expected}, whose results differ; "
            "install the same version where the workers run"
        )
    import cv2

    cv2.setNumThreads(1)
    return function(*arguments)
