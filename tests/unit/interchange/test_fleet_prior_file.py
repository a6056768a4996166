"""The file of a fleet's prior: what is written is read back, and what no fleet says is refused."""

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.errors import InputError
from calib_core.fleet_prior import FleetPrior
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.interchange.own.fleet_prior_json import read_fleet_prior, write_fleet_prior


def prior(seed: int = 1) -> FleetPrior:
    rng = np.random.default_rng(seed)
    spread = 5e-3 * rng.normal(size=(6, 9))
    pose = RigidTransform(rotation_exp(rng.normal(size=3)), rng.normal(size=3))
    known = {} if seed % 2 else {"widened": 1.0 + rng.random(), "freedom": 8.0 + rng.random()}
    return FleetPrior("van", pose, spread @ spread.T, ("van 1", "van 2"), ("van 3",), **known)


@given(st.integers(0, 2**32 - 1))
def test_what_is_written_is_read_back(seed: int) -> None:
    one = prior(seed)
    text = write_fleet_prior(one)
    read = read_fleet_prior(text)
    assert (read.vehicle_type, read.vehicles, read.left_out) == (one.vehicle_type, one.vehicles, one.left_out)
    assert (read.widened, read.freedom) == (one.widened, one.freedom)
    assert np.abs(read.camera_from_radar.as_matrix() - one.camera_from_radar.as_matrix()).max() < 1e-15
    assert np.abs(read.covariance - one.covariance).max() <= 1e-15 * np.abs(one.covariance).max()
    assert np.array_equal(read.covariance, read.covariance.T)
    assert write_fleet_prior(read) == text


def _asymmetric(document: dict[str, Any]) -> None:
    document["covariance"][0][1] += 1e-5


def _indefinite(document: dict[str, Any]) -> None:
    document["covariance"] = (np.full((6, 6), 2e-6) - 1e-6 * np.eye(6)).tolist()


def _no_variance(document: dict[str, Any]) -> None:
    document["covariance"][5][5] = 0.0


def _in_millimetres(document: dict[str, Any]) -> None:
    document["covariance"] = (25.0 * np.eye(6)).tolist()


def _pinned(document: dict[str, Any]) -> None:
    document["covariance"] = (1e-12 * np.eye(6)).tolist()


def _mirrored(document: dict[str, Any]) -> None:
    document["camera_from_radar"] = {"rotation": [[-1, 0, 0], [0, 1, 0], [0, 0, 1]], "translation_m": [0, 0, 0]}


def _twice(document: dict[str, Any]) -> None:
    document["left_out"] = ["van 1"]


def _of_nobody(document: dict[str, Any]) -> None:
    document["vehicles"] = []


def _narrowed(document: dict[str, Any]) -> None:
    document["widened"] = 0.5


def _without_freedom(document: dict[str, Any]) -> None:
    document["freedom"] = 0.0


def _misspelt(document: dict[str, Any]) -> None:
    document["leftout"] = []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_asymmetric, r"fleet\.json: covariance: is not symmetric"),
        (_indefinite, r"fleet\.json: covariance: is not positive definite"),
        (
            _in_millimetres,
            r"covariance: a standard deviation of 5 rad is not how vehicles are mounted \(1e-05 to 1.6 rad\)",
        ),
        (_pinned, r"covariance: a standard deviation of 1e-06 m is not how vehicles are mounted \(0.0001 to 10 m\)"),
        (_no_variance, r"fleet\.json: covariance: a variance .* not positive"),
        (_mirrored, r"fleet\.json: camera_from_radar\.rotation"),
        (_twice, r"fleet\.json: .*'van 1' occurs twice"),
        (_of_nobody, r"fleet\.json: vehicles"),
        (_narrowed, r"fleet\.json: widened"),
        (_without_freedom, r"fleet\.json: freedom"),
        (_misspelt, r"fleet\.json: .*leftout"),
    ],
)
def test_what_no_fleet_says_is_refused(change: Callable[[dict[str, Any]], None], words: str) -> None:
    document = json.loads(write_fleet_prior(prior()))
    change(document)
    with pytest.raises(InputError, match=words):
        read_fleet_prior(json.dumps(document), "fleet.json")
