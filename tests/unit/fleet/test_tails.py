"""Quantiles of squared distances: known cases and simulation."""

import numpy as np
import pytest
from scipy.special import chdtri

from calib_core.fleet.tails import mixture_quantile, quantile, tail


def test_one_normal_part_has_the_quantile_of_chi2() -> None:
    found = mixture_quantile(0.95, np.full((1, 6), 4.0), np.ones(1))
    assert found == pytest.approx(4.0 * chdtri(6, 0.05), rel=1e-6)
    assert quantile(0.95, float("inf")) == pytest.approx(chdtri(6, 0.05), rel=1e-4)


@pytest.mark.parametrize("probability", [0.5, 0.95, 0.999])
def test_a_mixture_has_the_quantile_of_its_simulation(probability: float) -> None:
    rng = np.random.default_rng(1)
    variances, weights = np.array([[1.0] * 6, [9.0, 4.0, 4.0, 1.0, 1.0, 0.25]]), np.array([0.8, 0.2])
    chosen = variances[(rng.random(400_000) > weights[0]).astype(int)]
    squared = (chosen * rng.standard_normal(chosen.shape) ** 2).sum(axis=1)
    assert (squared <= mixture_quantile(probability, variances, weights)).mean() == pytest.approx(
        probability, abs=0.02 * (1.0 - probability) + 0.004
    )


def test_a_quantile_is_exceeded_as_often_as_it_says() -> None:
    for freedom, whole in ((8.0, 0.0), (30.0, 5.0), (1e6, 2.0)):
        assert tail(quantile(0.95, freedom, whole=whole), freedom, whole=whole) == pytest.approx(0.05, rel=1e-6)
