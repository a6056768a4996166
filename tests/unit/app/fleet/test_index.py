"""The index says what the results say, however it was written, and can be read whatever became of its writer."""

import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Mapping
from contextlib import closing
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import InputError
from cocalib.batch.job import Job
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.outcome import read_outcome
from cocalib.batch.plan import write_plan
from cocalib.batch.results_folder import OUTCOME_FILE, ResultsFolder
from cocalib.fleet.index import INDEX_VERSION, FleetIndex, index_path, read_fleet, rebuild_index
from cocalib.fleet.records import FleetRecord
from tests.unit.app.fleet.made_results import DAY_NS, FIRST_NS, digest_of, make_fleet, make_result

_TABLES = ("sessions", "poses", "transitions", "files")


def _content(folder: Path) -> dict[str, list[tuple[object, ...]]]:
    with closing(sqlite3.connect(index_path(folder))) as connection:
        return {name: connection.execute(f"SELECT * FROM {name} ORDER BY 1, 2").fetchall() for name in _TABLES}


def _summary(fleet: FleetRecord) -> list[tuple[str, list[str], list[str]]]:
    return [
        (one.name, [record.name for record in one.sessions], [change.words for change in one.transitions])
        for one in fleet.vehicles
    ]


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fleet")
    make_fleet(folder, 3, 2, moved={"V001": np.array([0.0, 0.0, 0.0, 0.1, 0.0, 0.0])})
    make_result(folder, "V001", "s0", run=2, recorded_ns=FIRST_NS)
    make_result(folder, "V002", "s9", status="failed", reason="no such file")
    return folder


@pytest.fixture
def folder(results: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(results, tmp_path / "out"))


def _write_plan(folder: Path, *names: tuple[str, str], digests: Mapping[tuple[str, str], str] | None = None) -> None:
    """Write what a manifest wants; by default six sessions."""
    rows = names or (("V002", "s9"), ("V002", "s0"), ("V002", "s1"), ("V001", "s0"), ("V001", "s1"), ("V000", "s0"))
    jobs = [Job(ManifestRow(*name, ()), (digests or {}).get(name, "unknown")) for name in rows]
    write_plan(folder, Path("fleet.toml"), jobs)


@pytest.mark.parametrize("order", [1, -1])
def test_an_index_written_along_equals_one_rebuilt_from_the_results(folder: Path, tmp_path: Path, order: int) -> None:
    other = tmp_path / "other"
    _write_plan(other)
    _write_plan(folder)
    with FleetIndex(other) as index:
        for place in sorted((folder / "results").iterdir())[::order]:
            shutil.copytree(place, other / "results" / place.name)
            index.add(read_outcome((place / OUTCOME_FILE).read_text()))
    rebuild_index(folder)
    assert _content(folder) == _content(other)
    assert _summary(read_fleet(folder)) == _summary(read_fleet(other))


def test_reading_needs_no_index_and_the_index_no_reading(folder: Path) -> None:
    without = read_fleet(folder)
    assert not index_path(folder).exists()
    rebuild_index(folder)
    assert _summary(read_fleet(folder)) == _summary(without)
    assert [one.name for one in without.vehicles] == ["V000", "V001", "V002"]


def test_poses_and_transitions_come_back_without_a_digit_lost(folder: Path) -> None:
    before = read_fleet(folder).vehicles[1].transitions[0]
    rebuild_index(folder)
    after = read_fleet(folder).vehicles[1].transitions[0]
    assert after.is_remount
    assert after.words == before.words
    assert np.array_equal(after.covariance, before.covariance)
    assert np.array_equal(after.after.camera_from_radar.rotation, before.after.camera_from_radar.rotation)
    assert np.array_equal(after.before.systematic, before.before.systematic)
    assert after.after.camera is not None
    assert before.after.camera is not None
    assert np.array_equal(after.after.camera.matrix_px, before.after.camera.matrix_px)


