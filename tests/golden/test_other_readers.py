"""Our files in the hands of readers that are not ours: pytransform3d, PyYAML, SciPy, OpenCV."""

import json
import shlex
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from pytransform3d.rotations import check_matrix, matrix_from_quaternion
from pytransform3d.transformations import transform_from
from pytransform3d.urdf import UrdfTransformManager
from scipy.spatial.transform import Rotation

from calib_core.interchange import CalibrationFile, export, parent_pose, read_any, read_calibration

BODY_FROM_OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
POINT_RADAR_M = np.array([8.0, -1.5, 0.4])
CLOSE = {"rtol": 0, "atol": 1e-9}


@pytest.fixture(scope="module")
def file(project_root: Path) -> CalibrationFile:
    return read_calibration((project_root / "tests/golden/calibration-1.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def expected_m(file: CalibrationFile) -> np.ndarray:
    """Where the point lies for the camera, by the numbers of calibration-1 alone."""
    return (
        file.calibration.camera_from_radar.rotation @ POINT_RADAR_M + file.calibration.camera_from_radar.translation_m
    )


def text_of(file: CalibrationFile, name: str) -> str:
    return export(file, name).data.decode()


def into_camera(radar_from_camera: np.ndarray) -> np.ndarray:
    return (np.linalg.inv(radar_from_camera) @ [*POINT_RADAR_M, 1.0])[:3]


def test_pytransform3d_reads_the_urdf_and_carries_a_point_into_the_camera(file, expected_m):
    manager = UrdfTransformManager()
    manager.load_urdf(text_of(file, "urdf"))
    camera_from_radar = manager.get_transform(file.frames.radar, file.frames.camera)
    np.testing.assert_allclose((camera_from_radar @ [*POINT_RADAR_M, 1.0])[:3], expected_m, **CLOSE)


def test_pytransform3d_takes_the_static_transform_for_the_pose_of_the_child(file, expected_m):
    words = shlex.split(text_of(file, "tf2"), comments=True)
    value = {words[i][2:]: words[i + 1] for i in range(len(words) - 1) if words[i].startswith("--")}
    qx, qy, qz, qw = (float(value[f"q{axis}"]) for axis in "xyzw")
    pose = transform_from(matrix_from_quaternion([qw, qx, qy, qz]), [float(value[axis]) for axis in "xyz"])
    np.testing.assert_allclose(into_camera(pose), expected_m, **CLOSE)
    assert (value["frame-id"], value["child-frame-id"]) == (file.frames.radar, file.frames.camera)


def test_pyyaml_reads_the_stamped_transform(file, expected_m):
    stamped = yaml.safe_load(text_of(file, "apollo"))
    turn, shift = stamped["transform"]["rotation"], stamped["transform"]["translation"]
    rotation = matrix_from_quaternion([turn[axis] for axis in "wxyz"])
    np.testing.assert_allclose(
        into_camera(transform_from(rotation, [shift[axis] for axis in "xyz"])), expected_m, **CLOSE
    )


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


def test_pyyaml_and_opencv_read_the_camera_chain_and_the_file_storage(file, expected_m, tmp_path):
    chain = yaml.safe_load(text_of(file, "kalibr"))
    matrix = np.array(chain["cam0"]["T_cam_radar"])
    check_matrix(matrix[:3, :3])
    np.testing.assert_allclose((matrix @ [*POINT_RADAR_M, 1.0])[:3], expected_m, **CLOSE)
    path = tmp_path / "radar_camera.yml"
    path.write_bytes(export(file, "opencv").data)
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    carried = storage.getNode("R").mat() @ POINT_RADAR_M + storage.getNode("T").mat().ravel()
    storage.release()
    np.testing.assert_allclose(carried, expected_m, **CLOSE)


def test_nuscenes_records_chain_through_the_ego_frame(file, expected_m):
    ego_from_radar = parent_pose([3.4, 0.0, 0.5, 0.0, 0.0, np.sin(0.1), np.cos(0.1)])
    radar, camera = json.loads(export(file, "nuscenes", parent_from_radar=ego_from_radar).data)
    point = matrix_from_quaternion(radar["rotation"]) @ POINT_RADAR_M + radar["translation"]
    point = matrix_from_quaternion(camera["rotation"]).T @ (point - camera["translation"])
    np.testing.assert_allclose(point, expected_m, **CLOSE)


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
        (lambda rig: rig["rig"]["sensors"].pop(), "1 radars and 0 cameras"),
        (lambda rig: rig["rig"]["sensors"][1].update(correction_rig_T=[0, 0, 0.3]), "correction_rig_T is not zero"),
        (lambda rig: rig["rig"]["sensors"][1].pop("nominalSensor2Rig_FLU"), "no nominalSensor2Rig_FLU"),
    ],
)
def test_a_rig_that_cannot_be_understood_is_refused_in_words(file, change, words):
    from calib_core.errors import InputError

    rig = json.loads(text_of(file, "driveworks"))
    change(rig)
    with pytest.raises(InputError, match=words):
        read_any(json.dumps(rig), "rig.json")
