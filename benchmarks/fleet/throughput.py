"""A simulated fleet on every engine: what it costs, and that killed workers change nothing.

python -m benchmarks.fleet.throughput FOLDER --vehicles 50 --sessions 3 --workers 2 --kills 20
"""

import argparse
import multiprocessing
import os
import shutil
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
import psutil

from benchmarks.fleet.plan import plan_fleet
from benchmarks.fleet.simulated_fleet import write_fleet
from cocalib.batch.driving import drive
from cocalib.batch.engine import InProcess
from cocalib.batch.job import Job, jobs_of
from cocalib.batch.manifest import read_manifest
from cocalib.batch.outcome import Outcome
from cocalib.batch.results_folder import OUTCOME_FILE, ResultsFolder
from cocalib.batch.running_job import run_job
from cocalib.batch.worker_processes import WorkerProcesses

__all__ = ["killing", "main"]

_LONGEST_PAUSE_S = 3.0
_LOOK_EVERY_S = 0.1
_RUNS = ("loop", "one", "workers", "killed")


@dataclass(frozen=True, slots=True)
class _Measured:
    name: str
    seconds: float
    processor_seconds: float
    outcomes: tuple[Outcome, ...]
    results: ResultsFolder
    largest_mb: float
    kills: int = 0


@contextmanager
def killing(count: int, seed: int) -> Iterator[list[int]]:
    """Kill worker processes of this process at random moments; give the list of those killed, which grows.

    Args:
        count: how many to kill.
        seed: of the random generator.
    """
    random, killed, ended = np.random.default_rng(seed), list[int](), threading.Event()

    def kill() -> None:
        while len(killed) < count and not ended.wait(float(random.uniform(0.0, _LONGEST_PAUSE_S))):
            workers = _workers()
            if workers:
                worker = workers[int(random.integers(len(workers)))]
                worker.kill()
                killed.append(worker.pid)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    try:
        yield killed
    finally:
        ended.set()
        thread.join()


@contextmanager
def _watching() -> Iterator[list[float]]:
    """Give the memory of the largest process so far [MB]: of a worker, or of this process as long as there is none."""
    sizes_mb, ended = [0.0], threading.Event()

    def watch() -> None:
        while not ended.wait(_LOOK_EVERY_S):
            for process in _workers() or [psutil.Process()]:
                with suppress(psutil.NoSuchProcess):
                    sizes_mb[0] = max(sizes_mb[0], process.memory_info().rss / 1e6)

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield sizes_mb
    finally:
        ended.set()
        thread.join()


def _workers() -> list[psutil.Process]:
    return [psutil.Process(one.pid) for one in multiprocessing.active_children() if psutil.pid_exists(one.pid or 0)]


def _measured(name: str, folder: Path, run: Callable[[Path], Sequence[Outcome]]) -> _Measured:
    results = folder / f"results-{name.replace(' ', '-')}"
    shutil.rmtree(results, ignore_errors=True)
    begin_s, begin_processor_s = time.monotonic(), _processor_s()
    with _watching() as largest_mb:
        outcomes = tuple(run(results))
    passed_s, processor_s = time.monotonic() - begin_s, _processor_s() - begin_processor_s
    return _Measured(name, passed_s, processor_s, outcomes, ResultsFolder(results), largest_mb[0])


def _processor_s() -> float:
    """Return the processor time of this process and its children that have ended [s]."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _differences(one: _Measured, other: _Measured) -> int:
    """Count the jobs whose outcome, times and host apart, or any other file is not the same byte for byte."""
    return sum(
        _without_run(a) != _without_run(b)
        or _files(one.results.folder_of(a.digest)) != _files(other.results.folder_of(b.digest))
        for a, b in zip(one.outcomes, other.outcomes, strict=True)
    )


def _without_run(outcome: Outcome) -> Outcome:
    return msgspec.structs.replace(outcome, run=None)


def _files(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != OUTCOME_FILE
    }


def _measured_runs(
    jobs: Sequence[Job], folder: Path, names: Sequence[str], *, workers: int, kills: int, seed: int
) -> list[_Measured]:
    def on(engine: InProcess | WorkerProcesses) -> Callable[[Path], Sequence[Outcome]]:
        return lambda results: drive(jobs, engine, ResultsFolder(results))

    def killed() -> _Measured:
        with killing(kills, seed) as ended:
            found = _measured("workers killed", folder, on(WorkerProcesses(workers)))
            count = len(ended)
        return replace(found, kills=count)

    runs: dict[str, Callable[[], _Measured]] = {
        "loop": lambda: _measured("plain loop", folder, lambda results: [run_job(job, results) for job in jobs]),
        "one": lambda: _measured("one process", folder, on(InProcess())),
        "workers": lambda: _measured(f"{workers} workers", folder, on(WorkerProcesses(workers))),
        "killed": killed,
    }
    return [runs[name]() for name in names]


def _table(measured: Sequence[_Measured]) -> str:
    lines = [
        "| run | workers killed | outcomes | solved / weak / refused / failed "
        "| time | to the first | processor time | largest process | jobs that differ |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    first = measured[0]
    for one in measured:
        status = Counter(outcome.status for outcome in one.outcomes)
        counts = " / ".join(str(status[name]) for name in ("solved", "weak", "refused", "failed"))
        lines.append(
            f"| {one.name} | {one.kills} | {len(one.outcomes)} | {counts} | {one.seconds:.0f} s "
            f"| {one.seconds / first.seconds:.2f} | {one.processor_seconds:.0f} s | {one.largest_mb:.0f} MB "
            f"| {_differences(first, one)} |"
        )
    return "\n".join(lines)


def main(arguments: list[str]) -> int:
    """Measure a fleet on every engine and print a table; exit code 1 if any run differs from the first."""
    parser = argparse.ArgumentParser(prog="benchmarks.fleet.throughput", description=main.__doc__)
    parser.add_argument("folder", type=Path, help="the fleet's, written if it holds none")
    parser.add_argument("--vehicles", type=int, default=50)
    parser.add_argument("--sessions", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--runs", nargs="+", choices=_RUNS, default=_RUNS, help="which, in this order; by default all")
    given = parser.parse_args(arguments)
    manifest = given.folder / "manifest.toml"
    if not manifest.exists():
        write_fleet(
            given.folder, plan_fleet(given.vehicles, given.sessions, given.seed), WorkerProcesses(given.workers)
        )
    jobs = jobs_of(read_manifest(manifest).rows, given.folder)
    measured = _measured_runs(jobs, given.folder, given.runs, workers=given.workers, kills=given.kills, seed=given.seed)
    print(_table(measured))
    return int(any(_differences(measured[0], one) for one in measured[1:]))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
