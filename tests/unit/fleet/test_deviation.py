"""One test over six degrees of freedom: its false rate, and the quantiles that it rests on."""

import numpy as np
import pytest
from scipy.special import chdtri

from calib_core.fleet.deviation import FALSE_RATE, deviation, quantile, tail
from calib_core.fleet.random_effects import RandomEffects, random_effects
from calib_core.fleet.session_pose import CHI2_95

EQUAL = np.full(6, 0.005)
EXACT = 1e-7 * np.eye(6)


def estimated(count: int, sigma: np.ndarray, error: np.ndarray, rng: np.random.Generator) -> RandomEffects:
    vectors = sigma * rng.standard_normal((count, 6)) + rng.multivariate_normal(np.zeros(6), error, count)
    return random_effects(vectors, np.repeat(error[None], count, axis=0))


def squared_of_new(effects: RandomEffects, rng: np.random.Generator, count: int) -> np.ndarray:
    away = EQUAL * rng.standard_normal((count, 6)) - effects.mean
    return np.asarray(np.einsum("ni,ij,nj->n", away, np.linalg.inv(effects.covariance + EXACT), away))


@pytest.mark.parametrize(("count", "fleets"), [(10, 60), (49, 20)])
def test_the_false_rate_of_one_test_is_at_most_one_in_10000(count: int, fleets: int) -> None:
    rng, beyond = np.random.default_rng(count), 0
    for _ in range(fleets):
        effects = estimated(count, EQUAL, EXACT, rng)
        limit = deviation(effects, effects.mean, EXACT, freedom=1e7).limit
        beyond += int((squared_of_new(effects, rng, 2000) > limit).sum())
    assert beyond <= 2.0 * FALSE_RATE * fleets * 2000


def test_the_limit_is_hotellings_where_the_scatter_is_all_and_f_where_the_calibration_is() -> None:
    effects = estimated(49, EQUAL, EXACT, np.random.default_rng(1))
    narrow = deviation(effects, effects.mean, 1e-12 * np.eye(6), freedom=20.0)
    wide = deviation(effects, effects.mean, 1e6 * np.eye(6), freedom=20.0)
    assert narrow.limit == pytest.approx(quantile(1.0 - FALSE_RATE, effects.freedom, whole=5.0), rel=1e-4)
    assert wide.limit == pytest.approx(quantile(1.0 - FALSE_RATE, 20.0), rel=1e-4)


def test_quantiles_are_chi2_f_and_hotellings() -> None:
    rng = np.random.default_rng(2)
    assert quantile(0.95, 1e9) == pytest.approx(CHI2_95, rel=1e-4)
    level = rng.chisquare(6, 200_000) / (rng.chisquare(12, 200_000) / 12)
    assert (level <= quantile(0.95, 12)).mean() == pytest.approx(0.95, abs=0.002)
    samples = rng.standard_normal((4000, 13, 6))
    scatter = np.swapaxes(samples[:, 1:], 1, 2) @ samples[:, 1:] / 12
    squared = np.einsum("ni,ni->n", samples[:, 0], np.linalg.solve(scatter, samples[:, 0, :, None])[..., 0])
    assert (squared <= quantile(0.95, 12, whole=5.0)).mean() == pytest.approx(0.95, abs=0.01)


@pytest.mark.parametrize("whole", [0.0, 3.0])
def test_the_tail_is_the_inverse_of_the_quantile(whole: float) -> None:
    for probability in (0.1, 0.5, 0.95, 1.0 - FALSE_RATE):
        assert tail(quantile(probability, 15.0, whole=whole), 15.0, whole=whole) == pytest.approx(1.0 - probability)


def test_a_quantile_is_exceeded_as_often_as_it_says() -> None:
    for freedom, whole in ((8.0, 0.0), (30.0, 5.0), (1e6, 2.0)):
        assert tail(quantile(0.95, freedom, whole=whole), freedom, whole=whole) == pytest.approx(0.05, rel=1e-6)


def test_the_quantile_of_a_known_covariance_is_that_of_chi2() -> None:
    assert quantile(0.95, float("inf")) == pytest.approx(chdtri(6, 0.05), rel=1e-4)
