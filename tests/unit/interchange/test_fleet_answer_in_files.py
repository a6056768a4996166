"""What a fleet's prior did to a calibration, in its file."""

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from calib_core.calibration import calibrate_pairs
from calib_core.errors import InputError
from calib_core.fleet_prior import FleetAnswer, FleetPrior
from calib_core.interchange import calibration_text, read_calibration
from calib_core.interchange.own.calibration_json import write_calibration
from calib_core.results import Calibration
from calib_core.synthetic.simulated_pairs import simulate_pairs

SCATTER = np.diag([5e-3] * 3 + [5e-3] * 3) ** 2


@cache
def calibration() -> Calibration:
    made = simulate_pairs(8, rng=np.random.default_rng(2), noise="imaging")
    prior = FleetPrior("van", made.camera_from_radar, SCATTER, ("V1", "V2"), ("V9",), widened=1.25, freedom=8.5)
    return calibrate_pairs(made.pairs, made.camera, fleet_prior=prior).unwrap()


def changed(path: str, value: object) -> str:
    document = json.loads(calibration_text(calibration()))
    place: Any = document
    *parents, last = path.split(".")
    for key in parents:
        place = place[key]
    place[last] = value
    return json.dumps(document)


def test_reading_and_writing_it_again_gives_the_same_bytes_and_the_same_numbers() -> None:
    text = calibration_text(calibration())
    file = read_calibration(text)
    assert write_calibration(file) == text
    wrote, read = calibration().fleet, file.calibration.fleet
    assert wrote is not None
    assert read is not None
    assert wrote.data_alone is not None
    assert read.data_alone is not None
    assert np.array_equal(wrote.prior.covariance, read.prior.covariance)
    assert np.array_equal(wrote.data_alone.covariance, read.data_alone.covariance)
    assert wrote.data_alone.covariance_quantile == read.data_alone.covariance_quantile
    assert wrote.data_alone.verdict == read.data_alone.verdict == "usable"
    assert wrote.data_alone.covariance_parts is not None
    assert read.data_alone.covariance_parts is not None
    np.testing.assert_allclose(
        read.data_alone.covariance_parts.systematic, wrote.data_alone.covariance_parts.systematic, rtol=1e-12
    )
    for one in ("vehicle_type", "vehicles", "left_out", "widened", "freedom"):
        assert getattr(wrote.prior, one) == getattr(read.prior, one)
    assert (wrote.used, wrote.squared, wrote.limit) == (read.used, read.squared, read.limit)


def test_a_prior_that_was_not_tested_says_so_by_what_is_absent() -> None:
    fleet = calibration().fleet
    assert fleet is not None
    untested = FleetAnswer(replace(fleet.prior, widened=1.0, freedom=np.inf), used=True, data_alone=None)
    text = calibration_text(replace(calibration(), fleet=untested))
    written = json.loads(text)["fleet_prior"]
    assert not {"data_alone", "squared_distance", "limit", "widened", "freedom"} & set(written)
    assert write_calibration(read_calibration(text)) == text
    assert read_calibration(text).calibration.fleet_prior is not None


def test_without_a_prior_there_is_no_such_key() -> None:
    assert "fleet_prior" not in json.loads(calibration_text(replace(calibration(), fleet=None)))


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("fleet_prior.covariance", (-np.eye(6)).tolist(), r"fleet_prior\.covariance: a variance .* is not positive"),
        (
            "fleet_prior.data_alone.covariance",
            np.ones((6, 6)).tolist(),
            r"data_alone\.covariance: is not positive definite",
        ),
        (
            "fleet_prior.camera_from_radar.rotation",
            np.diag([1, 1, -1]).tolist(),
            r"fleet_prior\.camera_from_radar\.rotation",
        ),
        ("fleet_prior.vehicles", [], r"fleet_prior\.vehicles"),
        ("fleet_prior.widened", 0.5, r"fleet_prior\.widened"),
        ("fleet_prior.data_alone.verdict", "fine", r"fleet_prior\.data_alone\.verdict"),
    ],
)
def test_what_no_distribution_has_is_refused_with_its_place(path: str, value: object, words: str) -> None:
    with pytest.raises(InputError, match=f"file.json: .*{words}"):
        read_calibration(changed(path, value), "file.json")
