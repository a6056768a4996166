"""Radar coordinates by example; round trips are in tests/properties."""

import math

import numpy as np

from calib_core.radar import (
    cartesian_from_polar,
    covariance_from_sigma_polar,
    direction_cosines,
    polar_from_cartesian,
)


def test_azimuth_is_positive_to_the_left_and_elevation_upwards():
    polar = polar_from_cartesian(np.array([[1.0, 1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 0.0, 1.0], [3.0, 0.0, 0.0]]))
    quarter = math.pi / 4
    root = math.sqrt(2.0)
    expected = [[root, quarter, 0.0], [root, -quarter, 0.0], [root, 0.0, quarter], [3.0, 0.0, 0.0]]
    np.testing.assert_allclose(polar, expected, atol=1e-15)


def test_the_origin_has_no_direction_and_makes_no_nan():
    origin = np.zeros((1, 3))
    np.testing.assert_array_equal(polar_from_cartesian(origin), origin)
    np.testing.assert_array_equal(direction_cosines(origin), origin)


def test_a_covariance_ahead_has_range_along_x_azimuth_along_y_elevation_along_z():
    sigma = np.array([[0.03, 0.01, 0.02]])
    covariance = covariance_from_sigma_polar(np.array([[10.0, 0.0, 0.0]]), sigma)
    np.testing.assert_allclose(covariance, [np.diag([0.03**2, 0.1**2, 0.2**2])], atol=1e-15)


def test_a_covariance_predicts_the_scatter_of_noisy_returns():
    rng = np.random.default_rng(1)
    point = np.array([[8.0, 3.0, -1.0]])
    sigma = np.array([[0.03, 0.01, 0.02]])
    noisy = cartesian_from_polar(polar_from_cartesian(point) + sigma * rng.standard_normal((200_000, 3)))
    np.testing.assert_allclose(np.cov(noisy.T), covariance_from_sigma_polar(point, sigma)[0], atol=4e-4)
