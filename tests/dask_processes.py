"""A Dask scheduler and workers in processes of their own, on loopback, as their commands start them."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import psutil

if TYPE_CHECKING:
    from distributed import Nanny

_ROOT = Path(__file__).resolve().parent.parent


@contextmanager
def scheduler_process() -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """Start a scheduler; give its process and its address."""
    arguments = ("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    with _process(*arguments) as process:
        yield process, _said(process, r"Scheduler at:\s+(tcp://\S+)")


@contextmanager
def worker_process(
    address: str, *, count: int = 1, environment: Mapping[str, str] | None = None
) -> Iterator["subprocess.Popen[str]"]:
    """Start workers, as children of the given process, which starts them again when they are killed."""
    arguments = ("--nworkers", str(count), "--nthreads", "1", "--no-dashboard", "--death-timeout", "60")
    with _process("distributed.cli.dask_worker", address, *arguments, environment=environment) as process:
        for _ in range(count):
            _said(process, r"(Registered to)")
        _wait_for_nannies(address)
        yield process


def _wait_for_nannies(address: str) -> None:
    """Wait until the parents of the workers have noticed that these run: a worker killed before ends its parent, too."""
    from distributed import Client

    with Client(address) as client:
        while set(client.run(_status, nanny=True).values()) != {"running"}:
            pass


def _status(dask_worker: "Nanny") -> str:
    return dask_worker.status.name


def worker_processes(parent: int) -> list[psutil.Process]:
    """Return the workers that are children of a process now.

    Args:
        parent: its id.
    """
    return [child for child in psutil.Process(parent).children() if "spawn_main" in _command(child)]


def _command(process: psutil.Process) -> str:
    try:
        return " ".join(process.cmdline())
    except psutil.NoSuchProcess:
        return ""


@contextmanager
def _process(
    module: str, *arguments: str, environment: Mapping[str, str] | None = None
) -> Iterator["subprocess.Popen[str]"]:
    given = {**os.environ, "PYTHONPATH": str(_ROOT), **(environment or {})}
    process = subprocess.Popen(
        [sys.executable, "-m", module, *arguments],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        env=given,
    )
    try:
        yield process
    finally:
        for child in psutil.Process(process.pid).children(recursive=True) if process.poll() is None else []:
            child.kill()
        process.kill()
        process.communicate()


def _said(process: "subprocess.Popen[str]", pattern: str) -> str:
    """Wait until a process says something, and return the group of the pattern."""
    assert process.stderr is not None
    lines = []
    for line in process.stderr:
        lines.append(line)
        if found := re.search(pattern, line):
            return found[1]
    raise AssertionError("".join(lines))
