"""The expected distribution of residual lengths."""

import numpy as np

from calib_core.estimation.pair_results import expected_shares


def test_round_noise_gives_the_rayleigh_distribution():
    edges_px = np.array([0.0, 1.0, 2.0, 4.0, np.inf])
    shares = expected_shares(np.array([np.eye(2) * 4.0]), edges_px)

    np.testing.assert_allclose(shares, -np.diff(np.exp(-(edges_px**2) / 8.0)), rtol=1e-9)
    np.testing.assert_allclose(shares.sum(), 1.0)


def test_drawn_residuals_of_different_pairs_follow_it():
    rng = np.random.default_rng(2)
    factors = rng.normal(size=(5, 2, 2)) * np.array([3.0, 1.0])
    covariances_px2 = factors @ factors.transpose(0, 2, 1) + 0.5 * np.eye(2)
    draws = [rng.multivariate_normal(np.zeros(2), covariance, size=20_000) for covariance in covariances_px2]
    edges_px = np.array([0.0, 1.0, 2.0, 3.0, 5.0, 8.0, 100.0])
    counted = np.histogram(np.linalg.norm(np.concatenate(draws), axis=1), edges_px)[0]

    np.testing.assert_allclose(expected_shares(covariances_px2, edges_px), counted / counted.sum(), atol=0.006)
