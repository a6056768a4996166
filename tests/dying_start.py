"""Preloaded by a worker: kills it while it starts, the first two times; DYING_START names the folder that counts them."""

import os
import signal
from pathlib import Path

from tests.batch_calls import attempts

__all__ = ["dask_setup"]


def dask_setup(_: object) -> None:
    """Leave a file for each start, and die at the first two."""
    folder = Path(os.environ["DYING_START"])
    before = attempts(folder, "start")
    (folder / f"start.{before}").touch()
    if before < 2:
        os.kill(os.getpid(), signal.SIGKILL)
