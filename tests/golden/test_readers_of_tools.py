"""Files for other calibration tools, read by the steps of those tools: JSON, YAML, SciPy's rotations, OpenCV's projection."""

import json

import cv2
import numpy as np
import pytest
import yaml

from calib_core.interchange import CalibrationFile, export, read_camera

CLOSE = {"rtol": 0, "atol": 1e-9}
ON_THE_PIXEL = {"rtol": 0, "atol": 1e-6}


@pytest.fixture(scope="module")
def check_point(file: CalibrationFile) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The check point in the radar frame, in the camera frame by calibration-1's own numbers, and its pixel."""
    assert file.check_point is not None
    pose = file.calibration.camera_from_radar
    radar_m = np.array(file.check_point.radar_m)
    return radar_m, pose.rotation @ radar_m + pose.translation_m, np.array(file.check_point.pixel_px)


def written(file: CalibrationFile, name: str) -> dict:
    return json.loads(export(file, name).data)


def projected(point_camera_m: np.ndarray, matrix: np.ndarray, distortion: list[float]) -> np.ndarray:
    pixels, _ = cv2.projectPoints(point_camera_m[None], np.zeros(3), np.zeros(3), matrix, np.array(distortion))
    return pixels.ravel()


def test_sensors_calibration_takes_the_first_key_and_carries_a_radar_point_into_the_camera(file, check_point):
    radar_m, camera_m, _ = check_point
    root = written(file, "pjlab")
    for first in (next(iter(root)), min(root)):  # in the file's order, and sorted as some JSON libraries do
        data = root[first]["param"]["sensor_calib"]["data"]
        extrinsic = np.array([[data[row][column] for column in range(4)] for row in range(4)])
        np.testing.assert_allclose((extrinsic @ [*radar_m, 1.0])[:3], camera_m, **CLOSE)
    assert next(iter(root)) == "radar-to-camera_optical-extrinsic"
    assert (root[next(iter(root))]["sensor_name"], len(root)) == ("radar", 1)


def test_camera_info_is_loaded_as_ros_does_and_by_camera_option(file, check_point):
    _, camera_m, pixel_px = check_point
    text = export(file, "camera-info").data.decode()
    info = yaml.safe_load(text)
    matrix = np.reshape(info["camera_matrix"]["data"], (3, 3))
    np.testing.assert_allclose(
        projected(camera_m, matrix, info["distortion_coefficients"]["data"]), pixel_px, **ON_THE_PIXEL
    )
    assert (info["image_width"], info["image_height"], info["distortion_model"]) == (640, 480, "plumb_bob")
    assert np.array_equal(np.reshape(info["rectification_matrix"]["data"], (3, 3)), np.eye(3))
    assert np.array_equal(np.reshape(info["projection_matrix"]["data"], (3, 4))[:, :3], matrix)
    assert 'radar frame "radar"' in text
    assert "check point: p_radar [5.0, 1.0, -0.5] m" in text

    camera = read_camera(text)
    assert np.array_equal(camera.matrix_px, file.calibration.camera.matrix_px)
    assert np.array_equal(camera.distortion, file.calibration.camera.distortion)


@pytest.mark.parametrize("name", ["pjlab"])
def test_the_statement_is_a_list_under_one_key(file, name):
    lines: list[str] = []

    def find(value: object) -> None:
        if isinstance(value, dict):
            lines.extend(value.get("cocalib", []))
            for inner in value.values():
                find(inner)

    find(written(file, name))
    assert 'radar frame "radar" (x forward, y left, z up), camera frame "camera_optical"' in lines[0]
    assert any(line.startswith("check point: p_radar [5.0, 1.0, -0.5] m") for line in lines)
    assert any(line.startswith("evidence: clicked; from the calibration with sha256 ") for line in lines)
