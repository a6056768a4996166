"""Whatever goes wrong in a job is an outcome in words, and says whether another run may go well."""

import dataclasses
import errno
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import InputError, RecordingError
from calib_core.measurements import Unsolvable
from cocalib.batch import running_job
from cocalib.batch.job import job_of
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.outcome import Outcome
from cocalib.batch.results_folder import LOG_FILE, ResultsFolder
from cocalib.batch.running_job import run_job

SAMPLE = Path(__file__).resolve().parents[4] / "sample_data" / "rooftop"


@pytest.fixture
def row(tmp_path: Path) -> ManifestRow:
    """A session whose files may be changed."""
    for name in ("radar.bag", "camera.bag", "clicks.json"):
        shutil.copy(SAMPLE / name, tmp_path / name)
    return ManifestRow(
        "van", "1", (tmp_path / "radar.bag", tmp_path / "camera.bag"), clicks=tmp_path / "clicks.json", place="line 2"
    )


def outcome_of(row: ManifestRow, results: Path) -> Outcome:
    """Run the job of a row; what is final is kept, and only that counts as done."""
    job = job_of(row)
    outcome = run_job(job, results)
    assert (ResultsFolder(results).outcome(job.digest) is not None) == outcome.is_final
    assert "\n" not in outcome.reason + outcome.hint
    assert outcome.digest == job.digest
    return outcome


def raising(error: BaseException) -> Callable[..., object]:
    def fail(*_arguments: object, **_flags: object) -> object:
        raise error

    return fail


def test_a_file_that_only_the_worker_misses_is_not_final(row, tmp_path, monkeypatch):
    def unreached(*_arguments: object, **_flags: object) -> object:
        try:
            raise OSError(errno.ESTALE, "stale file handle", "radar.bag")
        except OSError as error:
            raise RecordingError("radar.bag: cannot be read") from error

    monkeypatch.setattr(running_job, "open_recording", unreached)
    assert not outcome_of(row, tmp_path / "results").is_final


def test_nothing_was_clicked(row, tmp_path):
    outcome = outcome_of(dataclasses.replace(row, clicks=None), tmp_path / "results")
    assert (outcome.status, outcome.reason, outcome.is_final) == ("refused", "nothing was clicked", True)
    assert outcome.recorded_ns is not None
    assert outcome.steps == {}


def another_recordings(clicks):
    return [one | {"image_time": one["image_time"] | {"sec": 1}} for one in clicks]


@pytest.mark.parametrize(
    ("name", "change", "status", "final", "words"),
    [
        ("radar.bag", None, "failed", False, "radar.bag"),
        ("clicks.json", None, "failed", False, "clicks.json"),
        ("radar.bag", b"#ROSBAG V2.0\n", "failed", True, "radar.bag"),
        ("clicks.json", b"[]", "failed", True, "clicks.json"),
        ("clicks.json", another_recordings, "failed", True, "has the stamp of no frame"),
        ("clicks.json", lambda clicks: clicks[:2], "refused", True, "2 of"),
    ],
    ids=["no recording", "no file of clicks", "broken recording", "no clicks", "another recording's", "too few"],
)
def test_what_a_file_lacks_is_an_outcome(name, change, status, final, words, row, tmp_path):
    path = tmp_path / name
    if callable(change):
        document = json.loads(path.read_text())
        change = json.dumps(document | {"clicks": change(document["clicks"])}).encode()
    path.unlink()
    if change is not None:
        path.write_bytes(change)
    outcome = outcome_of(row, tmp_path / "results")
    assert (outcome.status, outcome.is_final, outcome.files) == (status, final, ())
    assert words in outcome.reason
    assert outcome.hint or status == "failed"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError(), "not enough memory"),
        (np.exceptions.AxisError("a\nb"), "internal error (AxisError: a b)"),
        (PermissionError(errno.EACCES, "Permission denied", "camera.bag"), "camera.bag: Permission denied"),
        (OSError("av: invalid data"), "internal error (OSError: av: invalid data)"),
    ],
)
def test_what_nobody_expected_is_not_final(error, words, row, tmp_path, monkeypatch):
    monkeypatch.setattr(running_job, "solve_session", raising(error))
    outcome = outcome_of(row, tmp_path / "results")
    assert (outcome.status, outcome.is_final) == ("failed", False)
    assert outcome.reason.startswith(words)
    log = ResultsFolder(tmp_path / "results").folder_of(outcome.digest) / LOG_FILE
    assert log.is_file() == ("internal error" in words)
    assert not log.is_file() or "Traceback" in log.read_text(encoding="utf-8")
    monkeypatch.undo()
    assert outcome_of(row, tmp_path / "results").status == "solved"


