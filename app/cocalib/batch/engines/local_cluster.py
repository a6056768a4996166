"""A scheduler in this process and workers as its children. Those that die are replaced; all end with it, however it ends."""

import logging
import os
import shutil
import signal
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from distributed import LocalCluster

_ALLOWED_DEATHS = 1
"""Deaths of workers that a call survives; the next one ends it."""
_PRELOADED = "cocalib.batch.engines.worker_side"
_CHECKED_EVERY_MS = 1000


@contextmanager
def local_cluster(count: int) -> Iterator["LocalCluster"]:
    """Start a cluster on loopback, whose workers begin to appear; afterwards neither processes nor files are left.

    Args:
        count: number of workers, one thread each; they share the machine's memory equally.
    """
    import dask
    from distributed import LocalCluster
    from distributed.system import MEMORY_LIMIT
    from tornado.ioloop import PeriodicCallback

    folder = tempfile.mkdtemp(prefix="cocalib-workers-")
    try:
        with (
            dask.config.set({"temporary-directory": folder}),
            LocalCluster(
                n_workers=0,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",  # without one, a page is served at a fixed port
                memory_limit=MEMORY_LIMIT // count,
                local_directory=folder,
                silence_logs=logging.CRITICAL,
                preload=[_PRELOADED],
                scheduler_kwargs={"allowed_failures": _ALLOWED_DEATHS},
            ) as cluster,
        ):
            cluster.scale(count)
            replacing = PeriodicCallback(lambda: _replace_dead(cluster, count), _CHECKED_EVERY_MS)
            cluster.loop.add_callback(replacing.start)
            try:
                yield cluster
            except BaseException:
                _kill_workers(cluster)
                raise
            finally:
                cluster.loop.add_callback(replacing.stop)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _kill_workers(cluster: "LocalCluster") -> None:
    """Kill the workers, none of which starts again: a call that goes on would hold up the end by seconds."""
    for nanny in list(cluster.workers.values()):
        nanny.close_gracefully(reason="the driver ends")
        if nanny.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(nanny.pid, getattr(signal, "SIGKILL", signal.SIGTERM))  # Windows has no SIGKILL


def _replace_dead(cluster: "LocalCluster", count: int) -> None:
    """Open a new worker for each one that Dask gave up: one that was killed while it started."""
    from distributed.core import Status

    if cluster.status is not Status.running:
        return
    dead = [name for name, worker in cluster.workers.items() if worker.status in (Status.closed, Status.failed)]
    for name in dead:
        del cluster.workers[name]
    if dead or len(cluster.workers) < count:
        cluster.scale(count)
