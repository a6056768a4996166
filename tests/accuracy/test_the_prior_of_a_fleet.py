"""Is a fleet's prior honest, and worth something, at pair level? All of it: benchmarks.fleet.prior_value."""

import numpy as np
import pytest
from scipy.special import chdtri

from benchmarks.fleet.paired_fleet import Setting, answered, draw_vehicle, prior_from, prior_holds, sigmas
from benchmarks.fleet.simulated_poses import Spread, simulated_mounting
from calib_core.fleet_prior import FleetPrior
from calib_core.pose_difference import squared_distance
from calib_core.results import Calibration

OTHERS, FEW = 16, 6
NARROW, WIDE = Setting(Spread(0.005, 0.3)), Setting(Spread(0.05, 5.0))


@pytest.fixture(scope="module")
def narrow() -> FleetPrior:
    return prior_from([draw_vehicle(NARROW, (7, 0, number)) for number in range(OTHERS)])


def share_held(prior: FleetPrior, setting: Setting) -> float:
    rng = np.random.default_rng(7)
    return float(np.mean([prior_holds(prior, simulated_mounting(setting.spread, rng)) for _ in range(300)]))


def test_the_prior_contains_the_next_vehicles(narrow: FleetPrior) -> None:
    wide = prior_from([draw_vehicle(WIDE, (7, 1, number)) for number in range(OTHERS)])
    assert share_held(narrow, NARROW) >= 0.9
    assert 0.85 <= share_held(wide, WIDE) < 1.0
    _, rotation_deg = sigmas(wide.covariance, wide.camera_from_radar)
    assert 0.7 < rotation_deg / (5.0 * np.sqrt(3.0)) < 2.0


def test_six_placements_with_the_prior_are_surer_than_twenty_without_and_as_near_as_they_say(
    narrow: FleetPrior,
) -> None:
    squared, count = 0.0, 8
    for number in range(count):
        vehicle = draw_vehicle(NARROW, (7, 0, 100 + number))
        outcome = vehicle.solved(FEW, narrow)
        assert isinstance(outcome, Calibration)
        answer = answered(outcome, vehicle.truth)
        assert not answer.off_kind
        squared += squared_distance(vehicle.truth.error_from(outcome.camera_from_radar), outcome.covariance)
        if number < 2:
            alone = answered(vehicle.solved(), vehicle.truth)
            assert answer.sigma_cm < 0.6 * alone.sigma_cm
            assert answer.sigma_deg < alone.sigma_deg
    assert squared < chdtri(6 * count, 1e-3), "errors this far beyond the stated ones have a chance below 1 in 1000"


def test_a_vehicle_that_is_turned_by_20_deg_is_named(narrow: FleetPrior) -> None:
    vehicle = draw_vehicle(NARROW, (7, 0, 200), turned_deg=20.0)
    answer = answered(vehicle.solved(FEW, narrow), vehicle.truth)
    assert answer.off_kind
    assert "off-its-kind" in answer.warnings