def test_to_be_interrupted_is_no_outcome(row, tmp_path, monkeypatch):
    monkeypatch.setattr(running_job, "solve_session", raising(KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        outcome_of(row, tmp_path / "results")
    assert not (tmp_path / "results" / "results").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("step", "function", "error", "final", "files"),
    [
        ("evaluate", "judge_session", InputError("no box"), True, {"calibration.json", "report.html", "export/kitti.txt"}),
        ("report", "report_session", ValueError("a bug"), False, {"calibration.json", "evaluation.json", "export/kitti.txt"}),
        ("export", "export_session", InputError("no"), True, {"calibration.json", "evaluation.json", "report.html"}),
    ],
)  # fmt: skip
def test_a_step_fails_on_its_own(step, function, error, final, files, row, tmp_path, monkeypatch):
    def export(*_arguments: object) -> dict[str, bytes]:
        return {"export/kitti.txt": b"P2: 1"}

    monkeypatch.setattr(running_job, "export_session", export)
    monkeypatch.setattr(running_job, "report_session", lambda *_: "<p>report</p>")
    monkeypatch.setattr(running_job, function, raising(error))
    outcome = outcome_of(dataclasses.replace(row, exports=("kitti",)), tmp_path / "results")
    assert (outcome.status, outcome.is_final) == ("solved", final)
    assert outcome.steps == {"evaluate": "done", "report": "done", "export": "done"} | {step: "failed"}
    assert [name.split()[0] for name in outcome.step_reasons] == [step]
    assert str(error) in next(iter(outcome.step_reasons.values()))
    assert {file.name for file in outcome.files} == files


def test_an_input_that_changes_before_or_while_the_job_runs_is_no_result(row, tmp_path, monkeypatch):
    def change(*_arguments):
        (tmp_path / "clicks.json").write_text("other")
        return Unsolvable.reported("too-few-pairs", "reason", "hint")

    monkeypatch.setattr(running_job, "solve_session", change)
    outcome = outcome_of(row, tmp_path / "results")
    assert (outcome.status, outcome.is_final) == ("failed", False)
    assert "an input changed" in outcome.reason
    assert not (tmp_path / "results" / "results").exists()
    job = job_of(row)
    with (tmp_path / "camera.bag").open("ab") as file:
        file.write(b"more")
    monkeypatch.setattr(running_job, "run_steps", raising(AssertionError("it is read")))
    assert "an input changed" in run_job(job, tmp_path / "results").reason


def test_a_full_disk_is_an_outcome_that_nobody_keeps(row, tmp_path, monkeypatch):
    monkeypatch.setattr(running_job, "solve_session", lambda *_: Unsolvable.reported("too-few-pairs", "reason", "hint"))
    monkeypatch.setattr(running_job, "listed_files", raising(OSError(errno.ENOSPC, "No space left on device")))
    outcome = outcome_of(row, tmp_path / "results")
    assert (outcome.status, outcome.is_final) == ("failed", False)
    assert outcome.reason.startswith(f"{tmp_path / 'results'}: ")
    assert "No space left" in outcome.reason
    assert "make room" in outcome.hint
    assert list((tmp_path / "results" / "results").iterdir()) == []
