"""The paper's equations, each in a test named after it, compared with the sum written out."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp, rotation_from_euler
from calib_core.radar import cartesian_from_polar
from calib_core.results.metrics import acc, aed, cdsd, distances

# Printed by the authors with their result: camera matrix, distortion, rotation vector, translation.
PUBLISHED_CAMERA = Camera(
    "plumb_bob",
    640,
    480,
    np.array([[554.4203610, 0.0, 299.0464167], [0.0, 556.5392197, 265.1770865], [0.0, 0.0, 1.0]]),
    np.array([-0.3941065568, 0.1667170599, -0.0035270543, 0.0018664127, 0.0]),
)
PUBLISHED_CAMERA_FROM_RADAR = RigidTransform(
    rotation_exp(np.array([1.30927651, -1.29183232, 1.09104368])), np.array([-0.00115773, -0.0608874, -0.01496503])
)


def test_equation_polar_to_cartesian_has_x_forward_y_left_z_up():
    r, azimuth, elevation = 5.0, math.radians(20.0), math.radians(-10.0)
    expected = [
        r * math.cos(elevation) * math.cos(azimuth),
        r * math.cos(elevation) * math.sin(azimuth),
        r * math.sin(elevation),
    ]
    np.testing.assert_allclose(cartesian_from_polar(np.array([[r, azimuth, elevation]])), [expected], rtol=1e-15)


def test_equation_euler_is_rz_times_ry_times_rx():
    x, y, z = 0.3, -0.7, 1.9
    about = [Rotation.from_euler(axis, angle).as_matrix() for axis, angle in (("x", x), ("y", y), ("z", z))]
    np.testing.assert_allclose(rotation_from_euler(x, y, z), about[2] @ about[1] @ about[0], atol=1e-15)


def test_equation_euler_turns_about_x_first_then_y_then_z():
    quarter = math.pi / 2
    # about x: y -> z ; then about y: z -> x ; then about z: x -> y
    np.testing.assert_allclose(
        rotation_from_euler(quarter, quarter, quarter) @ [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15
    )
    np.testing.assert_allclose(
        rotation_from_euler(quarter, 0.0, quarter) @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], atol=1e-15
    )


def test_equation_euler_is_undone_by_its_inverse():
    radar_from_camera = PUBLISHED_CAMERA_FROM_RADAR.inverse()
    angles = Rotation.from_matrix(radar_from_camera.rotation).as_euler("xyz")
    np.testing.assert_allclose(angles, [-1.708788, 0.028995, -1.532137], atol=1e-6)
    np.testing.assert_allclose(rotation_from_euler(*angles), radar_from_camera.rotation, atol=1e-12)


def test_equation_projection_carries_the_published_point_to_the_published_pixel():
    point_radar = np.array([[5.0, 1.0, -0.5]])
    point_camera = PUBLISHED_CAMERA_FROM_RADAR @ point_radar
    np.testing.assert_allclose(point_camera, [[-0.792327, -0.235276, 5.044051]], atol=1e-6)
    np.testing.assert_allclose(PUBLISHED_CAMERA.project(point_camera), [[212.918515, 239.443277]], atol=1e-5)


def test_equation_projection_without_distortion_is_k_times_r_p_plus_t():
    plain = Camera("pinhole", 640, 480, PUBLISHED_CAMERA.matrix_px)
    point_radar = np.array([[5.0, 1.0, -0.5]])
    homogeneous = PUBLISHED_CAMERA.matrix_px @ (
        PUBLISHED_CAMERA_FROM_RADAR.rotation @ point_radar[0] + PUBLISHED_CAMERA_FROM_RADAR.translation_m
    )
    projected = plain.project(PUBLISHED_CAMERA_FROM_RADAR @ point_radar)
    np.testing.assert_allclose(projected, [homogeneous[:2] / homogeneous[2]], rtol=1e-13)
    np.testing.assert_allclose(projected, [[211.957221, 239.217724]], atol=1e-5)


def test_the_published_result_sends_radar_y_to_the_left_of_the_image():
    # The paper's text says y right; its data say y left.
    left_in_camera = PUBLISHED_CAMERA_FROM_RADAR.rotation @ [0.0, 1.0, 0.0]
    np.testing.assert_allclose(left_in_camera, [-0.999, 0.023, 0.042], atol=1e-3)


def test_equation_aed_divides_by_n():
    projected = np.array([[3.0, 4.0], [10.0, 10.0], [1.0, 8.0]])
    clicked = np.array([[0.0, 0.0], [10.0, 10.0], [1.0, -2.0]])
    written_out = (math.sqrt(3.0**2 + 4.0**2) + 0.0 + 10.0) / 3
    assert aed(distances(projected, clicked)) == pytest.approx(written_out, rel=1e-15)


def test_equation_cdsd_divides_by_n_minus_1():
    lengths = np.array([5.0, 0.0, 10.0])
    written_out = math.sqrt(((5.0 - 5.0) ** 2 + (0.0 - 5.0) ** 2 + (10.0 - 5.0) ** 2) / (3 - 1))
    assert cdsd(lengths) == pytest.approx(written_out, rel=1e-15)
    assert cdsd(lengths) == pytest.approx(float(np.std(lengths, ddof=1)), rel=1e-15)


def test_equation_acc_averages_the_share_inside_boxes_over_frames():
    frames = [np.array([True, False]), np.array([True]), np.array([True, True, True, False])]
    assert acc(frames) == pytest.approx((0.5 + 1.0 + 0.75) / 3)


def test_acc_keeps_zero_frames_unless_the_authors_way_is_asked_for():
    frames = [np.array([True, False]), np.array([False, False]), np.array([True])]
    assert acc(frames) == pytest.approx((0.5 + 0.0 + 1.0) / 3)
    assert acc(frames, zero_frames="drop") == pytest.approx((0.5 + 1.0) / 2)


def test_acc_does_not_count_a_frame_without_returns():
    frames = [np.array([True, False]), np.zeros(0, dtype=np.bool_)]
    assert acc(frames) == pytest.approx(0.5)
