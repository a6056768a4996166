"""A fleet is what its results say: which count, in which order, what changed, and what cannot be read."""

import shutil
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.errors import InputError
from cocalib.batch.job import Job
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, OutcomeRun
from cocalib.batch.plan import write_plan
from cocalib.batch.results_folder import ResultsFolder
from cocalib.cli import run
from cocalib.fleet.reading import in_order, read_fleet
from cocalib.fleet.records import SessionRecord
from tests.unit.app.fleet.made_results import DAY_NS, FIRST_NS, digest_of, make_fleet, make_result


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


def test_the_latest_run_of_a_session_counts_and_the_other_is_kept_as_superseded(folder):
    fleet = read_fleet(folder)
    assert [one.outcome.digest for one in fleet.superseded] == [digest_of("V001", "s0")]
    assert fleet.vehicles[1].sessions[0].outcome.digest == digest_of("V001", "s0", 2)
    assert [one.before.session for one in fleet.vehicles[1].transitions] == ["s0"]


def test_the_result_counts_that_the_latest_batch_wanted_although_another_is_newer(folder):
    wanted = {("V001", "s0"): digest_of("V001", "s0")}
    _write_plan(folder, ("V001", "s0"), digests=wanted)
    fleet = read_fleet(folder)
    assert fleet.vehicles[1].sessions[0].outcome.digest == digest_of("V001", "s0")
    assert [one.outcome.digest for one in fleet.superseded] == [digest_of("V001", "s0", 2)]
    _write_plan(folder, ("V001", "s0"), digests={("V001", "s0"): digest_of("V001", "s0", 2)})
    assert [one.outcome.digest for one in read_fleet(folder).superseded] == [digest_of("V001", "s0")]


def test_what_a_manifest_names_without_a_result_is_missing_and_the_other_way_round_unlisted(folder):
    assert read_fleet(folder).missing == read_fleet(folder).unlisted == ()
    _write_plan(folder, ("V000", "s0"), ("V000", "s7"), ("new", "s0"))
    (folder / "manifests" / "torn.toml.json").write_text("{")
    fleet = read_fleet(folder)
    assert fleet.missing == (("V000", "s7"), ("new", "s0"))
    assert ("V001", "s0") in fleet.unlisted
    assert ("V000", "s0") not in fleet.unlisted
    assert fleet.manifests == ("fleet.toml",)


def test_sessions_come_by_time_and_those_never_opened_after_the_one_before_them_in_the_manifest(folder):
    _write_plan(folder)
    assert [one.name for one in read_fleet(folder).vehicles[2].sessions] == ["s9", "s0", "s1"]
    _write_plan(folder, ("V002", "s0"), ("V002", "s9"), ("V002", "s1"))
    assert [one.name for one in read_fleet(folder).vehicles[2].sessions] == ["s0", "s9", "s1"]
    make_result(folder, "V002", "earlier", recorded_ns=FIRST_NS - DAY_NS)
    assert [one.name for one in read_fleet(folder).vehicles[2].sessions] == ["earlier", "s0", "s9", "s1"]


def test_what_cannot_be_read_is_left_out_and_named(folder):
    results = folder / "results"
    shutil.copytree(results / digest_of("V000", "s0"), results / ("ab" * 16))
    make_result(folder, "V9", "s0", recorded_ns=2**64)
    _write_plan(folder, ("V001", "s0"))
    (folder / "manifests" / "spoilt.json").write_text("garbage")
    other, damaged = (results / digest_of(*name) / "outcome.json" for name in (("V000", "s0"), ("V001", "s1")))
    other.write_text(other.read_text().replace("outcome-1", "outcome-2"))
    damaged.write_bytes(bytes([damaged.read_bytes()[0] ^ 1]) + damaged.read_bytes()[1:])
    fleet = read_fleet(folder)
    reasons = {one.place: one.reason for one in fleet.unread}
    assert set(reasons) == {
        "manifests/spoilt.json",
        f"results/{'ab' * 16}/outcome.json",
        *(f"results/{digest_of(*name)}/outcome.json" for name in (("V9", "s0"), ("V000", "s0"), ("V001", "s1"))),
    }
    assert reasons["manifests/spoilt.json"].startswith("is no cocalib/batch-plan-1: ")
    assert "states a time" in reasons[f"results/{digest_of('V9', 's0')}/outcome.json"]
    assert "outcome-1" in reasons[f"results/{digest_of('V000', 's0')}/outcome.json"]
    assert [one.name for one in fleet.vehicles[0].sessions] == ["s1"]


