"""Adaptive importance sampling finds means, covariances and shares of known densities."""

import numpy as np
import pytest

from calib_core.arrays import Values
from calib_core.estimation.posterior_samples import Mixture, WeightedSamples, importance_samples

COVARIANCE = np.array([[1.0, 0.9, 0.0], [0.9, 1.0, 0.2], [0.0, 0.2, 0.3]])


def normal_costs(states: np.ndarray, mean: float, covariance: np.ndarray) -> Values:
    away = states - mean
    return np.asarray((away * np.linalg.solve(covariance, away.T).T).sum(axis=1))


def drawn_from(start: Mixture, *, apart: float | None = None) -> WeightedSamples:
    """Sample a normal density, or one of two peaks with shares of 0.75 and 0.25."""

    def costs(states: np.ndarray) -> Values:
        first = normal_costs(states, 0.0, COVARIANCE)
        if apart is None:
            return first
        second = normal_costs(states, apart, COVARIANCE)
        return np.asarray(-2.0 * np.logaddexp(np.log(0.75) - 0.5 * first, np.log(0.25) - 0.5 * second))

    return importance_samples(costs, start, per_round=500, rounds=(3, 8), enough=1000.0, rng=np.random.default_rng(1))


def test_a_normal_density_gives_its_mean_and_covariance_even_from_a_bad_start() -> None:
    bad = Mixture(np.ones(1), np.full((1, 3), 1.5), 4.0 * np.eye(3)[None])
    samples = drawn_from(bad)
    mean = samples.weights @ samples.states
    away = samples.states - mean
    assert samples.effective > 1000.0
    assert mean == pytest.approx(np.zeros(3), abs=0.1)
    assert (away * samples.weights[:, None]).T @ away == pytest.approx(COVARIANCE, abs=0.1)


def test_two_peaks_get_their_shares_whatever_the_first_guess_of_them() -> None:
    start = Mixture(np.array([0.1, 0.9]), np.array([[0.0] * 3, [6.0] * 3]), np.stack([COVARIANCE] * 2))
    samples = drawn_from(start, apart=6.0)
    assert samples.weights[samples.states.mean(axis=1) < 3.0].sum() == pytest.approx(0.75, abs=0.05)
    assert samples.mixture.weights == pytest.approx([0.75, 0.25], abs=0.08)


def test_a_mixture_s_samples_follow_its_density() -> None:
    mixture = Mixture(np.array([0.3, 0.7]), np.array([[0.0], [5.0]]), np.array([[[1.0]], [[4.0]]]))
    states = mixture.draw(4000, np.random.default_rng(2))[:, 0]
    grid = np.linspace(-60.0, 60.0, 12001)
    density = np.exp(mixture.log_density(grid[:, None]))
    assert density.sum() * 0.01 == pytest.approx(1.0, abs=0.01)
    assert (states < 2.5).mean() == pytest.approx(density[grid < 2.5].sum() * 0.01, abs=0.03)