def test_the_latest_run_of_a_session_counts_and_the_other_is_kept_as_superseded(folder: Path) -> None:
    fleet = read_fleet(folder)
    assert [one.outcome.digest for one in fleet.superseded] == [digest_of("V001", "s0")]
    assert fleet.vehicles[1].sessions[0].outcome.digest == digest_of("V001", "s0", 2)
    assert [one.before.session for one in fleet.vehicles[1].transitions] == ["s0"]


def test_the_result_counts_that_the_latest_batch_wanted_although_another_is_newer(folder: Path) -> None:
    wanted = {("V001", "s0"): digest_of("V001", "s0")}
    _write_plan(folder, ("V001", "s0"), digests=wanted)
    for _ in range(2):
        fleet = read_fleet(folder)
        assert fleet.vehicles[1].sessions[0].outcome.digest == digest_of("V001", "s0")
        assert [one.outcome.digest for one in fleet.superseded] == [digest_of("V001", "s0", 2)]
        rebuild_index(folder)
    _write_plan(folder, ("V001", "s0"), digests={("V001", "s0"): digest_of("V001", "s0", 2)})
    assert [one.outcome.digest for one in read_fleet(folder).superseded] == [digest_of("V001", "s0")]
    with FleetIndex(folder):
        pass
    assert [one.outcome.digest for one in read_fleet(folder).superseded] == [digest_of("V001", "s0")]


def test_what_a_manifest_names_without_a_result_is_missing_and_the_other_way_round_unlisted(folder: Path) -> None:
    assert read_fleet(folder).missing == read_fleet(folder).unlisted == ()
    _write_plan(folder, ("V000", "s0"), ("V000", "s7"), ("new", "s0"))
    (folder / "manifests" / "torn.toml.json").write_text("{")
    fleet = read_fleet(folder)
    assert fleet.missing == (("V000", "s7"), ("new", "s0"))
    assert ("V001", "s0") in fleet.unlisted
    assert ("V000", "s0") not in fleet.unlisted
    assert fleet.manifests == ("fleet.toml",)


def test_sessions_come_by_time_and_those_never_opened_after_the_one_before_them_in_the_manifest(folder: Path) -> None:
    _write_plan(folder)
    rebuild_index(folder)
    assert [one.name for one in read_fleet(folder).vehicles[2].sessions] == ["s9", "s0", "s1"]
    _write_plan(folder, ("V002", "s0"), ("V002", "s9"), ("V002", "s1"))
    assert [one.name for one in read_fleet(folder).vehicles[2].sessions] == ["s0", "s9", "s1"]
    with FleetIndex(folder):
        pass
    assert [one.name for one in read_fleet(folder).vehicles[2].sessions] == ["s0", "s9", "s1"]
    make_result(folder, "V002", "earlier", recorded_ns=FIRST_NS - DAY_NS)
    assert [one.name for one in read_fleet(folder).vehicles[2].sessions] == ["earlier", "s0", "s9", "s1"]


def test_results_that_the_index_lacks_are_read_and_those_deleted_are_not_and_nothing_is_written(folder: Path) -> None:
    rebuild_index(folder)
    before = index_path(folder).read_bytes()
    make_result(folder, "V005", "s0")
    shutil.rmtree(ResultsFolder(folder).folder_of(digest_of("V000", "s0")))
    shutil.rmtree(ResultsFolder(folder).folder_of(digest_of("V000", "s1")))
    fleet = read_fleet(folder)
    assert [one.name for one in fleet.vehicles] == ["V001", "V002", "V005"]
    assert index_path(folder).read_bytes() == before
    rebuild_index(folder)
    assert _summary(read_fleet(folder)) == _summary(fleet)


