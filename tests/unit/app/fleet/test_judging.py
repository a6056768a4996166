"""Judging a fleet by its truth: each kind of mistake is found where it is made."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.fleet.judging import judge, main
from benchmarks.fleet.truth import FleetTruth, TrueSession
from calib_core.geometry import RigidTransform
from cocalib.fleet.reading import read_fleet
from tests.unit.app.fleet.made_results import make_fleet, make_result

_TURNED = np.array([0.0, 0.0, 0.0, 0.1, 0.0, 0.0])
_POSE = RigidTransform(np.eye(3), np.zeros(3))
_QUESTIONS = ("accounted", "remounts", "wrong radars", "spoilt", "unchanged", "of their kind", "trusted")


def _truth(vehicles: int = 6, **faults: str) -> FleetTruth:
    """Return the truth of a made fleet; "remounted" is before the last session, any other fault in both."""
    rows = []
    for name in (f"V{index:03}" for index in range(vehicles)):
        fault = faults.get(name)
        said = None if fault == "remounted" else fault
        rows += [
            TrueSession(name, "s0", False, said, _POSE),
            TrueSession(name, "s1", fault == "remounted", said, _POSE),
        ]
    return FleetTruth(tuple(rows))


def _wrong(truth: FleetTruth, folder: Path) -> dict[str, int]:
    judged = judge(truth, read_fleet(folder))
    return {name: len(one.wrong) for name, one in zip(_QUESTIONS, judged, strict=True) if one.wrong}


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sound")
    make_fleet(folder, 6)
    return folder


@pytest.fixture(scope="module")
def moved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("moved")
    make_fleet(folder, 6, moved={"V002": _TURNED})
    return folder


def test_a_sound_fleet_has_nothing_wrong(sound):
    judged = judge(_truth(), read_fleet(sound))
    assert [one.of for one in judged] == [12, 0, 0, 0, 6, 12, 12]
    assert not any(one.wrong for one in judged)


@pytest.mark.parametrize(
    ("is_moved", "faults", "wrong"),
    [
        (True, {"V002": "remounted"}, {}),
        (False, {"V002": "remounted"}, {"remounts": 1}),
        (True, {}, {"unchanged": 1, "of their kind": 1}),
        (True, {"V002": "mirrored radar"}, {}),
        (False, {"V004": "mirrored radar"}, {"wrong radars": 1}),
        (False, {"V001": "broken recording"}, {"spoilt": 2}),
    ],
    ids=["named", "missed", "false", "of a wrong radar", "wrong radar that looks healthy", "broken has to fail"],
)
def test_each_kind_of_mistake_is_found_where_it_is_made(sound, moved, is_moved, faults, wrong):
    truth, folder = _truth(**faults), moved if is_moved else sound
    assert _wrong(truth, folder) == wrong
    if "remounted" in faults.values() and is_moved:
        assert "remounted" in judge(truth, read_fleet(folder))[1].named[0]


def test_a_session_without_a_result_or_without_a_reason_is_not_accounted_for(tmp_path):
    make_fleet(tmp_path, 2)
    make_result(tmp_path, "V000", "s2", status="failed")
    make_result(tmp_path, "V000", "s3", status="refused", reason="nothing was clicked")
    more = tuple(TrueSession("V000", name, False, None, _POSE) for name in ("s2", "s3", "s4"))
    truth = FleetTruth((*_truth(2).sessions, *more))
    assert _wrong(truth, tmp_path) == {"accounted": 2, "trusted": 2}


def test_the_exit_code_says_whether_anything_is_wrong(sound, tmp_path, capsys):
    pose = '"camera_from_radar": {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation_m": [0, 0, 0]}'
    rows = [
        f'{{"vehicle": "{one.vehicle}", "session": "{one.session}", "remounted": false, "fault": null, {pose}}}'
        for one in _truth().sessions
    ]
    truth = tmp_path / "truth.json"
    truth.write_text(f'{{"sessions": [{", ".join(rows)}]}}')
    assert main([str(tmp_path), str(sound)]) == 0
    truth.write_text(f'{{"sessions": [{", ".join([*rows, rows[0].replace("s0", "s9")])}]}}')
    assert main([str(tmp_path), str(sound)]) == 1
    assert "wrong: V000/s9: no result" in capsys.readouterr().out
