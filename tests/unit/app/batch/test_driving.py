"""Driving a batch: nothing is run twice, the order is kept, and the time left is honest."""

import os
from collections.abc import Callable, Generator, Sequence
from typing import Any, TypeVar

import pytest

from calib_core.errors import InputError, OptionError
from cocalib.batch.dask_scheduler import DaskScheduler
from cocalib.batch.driving import BatchProgress, chosen_engine, drive
from cocalib.batch.engine import InProcess, workers_died
from cocalib.batch.results_folder import ResultsFolder
from cocalib.batch.worker_processes import WorkerProcesses
from tests.batch_calls import quick_jobs

_Found = TypeVar("_Found")


class _Backwards(InProcess):
    """Finishes the last job first, and counts."""

    def __init__(self) -> None:
        self.ran: list[str] = []

    def run_all(
        self,
        function: Callable[..., _Found],
        arguments: Sequence[tuple[Any, ...]],
        if_died: Callable[[int], _Found] = workers_died,
    ) -> Generator[tuple[int, _Found], None, None]:
        for number, (job, results) in reversed([*enumerate(arguments)]):
            self.ran.append(job.digest)
            yield number, function(job, results)


def test_outcomes_are_in_the_order_of_the_jobs_and_equal_jobs_run_once(tmp_path):
    a, b, c = quick_jobs(tmp_path, 3)
    engine, told = _Backwards(), []
    outcomes = drive((a, b, a, c), engine, ResultsFolder(tmp_path), told.append)
    assert [outcome.digest for outcome in outcomes] == [a.digest, b.digest, a.digest, c.digest]
    assert engine.ran == [c.digest, b.digest, a.digest]
    assert [(now.done, now.count) for now in told] == [(0, 4), (1, 4), (2, 4), (4, 4)]


def test_what_is_done_is_not_run_again(tmp_path):
    jobs, results, engine = quick_jobs(tmp_path, 3), ResultsFolder(tmp_path), _Backwards()
    first = drive(jobs[:2], engine, results)
    told: list[BatchProgress] = []
    assert drive(jobs, engine, results, told.append)[:2] == first
    assert engine.ran == [jobs[1].digest, jobs[0].digest, jobs[2].digest]
    assert told[0] == BatchProgress(2, 3)


def test_a_killed_driver_goes_on_where_it_was(tmp_path):
    jobs, results, engine = quick_jobs(tmp_path, 4), ResultsFolder(tmp_path), _Backwards()

    def interrupt(now: BatchProgress) -> None:
        if now.done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        drive(jobs, engine, results, interrupt)
    drive(jobs, engine, results)
    assert engine.ran == [job.digest for job in reversed(jobs)]


def test_the_time_left_is_unknown_until_some_jobs_have_finished(tmp_path):
    clock = iter(range(0, 1000, 10))
    told: list[BatchProgress] = []
    drive(quick_jobs(tmp_path, 5), InProcess(), ResultsFolder(tmp_path), told.append, lambda: float(next(clock)))
    assert [now.left_s for now in told] == [None, None, None, 20.0, 10.0, 0.0]


def test_kept_outcomes_do_not_make_the_rest_look_quick(tmp_path):
    jobs, results = quick_jobs(tmp_path, 10), ResultsFolder(tmp_path)
    drive(jobs[:6], InProcess(), results)
    clock = iter(range(0, 1000, 10))
    told: list[BatchProgress] = []
    drive(jobs, InProcess(), results, told.append, lambda: float(next(clock)))
    assert [now.left_s for now in told] == [None, None, None, 10.0, 0.0]


def test_small_manifests_run_in_this_process_and_large_ones_on_all_processors(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    assert isinstance(chosen_engine(7), InProcess)
    assert chosen_engine(8) == WorkerProcesses(4)


def test_what_is_asked_for_is_taken():
    assert chosen_engine(1, workers=3) == WorkerProcesses(3)
    assert chosen_engine(1, scheduler="tls://h:1") == DaskScheduler("tls://h:1")
    assert isinstance(chosen_engine(10_000, workers=1), InProcess)


def test_flags_that_do_not_go_together_are_refused():
    with pytest.raises(InputError, match="give one of them"):
        chosen_engine(1, workers=2, scheduler="tls://h:1")
    with pytest.raises(OptionError, match="at least 1"):
        chosen_engine(1, workers=0)
