"""A cluster that is started here: the same outcomes as in one process, and workers that die."""

import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
import pytest

from calib_core.errors import InputError
from cocalib.batch.driving import drive
from cocalib.batch.engines import dask_cluster, local_cluster
from cocalib.batch.engines.dask_cluster import DaskCluster
from cocalib.batch.engines.in_process import InProcess
from cocalib.batch.outcome import Outcome
from cocalib.batch.results_folder import ResultsFolder
from tests.batch_calls import attempts, dying, dying_job, failing, quick_jobs, squared, written
from tests.dask_processes import worker_processes

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::ResourceWarning")]


def _without_run(outcomes: Sequence[Outcome]) -> list[Outcome]:
    return [msgspec.structs.replace(outcome, run=None) for outcome in outcomes]


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def test_workers_killed_at_random_change_no_outcome_and_leave_nothing_behind(tmp_path: Path, temporary: Path) -> None:
    jobs, random = quick_jobs(tmp_path, 30), np.random.default_rng(1)
    killed = []

    def kill(_: object) -> None:
        workers = worker_processes(os.getpid())
        if len(killed) < 2 and len(workers) == 2 and random.uniform() < 0.5:
            process = workers[int(random.integers(2))]
            process.kill()
            killed.append(process.pid)

    found = drive(jobs, DaskCluster(workers=2), ResultsFolder(tmp_path / "dask"), kill)
    assert len(killed) == 2
    plain = drive(jobs, InProcess(), ResultsFolder(tmp_path / "none"))
    assert _without_run(found) == _without_run(plain)
    assert worker_processes(os.getpid()) == []
    assert list(temporary.iterdir()) == []


def test_a_job_that_kills_its_workers_fails_and_the_others_do_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_cluster, "run_in_worker", dying_job)
    jobs = quick_jobs(tmp_path, 4)
    outcomes = drive(jobs, DaskCluster(workers=2), ResultsFolder(tmp_path))
    assert [outcome.vehicle for outcome in outcomes] == ["v000", "v001", "v002", "v003"]
    assert "every worker that ran this job died" in outcomes[1].reason
    assert "memory" in outcomes[1].hint
    assert all("died" not in outcome.reason for outcome in (outcomes[0], *outcomes[2:]))
    assert attempts(tmp_path, "v001") == 3  # twice among others, and once alone
    assert written(tmp_path, jobs[1].digest) == outcomes[1]
    assert ResultsFolder(tmp_path).outcome(jobs[1].digest) is None  # it is run again next time


def test_functions_run_on_it_too_and_one_death_costs_one_more_run(tmp_path: Path) -> None:
    cluster = DaskCluster(workers=1)
    assert sorted(cluster.run_all(squared, [(3,), (1,), (2,)])) == [(0, 9), (1, 1), (2, 4)]
    assert list(cluster.run_all(dying, [(str(tmp_path), "a", 1)])) == [(0, "a")]
    assert attempts(tmp_path, "a") == 2


def test_a_worker_that_is_killed_while_it_starts_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DYING_START", str(tmp_path))
    monkeypatch.setattr(local_cluster, "_PRELOADED", "tests.dying_start")
    assert list(DaskCluster(workers=1).run_all(squared, [(3,)])) == [(0, 9)]
    assert attempts(tmp_path, "start") == 3


def test_what_a_function_raises_is_raised(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not 7"):
        list(DaskCluster(workers=1).run_all(failing, [(7,)]))


def test_nothing_starts_for_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert list(DaskCluster().run((), tmp_path)) == []
    with pytest.raises(InputError, match=r"Dask is not installed; install cocalib\[fleet\], or use --engine none"):
        list(DaskCluster().run(quick_jobs(tmp_path, 1), tmp_path))
