"""Whether the workers of a scheduler can do jobs for this process, or what to do about it."""

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from calib_core.errors import InputError
from cocalib.batch.engines.worker_side import worker_version
from cocalib.platform.resources import version

if TYPE_CHECKING:
    from distributed import Client

_RESTART_S = 90
"""How long workers that were killed may take to start again on a busy machine."""


def check_workers(client: "Client", address: str, patience_s: float) -> None:
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
    trouble = dask_trouble(versions) or version_trouble(version(), client.run(worker_version, on_error="return"))
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
                f"install cocalib[fleet] {here} where it runs"
            )
        if there != here:
            return (
                f"the worker at {address} runs cocalib {there} and this is cocalib {here}, whose results differ; "
                "install the same version in both places"
            )
    return ""
