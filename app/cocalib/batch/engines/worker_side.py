"""What runs in a worker of Dask: a job, after a look whether this worker can do it."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

from calib_core.errors import InputError
from cocalib.batch.engines.one_job import run_once
from cocalib.batch.job import Job
from cocalib.batch.outcome import Outcome
from cocalib.platform.resources import version


def dask_setup(_: object) -> None:
    """Leave Ctrl+C to the driver; Dask calls this when a worker starts that preloads this module."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def worker_version() -> str:
    """Return the version that this worker runs."""
    return version()


def run_in_worker(job: Job, results: Path, expected: str) -> Outcome:
    """Run a job in this worker.

    Args:
        job: to be run.
        results: the folder of results, on a shared file system.
        expected: the version that the driver runs.

    Raises:
        InputError: this worker cannot do any job: it runs another version, or does not reach the folder.
    """
    if version() != expected:
        raise InputError(
            f"a worker runs cocalib {version()} and this is cocalib {expected}, whose results differ; "
            "install the same version where the workers run"
        )
    if not results.is_dir():
        raise InputError(
            f"a worker does not reach the folder of results {results}; "
            "put it, and the recordings, on a file system that all workers share under the same path"
        )
    return call(run_once, job, results)


def call(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function with one thread of OpenCV, since each processor has a worker of its own."""
    import cv2

    cv2.setNumThreads(1)
    return function(*arguments)
