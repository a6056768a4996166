"""Our files in the hands of readers that are not ours.

xacro, pytransform3d, pyquaternion, PyYAML, SciPy, OpenCV, COLMAP."""

import io
import json
import zipfile

import cv2
import numpy as np
import pytest
import xacro
import yaml
from pyquaternion import Quaternion
from pytransform3d.transformations import transform_from
from pytransform3d.urdf import UrdfTransformManager
from scipy.spatial.transform import Rotation

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.files import read_camera
from calib_core.interchange.exporting import export, parent_pose
from calib_core.interchange.formats.registry import format_named
from calib_core.interchange.importing import read_any

BODY_FROM_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
POINT_RADAR_M = np.array([8.0, -1.5, 0.4])
CLOSE = {"rtol": 0, "atol": 1e-9}


@pytest.fixture(scope="module")
def expected_m(file: CalibrationFile) -> np.ndarray:
    """Where the point lies for the camera, by the numbers of calibration-1 alone."""
    return (
        file.calibration.camera_from_radar.rotation @ POINT_RADAR_M + file.calibration.camera_from_radar.translation_m
    )


def text_of(file: CalibrationFile, name: str) -> str:
    return export(file, name, rectified=format_named(name).is_for_rectified).data.decode()


def into_camera(radar_from_camera: np.ndarray) -> np.ndarray:
    return (np.linalg.inv(radar_from_camera) @ [*POINT_RADAR_M, 1.0])[:3]


def test_pyyaml_reads_the_sensor_kit_with_the_radar_posed_in_it(file, expected_m):
    kit_from_radar = parent_pose([1.2, -0.3, 0.5, 0.0, 0.0, np.sin(0.2), np.cos(0.2)])
    kit = yaml.safe_load(export(file, "autoware", parent_from_radar=kit_from_radar).data)["sensor_kit_base_link"]

    def posed(name: str) -> np.ndarray:
        entry = kit[name]
        rotation = Rotation.from_euler("xyz", [entry[key] for key in ("roll", "pitch", "yaw")]).as_matrix()
        return transform_from(rotation, [entry[axis] for axis in "xyz"])

    radar_from_link = np.linalg.inv(posed(file.frames.radar)) @ posed(file.frames.camera_link)
    np.testing.assert_allclose(
        into_camera(radar_from_link @ transform_from(BODY_FROM_OPTICAL, [0, 0, 0])), expected_m, **CLOSE
    )


def test_xacro_takes_the_urdf_into_a_vehicle_and_pytransform3d_reads_what_comes_out(file, expected_m, tmp_path):
    (tmp_path / "radar_camera.urdf").write_text(text_of(file, "urdf"), encoding="utf-8")
    vehicle = f"""<robot name="vehicle" xmlns:xacro="http://www.ros.org/wiki/xacro">
      <xacro:include filename="{tmp_path}/radar_camera.urdf"/>
      <link name="base_link"/>
      <joint name="mount" type="fixed"><parent link="base_link"/><child link="{file.frames.radar}"/>
        <origin xyz="${{1.5 + 2}} 0 0.5" rpy="0 0 0.3"/></joint>
    </robot>"""
    (tmp_path / "vehicle.xacro").write_text(vehicle, encoding="utf-8")

    manager = UrdfTransformManager()
    manager.load_urdf(xacro.process_file(str(tmp_path / "vehicle.xacro")).toxml())

    into_camera_from = manager.get_transform("base_link", file.frames.camera)
    base_from_radar = transform_from(Rotation.from_euler("z", 0.3).as_matrix(), [3.5, 0, 0.5])
    np.testing.assert_allclose((into_camera_from @ base_from_radar @ [*POINT_RADAR_M, 1.0])[:3], expected_m, **CLOSE)


def test_nuscenes_records_carry_a_radar_point_into_the_image_as_the_devkit_does(file, expected_m):
    """The devkit's documented steps: rotate and translate into the ego frame by the radar's record, undo the camera's."""
    ego_from_radar = parent_pose([3.4, 0.0, 0.5, 0.0, 0.0, np.sin(0.1), np.cos(0.1)])
    written = export(file, "nuscenes", parent_from_radar=ego_from_radar, rectified=True).data
    radar, camera = json.loads(zipfile.ZipFile(io.BytesIO(written)).read("calibrated_sensor.json"))
    point = Quaternion(radar["rotation"]).rotation_matrix @ POINT_RADAR_M + np.array(radar["translation"])
    point = Quaternion(camera["rotation"]).rotation_matrix.T @ (point - np.array(camera["translation"]))
    np.testing.assert_allclose(point, expected_m, **CLOSE)

    pixel = np.array(camera["camera_intrinsic"]) @ point
    undistorted, _ = cv2.projectPoints(
        expected_m[None], np.zeros(3), np.zeros(3), file.calibration.camera.matrix_px, np.zeros(5)
    )
    np.testing.assert_allclose(pixel[:2] / pixel[2], undistorted.ravel(), **CLOSE)


