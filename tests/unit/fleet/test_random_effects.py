"""Mean and scatter of vectors with known covariances: truth by simulation, and how often a further one is covered."""

import numpy as np
import pytest

from calib_core.fleet.deviation import quantile
from calib_core.fleet.random_effects import PRIOR_VECTORS, RandomEffects, random_effects

EQUAL = np.full(6, 0.005)
UNEQUAL = np.array([0.01, 0.003, 0.001, 0.001, 0.01, 0.003])
WHOLE = 5.0
EXACT, ROUGH = 1e-7 * np.eye(6), np.diag(np.repeat([1e-4, 1e-4], 3))


def estimated(count: int, sigma: np.ndarray, error: np.ndarray, rng: np.random.Generator) -> RandomEffects:
    vectors = sigma * rng.standard_normal((count, 6)) + rng.multivariate_normal(np.zeros(6), error, count)
    return random_effects(vectors, np.repeat(error[None], count, axis=0))


def squared_of_new(
    effects: RandomEffects, sigma: np.ndarray, rng: np.random.Generator, count: int = 1000
) -> np.ndarray:
    away = sigma * rng.standard_normal((count, 6)) - effects.mean
    return np.asarray(np.einsum("ni,ij,nj->n", away, np.linalg.inv(effects.covariance), away))


def covered(count: int, fleets: int, sigma: np.ndarray, error: np.ndarray) -> float:
    """Return the share of new vectors that are no farther out than 95 % are, as `deviation` judges it."""
    rng, shares = np.random.default_rng(count), []
    for _ in range(fleets):
        effects = estimated(count, sigma, error, rng)
        limit = quantile(0.95, effects.freedom, whole=WHOLE)
        shares.append((squared_of_new(effects, sigma, rng) <= limit).mean())
    return float(np.mean(shares))


@pytest.mark.parametrize(("count", "fleets"), [(5, 120), (10, 80), (49, 20)])
def test_a_further_vector_is_covered_in_at_least_95_percent(count: int, fleets: int) -> None:
    assert covered(count, fleets, EQUAL, EXACT) >= 0.93


@pytest.mark.parametrize("count", [10, 49])
def test_unequal_axes_are_covered_too(count: int) -> None:
    assert covered(count, 20, UNEQUAL, EXACT) >= 0.92


@pytest.mark.parametrize("count", [10, 20])
def test_errors_twice_as_large_as_the_scatter_do_not_make_it_overconfident(count: int) -> None:
    assert covered(count, 30, EQUAL, ROUGH) >= 0.93


def covered_with_stated(there: float, share: float, sigma: np.ndarray) -> float:
    """Return the share of new vectors inside, if a share of the covariance is stated and only some of that is there."""
    stated, count, rng, inside = share * (1.0 - 1e-9) * ROUGH, 30, np.random.default_rng(5), []
    error = ROUGH - (1.0 - there) * stated
    for _ in range(12):
        vectors = sigma * rng.standard_normal((count, 6)) + rng.multivariate_normal(np.zeros(6), error, count)
        effects = random_effects(vectors, np.tile(ROUGH, (count, 1, 1)), np.tile(stated, (count, 1, 1)))
        limit = quantile(0.95, effects.freedom, whole=WHOLE)
        inside.append((squared_of_new(effects, sigma, rng) <= limit).mean())
    return float(np.mean(inside))


@pytest.mark.parametrize("share", [0.3, 1.0])
@pytest.mark.parametrize("sigma", [EQUAL, 2.0 * EQUAL], ids=["half the errors", "as large as the errors"])
def test_errors_smaller_than_stated_do_not_make_it_overconfident(share: float, sigma: np.ndarray) -> None:
    shares = [covered_with_stated(there, share, sigma) for there in (0.0, 0.3, 1.0)]
    assert np.mean(shares) >= 0.93
    assert min(shares) >= 0.85


def test_what_was_stated_is_found_to_be_there_or_not_where_it_decides() -> None:
    rng = np.random.default_rng(6)
    of_rotation = np.diag(np.repeat([1e-8, 1e-4], 3))
    stated = np.where(np.arange(60)[:, None, None] % 2, of_rotation, 0.0)  # of every other vector only
    whole = stated + 1e-6 * np.eye(6)
    vectors = 1e-3 * rng.standard_normal((60, 6))
    assert random_effects(vectors, whole, stated).of_stated < 0.2
    there = vectors + np.sqrt(np.diagonal(stated, axis1=1, axis2=2)) * rng.standard_normal((60, 6))
    assert random_effects(there, whole, stated).of_stated > 0.7


def test_many_exact_vectors_give_the_sample_covariance_and_a_little_of_the_prior() -> None:
    rng, count = np.random.default_rng(3), 300
    vectors = UNEQUAL * rng.standard_normal((count, 6))
    effects = random_effects(vectors, np.repeat(1e-9 * np.eye(6)[None], count, axis=0))
    sample = (vectors - vectors.mean(axis=0)).T @ (vectors - vectors.mean(axis=0)) / (count - 1)
    equal = np.repeat(np.diag(sample).reshape(2, 3).mean(axis=1), 3)
    expected = (count * sample + PRIOR_VECTORS * np.diag(equal)) / (count + PRIOR_VECTORS)
    np.testing.assert_allclose(np.diag(effects.scatter), np.diag(expected), rtol=0.02)
    np.testing.assert_allclose(effects.mean, vectors.mean(axis=0), atol=1e-5)
    assert effects.informative == pytest.approx(count, rel=0.01)


def test_where_the_errors_hide_the_scatter_it_is_neither_zero_nor_theirs() -> None:
    effects = estimated(30, np.full(6, 1e-4), ROUGH, np.random.default_rng(4))
    sigma = np.sqrt(np.diag(effects.scatter))
    assert (sigma > 3e-4).all()
    assert (sigma < 6e-3).all()
    assert effects.informative < 5.0


def test_vectors_that_are_all_the_same_have_next_to_no_scatter() -> None:
    effects = random_effects(np.zeros((6, 6)), np.repeat(1e-8 * np.eye(6)[None], 6, axis=0))
    assert np.sqrt(np.diag(effects.scatter)).max() < 2e-4
    assert np.linalg.eigvalsh(effects.scatter)[0] > 0.0


def test_the_axes_in_which_vectors_are_given_do_not_matter() -> None:
    rng = np.random.default_rng(6)
    vectors, errors = EQUAL * rng.standard_normal((20, 6)), np.array([np.diag(row) for row in rng.random((20, 6))])
    turned = np.kron(np.eye(2), np.linalg.qr(rng.standard_normal((3, 3)))[0])
    one = random_effects(vectors, 1e-4 * errors)
    other = random_effects(vectors @ turned.T, 1e-4 * turned @ errors @ turned.T)
    np.testing.assert_allclose(other.covariance, turned @ one.covariance @ turned.T, rtol=1e-3, atol=1e-8)
