"""Laws of every lens model, with OpenCV as the second opinion where it has the model."""

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from calib_core.camera import CAMERA_MODELS, Camera, CameraModel
from calib_core.lens_models.registry import LENS_MODELS

_unit = st.floats(-1.0, 1.0)
_shares = st.lists(_unit, min_size=8, max_size=8)

# How large each coefficient may be: strong lenses that still image 45 degrees without a fold. Other models take those
# of their typical lens.
_LARGEST: dict[CameraModel, list[float]] = {
    "pinhole": [],
    "plumb_bob": [0.12, 0.03, 0.005, 0.005, 0.004],
    "rational_polynomial": [0.12, 0.03, 0.005, 0.005, 0.004, 0.05, 0.01, 0.002],
    "equidistant": [0.05, 0.02, 0.01, 0.005],
}
_OPENCV_MODELS = tuple(name for name, lens in LENS_MODELS.items() if lens.opencv)


@st.composite
def cameras(draw: st.DrawFn, models: tuple[CameraModel, ...] = CAMERA_MODELS) -> Camera:
    model = draw(st.sampled_from(models))
    focal_px = draw(st.floats(300.0, 2000.0))
    matrix = np.array(
        [
            [focal_px, 0.0, 640.0 + 60.0 * draw(_unit)],
            [0.0, focal_px * (1.0 + 0.05 * draw(_unit)), 360.0],
            [0.0, 0.0, 1.0],
        ]
    )
    largest = np.array(_LARGEST.get(model, LENS_MODELS[model].typical.distortion))
    return Camera(model, 1280, 720, matrix, largest * draw(_shares)[: len(largest)])


@st.composite
def points_ahead(draw: st.DrawFn) -> np.ndarray:
    """Draw points (n, 3) within 45 degrees of the axis, 0.2 to 50 m away."""
    rows = []
    for _ in range(draw(st.integers(1, 6))):
        radius, turn = draw(st.floats(0.0, 1.0)), draw(st.floats(0.0, 2.0 * np.pi))
        rows.append([radius * np.cos(turn), radius * np.sin(turn), 1.0])
    return np.array(rows) * draw(st.floats(0.2, 50.0))


def projected_by_opencv(camera: Camera, points: np.ndarray) -> np.ndarray:
    matrix, distortion = np.array(camera.matrix_px), np.array(camera.distortion)
    if camera.lens.opencv == "fisheye.projectPoints":
        pixels, _ = cv2.fisheye.projectPoints(points.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), matrix, distortion)
    else:
        pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, distortion)
    return np.asarray(pixels).reshape(-1, 2)


@given(cameras(_OPENCV_MODELS), points_ahead())
def test_projection_agrees_with_opencv(camera, points):
    np.testing.assert_allclose(camera.project(points), projected_by_opencv(camera, points), atol=1e-6)


@given(cameras(), points_ahead())
def test_the_jacobian_is_the_slope_of_the_projection(camera, points):
    _, jacobian = camera.project_with_jacobian(points)
    distance = float(np.abs(points).max())
    step = 1e-6 * distance
    columns = [
        (camera.project(points + step * axis) - camera.project(points - step * axis)) / (2.0 * step)
        for axis in np.eye(3)
    ]
    scale = float(camera.matrix_px[0, 0]) / float(points[0, 2])
    np.testing.assert_allclose(jacobian, np.stack(columns, axis=-1), atol=3e-6 * scale)


@given(cameras(), points_ahead())
def test_a_point_lies_on_the_ray_of_its_pixel(camera, points):
    rays = camera.rays(camera.project(points))
    directions = points / np.linalg.norm(points, axis=1, keepdims=True)
    np.testing.assert_allclose(rays, directions, atol=1e-7)


@given(cameras(), st.lists(st.tuples(st.floats(0.0, 1279.0), st.floats(0.0, 719.0)), min_size=1, max_size=6))
def test_a_ray_projects_back_to_its_pixel(camera, pixels):
    rays = camera.rays(np.array(pixels))
    known = np.isfinite(rays).all(axis=1)
    np.testing.assert_allclose(np.linalg.norm(rays[known], axis=1), 1.0, rtol=1e-12)
    np.testing.assert_allclose(camera.project(rays[known]), np.array(pixels)[known], atol=1e-4)


@given(cameras(), points_ahead(), st.floats(0.1, 10.0))
def test_a_pixel_does_not_depend_on_the_distance_along_its_ray(camera, points, factor):
    np.testing.assert_allclose(camera.project(factor * points), camera.project(points), atol=1e-6)


@given(cameras(), points_ahead(), st.sampled_from([0.25, 0.5, 2.0, 3.0]))
def test_scaling_the_camera_scales_the_pixels_about_the_corner_of_the_image(camera, points, factor):
    scaled_px = camera.scaled(factor).project(points)
    np.testing.assert_allclose(scaled_px + 0.5, factor * (camera.project(points) + 0.5), atol=1e-6)


@given(cameras(), points_ahead())
def test_what_the_camera_sees_is_what_falls_on_the_image(camera, points):
    assert camera.sees(points).tolist() == camera.in_image(camera.project(points)).tolist()
    if camera.lens.is_perspective:  # a fisheye lens may well see what is behind it
        assert not camera.sees(-points).any()