def test_a_job_that_was_run_again_without_the_index_is_read_again(folder: Path) -> None:
    rebuild_index(folder)
    make_result(folder, "V002", "s9", recorded_ns=FIRST_NS + 5 * DAY_NS)
    fleet = read_fleet(folder)
    assert [(one.name, one.outcome.status) for one in fleet.vehicles[2].sessions][-1] == ("s9", "solved")
    with FleetIndex(folder):
        pass
    content = _content(folder)
    rebuild_index(folder)
    assert _content(folder) == content


def test_a_writer_at_work_is_read_past(folder: Path) -> None:
    rebuild_index(folder)
    expected = _summary(read_fleet(folder))
    with closing(sqlite3.connect(index_path(folder), isolation_level=None)) as writer:
        writer.execute("BEGIN IMMEDIATE")
        writer.execute("DELETE FROM sessions")
        assert _summary(read_fleet(folder)) == expected
        writer.execute("ROLLBACK")


def test_two_drivers_of_one_folder_write_one_index(folder: Path) -> None:
    with FleetIndex(folder) as one, FleetIndex(folder) as other:
        for index in range(4):
            outcome = make_result(folder, f"W{index % 2}", f"s{index}", recorded_ns=FIRST_NS - index * DAY_NS)
            (one, other)[index // 2].add(outcome)
    content = _content(folder)
    rebuild_index(folder)
    assert _content(folder) == content
    assert [record.name for record in read_fleet(folder).vehicles[3].sessions] == ["s2", "s0"]


_KILLED = """
import os, sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
connection.execute("PRAGMA cache_size = 1")
connection.execute("BEGIN IMMEDIATE")
connection.execute("UPDATE sessions SET vehicle = 'gone', outcome = outcome || outcome || outcome")
connection.execute("UPDATE poses SET covariance = covariance || covariance")
os._exit(9)
"""


def test_a_killed_writer_leaves_an_index_that_can_be_read_and_that_the_next_one_continues(folder: Path) -> None:
    rebuild_index(folder)
    expected, content = _summary(read_fleet(folder)), _content(folder)
    killed = subprocess.run([sys.executable, "-c", _KILLED, str(index_path(folder))], check=False)
    assert killed.returncode == 9
    assert Path(f"{index_path(folder)}-journal").stat().st_size > 0
    assert _summary(read_fleet(folder)) == expected
    assert Path(f"{index_path(folder)}-journal").exists()
    with FleetIndex(folder):
        pass
    assert _content(folder) == content


def test_a_rebuild_over_a_killed_writers_index_is_not_undone_by_its_journal(folder: Path) -> None:
    rebuild_index(folder)
    content = _content(folder)
    subprocess.run([sys.executable, "-c", _KILLED, str(index_path(folder))], check=False)
    rebuild_index(folder)
    assert _content(folder) == content


def test_an_index_of_another_version_says_what_to_do(folder: Path) -> None:
    rebuild_index(folder)
    with closing(sqlite3.connect(index_path(folder))) as connection:
        connection.execute(f"PRAGMA user_version = {INDEX_VERSION + 1}")
    with pytest.raises(InputError, match=rf"version {INDEX_VERSION + 1}.*cocalib fleet rebuild"):
        read_fleet(folder)
    with pytest.raises(InputError, match="cocalib fleet rebuild"):
        FleetIndex(folder)
    rebuild_index(folder)
    assert len(read_fleet(folder).vehicles) == 3


def test_a_file_that_is_no_index_says_what_to_do(folder: Path) -> None:
    index_path(folder).write_bytes(b"no database at all" * 100)
    with pytest.raises(InputError, match="cocalib fleet rebuild"):
        read_fleet(folder)
    with pytest.raises(InputError, match="cocalib fleet rebuild"):
        FleetIndex(folder)


def test_rows_that_were_changed_are_read_from_the_results(folder: Path) -> None:
    rebuild_index(folder)
    expected = _summary(read_fleet(folder))
    with closing(sqlite3.connect(index_path(folder))) as connection, connection:
        connection.execute("UPDATE sessions SET outcome = replace(outcome, 'outcome-1', 'outcome-2')")
    assert _summary(read_fleet(folder)) == expected


def test_an_index_of_results_that_a_newer_program_wrote_says_what_to_do(folder: Path) -> None:
    rebuild_index(folder)
    for place in (folder / "results").glob("*/outcome.json"):
        text = place.read_text()
        if '"session": "s0"' in text:
            place.write_text(text.replace('"status"', '"state"'))
    with closing(sqlite3.connect(index_path(folder))) as connection, connection:
        connection.execute(
            "UPDATE sessions SET outcome = replace(outcome, '\"status\"', '\"state\"') WHERE session = 's0'"
        )
    with pytest.raises(InputError, match="cocalib fleet rebuild"):
        read_fleet(folder)
    assert len(rebuild_index(folder)) == 4
    assert [one.name for one in read_fleet(folder).vehicles[0].sessions] == ["s1"]


def test_a_result_that_no_table_can_hold_is_named(folder: Path) -> None:
    make_result(folder, "V9", "s0", recorded_ns=2**64)
    (unread,) = read_fleet(folder).unread
    assert "states a time" in unread.reason


def test_results_of_another_version_are_left_out_and_named(folder: Path) -> None:
    place = ResultsFolder(folder).folder_of(digest_of("V000", "s0")) / "outcome.json"
    place.write_text(place.read_text().replace("outcome-1", "outcome-2"))
    unread = rebuild_index(folder)
    assert [one.place for one in unread] == [f"results/{digest_of('V000', 's0')}/outcome.json"]
    assert "outcome-1" in unread[0].reason
    fleet = read_fleet(folder)
    assert fleet.unread == unread
    assert [one.name for one in fleet.vehicles[0].sessions] == ["s1"]


def test_a_folder_of_nothing_but_foreign_results_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no results"):
        read_fleet(tmp_path)
    with pytest.raises(InputError, match="no results"):
        rebuild_index(tmp_path)
    make_result(tmp_path, "V", "s")
    (ResultsFolder(tmp_path).folder_of(digest_of("V", "s")) / "outcome.json").write_text("{}")
    with pytest.raises(InputError, match=r"no result can be read: results/.*outcome\.json"):
        read_fleet(tmp_path)


def test_a_calibration_that_was_changed_is_not_compared(folder: Path) -> None:
    place = ResultsFolder(folder).folder_of(digest_of("V000", "s1")) / "calibration.json"
    place.write_text(place.read_text() + " ")
    record = read_fleet(folder).vehicles[0].last
    assert record.pose is None
    assert "is not the file that the outcome lists" in record.pose_problem
    assert record.outcome.status == "solved"


def test_a_calibration_of_another_version_is_named_and_not_compared(folder: Path) -> None:
    place = ResultsFolder(folder).folder_of(digest_of("V000", "s1"))
    given = (place / "calibration.json").read_text()
    text = given.replace("calibration-1", "calibration-2")
    (place / "calibration.json").write_text(text)
    outcome = (place / "outcome.json").read_text()
    (place / "outcome.json").write_text(
        outcome.replace(sha256(given.encode()).hexdigest(), sha256(text.encode()).hexdigest())
    )
    record = read_fleet(folder).vehicles[0].last
    assert record.pose is None
    assert "calibration-2" in record.pose_problem


def test_an_outcome_in_the_wrong_folder_is_named(folder: Path) -> None:
    results = folder / "results"
    shutil.copytree(results / digest_of("V000", "s0"), results / ("ab" * 16))
    assert [one.place for one in read_fleet(folder).unread] == [f"results/{'ab' * 16}/outcome.json"]


@pytest.mark.parametrize("count", [1, 2])
def test_small_fleets_are_told_too(tmp_path: Path, count: int) -> None:
    make_fleet(tmp_path, count, 1)
    fleet = read_fleet(tmp_path)
    assert len(fleet.vehicles) == count
    assert all(one.transitions == () for one in fleet.vehicles)
