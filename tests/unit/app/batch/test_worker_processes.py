"""Worker processes on this machine: the same outcomes as in one process, nothing listens, and workers that die."""

import multiprocessing
import os
import signal
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import psutil
import pytest
from msgspec.structs import replace

from calib_core.errors import InputError
from cocalib.batch import driving
from cocalib.batch.driving import drive
from cocalib.batch.engine import InProcess
from cocalib.batch.results_folder import ResultsFolder
from cocalib.batch.worker_processes import WorkerProcesses
from tests.batch_calls import (
    attempts,
    dying,
    dying_job,
    dying_start,
    failing,
    quick_jobs,
    squared,
    temporary_file,
    written,
)

pytestmark = pytest.mark.slow


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def test_workers_killed_at_random_change_no_outcome_and_leave_nothing_behind(tmp_path, temporary):
    jobs, random = quick_jobs(tmp_path, 30), np.random.default_rng(1)
    killed = []

    def kill(_: object) -> None:
        workers = multiprocessing.active_children()
        if len(killed) < 4 and len(workers) == 2 and random.uniform() < 0.5:
            process = workers[int(random.integers(2))]
            process.kill()
            killed.append(process.pid)

    found = drive(jobs, WorkerProcesses(2), ResultsFolder(tmp_path / "workers"), kill)
    assert len(killed) == 4
    plain = drive(jobs, InProcess(), ResultsFolder(tmp_path / "none"))
    assert [replace(one, run=None) for one in found] == [replace(one, run=None) for one in plain]
    assert multiprocessing.active_children() == []
    assert list(temporary.iterdir()) == []
    assert not list((tmp_path / "workers" / "results").glob(".*"))


def _sockets(processes: Sequence[psutil.Process]) -> set[tuple[object, ...]]:
    """Return all network sockets of processes, and their UNIX sockets that have a name."""
    of_kind = (
        (one.pid, kind, found) for one in processes for kind in ("inet", "unix") for found in one.net_connections(kind)
    )
    return {(pid, found.fd, found.laddr) for pid, kind, found in of_kind if kind == "inet" or found.laddr}


def test_nothing_listens_on_a_port_or_a_socket(tmp_path):
    this = psutil.Process()
    before, during, counts = _sockets([this]), set[tuple[object, ...]](), list[int]()

    def look(_: object) -> None:
        family = [this, *this.children(recursive=True)]
        counts.append(len(family))
        during.update(_sockets([one for one in family if one.is_running()]))

    drive(quick_jobs(tmp_path, 6), WorkerProcesses(2), ResultsFolder(tmp_path), look)
    assert max(counts) >= 3
    assert during <= before


def test_a_job_that_kills_its_workers_fails_and_the_others_do_not(tmp_path, monkeypatch):
    monkeypatch.setattr(driving, "run_once", dying_job)
    jobs = quick_jobs(tmp_path, 4)
    outcomes = drive(jobs, WorkerProcesses(2), ResultsFolder(tmp_path))
    assert [outcome.vehicle for outcome in outcomes] == ["v000", "v001", "v002", "v003"]
    assert "every worker" in outcomes[1].reason
    assert "memory" in outcomes[1].hint
    assert all("died" not in outcome.reason for outcome in (outcomes[0], *outcomes[2:]))
    assert attempts(tmp_path, "v001") == 3  # among all others, after them, and alone
    assert all(attempts(tmp_path, vehicle) == 1 for vehicle in ("v000", "v002", "v003"))
    assert written(tmp_path, jobs[1].digest) == outcomes[1]
    assert ResultsFolder(tmp_path).outcome(jobs[1].digest) is None  # it is run again next time


def test_one_death_costs_its_own_call_one_more_run(tmp_path):
    calls = [(str(tmp_path), name, int(name == "b")) for name in "abcd"]
    told: list[str] = []
    assert sorted(WorkerProcesses(2, told.append).run_all(dying, calls)) == list(enumerate("abcd"))
    assert [attempts(tmp_path, name) for name in "abcd"] == [1, 2, 1, 1]
    assert len(told) == 1
    assert "1 job was run" in told[0]


def test_what_workers_that_are_killed_had_in_temporary_files_is_removed(tmp_path, temporary):
    folders = {Path(made).parent for _, made in WorkerProcesses(2).run_all(temporary_file, [(1,), (2,)])}
    assert {one.parent for one in folders} == {temporary}
    assert list(temporary.iterdir()) == []


def test_what_a_driver_that_was_killed_left_is_removed_by_the_next(temporary):
    left = multiprocessing.get_context("spawn").Process(target=_killed_driver, args=(str(temporary),))
    left.start()
    left.join()
    assert left.exitcode == -signal.SIGKILL
    assert len(list(temporary.iterdir())) == 1
    assert list(InProcess().run_all(squared, [(3,)])) == [(0, 9)]
    assert list(temporary.iterdir()) == []


def _killed_driver(temporary: str) -> None:
    tempfile.tempdir = temporary
    for _ in InProcess().run_all(temporary_file, [(1,)]):
        os.kill(os.getpid(), signal.SIGKILL)


def test_workers_that_never_start_are_told(monkeypatch):
    monkeypatch.setattr("cocalib.batch.worker_processes._MOST_FAILED_STARTS", 2)
    monkeypatch.setattr("cocalib.batch.worker_processes._work", failing)
    with pytest.raises(InputError, match="end as soon as they start; use --workers 1"):
        list(WorkerProcesses(1).run_all(squared, [(3,)]))


def test_workers_that_are_killed_while_they_start_are_replaced(tmp_path, monkeypatch):
    monkeypatch.setattr("cocalib.batch.worker_processes._MOST_FAILED_STARTS", 1)
    monkeypatch.setattr("cocalib.batch.worker_processes._work", dying_start)
    monkeypatch.setenv("DYING_START", str(tmp_path))
    assert list(WorkerProcesses(1).run_all(squared, [(3,)])) == [(0, 9)]
    assert attempts(tmp_path, "start") == 3


def test_what_a_function_raises_is_raised():
    with pytest.raises(ValueError, match="not 7"):
        list(WorkerProcesses(2).run_all(failing, [(7,)]))
    assert multiprocessing.active_children() == []


def test_nothing_starts_for_nothing(monkeypatch):
    monkeypatch.setattr("cocalib.batch.worker_processes._PROCESSES", None)
    assert list(WorkerProcesses(2).run_all(squared, [])) == []
