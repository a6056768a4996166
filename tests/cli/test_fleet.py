"""`cocalib batch status` and the other actions: what it prints, writes and returns."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from cocalib.batch.results_folder import ResultsFolder
from tests.unit.app.fleet.made_results import digest_of, make_fleet, make_result


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sound")
    make_fleet(folder, 6, 2)
    return folder


@pytest.fixture(scope="module")
def moved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("moved")
    make_fleet(folder, 2, 2, moved={"V001": np.array([0.0, 0.0, 0.0, 0.1, 0.0, 0.0])})
    make_result(folder, "V001", "s0", run=1)
    return folder


def test_a_sound_fleet_has_nothing_to_look_at(cocalib, sound):
    answer = cocalib("batch", "status", sound)
    assert answer.code == 0, answer.err
    lines = answer.out.splitlines()
    assert lines[0].split()[:3] == ["vehicle", "last", "session"]
    assert [line.split()[0] for line in lines[1:7]] == [f"V00{index}" for index in range(6)]
    assert lines[7] == "6 vehicles, nothing to look at"
    assert lines[8].startswith("type van, 6 vehicles: mountings scatter by ")


def test_what_needs_a_look_is_exit_code_3_and_as_json_every_figure(cocalib, moved):
    answer, data = cocalib("batch", "status", moved), cocalib("batch", "status", moved, "--json")
    assert answer.code == data.code == 3
    assert "1 of 2 vehicles to look at:\n  V001: this radar was remounted: " in answer.out
    found = json.loads(data.out)
    assert found["schema"] == "cocalib/fleet-status-1"
    one, other = found["vehicles"]
    assert (one["vehicle"], one["remounted"], one["needs"]) == ("V000", False, [])
    assert (other["vehicle"], other["remounted"]) == ("V001", True)
    assert other["last"]["verdict"] in ("good", "usable")
    assert other["change"]["rotation_deg"] > 4
    assert other["age_days"] > 0
    assert found["types"][0]["sigma"] is None
    assert "too few" in found["types"][0]["reason"]


def test_history_has_each_transition_with_its_covariance(cocalib, moved):
    answer = cocalib("batch", "history", "V001", moved, "--json")
    assert answer.code == 0
    found = json.loads(answer.out)
    assert [one["session"] for one in found["sessions"]] == ["s0", "s1"]
    assert [one["digest"] for one in found["superseded"]] == [digest_of("V001", "s0")]
    (change,) = found["transitions"]
    covariance = np.array(change["covariance"])
    before, after = (np.array(one["covariance"]) for one in found["sessions"])
    assert np.allclose(covariance, before + after, rtol=1e-12)
    squared = np.array(change["change"]) @ np.linalg.solve(covariance, np.array(change["change"]))
    assert squared == pytest.approx(change["squared_distance"], rel=1e-6)
    assert change["outcome"] == "remounted"
    assert change["picture_px"] > 0
    text = cocalib("batch", "history", "V001", moved)
    assert "this radar was remounted" in text.out
    assert f"superseded by later runs: s0 ({digest_of('V001', 's0')})" in text.out


def test_compare_says_whether_two_differ(cocalib, moved):
    differing = cocalib("batch", "compare", "V001/s0", "V001/s1", moved)
    assert differing.code == 3
    assert differing.out.startswith("this radar was remounted: ")
    same = cocalib("batch", "compare", "V000/s0", "V000/s1", moved, "--json")
    assert same.code == 0
    assert json.loads(same.out)["outcome"] in ("same", "cannot-tell")
    vehicles = cocalib("batch", "compare", "V000", "V001", moved)
    assert "V000 and V001" in vehicles.out


def test_export_and_summary_write_the_table_and_the_page_and_results_of_another_version_are_named(cocalib, tmp_path):
    make_fleet(tmp_path / "out", 2, 1)
    assert cocalib("batch", "summary", tmp_path / "out").code == 0
    assert "<html" in (tmp_path / "out" / "summary.html").read_text()
    assert cocalib("batch", "export", tmp_path / "out", "--csv", tmp_path / "f.csv").code == 0
    assert len((tmp_path / "f.csv").read_text().splitlines()) == 3
    place = ResultsFolder(tmp_path / "out").folder_of(digest_of("V001", "s0")) / "outcome.json"
    place.write_text(place.read_text().replace("outcome-1", "outcome-2"))
    answer = cocalib("batch", "status", tmp_path / "out")
    assert answer.code == 3
    assert re.search(r"note: results/\w+/outcome\.json is no cocalib/outcome-1", answer.err)
    assert "V000" in answer.out


def test_names_cannot_act_on_the_terminal(cocalib, tmp_path):
    make_result(tmp_path, "V\x1b[2J", "s\u202e0", status="failed", reason="\x07")
    for action in ("status", "history V\x1b[2J"):
        out = cocalib("batch", *action.split(" "), tmp_path).out
        assert not set(out) & {"\x1b", "\u202e", "\x07"}