def test_colmap_reads_its_model_and_finds_the_check_point_half_a_pixel_on(file, tmp_path):
    pycolmap = pytest.importorskip("pycolmap", reason="the dependency group 'bench' is not installed")
    zipfile.ZipFile(io.BytesIO(export(file, "colmap").data)).extractall(tmp_path)
    model = pycolmap.Reconstruction(str(tmp_path))
    (image,), (camera,) = model.images.values(), model.cameras.values()
    point_camera_m = image.cam_from_world() * file.check_point.radar_m
    np.testing.assert_allclose(
        camera.img_from_cam(point_camera_m[None])[0], file.check_point.pixel_px + 0.5, rtol=0, atol=1e-6
    )


def test_a_rig_is_read_as_its_other_readers_do(file, expected_m):
    """Degrees about fixed axes, every sensor with body axes: as several readers of such rigs turn it into a matrix."""
    rig_from_radar = parent_pose([3.4, 0.1, 0.5, 0.0, np.sin(0.05), 0.0, np.cos(0.05)])
    text = export(file, "driveworks", parent_from_radar=rig_from_radar).data
    radar, camera = json.loads(text)["rig"]["sensors"]

    def posed(sensor: dict) -> np.ndarray:
        pose = sensor["nominalSensor2Rig_FLU"]
        return transform_from(Rotation.from_euler("xyz", pose["roll-pitch-yaw"], degrees=True).as_matrix(), pose["t"])

    optical = posed(camera) @ transform_from(BODY_FROM_OPTICAL, [0, 0, 0])
    np.testing.assert_allclose(into_camera(np.linalg.inv(posed(radar)) @ optical), expected_m, **CLOSE)
    again = read_any(text).camera_from_radar
    np.testing.assert_allclose((again @ POINT_RADAR_M[None])[0], expected_m, **CLOSE)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rig: rig["rig"]["sensors"].pop(), "'rig' is no camera by its name"),
        (
            lambda rig: rig["rig"]["sensors"][1].update(correction_sensor_T=[0, 0, 0.3]),
            "correction_sensor_T is not zero",
        ),
        (lambda rig: rig["rig"]["sensors"][1].pop("nominalSensor2Rig_FLU"), "no nominalSensor2Rig_FLU"),
    ],
)
def test_a_rig_that_cannot_be_understood_is_refused_in_words(file, change, words):
    rig = json.loads(text_of(file, "driveworks"))
    change(rig)
    with pytest.raises(InputError, match=words):
        read_any(json.dumps(rig), "rig.json")


def test_sensors_calibration_takes_the_first_key_and_carries_a_radar_point_into_the_camera(file, expected_m):
    root = json.loads(text_of(file, "pjlab"))
    for first in (next(iter(root)), min(root)):  # in the file's order, and sorted as some JSON libraries do
        data = root[first]["param"]["sensor_calib"]["data"]
        extrinsic = np.array([[data[row][column] for column in range(4)] for row in range(4)])
        np.testing.assert_allclose((extrinsic @ [*POINT_RADAR_M, 1.0])[:3], expected_m, **CLOSE)
    assert next(iter(root)) == "radar-to-camera_optical-extrinsic"
    assert (root[next(iter(root))]["sensor_name"], len(root)) == ("radar", 1)


def test_camera_info_is_loaded_as_ros_does_and_by_camera_option(file):
    text = export(file, "camera-info").data.decode()
    info = yaml.safe_load(text)
    matrix = np.reshape(info["camera_matrix"]["data"], (3, 3))
    distortion = np.array(info["distortion_coefficients"]["data"])
    point_camera_m = file.calibration.camera_from_radar @ file.check_point.radar_m[None]
    pixel_px, _ = cv2.projectPoints(point_camera_m, np.zeros(3), np.zeros(3), matrix, distortion)
    np.testing.assert_allclose(pixel_px.ravel(), file.check_point.pixel_px, rtol=0, atol=1e-6)
    assert (info["image_width"], info["image_height"], info["distortion_model"]) == (640, 480, "plumb_bob")
    assert np.array_equal(np.reshape(info["rectification_matrix"]["data"], (3, 3)), np.eye(3))
    assert np.array_equal(np.reshape(info["projection_matrix"]["data"], (3, 4))[:, :3], matrix)
    assert 'radar frame "radar"' in text
    assert "[5.0, 1.0, -0.5] m" in text

    camera = read_camera(text)
    assert np.array_equal(camera.matrix_px, file.calibration.camera.matrix_px)
    assert np.array_equal(camera.distortion, file.calibration.camera.distortion)
