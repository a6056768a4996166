"""Round trips between the radar's coordinates, and their derivatives."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from calib_core.radar import (
    cartesian_from_polar,
    cartesian_jacobian,
    covariance_from_sigma_polar,
    direction_cosines,
    polar_from_cartesian,
)

_azimuths = st.floats(-math.pi + 1e-6, math.pi)
_elevations = st.floats(-math.pi / 2 + 1e-6, math.pi / 2 - 1e-6)
_polar = st.tuples(st.floats(0.01, 300.0), _azimuths, _elevations).map(lambda row: np.array([row]))
_coordinates = st.floats(-300.0, 300.0).filter(lambda value: value == 0.0 or abs(value) > 1e-6)
_points = st.tuples(_coordinates, _coordinates, _coordinates).map(lambda row: np.array([row]))


@given(_polar)
def test_polar_to_cartesian_and_back(polar):
    np.testing.assert_allclose(polar_from_cartesian(cartesian_from_polar(polar)), polar, rtol=1e-9, atol=1e-9)


@given(_points)
def test_cartesian_to_polar_and_back(points_radar_m):
    back = cartesian_from_polar(polar_from_cartesian(points_radar_m))
    np.testing.assert_allclose(back, points_radar_m, rtol=1e-12, atol=1e-11)


@given(_polar)
def test_the_jacobian_is_the_slope_of_the_numbers(polar):
    step = 1e-6
    columns = []
    for axis in np.eye(3):
        ahead, behind = cartesian_from_polar(polar + step * axis), cartesian_from_polar(polar - step * axis)
        columns.append((ahead - behind) / (2.0 * step))
    np.testing.assert_allclose(cartesian_jacobian(polar), np.stack(columns, axis=-1), rtol=1e-6, atol=1e-6)


@given(_polar)
def test_direction_cosines_are_the_sines_of_the_angles(polar):
    range_m, azimuth, elevation = polar[0]
    u, w = math.cos(elevation) * math.sin(azimuth), math.sin(elevation)
    np.testing.assert_allclose(
        direction_cosines(cartesian_from_polar(polar)), [[range_m, u, w]], rtol=1e-12, atol=1e-12
    )


@given(_polar, st.tuples(st.floats(0.001, 1.0), st.floats(1e-4, 0.1), st.floats(1e-4, 0.1)))
def test_a_covariance_is_symmetric_positive_and_keeps_its_volume(polar, sigmas):
    covariance = covariance_from_sigma_polar(cartesian_from_polar(polar), np.array([sigmas]))[0]
    np.testing.assert_allclose(covariance, covariance.T, rtol=1e-12, atol=1e-15)
    range_m, _, elevation = polar[0]
    stretch = range_m**2 * math.cos(elevation)  # the determinant of the Jacobian
    sign, log_volume = np.linalg.slogdet(covariance)
    if stretch > 1e-3:
        assert sign > 0
        np.testing.assert_allclose(0.5 * log_volume, math.log(stretch * math.prod(sigmas)), atol=1e-4)
