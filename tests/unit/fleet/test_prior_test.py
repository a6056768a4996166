"""A calibration against a fleet's prior alone."""

import numpy as np
import pytest

from calib_core.fleet.prior_test import prior_test
from calib_core.fleet.session_pose import CHI2_95
from calib_core.fleet_prior import DataAlone, FleetPrior
from calib_core.geometry import RigidTransform, rotation_exp

MEAN = RigidTransform(rotation_exp(np.array([0.1, -0.2, 0.3])), np.array([0.1, 0.2, -0.3]))
SCATTER = np.diag([5e-3] * 3 + [np.deg2rad(0.3)] * 3) ** 2
TURNED = MEAN.perturbed(np.array([0.0, 0.0, 0.0, 0.0, np.deg2rad(5.0), 0.0]))


def prior(*, freedom: float = 1e7, widened: float = 1.0) -> FleetPrior:
    return FleetPrior("van", MEAN, widened * SCATTER, ("a", "b", "c", "d", "e"), widened=widened, freedom=freedom)


def alone(pose: RigidTransform, covariance: np.ndarray = SCATTER) -> DataAlone:
    return DataAlone(pose, covariance, CHI2_95)


def test_the_limit_of_a_known_scatter_is_that_of_chi2_and_an_estimated_one_allows_more() -> None:
    limits = [prior_test(prior(freedom=freedom), alone(MEAN)).limit for freedom in (8.0, 50.0, 1e7)]
    assert limits[0] > limits[1] > limits[2]
    assert limits[2] == pytest.approx(27.856, abs=0.01)  # the 1-in-10,000 point of chi2 with 6 degrees of freedom


def test_the_test_undoes_what_widens_the_prior() -> None:
    plain, wide = (prior_test(prior(freedom=20.0, widened=factor), alone(TURNED)) for factor in (1.0, 1.7))
    assert (wide.squared, wide.limit) == pytest.approx((plain.squared, plain.limit))


def test_sound_vehicles_are_of_their_kind_and_turned_ones_are_not() -> None:
    rng = np.random.default_rng(1)
    away = rng.multivariate_normal(np.zeros(6), 2.0 * SCATTER, size=2000)
    assert not any(prior_test(prior(freedom=50.0), alone(MEAN.perturbed(one))).is_beyond for one in away)
    found = prior_test(prior(freedom=50.0), alone(TURNED))
    assert found.is_beyond
    assert " deg " in found.text


def test_a_calibration_that_knows_little_is_not_off_its_kind() -> None:
    assert not prior_test(prior(freedom=50.0), alone(TURNED, 400.0 * SCATTER)).is_beyond
