"""A connection to a cluster of Dask: one that is started on this machine, or a scheduler that exists."""

import asyncio
import logging
import os
import ssl
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from calib_core.errors import InputError
from cocalib.batch.engines.local_cluster import local_cluster
from cocalib.batch.engines.scheduler_address import checked_address
from cocalib.batch.engines.worker_checks import check_workers

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

_PATIENCE_S = 5
_START_S = 120
_COUNTED_EVERY_S = 1.0
_LOGGERS = ("distributed", "distributed.client", "distributed.worker", "tornado", "tornado.application", "asyncio")
_SETTINGS: dict[str, Any] = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.gil.enabled": False,
    "distributed.comm.timeouts.connect": f"{_PATIENCE_S}s",
    "distributed.deploy.lost-worker-timeout": "60s",  # a busy machine takes long to start one again
}


class Connection:
    """A client of a scheduler.

    Attributes:
        client: of Dask.
        name: of the scheduler, for people.
    """

    def __init__(self, client: "Client", name: str, local: "LocalCluster | None" = None) -> None:
        self.client, self.name = client, name
        self._local = local
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

    def allow_no_more_deaths(self) -> None:
        """Have the next death of a worker end its call; a scheduler that others started keeps its own setting."""
        if self._local is not None and self._local.scheduler is not None:
            self._local.scheduler.allowed_failures = 0


@contextmanager
def connected(workers: int | None, scheduler: str | None) -> Iterator[Connection]:
    """Give a connection; what is started here is gone afterwards.

    Args:
        workers: processes on this machine; None for one per processor.
        scheduler: address of a scheduler that exists; None to start one on this machine.

    Raises:
        InputError: Dask is not installed, or the scheduler cannot be used.
    """
    if scheduler is not None:
        checked_address(scheduler)
    try:
        import dask
        import distributed  # noqa: F401
    except ImportError:
        raise InputError("Dask is not installed; install cocalib[fleet], or use --engine none") from None
    with (
        _quiet(),
        dask.config.set(_SETTINGS),
        _local(workers) if scheduler is None else _existing(scheduler) as connection,
    ):
        yield connection


@contextmanager
def _local(workers: int | None) -> Iterator[Connection]:
    """Start a cluster and connect to it when its first worker is there."""
    from distributed import Client

    count = workers or os.cpu_count() or 1
    with local_cluster(count) as cluster, Client(cluster, set_as_default=False) as client:
        try:
            client.wait_for_workers(1, timeout=_START_S)
        except TimeoutError:
            raise InputError(
                f"no worker process starts on this machine within {_START_S} s; use --engine none"
            ) from None
        yield Connection(client, "the cluster on this machine", cluster)


@contextmanager
def _existing(address: str) -> Iterator[Connection]:
    """Connect to a scheduler and check its workers."""
    from distributed import Client

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
        check_workers(client, address, _PATIENCE_S)
        yield Connection(client, f"the scheduler at {address}")


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
