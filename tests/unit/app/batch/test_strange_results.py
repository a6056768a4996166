"""A folder of results that somebody else can write to: links, pipes, devices and names that lead out of it."""

import json
import os
from pathlib import Path

import pytest

from calib_core.errors import CalibrationError, InputError
from cocalib.batch.driving import drive
from cocalib.batch.engine import InProcess
from cocalib.batch.job import Job
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.outcome import read_outcome
from cocalib.batch.plan import read_plans, write_plan
from cocalib.batch.results_folder import OUTCOME_FILE, ResultsFolder
from cocalib.batch.results_table import SessionRow, read_results
from tests.batch_calls import quick_jobs
from tests.unit.app.batch.test_results_folder import DIGEST, write

pytestmark = [
    pytest.mark.skipif(os.name == "nt", reason="no pipes and devices in folders"),
    pytest.mark.timeout(60),  # what must not happen is that one of these is waited for
]
KINDS = ("link to /dev/zero", "link to a file", "pipe", "folder")


def put(kind: str, place: Path) -> None:
    """Put something that is not a regular file under a name."""
    if place.exists():
        place.unlink()
    if kind == "link to /dev/zero":
        place.symlink_to("/dev/zero")
    elif kind == "link to a file":
        other = place.parent.parent / "elsewhere.json"
        other.write_text("theirs")
        place.symlink_to(other)
    elif kind == "pipe":
        os.mkfifo(place)
    else:
        place.mkdir()


def row_of(out: Path) -> SessionRow:
    """Return the row of the one result in a folder."""
    write_plan(out, Path("all.toml"), [Job(ManifestRow("van", "1", ()), DIGEST)])
    (row,) = read_results(out).sessions
    return row


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", [OUTCOME_FILE, "calibration.json", "export/tf2.sh"])
def test_a_result_with_something_else_than_files_is_refused_and_stays(kind, name, tmp_path):
    folder = ResultsFolder(tmp_path)
    write(folder)
    put(kind, place := folder.folder_of(DIGEST) / name)
    before = os.lstat(place)
    for refused in (lambda: folder.outcome(DIGEST), lambda: write(folder)):
        with pytest.raises(CalibrationError, match=f"{name}: is .*, not a file; it was neither read nor changed"):
            refused()
    assert os.lstat(place) == before
    assert not list(folder.folder_of("").glob(".*"))


def test_a_batch_refuses_a_result_that_status_cannot_read(tmp_path):
    out, jobs = tmp_path / "out", quick_jobs(tmp_path, 1)
    drive(jobs, InProcess(), ResultsFolder(out))
    write_plan(out, Path("all.toml"), jobs)
    put("link to a file", place := ResultsFolder(out).folder_of(jobs[0].digest) / OUTCOME_FILE)
    (row,) = read_results(out).sessions
    with pytest.raises(CalibrationError) as refused:
        drive(jobs, InProcess(), ResultsFolder(out))
    assert (row.status, row.reason) == ("unreadable", str(refused.value))
    assert row.reason.startswith(f"{place}: ")
    assert place.is_symlink()


@pytest.mark.parametrize(
    "name",
    ["/dev/zero", "../../elsewhere.json", "export/../calibration.json", "./calibration.json", "", "a//b", "a\\b"],
)
def test_an_outcome_that_lists_what_is_not_in_its_folder_is_none(name, tmp_path):
    folder = ResultsFolder(tmp_path)
    write(folder)
    place = folder.folder_of(DIGEST) / OUTCOME_FILE
    outcome = json.loads(place.read_text())
    outcome["files"][0]["name"] = name
    place.write_text(json.dumps(outcome))
    assert folder.outcome(DIGEST) is None
    with pytest.raises(InputError, match=r"files\[0\]\.name"):
        read_outcome(place.read_text())


@pytest.mark.parametrize("text", ['{"schema": ' + "[" * 30_000, '{"schema": ' + "9" * 5000, "{", ""], ids=len)
def test_an_outcome_that_cannot_be_parsed_is_none_and_told(text, tmp_path):
    folder = ResultsFolder(tmp_path)
    write(folder)
    (folder.folder_of(DIGEST) / OUTCOME_FILE).write_text(text)
    assert folder.outcome(DIGEST) is None
    assert row_of(tmp_path).status == "unreadable"


@pytest.mark.parametrize("below", ["", "export"])
def test_a_folder_of_a_result_that_is_a_link_is_not_followed(below, tmp_path):
    folder = ResultsFolder(tmp_path / "out")
    write(folder)
    place = folder.folder_of(DIGEST) / below
    place.rename(tmp_path / "theirs")
    place.symlink_to(tmp_path / "theirs")
    for refused in (lambda: folder.outcome(DIGEST), lambda: write(folder)):
        with pytest.raises(CalibrationError, match="is a symbolic link, which is not followed"):
            refused()
    assert place.is_symlink()
    assert not list(folder.folder_of("").glob(".*"))
    assert list((tmp_path / "theirs").iterdir())
    assert below or row_of(tmp_path / "out").status == "unreadable"


def test_results_behind_a_link_are_neither_read_nor_written_but_the_folder_itself_may_be_one(tmp_path):
    (tmp_path / "theirs").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "results").symlink_to(tmp_path / "theirs")
    with pytest.raises(
        CalibrationError, match=r"out/results: is a symbolic link, .* or name another folder of results"
    ):
        drive(quick_jobs(tmp_path, 1), InProcess(), ResultsFolder(tmp_path / "out"))
    with pytest.raises(CalibrationError, match="is a symbolic link"):
        write(ResultsFolder(tmp_path / "out"))
    assert list((tmp_path / "theirs").iterdir()) == []
    (tmp_path / "mine").symlink_to(tmp_path / "theirs")
    write(ResultsFolder(tmp_path / "mine"))
    assert ResultsFolder(tmp_path / "theirs").outcome(DIGEST) is not None


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_manifest_wants_is_never_read_or_written_through_something_else(kind, tmp_path):
    (tmp_path / "out" / "manifests").mkdir(parents=True)
    put(kind, tmp_path / "out" / "manifests" / "all.toml.json")
    plan = read_plans(tmp_path / "out")
    assert plan.digests == {}
    (unread,) = plan.unread
    assert "manifests/all.toml.json: " in unread
    assert "neither read nor changed" in unread
    with pytest.raises(CalibrationError, match=r"all\.toml\.json: is .*, not a file; it was neither read nor changed"):
        write_plan(tmp_path / "out", Path("all.toml"), ())
    if kind == "link to a file":
        assert (tmp_path / "out" / "elsewhere.json").read_text() == "theirs"


@pytest.mark.parametrize("kind", KINDS[:3])
def test_an_outcome_that_is_no_file_is_named(kind, tmp_path):
    folder = ResultsFolder(tmp_path / "out")
    write(folder)
    put(kind, folder.folder_of(DIGEST) / OUTCOME_FILE)
    row = row_of(tmp_path / "out")
    assert row.status == "unreadable"
    assert f"results/{DIGEST}/outcome.json: is a " in row.reason
