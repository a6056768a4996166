"""A job runs once, whatever other drivers do, and whatever goes wrong is an outcome."""

from pathlib import Path

import pytest

from calib_core.errors import InputError
from cocalib.batch import running_job
from cocalib.batch.driving import drive
from cocalib.batch.engine import InProcess
from cocalib.batch.job import Job
from cocalib.batch.outcome import Outcome
from cocalib.batch.results_folder import ResultsFolder
from cocalib.batch.running_job import failed_outcome, run_once
from tests.batch_calls import quick_jobs, squared, written


def test_jobs_run_in_order_and_leave_their_outcomes(tmp_path):
    jobs = quick_jobs(tmp_path, 3)
    outcomes = list(drive(jobs, InProcess(), ResultsFolder(tmp_path / "out")))
    assert [outcome.digest for outcome in outcomes] == [job.digest for job in jobs]
    assert [ResultsFolder(tmp_path / "out").outcome(job.digest) for job in jobs] == outcomes


def test_functions_run_in_order():
    assert list(InProcess().run_all(squared, [(3,), (1,)])) == [(0, 9), (1, 1)]


def test_what_another_driver_finished_is_not_run_again(tmp_path, monkeypatch):
    (job,) = quick_jobs(tmp_path, 1)
    first = run_once(job, tmp_path)
    monkeypatch.setattr(running_job, "run_job", lambda *_: pytest.fail("it ran again"))
    assert run_once(job, tmp_path) == first


def test_a_bug_in_one_job_is_its_outcome(tmp_path, monkeypatch):
    def broken(job: Job, _: Path) -> Outcome:
        raise RuntimeError(f"no such thing as {job.row.vehicle}")

    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr(running_job, "run_job", broken)
    outcomes = drive(quick_jobs(tmp_path, 2), InProcess(), ResultsFolder(tmp_path))
    assert [outcome.status for outcome in outcomes] == ["failed", "failed"]
    assert "RuntimeError: no such thing as v001" in outcomes[1].reason
    assert written(tmp_path, outcomes[1].digest) == outcomes[1]


def test_a_folder_that_cannot_be_written_is_told_in_words(tmp_path):
    (job,) = quick_jobs(tmp_path, 1)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"the result of v000 / s1 cannot be written .*what is done is kept"):
        failed_outcome(job, tmp_path / "file", reason="its worker died")


def test_a_folder_that_a_worker_does_not_reach_is_told_in_words(tmp_path):
    (job,) = quick_jobs(tmp_path, 1)
    with pytest.raises(InputError, match=r"out: a worker does not reach this folder of results; put it, and the rec"):
        run_once(job, tmp_path / "out")
