"""A calibration against a fleet's prior alone."""

import numpy as np
import pytest

from calib_core.fleet.prior_test import prior_test
from calib_core.fleet_prior import FleetPrior
from calib_core.geometry import RigidTransform, rotation_exp

MEAN = RigidTransform(rotation_exp(np.array([0.1, -0.2, 0.3])), np.array([0.1, 0.2, -0.3]))
SCATTER = np.diag([5e-3] * 3 + [np.deg2rad(0.3)] * 3) ** 2


def prior(vehicles: int) -> FleetPrior:
    return FleetPrior("van", MEAN, SCATTER, tuple(f"van {i}" for i in range(vehicles)))


def test_the_limit_of_a_large_fleet_is_that_of_chi2_and_a_small_one_allows_more() -> None:
    limits = [prior_test(prior(count), MEAN, SCATTER).limit for count in (5, 50, 1_000_000)]
    assert limits[0] > limits[1] > limits[2]
    assert limits[2] == pytest.approx(27.856, abs=0.01)  # the 1-in-10,000 point of chi2 with 6 degrees of freedom


def test_sound_vehicles_are_of_their_kind_and_turned_ones_are_not() -> None:
    rng = np.random.default_rng(1)
    away = rng.multivariate_normal(np.zeros(6), 2.0 * SCATTER, size=2000)
    assert not any(prior_test(prior(50), MEAN.perturbed(one), SCATTER).is_off for one in away)
    turned = np.array([0.0, 0.0, 0.0, 0.0, np.deg2rad(5.0), 0.0])
    assert prior_test(prior(50), MEAN.perturbed(turned), SCATTER).is_off


def test_a_calibration_that_knows_little_is_not_off_its_kind() -> None:
    turned = np.array([0.0, 0.0, 0.0, 0.0, np.deg2rad(5.0), 0.0])
    assert not prior_test(prior(50), MEAN.perturbed(turned), 400.0 * SCATTER).is_off
