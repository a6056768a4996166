"""Laws of rigid motion, with SciPy's Rotation as the second opinion."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from calib_core.geometry import (
    RigidTransform,
    matrix_from_quaternion_wxyz,
    quaternion_wxyz_from_matrix,
    rotation_angle_rad,
    rotation_exp,
    rotation_from_euler,
    rotation_log,
)

_angles = st.one_of(
    st.floats(0.0, math.pi),
    st.floats(-14.0, -2.0).map(lambda exponent: 10.0**exponent),
    st.floats(-14.0, -2.0).map(lambda exponent: math.pi - 10.0**exponent),
    st.sampled_from([0.0, math.pi]),
)
_coordinates = st.floats(-100.0, 100.0, allow_nan=False)


@st.composite
def unit_vectors(draw: st.DrawFn) -> np.ndarray:
    z = draw(st.floats(-1.0, 1.0))
    turn = draw(st.floats(0.0, 2.0 * math.pi))
    across = math.sqrt(1.0 - z * z)
    return np.array([across * math.cos(turn), across * math.sin(turn), z])


@st.composite
def rotation_vectors(draw: st.DrawFn) -> np.ndarray:
    return draw(_angles) * draw(unit_vectors())


@st.composite
def transforms(draw: st.DrawFn) -> RigidTransform:
    return RigidTransform(rotation_exp(draw(rotation_vectors())), np.array([draw(_coordinates) for _ in range(3)]))


@st.composite
def points(draw: st.DrawFn) -> np.ndarray:
    count = draw(st.integers(0, 5))
    return np.array([[draw(_coordinates) for _ in range(3)] for _ in range(count)]).reshape(count, 3)


def assert_same(one: RigidTransform, other: RigidTransform) -> None:
    np.testing.assert_allclose(one.rotation, other.rotation, atol=1e-12)
    np.testing.assert_allclose(one.translation_m, other.translation_m, atol=1e-10)


@given(transforms(), transforms(), transforms())
def test_composition_is_associative(c_from_d, b_from_c, a_from_b):
    assert_same((a_from_b @ b_from_c) @ c_from_d, a_from_b @ (b_from_c @ c_from_d))


@given(transforms())
def test_a_transform_and_its_inverse_cancel_from_both_sides(camera_from_radar):
    radar_from_camera = camera_from_radar.inverse()
    assert_same(radar_from_camera @ camera_from_radar, RigidTransform.identity())
    assert_same(camera_from_radar @ radar_from_camera, RigidTransform.identity())


@given(transforms())
def test_the_identity_changes_nothing(camera_from_radar):
    assert_same(camera_from_radar @ RigidTransform.identity(), camera_from_radar)
    assert_same(RigidTransform.identity() @ camera_from_radar, camera_from_radar)


@given(transforms(), transforms(), points())
def test_moving_points_twice_is_moving_them_by_the_composition(c_from_b, b_from_a, points_a):
    np.testing.assert_allclose(c_from_b @ (b_from_a @ points_a), (c_from_b @ b_from_a) @ points_a, atol=1e-9)


@given(transforms(), points())
def test_the_homogeneous_matrix_moves_points_alike(camera_from_radar, points_radar):
    homogeneous = np.concatenate([points_radar, np.ones((len(points_radar), 1))], axis=1)
    by_matrix = (camera_from_radar.as_matrix() @ homogeneous.T).T[:, :3]
    np.testing.assert_allclose(camera_from_radar @ points_radar, by_matrix, atol=1e-10)


@given(rotation_vectors())
def test_exp_agrees_with_scipy(vector):
    np.testing.assert_allclose(rotation_exp(vector), Rotation.from_rotvec(vector).as_matrix(), atol=1e-14)


@given(rotation_vectors())
def test_log_undoes_exp_up_to_half_a_turn(vector):
    back = rotation_log(rotation_exp(vector))
    angle = float(np.linalg.norm(vector))
    assert float(np.linalg.norm(back)) <= math.pi + 1e-12
    if angle < math.pi - 1e-6:
        np.testing.assert_allclose(back, vector, rtol=1e-8, atol=1e-14)
    else:  # at half a turn both directions of the axis are right
        np.testing.assert_allclose(rotation_exp(back), rotation_exp(vector), atol=1e-12)


@given(rotation_vectors())
def test_the_angle_agrees_with_scipys_magnitude(vector):
    rotation = rotation_exp(vector)
    np.testing.assert_allclose(rotation_angle_rad(rotation), Rotation.from_matrix(rotation).magnitude(), atol=1e-10)


@given(rotation_vectors())
def test_a_quaternion_holds_the_same_rotation_as_scipys(vector):
    rotation = rotation_exp(vector)
    quaternion = quaternion_wxyz_from_matrix(rotation)
    x, y, z, w = Rotation.from_matrix(rotation).as_quat()
    same_up_to_sign = abs(float(quaternion @ [w, x, y, z]))
    assert quaternion[0] >= 0.0
    np.testing.assert_allclose(same_up_to_sign, 1.0, atol=1e-12)
    np.testing.assert_allclose(matrix_from_quaternion_wxyz(quaternion), rotation, atol=1e-14)


@given(st.floats(-math.pi, math.pi), st.floats(-math.pi / 2, math.pi / 2), st.floats(-math.pi, math.pi))
def test_euler_angles_agree_with_scipys_fixed_axes(x_rad, y_rad, z_rad):
    rotation = rotation_from_euler(x_rad, y_rad, z_rad)
    np.testing.assert_allclose(rotation, Rotation.from_euler("xyz", [x_rad, y_rad, z_rad]).as_matrix(), atol=1e-14)


@given(transforms(), transforms())
def test_the_error_between_two_transforms_leads_from_one_to_the_other(camera_from_radar, estimate):
    assert_same(estimate.perturbed(camera_from_radar.error_from(estimate)), camera_from_radar)


@given(transforms(), transforms())
def test_the_adjoint_of_a_composition_is_the_product_of_adjoints(c_from_b, b_from_a):
    np.testing.assert_allclose((c_from_b @ b_from_a).adjoint(), c_from_b.adjoint() @ b_from_a.adjoint(), atol=1e-9)