def test_the_history_of_a_vehicle_whose_outcome_cannot_be_read_names_the_file(folder, capsys):
    make_result(folder, "V9", "s0")
    names = [("V000", "s0"), ("V9", "s0")]
    for name in names:
        (ResultsFolder(folder).folder_of(digest_of(*name)) / "outcome.json").write_text("garbage")
    _write_plan(folder, *names, digests={name: digest_of(*name) for name in names})
    assert run(["batch", "history", "V000", str(folder)]) == 0
    assert (
        f"session s0: results/{digest_of('V000', 's0')}/outcome.json is no cocalib/outcome-1" in capsys.readouterr().out
    )
    assert run(["batch", "history", "V9", str(folder)]) == 2
    assert f"'V9': session 's0': results/{digest_of('V9', 's0')}/outcome.json: " in capsys.readouterr().err


def test_a_folder_of_nothing_but_foreign_results_is_refused(tmp_path):
    with pytest.raises(InputError, match="no results"):
        read_fleet(tmp_path)
    make_result(tmp_path, "V", "s")
    (ResultsFolder(tmp_path).folder_of(digest_of("V", "s")) / "outcome.json").write_text("{}")
    with pytest.raises(InputError, match=r"no result can be read: results/.*outcome\.json"):
        read_fleet(tmp_path)


@pytest.mark.parametrize("listed", [False, True])
def test_a_calibration_that_was_changed_or_of_another_version_is_named_and_not_compared(folder, listed):
    place = ResultsFolder(folder).folder_of(digest_of("V000", "s1"))
    given, outcome = ((place / name).read_text() for name in ("calibration.json", "outcome.json"))
    text = given.replace("calibration-1", "calibration-2")
    (place / "calibration.json").write_text(text)
    if listed:
        before, after = (sha256(content.encode()).hexdigest() for content in (given, text))
        (place / "outcome.json").write_text(outcome.replace(before, after))
    record = read_fleet(folder).vehicles[0].last
    assert record.pose is None
    assert ("calibration-2" if listed else "is not the file that the outcome lists") in record.pose_problem
    assert record.outcome.status == "solved"


@pytest.mark.parametrize("count", [1, 2])
def test_small_fleets_are_told_too(tmp_path, count):
    make_fleet(tmp_path, count, 1)
    fleet = read_fleet(tmp_path)
    assert len(fleet.vehicles) == count
    assert all(one.transitions == () for one in fleet.vehicles)


def test_a_result_that_is_still_being_written_is_none_yet(folder):
    (folder / "results" / ("cd" * 16)).mkdir()
    shutil.copytree(folder / "results" / digest_of("V000", "s0"), folder / "results" / ".unfinished")
    fleet = read_fleet(folder)
    assert fleet.unread == ()
    assert [one.name for one in fleet.vehicles] == ["V000", "V001", "V002"]


_TIMES = st.none() | st.integers(0, 20)
_ROWS = st.lists(st.tuples(_TIMES, st.none() | st.integers(0, 20)), min_size=1, max_size=8)


def _record(session: str, recorded_ns: int | None, place: int | None, *, run: str = "") -> SessionRecord:
    more = {"recorded_ns": recorded_ns, "run": OutcomeRun("host", run, 1.0) if run else None}
    return SessionRecord(Outcome(OUTCOME_SCHEMA, run or "d", "V", session, "solved", **more), place)


@given(_ROWS, st.randoms())
def test_times_grow_and_the_order_of_arrival_does_not_matter(given, shuffle):
    records = [_record(f"s{index}", time, place) for index, (time, place) in enumerate(given)]
    ordered = in_order(records)
    times = [one.outcome.recorded_ns for one in ordered if one.outcome.recorded_ns is not None]
    assert times == sorted(times)
    shuffle.shuffle(records)
    assert in_order(records) == ordered


@given(st.lists(st.integers(0, 20), min_size=1, max_size=8, unique=True))
def test_without_any_time_the_manifest_decides(places):
    records = [_record(f"s{place}", None, place) for place in places]
    assert [one.place for one in in_order(records)] == sorted(places)
