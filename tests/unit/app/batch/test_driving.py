"""Driving a batch: nothing is run twice, the order is kept, the time left is honest, and what goes wrong is an outcome."""

import os
from collections.abc import Callable, Generator, Sequence
from typing import Any, TypeVar

import pytest

from calib_core.errors import InputError, OptionError
from cocalib.batch import running_job
from cocalib.batch.dask_scheduler import DaskScheduler
from cocalib.batch.driving import BatchProgress, chosen_engine, drive
from cocalib.batch.engine import InProcess, workers_died
from cocalib.batch.results_folder import ResultsFolder
from cocalib.batch.running_job import failed_outcome, run_once
from cocalib.batch.worker_processes import WorkerProcesses
from tests.batch_calls import quick_jobs, written

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


@pytest.mark.parametrize(
    ("count", "kept", "left_s"),
    [(5, 0, [None, None, None, 20.0, 10.0, 0.0]), (10, 6, [None, None, None, 10.0, 0.0])],
    ids=["none kept", "some kept"],
)
def test_the_time_left_is_unknown_until_some_jobs_have_finished_and_rests_on_those_alone(tmp_path, count, kept, left_s):
    jobs, results, clock, told = quick_jobs(tmp_path, count), ResultsFolder(tmp_path), iter(range(0, 1000, 10)), []
    drive(jobs[:kept], InProcess(), results)
    drive(jobs, InProcess(), results, told.append, lambda: float(next(clock)))
    assert [now.left_s for now in told] == left_s


def test_small_manifests_run_in_this_process_and_large_ones_on_all_processors_unless_more_is_asked_for(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    assert isinstance(chosen_engine(7), InProcess)
    assert chosen_engine(8) == WorkerProcesses(4)
    assert chosen_engine(1, workers=3) == WorkerProcesses(3)
    assert chosen_engine(1, scheduler="tls://h:1") == DaskScheduler("tls://h:1")
    assert isinstance(chosen_engine(10_000, workers=1), InProcess)
    with pytest.raises(InputError, match="give one of them"):
        chosen_engine(1, workers=2, scheduler="tls://h:1")
    with pytest.raises(OptionError, match="at least 1"):
        chosen_engine(1, workers=0)


def test_what_another_driver_finished_is_not_run_again(tmp_path, monkeypatch):
    (job,) = quick_jobs(tmp_path, 1)
    first = run_once(job, tmp_path)
    monkeypatch.setattr(running_job, "run_job", lambda *_: pytest.fail("it ran again"))
    assert run_once(job, tmp_path) == first


def test_a_bug_in_one_job_is_its_outcome(tmp_path, monkeypatch):
    def broken(job, _):
        raise RuntimeError(f"not {job.row.vehicle}")

    monkeypatch.setattr(running_job, "run_job", broken)
    outcomes = drive(quick_jobs(tmp_path, 2), InProcess(), ResultsFolder(tmp_path))
    assert [outcome.status for outcome in outcomes] == ["failed", "failed"]
    assert "RuntimeError: not v001" in outcomes[1].reason
    assert written(tmp_path, outcomes[1].digest) == outcomes[1]


def test_a_folder_that_cannot_be_reached_or_written_is_told_in_words(tmp_path):
    (job,) = quick_jobs(tmp_path, 1)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"the result of v000 / s1 cannot be written .*what is done is kept"):
        failed_outcome(job, tmp_path / "file", reason="its worker died")
    with pytest.raises(InputError, match=r"out: a worker does not reach this folder of results; put it, and the rec"):
        run_once(job, tmp_path / "out")
