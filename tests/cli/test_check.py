"""`cocalib check` as a gate: exit codes, JSON, JUnit, several files, and a recording."""

import json
import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import calib_core as cc
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.interchange.check.slips import QUESTIONS
from calib_core.interchange.own.calibration_json import read_calibration


@pytest.fixture
def moved(solved: Path, tmp_path: Path) -> Path:
    """Return the pose turned by 5 degrees, as a bare matrix."""
    pose = read_calibration(solved.read_text()).calibration.camera_from_radar
    turn = RigidTransform(rotation_exp(np.array([0.0, 0.0, np.radians(5.0)])), np.zeros(3))
    matrix = (turn @ pose).as_matrix()
    matrix[:3, 3] = pose.translation_m
    np.savetxt(tmp_path / "moved.txt", matrix)
    return tmp_path / "moved.txt"


@pytest.mark.slow
def test_a_difference_fails_the_gate_unless_the_limits_allow_it(cocalib, solved, moved, tmp_path):
    differs = cocalib("check", moved, "--against", solved)
    assert differs.code == 1
    assert "DIFFERS: 5 deg" in differs.out
    assert cocalib("check", moved, "--against", solved, "--max-deg", "6").code == 0
    assert cocalib("check", moved, "--against", solved, "--max-deg", "6", "--max-px", "2").code == 1
    same = shutil.copy(solved, tmp_path / "same.json")
    assert cocalib("check", same, "--against", solved, "--max-sigma", "1").code == 0


def test_json_is_one_object_with_every_file(cocalib, solved, moved, tmp_path):
    broken = tmp_path / "broken.json"
    broken.write_text("{}")

    answer = cocalib("check", solved, moved, broken, "--against", solved, "--json")

    assert answer.code == 1
    found = json.loads(answer.out)
    assert (found["schema"], found["exit_code"]) == ("cocalib/check-1", 1)
    assert [one["verdict"] for one in found["files"]] == ["right", "wrong", "unreadable"]
    right, wrong, unreadable = found["files"]
    assert right["comparison"]["agree"] is True
    assert wrong["comparison"]["rotation_deg"] == pytest.approx(5.0)
    assert wrong["comparison"]["criteria"][0].keys() == {"name", "value", "limit", "met"}
    assert [one["code"] for one in wrong["results"] if one["level"] == "error"] == ["disagrees"]
    assert [at["distance_m"] for at in wrong["comparison"]["pixels"]] == [5.0, 20.0, 60.0]
    assert "no pose" in unreadable["error"]
    first, second = cocalib("check", solved, moved, "--against", solved).out.splitlines()
    assert first.startswith(f"{solved}: right: ")
    assert second.startswith(f"{moved}: wrong: 5 deg")


def test_junit_has_the_same_cases_whatever_the_answers_and_failures_with_their_code(cocalib, solved, moved, tmp_path):
    (tmp_path / "broken.json").write_text("{}")
    out = tmp_path / "report.xml"

    answer = cocalib("check", solved, moved, tmp_path / "broken.json", "--against", solved, "--junit", out)

    assert answer.code == 1
    suites = ElementTree.fromstring(out.read_text())
    assert [suite.get("name") for suite in suites] == [str(solved), str(moved), str(tmp_path / "broken.json")]
    assert [suite.get("failures") for suite in suites] == ["0", "2", "0"]
    assert [suite.get("errors") for suite in suites] == ["0", "0", "1"]
    for suite in suites:
        assert int(suite.get("tests", "0")) == len(suite.findall("testcase")) > 0
        assert [case.get("name") for case in suite] == ["readable", *QUESTIONS, "verdict"]
        assert all(case.get("classname") for case in suite)
    failed = {case.get("name"): failure for case in suites.iter("testcase") for failure in case.iter("failure")}
    assert {name: failure.get("type") for name, failure in failed.items()} == {
        "against": "disagrees",
        "verdict": "wrong",
    }
    assert "5 deg" in (failed["against"].get("message") or "")


def test_every_result_answers_a_question(cocalib, solved, moved, clicks_file):
    made = solved.with_name("made.mcap")
    asked = set()
    for options in (
        ("--of", solved),
        ("--against", solved),
        ("--pairs", solved),
        ("--recording", made, "--clicks", clicks_file),
    ):
        (file,) = json.loads(cocalib("check", moved, *options, "--json").out)["files"]
        assert all(result["question"] in QUESTIONS for result in file["results"])
        asked |= {result["question"] for result in file["results"]}
    assert {"of", "against", "pairs", "recording"} <= asked


def test_in_python_a_check_has_what_json_has(cocalib, solved, tmp_path):
    other = shutil.copy(solved, tmp_path / "other.json")
    report = cc.check(other, against=solved, same_sensors=True, same_person=True)
    answer = cocalib("check", other, "--against", solved, "--same-sensors", "--same-person", "--json")
    comparison = json.loads(answer.out)["files"][0]["comparison"]
    assert (report.comparison.shared, report.comparison.unshared) == (
        tuple(comparison["shared"]),
        comparison["unshared"],
    )
    for key in ("agree", "p_value", "noticeable"):
        assert getattr(report, key) == comparison[key]
    alone = cc.check(other)
    assert (alone.agree, alone.p_value, alone.noticeable) == (None, None, None)


def test_a_calibration_holds_on_its_own_recording_and_not_after_the_camera_moved(cocalib, solved, clicks_file):
    holds = cocalib("check", solved, "--recording", solved.with_name("made.mcap"), "--clicks", clicks_file)
    assert holds.code == 0, holds.out
    assert "holds: residuals of 8" in holds.out

    assert (
        cocalib("check", solved, "--recording", solved.with_name("made.mcap")).code == 0
    )  # the clicks that the calibration keeps

    late = json.loads(clicks_file.read_text())
    for click in late["clicks"]:
        click["pixel_px"][0] += 20.0
    clicks_file.write_text(json.dumps(late))
    fails = cocalib("check", solved, "--recording", solved.with_name("made.mcap"), "--clicks", clicks_file)
    assert fails.code == 1
    assert "solve this recording" in fails.out


def test_a_file_without_a_camera_is_held_against_a_recording_through_its_intrinsics(
    cocalib, solved, clicks_file, tmp_path
):
    right, wrong = tmp_path / "right.sh", tmp_path / "wrong.sh"
    cocalib("export", solved, "--to", "tf2", "--out", right)
    wrong.write_text(re.sub(r"--x \S+", "--x 9.0", right.read_text()))
    on_it = ("--recording", solved.with_name("made.mcap"), "--clicks", clicks_file)

    holds = cocalib("check", right, *on_it)
    assert holds.code == 0
    assert "the given intrinsics" in holds.out
    assert cocalib("check", wrong, *on_it).code == 1


def test_another_recording_of_the_same_name_is_said(cocalib, solved, made, clicks_file):
    solved.with_name("made.mcap").rename(solved.with_name("yesterday"))
    again = made(nan_scans=1)

    answer = cocalib("check", solved, "--recording", again, "--clicks", clicks_file)

    assert f"from another {again.name} (sha256 " in answer.out
