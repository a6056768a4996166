"""CameraInfo becomes the camera of the published pixels."""

import numpy as np
import pytest

from calib_core.measurements import NS_PER_S
from calib_core.recordings import open_recording

START_NS = 1_700_000_000 * NS_PER_S
K = np.array([[500.0, 0, 319.5], [0, 510.0, 239.5], [0, 0, 1]])


def camera_of(write, ros, *infos, size=(640, 480), topic="/camera/image"):
    grey = np.zeros((size[1], size[0]), dtype=np.uint8)
    rows = [(topic, START_NS, ros.image(START_NS, grey, "mono8"))]
    rows += [("/camera/camera_info", START_NS + i, info) for i, info in enumerate(infos)]
    with open_recording(write(ros, rows), require=("image",)) as recording:
        return recording.camera(), [warning.code for warning in recording.warnings], recording.warnings


@pytest.mark.parametrize(
    ("model", "distortion", "expected", "coefficients"),
    [
        ("plumb_bob", [-0.1, 0.02, 0.001, -0.002, 0.003], "plumb_bob", 5),
        ("plumb_bob", [-0.1, 0.02, 0.001, -0.002], "plumb_bob", 4),
        ("plumb_bob", [0.0] * 5, "pinhole", 0),
        ("plumb_bob", [], "pinhole", 0),
        ("", [0.1, 0.0, 0.0, 0.0, 0.0], "plumb_bob", 5),
        ("rational_polynomial", [0.1, 0.2, 0, 0, 0.3, 0.4, 0.5, 0.6], "rational_polynomial", 8),
        ("rational_polynomial", [0.1, 0.2, 0, 0, 0.3, 0.4, 0.5, 0.6, 0, 0, 0, 0], "rational_polynomial", 8),
        ("equidistant", [0.1, 0.2, 0.3, 0.4], "equidistant", 4),
        ("fisheye", [0.0, 0.0, 0.0, 0.0], "equidistant", 4),
    ],
)
def test_lens_models_are_read(ros, write, model, distortion, expected, coefficients):
    info = ros.camera_info(distortion_model=model, D=np.array(distortion, dtype=np.float64))
    camera, codes, _ = camera_of(write, ros, info)
    assert camera is not None
    assert (camera.model, camera.distortion.tolist(), codes) == (expected, distortion[:coefficients], [])
    assert (camera.width_px, camera.height_px) == (640, 480)
    np.testing.assert_array_equal(camera.matrix_px, K)


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"K": np.zeros(9)}, "camera-uncalibrated"),
        ({"K": np.full(9, np.nan)}, "camera-uncalibrated"),
        ({"distortion_model": "omnidirectional"}, "camera-model"),
        ({"D": np.ones(12)}, "camera-model"),
        ({"D": np.array([np.inf, 0, 0, 0, 0])}, "camera-model"),
        ({"distortion_model": "equidistant", "D": np.ones(2)}, "camera-model"),
        ({"width": 0, "height": 0}, "camera-size"),
        ({"width": 640, "height": 640}, "camera-size"),
    ],
)
def test_unusable_intrinsics_are_none_with_a_warning(ros, write, changes, code):
    camera, codes, warnings = camera_of(write, ros, ros.camera_info(**changes))
    assert camera is None
    assert codes == [code]
    assert "/camera/camera_info" in warnings[0].message
    assert "--camera FILE" in warnings[0].hint


def test_a_region_of_interest_moves_the_principal_point(ros, write):
    info = ros.camera_info(region=(100, 50, 320, 200))
    camera, codes, _ = camera_of(write, ros, info, size=(320, 200))
    assert camera is not None
    np.testing.assert_array_equal(camera.matrix_px, [[500, 0, 219.5], [0, 510, 189.5], [0, 0, 1]])
    assert (camera.width_px, camera.height_px, codes) == (320, 200, [])


def test_binning_keeps_pixel_centres_in_place(ros, write):
    """The middle of the sensor is the middle of the binned image: (640 - 1) / 2 becomes (320 - 1) / 2."""
    camera, codes, _ = camera_of(write, ros, ros.camera_info(binning_x=2, binning_y=2), size=(320, 240))
    assert camera is not None
    np.testing.assert_array_equal(camera.matrix_px, [[250, 0, 159.5], [0, 255, 119.5], [0, 0, 1]])
    assert codes == []


def test_intrinsics_of_a_resized_image_are_scaled_with_a_warning(ros, write):
    camera, codes, _ = camera_of(write, ros, ros.camera_info(), size=(320, 240))
    assert camera is not None
    np.testing.assert_allclose(camera.matrix_px, [[250, 0, 159.5], [0, 255, 119.5], [0, 0, 1]])
    assert codes == ["camera-scaled"]


def test_a_rectified_image_uses_the_projection_matrix(ros, write):
    camera, codes, _ = camera_of(write, ros, ros.camera_info(), topic="/camera/image_rect_color")
    assert camera is not None
    assert (camera.model, codes) == ("pinhole", [])
    np.testing.assert_allclose(camera.matrix_px, [[450, 0, 319.5 * 0.9], [0, 459, 239.5 * 0.9], [0, 0, 1]])


def test_intrinsics_that_change_during_the_recording_give_a_warning(ros, write):
    other = ros.camera_info(K=2 * np.array([500.0, 0, 319.5, 0, 510.0, 239.5, 0, 0, 0.5]))
    camera, codes, _ = camera_of(write, ros, ros.camera_info(), other)
    assert camera is not None
    assert camera.matrix_px[0, 0] == 500
    assert codes == ["camera-changes"]
