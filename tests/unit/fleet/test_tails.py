"""Quantiles of squared distances: known cases and simulation."""

import pytest
from scipy.special import chdtri

from calib_core.fleet.tails import quantile, tail


def test_a_quantile_is_exceeded_as_often_as_it_says() -> None:
    for freedom, whole in ((8.0, 0.0), (30.0, 5.0), (1e6, 2.0)):
        assert tail(quantile(0.95, freedom, whole=whole), freedom, whole=whole) == pytest.approx(0.05, rel=1e-6)


def test_the_quantile_of_a_known_covariance_is_that_of_chi2() -> None:
    assert quantile(0.95, float("inf")) == pytest.approx(chdtri(6, 0.05), rel=1e-4)
