"""A connection to a scheduler of Dask that the user started."""

import asyncio
import logging
import ssl
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from calib_core.errors import InputError
from cocalib.batch.engines.scheduler_address import checked_address
from cocalib.batch.engines.worker_checks import check_workers

if TYPE_CHECKING:
    from distributed import Client

_PATIENCE_S = 5
_COUNTED_EVERY_S = 1.0
_LOGGERS = ("distributed", "distributed.client", "distributed.worker", "tornado", "tornado.application", "asyncio")
_SETTINGS: dict[str, Any] = {
    "distributed.comm.timeouts.connect": f"{_PATIENCE_S}s",
}


class Connection:
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
def connected(address: str) -> Iterator[Connection]:
    """Connect to a scheduler and check its workers.

    Args:
        address: of the scheduler.

    Raises:
        InputError: Dask is not installed, or the scheduler cannot be used.
    """
    checked_address(address)
    try:
        import dask
        from distributed import Client
    except ImportError:
        raise InputError("Dask is not installed; install cocalib[fleet], or leave out --scheduler") from None
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
