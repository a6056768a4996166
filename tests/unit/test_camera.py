"""The camera by example; its laws, with OpenCV as the reference, are in tests/properties."""

import numpy as np
import pytest

from calib_core.camera import CAMERA_MODELS, Camera, CameraCovariance
from calib_core.synthetic.rig import typical_camera

MATRIX_PX = np.array([[500.0, 0.0, 319.5], [0.0, 510.0, 239.5], [0.0, 0.0, 1.0]])


def pinhole() -> Camera:
    return Camera("pinhole", 640, 480, MATRIX_PX)


@pytest.mark.parametrize("model", ["pinhole", "plumb_bob", "rational_polynomial"])
def test_points_behind_the_camera_or_at_zero_depth_have_no_pixel(model):
    pixels = typical_camera(model).project(np.array([[0.0, 0.0, -4.0], [1.0, 0.0, 0.0], [0.0, 0.0, 2.0]]))
    assert np.isnan(pixels).all(axis=1).tolist() == [True, True, False]


def test_a_fisheye_sees_beyond_ninety_degrees():
    camera = Camera(
        "equidistant", 2000, 2000, np.array([[500.0, 0.0, 999.5], [0.0, 500.0, 999.5], [0.0, 0.0, 1.0]]), np.zeros(4)
    )
    theta = np.deg2rad(100.0)
    pixels = camera.project(np.array([[np.sin(theta), 0.0, np.cos(theta)]]))
    np.testing.assert_allclose(pixels, [[999.5 + 500.0 * theta, 999.5]])


@pytest.mark.parametrize("model", CAMERA_MODELS)
def test_no_points_give_no_pixels(model):
    camera = typical_camera(model)
    pixels, jacobian = camera.project_with_jacobian(np.zeros((0, 3)))
    assert pixels.shape == (0, 2)
    assert jacobian.shape == (0, 2, 3)
    assert camera.rays(np.zeros((0, 2))).shape == (0, 3)
    assert camera.sees(np.zeros((0, 3))).shape == (0,)


def test_skew_moves_columns_by_rows():
    matrix = MATRIX_PX.copy()
    matrix[0, 1] = 30.0
    camera = Camera("pinhole", 640, 480, matrix)
    pixels = camera.project(np.array([[0.0, 0.2, 1.0]]))
    np.testing.assert_allclose(pixels, [[319.5 + 6.0, 239.5 + 102.0]])
    np.testing.assert_allclose(np.cross(camera.rays(pixels)[0], [0.0, 0.2, 1.0]), 0.0, atol=1e-15)


def test_the_image_ends_half_a_pixel_outside_the_outermost_centres():
    pixels = np.array([[-0.5, -0.5], [639.5, 479.5], [-0.51, 10.0], [10.0, 479.51], [np.nan, 10.0]])
    assert pinhole().in_image(pixels).tolist() == [True, True, False, False, False]
    assert pinhole().in_image(pixels, margin_px=0.1).tolist() == [True, True, True, True, False]
    assert pinhole().in_image(pixels, margin_px=-1.0).tolist() == [False] * 5


def test_a_point_beyond_the_fold_of_the_distortion_is_not_seen_though_it_projects_into_the_image():
    camera = Camera("plumb_bob", 640, 480, MATRIX_PX, np.array([-0.4, 0.0, 0.0, 0.0]))
    beyond = np.array([[1.6, 0.0, 1.0]])  # r (1 - 0.4 r^2) has its maximum at r = 0.91
    assert camera.in_image(camera.project(beyond)).all()
    assert not camera.sees(beyond).any()
    assert camera.sees(np.array([[0.5, 0.0, 1.0]])).all()


def test_a_pixel_outside_the_lens_has_no_ray():
    camera = Camera("plumb_bob", 640, 480, MATRIX_PX, np.array([-0.4, 0.0, 0.0, 0.0]))
    rays = camera.rays(np.array([[319.5 + 500.0 * 0.7, 239.5], [400.0, 239.5]]))  # the maximum is at 0.61
    assert np.isnan(rays).all(axis=1).tolist() == [True, False]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("fisheye", 640, 480, MATRIX_PX, np.zeros(4)), "unknown camera model"),
        (("plumb_bob", 640, 480, MATRIX_PX, np.zeros(3)), "4 or 5"),
        (("equidistant", 640, 480, MATRIX_PX, np.zeros(5)), "takes 4"),
        (("pinhole", 640, 480, MATRIX_PX, np.zeros(5)), "takes 0"),
        (("pinhole", 0, 480, MATRIX_PX), "image size"),
        (("pinhole", 640, 480, np.zeros((3, 3))), "not calibrated"),
        (("pinhole", 640, 480, np.full((3, 3), np.nan)), "finite"),
        (("pinhole", 640, 480, np.eye(4)), "3 x 3"),
    ],
)
def test_an_invalid_camera_is_refused_with_a_reason(arguments, reason):
    with pytest.raises(ValueError, match=reason):
        Camera(*arguments)


@pytest.mark.parametrize("model", CAMERA_MODELS)
def test_pixels_move_with_the_intrinsics_as_their_derivative_says(model):
    camera = typical_camera(model)
    points = np.random.default_rng(1).uniform([-0.6, -0.6, 1.0], [0.6, 0.6, 2.0], (20, 3))
    slopes = camera.parameter_planes(points.T)
    for row, value in enumerate(camera.parameters):
        step = 1e-6 * max(1.0, abs(value)) * np.eye(len(camera.parameters))[row]
        ahead, behind = (camera.with_parameters(camera.parameters + way * step).project(points) for way in (1.0, -1.0))
        np.testing.assert_allclose(slopes[row].T, (ahead - behind) / (2.0 * step[row]), rtol=1e-4, atol=1e-3)


def test_the_covariance_of_the_intrinsics_is_scaled_with_the_image():
    camera = typical_camera("plumb_bob")
    known = CameraCovariance(("fx_px", "k1"), np.array([[4.0, 0.1], [0.1, 0.01]]))
    half = camera.with_parameters(camera.parameters, known).scaled(0.5)
    assert half.covariance.sigma("fx_px") == 1.0
    assert half.covariance.sigma("k1") == pytest.approx(0.1)
    assert half.covariance.sigma("cx_px") == 0.0
    np.testing.assert_allclose(half.covariance.matrix[0, 1], 0.05)


@pytest.mark.parametrize(
    ("order", "matrix", "words"),
    [
        (("fx_px", "fx_px"), np.eye(2), "twice"),
        (("fx_px",), np.array([[np.nan]]), "finite"),
        (("fx_px", "fy_px"), np.array([[1.0, 0.5], [0.0, 1.0]]), "symmetric"),
        (("fx_px", "fy_px"), np.array([[1.0, 2.0], [2.0, 1.0]]), "negative"),
        (("fx_px",), np.array([[-1.0]]), "negative"),
        (("k6",), np.eye(1), "k6, which plumb_bob does not have; it has fx_px, fy_px, cx_px, cy_px, k1"),
    ],
)
def test_a_covariance_that_cannot_be_is_refused(order, matrix, words):
    camera = typical_camera("plumb_bob")
    with pytest.raises(ValueError, match=words):
        camera.with_parameters(camera.parameters, CameraCovariance(order, matrix))
