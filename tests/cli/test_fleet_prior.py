"""`cocalib solve --fleet-prior`: from a file of the fleet to a calibration that names it."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib_core.fleet_prior import FleetPrior
from calib_core.interchange.own.fleet_prior_json import write_fleet_prior
from tests.cli.conftest import Made

Cocalib = Callable[..., Any]


@pytest.fixture
def prior_file(tmp_path: Path) -> Callable[..., Path]:
    def write(turned_deg: float = 0.0) -> Path:
        mean = Made().camera_from_radar.perturbed(np.array([0.0, 0.0, 0.0, 0.0, np.deg2rad(turned_deg), 0.0]))
        covariance = np.diag([5e-3] * 3 + [np.deg2rad(0.3)] * 3) ** 2
        path = tmp_path / f"van{turned_deg:g}.json"
        path.write_text(write_fleet_prior(FleetPrior("van", mean, covariance, tuple(f"V{k}" for k in range(20)))))
        return path

    return write


def test_a_recording_is_solved_with_it_and_again_from_its_file(
    cocalib: Cocalib, made: Callable[..., Path], clicks_file: Path, prior_file: Callable[..., Path], tmp_path: Path
) -> None:
    prior, out, again = prior_file(), tmp_path / "calibration.json", tmp_path / "again.json"
    answer = cocalib("solve", made(), "--clicks", clicks_file, "--fleet-prior", prior, "--out", out)
    assert answer.code == 0, answer.err
    assert "fleet: The pose rests on the data and on the prior of type van (20 vehicles): " in answer.out
    assert "fleet: The data alone would be " in answer.out
    assert "nobody said which this is: name it with --vehicle" in answer.err
    document = json.loads(out.read_text())
    assert document["fleet_prior"]["used"] is True
    assert document["provenance"]["inputs"][-1] == {
        "name": prior.name,
        "size_bytes": prior.stat().st_size,
        "sha256": hashlib.sha256(prior.read_bytes()).hexdigest(),
    }
    assert cocalib("solve", "--pairs", out, "--out", again).code == 0
    assert json.loads(again.read_text()) | {"provenance": 0} == document | {"provenance": 0}


def test_a_vehicle_off_its_kind_is_named(
    cocalib: Cocalib, pairs_file: Callable[..., Path], prior_file: Callable[..., Path], tmp_path: Path
) -> None:
    out, alone = tmp_path / "calibration.json", tmp_path / "alone.json"
    answer = cocalib("solve", "--pairs", pairs_file(), "--fleet-prior", prior_file(30.0), "--out", out)
    assert answer.code == 0, answer.err
    assert answer.out.startswith("verdict: weak: the data contradict the fleet's prior of type van: ")
    assert cocalib("solve", "--pairs", pairs_file(), "--out", alone).code == 0
    found, plain = json.loads(out.read_text()), json.loads(alone.read_text())
    assert found["fleet_prior"]["used"] is False
    assert found["camera_from_radar"] == plain["camera_from_radar"]
    assert [one["code"] for one in found["warnings"]].count("off-its-kind") == 1
    assert [one["name"] for one in found["provenance"]["inputs"]][-1] == prior_file(30.0).name


@pytest.mark.parametrize("method", ["paper"])
def test_other_methods_refuse_it_before_anything_is_solved(
    cocalib: Cocalib, pairs_file: Callable[..., Path], prior_file: Callable[..., Path], method: str
) -> None:
    answer = cocalib("solve", "--pairs", pairs_file(), "--fleet-prior", prior_file(), "--method", method)
    assert answer.code == 2
    assert f"a fleet's prior is used by the default method only, and the method is {method}" in answer.err


def test_the_prior_of_another_type_or_of_the_vehicle_itself_is_refused(
    cocalib: Cocalib, made: Callable[..., Path], clicks_file: Path, prior_file: Callable[..., Path]
) -> None:
    solve = ("solve", made(), "--clicks", clicks_file, "--fleet-prior", prior_file())
    answer = cocalib(*solve, "--vehicle", "T1", "--vehicle-type", "truck")
    assert answer.code == 2
    assert "the prior is of vehicles of type van, and this vehicle is of type truck" in answer.err
    answer = cocalib(*solve, "--vehicle", "V3", "--vehicle-type", "van")
    assert (answer.code, "the prior rests on V3 itself" in answer.err) == (2, True)
    answer = cocalib(*solve, "--vehicle", "v3")
    assert (answer.code, "the prior rests on v3 (V3) itself" in answer.err) == (2, True)


def test_another_file_in_its_place_is_named(cocalib: Cocalib, pairs_file: Callable[..., Path], tmp_path: Path) -> None:
    answer = cocalib("solve", "--pairs", pairs_file(), "--fleet-prior", tmp_path / "none.json")
    assert (answer.code, "none.json: no such file" in answer.err) == (2, True)
    answer = cocalib("solve", "--pairs", pairs_file(), "--fleet-prior", pairs_file())
    assert (answer.code, "expected 'cocalib/fleet-prior-1'" in answer.err) == (2, True)
