"""What runs in a worker of Dask: a call, after a look whether this worker can do it."""

from collections.abc import Callable
from typing import Any

from calib_core.errors import InputError
from cocalib.platform.resources import version


def worker_version() -> str:
    """Return the version that this worker runs."""
    return version()


def call(expected: str, function: Callable[..., Any], *arguments: Any) -> Any:
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
