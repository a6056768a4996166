"""Frame trees of whole vehicles: read, chained between radar and camera, and refused with words."""

import json
from pathlib import Path

import numpy as np
import pytest
from pyquaternion import Quaternion
from pytransform3d.urdf import UrdfTransformManager
from scipy.spatial.transform import Rotation
from xacro import process_file

from calib_core.errors import InputError
from calib_core.interchange.importing import read_any, read_any_files
from calib_core.interchange.trees.frame_choice import WantedFrames
from tests.unit.interchange.trees import vehicles

CLOSE = {"rtol": 0, "atol": 1e-9}
BODY_FROM_OPTICAL = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
XACRO = """<robot name="x" xmlns:xacro="http://ros.org/wiki/xacro">
  <xacro:property name="height" value="1"/>
  <joint name="j" type="fixed">
    <parent link="base"/><child link="radar"/>
    <origin xyz="1 0 0.5" rpy="0 0 0.1"/>
  </joint>
  <joint name="k" type="fixed">
    <parent link="base"/><child link="camera_optical"/>
    <origin xyz="1.5 0 1" rpy="-1.6 0 -1.5"/>
  </joint>
</robot>
"""


def written(folder: Path, **files: str) -> list[Path]:
    paths = []
    for name, text in files.items():
        paths.append(folder / name.replace("__", "."))
        paths[-1].write_text(text, encoding="utf-8")
    return paths


def pose(numbers: tuple[float, ...], *, degrees: bool = False) -> np.ndarray:
    """Return a pose of x, y, z, roll, pitch and yaw by SciPy."""
    matrix = np.eye(4)
    matrix[:3, 3] = numbers[:3]
    matrix[:3, :3] = Rotation.from_euler("xyz", numbers[3:], degrees=degrees).as_matrix()
    return matrix


def refusal(paths: list[Path], **frames: str) -> str:
    with pytest.raises(InputError) as caught:
        read_any_files(paths, WantedFrames(**frames))
    return str(caught.value).replace(str(paths[0].parent), "")


def test_a_cars_urdf_is_chained_as_pytransform3d_chains_it(tmp_path):
    found = read_any_files(
        written(tmp_path, car__urdf=vehicles.CAR_URDF), WantedFrames("radar_front", "camera_front_optical_frame")
    )

    manager = UrdfTransformManager()
    manager.load_urdf(vehicles.CAR_URDF)
    expected = manager.get_transform("radar_front", "camera_front_optical_frame")
    np.testing.assert_allclose(found.camera_from_radar.as_matrix(), expected, **CLOSE)
    assert (found.frames.radar, found.frames.camera) == ("radar_front", "camera_front_optical_frame")
    assert found.assumptions == ()


def test_several_radars_and_cameras_are_listed_with_the_flags_that_choose(tmp_path):
    paths = written(tmp_path, car__urdf=vehicles.CAR_URDF)

    message = refusal(paths)
    assert "frames: radar_front, radar_rear_left" in message
    assert "frames: camera_front_optical_frame, camera_rear_optical_frame" in message
    assert "--radar NAME and --camera-frame" in message
    assert "did you mean radar_front?" in refusal(paths, radar="radr_front")
    moving = refusal(paths, radar="radar_front", camera="wheel_left")
    assert "/car.urdf:11: " in moving
    assert "it is continuous" in moving


def test_a_body_frame_leads_to_the_optical_frame_that_it_carries(tmp_path):
    paths = written(tmp_path, car__urdf=vehicles.CAR_URDF)
    by_link, by_optical = (
        read_any_files(paths, WantedFrames("radar_front", f"camera_front_{end}")) for end in ("link", "optical_frame")
    )

    assert by_link.frames.camera == "camera_front_optical_frame"
    assert any(note.startswith("camera_front_link carries camera_front_optical_frame") for note in by_link.notes)
    np.testing.assert_array_equal(by_link.camera_from_radar.as_matrix(), by_optical.camera_from_radar.as_matrix())


def test_a_drivers_chain_is_joined_to_the_vehicle(tmp_path):
    paths = written(tmp_path, cart__urdf=vehicles.REALSENSE_URDF, echo__yaml=vehicles.REALSENSE_ECHO)
    found = read_any_files(paths, WantedFrames(camera="camera_color_optical_frame"))

    color = np.eye(4)
    color[:3, :3] = Quaternion(0.9999959, 0.0021, -0.0017, 0.0009).rotation_matrix
    color[:3, 3] = 0.00015, 0.01475, 0.0002
    radar_from_camera = np.linalg.inv(pose((0.3, 0, 0.4, 0, 0, 0))) @ color @ BODY_FROM_OPTICAL
    np.testing.assert_allclose(found.camera_from_radar.as_matrix(), np.linalg.inv(radar_from_camera), **CLOSE)


def test_what_topic_echo_prints_is_read_with_its_last_line_and_message_by_message():
    one = vehicles.REALSENSE_ECHO.replace("camera_depth_frame", "radar").replace("---\n", "")
    messages = one.replace("- header:", "---\ntransforms:\n- header:").replace("transforms:\n---\n", "", 1) + "---\n"

    poses = [read_any(text).camera_from_radar.as_matrix() for text in (one, one + "---\n", messages)]
    np.testing.assert_array_equal(poses[0], poses[1])
    np.testing.assert_array_equal(poses[0], poses[2])


def test_autowares_two_files_are_chained_over_the_kit(tmp_path):
    paths = written(
        tmp_path,
        sensors_calibration__yaml=vehicles.SENSORS_CALIBRATION,
        sensor_kit_calibration__yaml=vehicles.SENSOR_KIT_CALIBRATION,
    )
    found = read_any_files(paths, WantedFrames(camera="camera0/camera_link"))
    folder = read_any_files([tmp_path], WantedFrames(camera="camera0/camera_link"))

    kit = pose((0.9, 0, 2, -0.001, 0.015, -0.0364))
    link = pose((0.10731, 0.56343, -0.27697, -0.025, 0.315, 1.035))
    radar_from_camera = np.linalg.inv(pose((3.7, 0, 0.5, 0, 0, 0))) @ kit @ link @ BODY_FROM_OPTICAL
    np.testing.assert_allclose(found.camera_from_radar.as_matrix(), np.linalg.inv(radar_from_camera), **CLOSE)
    np.testing.assert_array_equal(folder.camera_from_radar.as_matrix(), found.camera_from_radar.as_matrix())
    assert any("camera0/camera_link" in one and "body axes" in one for one in found.assumptions)
    assert "like a camera" in refusal(paths[:1])
    assert "frames: camera0/camera_link, camera1/camera_link" in refusal(paths)


def test_a_folder_of_apollo_is_chained_and_its_intrinsics_name_the_camera(tmp_path):
    found = read_any_files([vehicles.write_apollo(tmp_path)])

    turn = np.eye(4)
    turn[:3, :3] = Quaternion(0.5, -0.5, 0.5, -0.5).rotation_matrix
    turn[:3, 3] = 0.67, -0.1 + 1.6, -0.5 + 1.7
    radar = np.eye(4)
    radar[:3, :3] = Quaternion(0.9999619, 0, 0, 0.0087265).rotation_matrix
    radar[:3, 3] = 3.1, 0, -0.4
    np.testing.assert_allclose(found.camera_from_radar.as_matrix(), np.linalg.inv(turn) @ radar, **CLOSE)
    assert (found.frames.radar, found.frames.camera, found.assumptions) == ("radar_front", "front_6mm", ())


def test_the_whole_table_of_nuscenes_is_read_by_its_sensors_names(tmp_path):
    found = read_any_files([vehicles.write_nuscenes(tmp_path / "one")], WantedFrames(camera="CAM_FRONT"))

    camera = Quaternion(0.499801, -0.503032, 0.499786, -0.497364).transformation_matrix
    camera[:3, 3] = 1.70079, 0.015946, 1.51096
    radar = Quaternion(0.9999984769, 0, 0, 0.0017453284).transformation_matrix
    radar[:3, 3] = 3.412, 0, 0.5
    np.testing.assert_allclose(found.camera_from_radar.as_matrix(), np.linalg.inv(camera) @ radar, **CLOSE)
    np.testing.assert_array_equal(found.matrix_px[0], [1266.4, 0, 816.3])
    two = vehicles.write_nuscenes(tmp_path / "two", two_vehicles=True)
    assert "4 camera frames: CAM_FRONT@000000a0" in refusal([two])
    assert read_any_files([two], WantedFrames(camera="CAM_FRONT@000000b0")).frames.camera == "CAM_FRONT@000000b0"
    assert "does not name its 8 sensors" in refusal([two / "calibrated_sensor.json"])


def test_a_rig_of_many_sensors_is_chained_with_body_axes():
    rig = """{"rig": {"sensors": [
      {"name": "lidar", "protocol": "lidar.virtual", "nominalSensor2Rig_FLU": {"roll-pitch-yaw": [0, 0, 0], "t": [1, 0, 2]}},
      {"name": "left", "protocol": "radar.virtual", "nominalSensor2Rig_FLU": {"roll-pitch-yaw": [0, 0, 40], "t": [3, 0.5, 0.4]}},
      {"name": "right", "protocol": "radar.virtual", "nominalSensor2Rig_FLU": {"roll-pitch-yaw": [0, 0, -4], "t": [3, -0.5, 0]},
       "correction_sensor_R_FLU": {"roll-pitch-yaw": [0.1, 2, 0]}, "correction_rig_T": [0.02, 0, 0.01]},
      {"name": "odd", "protocol": "radar.virtual", "nominalSensor2Rig_FLU": {"roll-pitch-yaw": [0, 0, -4], "t": [3, -0.5, 0]},
       "correction_other": [0.1, 0, 0]},
      {"name": "wide", "protocol": "camera.gmsl", "nominalSensor2Rig_FLU": {"roll-pitch-yaw": [0.5, 2, -1], "t": [1.8, 0, 1.4]}}
    ]}, "version": 7}"""
    found = read_any(rig, "rig.json", WantedFrames("left"))

    radar = pose((3, 0.5, 0.4, 0, 0, 40), degrees=True)
    camera = pose((1.8, 0, 1.4, 0.5, 2, -1), degrees=True) @ BODY_FROM_OPTICAL
    np.testing.assert_allclose(found.camera_from_radar.as_matrix(), np.linalg.inv(camera) @ radar, **CLOSE)
    corrected = read_any(rig, "rig.json", WantedFrames("right"))
    radar = pose((3.02, -0.5, 0.01, 0, 0, -4), degrees=True) @ pose((0, 0, 0, 0.1, 2, 0), degrees=True)
    np.testing.assert_allclose(corrected.camera_from_radar.as_matrix(), np.linalg.inv(camera) @ radar, **CLOSE)
    assert "how corrections apply" in " ".join(corrected.assumptions)
    with pytest.raises(InputError, match=r"rig.json:6: the joint from rig to odd .*: correction_other is not zero"):
        read_any(rig, "rig.json", WantedFrames("odd"))


def test_several_publishers_are_chained_in_scripts_and_launch_files():
    radar, camera = "1 0.1 0.4 0.2 0 0 base_link radar", "0.5 0 1 -1.5708 0 -1.5708 base_link camera_optical"
    ros1 = '<node pkg="tf" type="static_transform_publisher" name="{}" args="{} 100"/>'
    named = (
        "Node(package='tf2_ros', executable='static_transform_publisher', arguments=['--x', '{}', '--y', '{}', '--z', '{}', "
        "'--yaw', '{}', '--pitch', '{}', '--roll', '{}', '--frame-id', '{}', '--child-frame-id', '{}'])"
    )
    texts = {
        "tf2": "\n".join(f"ros2 run tf2_ros static_transform_publisher {words} &" for words in (radar, camera)),
        "tf1-launch": f"<launch>{ros1.format('a', radar)}{ros1.format('b', camera)}</launch>",
        "tf2-launch-py": "def generate_launch_description():\n  return LaunchDescription(["
        + ", ".join(named.format(*words.split()) for words in (radar, camera))
        + "])\n",
    }

    base_from_radar = pose((1, 0.1, 0.4, 0, 0, 0.2))
    base_from_camera = pose((0.5, 0, 1, -1.5708, 0, -1.5708))
    for name, text in texts.items():
        found = read_any(text, "file")
        assert found.format == name
        expected = np.linalg.inv(base_from_camera) @ base_from_radar
        np.testing.assert_allclose(found.camera_from_radar.as_matrix(), expected, **CLOSE)


def test_a_list_of_transforms_in_json_is_chained_as_ros_and_foxglove_write_it():
    radar, camera = pose((3.4, 0.1, 0.5, 0.02, -0.03, 0.04)), pose((1.8, 0.2, 1.4, -1.5, 0.1, -1.6))
    foxglove, ros = [], []
    for parent, child, matrix in (("base_link", "radar", radar), ("base_link", "camera_optical", camera)):
        turn = dict(zip("xyzw", Rotation.from_matrix(matrix[:3, :3]).as_quat().tolist(), strict=True))
        numbers = {"translation": dict(zip("xyz", matrix[:3, 3].tolist(), strict=True)), "rotation": turn}
        foxglove.append({"parent_frame_id": parent, "child_frame_id": child, **numbers})
        ros.append({"header": {"frame_id": parent}, "child_frame_id": child, "transform": numbers})
    for transforms, name in ((foxglove, "foxglove"), (ros, "apollo")):
        found = read_any(json.dumps({"transforms": transforms}), "message.json")
        assert found.format == name
        np.testing.assert_allclose(found.camera_from_radar.as_matrix(), np.linalg.inv(camera) @ radar, **CLOSE)
    lens = {"frame_id": "front", "K": [500, 0, 320, 0, 500, 240, 0, 0, 1], "width": 640, "height": 480, "D": []}
    foxglove[1]["child_frame_id"] = "front"
    named = {"FrameTransforms": {"transforms": foxglove}, "CameraCalibration": lens}
    assert read_any(json.dumps(named), "message.json").frames.camera == "front"
    del foxglove[0]["translation"]
    with pytest.raises(InputError, match=r"message.json: transforms\[0\].translation: missing; add it"):
        read_any(json.dumps({"transforms": foxglove}), "message.json")


def test_a_xacro_of_nothing_but_macros_is_refused_with_the_line_of_the_first():
    macro = XACRO[: XACRO.index("  <joint")].replace(
        '<xacro:property name="height" value="1"/>', '<xacro:kit n="radar"/>'
    )
    with pytest.raises(InputError, match=r"car.xacro:2 has <xacro:kit>, .* expand it first"):
        read_any(macro + "</robot>", "car.xacro")


def test_a_plain_xacro_is_read_as_xacro_expands_it(tmp_path):
    (path,) = written(tmp_path, plain__xacro=XACRO)
    expanded = process_file(str(path)).toxml()

    np.testing.assert_array_equal(
        read_any_files([path]).camera_from_radar.as_matrix(), read_any(expanded).camera_from_radar.as_matrix()
    )


def test_macros_and_expressions_are_refused_with_their_line_where_they_matter(tmp_path):
    expression = XACRO.replace("1.5 0 1", "1.5 0 ${height}")
    macro = '<xacro:macro name="kit"><joint name="z" type="fixed"><parent link="base"/><child link="camera_b_link"/></joint>'
    inside = XACRO.replace("</robot>", f"{macro}</xacro:macro>\n</robot>")
    (one,) = written(tmp_path, one__xacro=expression)
    (two,) = written(tmp_path, two__xacro=inside)

    for words, message in (
        (("/one.xacro:9: ", "an expression", 'xyz="1.5 0 ${'), refusal([one])),
        (("/two.xacro:11: ", "camera_b_link", "<xacro:macro> of line 11"), refusal([two], camera="camera_b_link")),
        (("/two.xacro:11 ", "<xacro:macro kit>", "expand it first"), refusal([two], camera="x")),
    ):
        assert [part for part in words if part not in message] == [], message
    assert read_any_files([two], WantedFrames(camera="camera_optical")).frames.camera == "camera_optical"


def test_a_second_parent_and_a_circle_are_refused(tmp_path):
    joint = '<joint name="{}" type="fixed"><parent link="{}"/><child link="{}"/></joint>\n'
    ends = [("base", "radar"), ("base", "camera_optical"), ("mast", "camera_optical")]
    (second,) = written(
        tmp_path, second__urdf="<robot>\n" + "".join(joint.format(c, p, c) for p, c in ends) + "</robot>"
    )
    (circle,) = written(
        tmp_path,
        circle__urdf="<robot>\n"
        + "".join(joint.format(c, p, c) for p, c in [("a", "radar"), ("radar", "b"), ("b", "a")])
        + "</robot>",
    )

    message = refusal([second])
    words = ("/second.urdf:4: ", "'camera_optical'", "'mast'", "'base' (/second.urdf:3)")
    assert [part for part in words if part not in message] == []
    assert "form a circle" in refusal([circle])


def test_files_and_folders_without_joints_are_refused(tmp_path):
    (notes,) = written(tmp_path, notes__yaml="a: 1\n")

    assert "no file of frames" in refusal([tmp_path])
    assert "/notes.yaml: no transforms" in refusal([notes, notes])


def test_the_frames_of_a_file_that_is_no_tree_are_called_as_the_user_says():
    found = read_any("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", "m.txt", WantedFrames("radar_front"))

    assert (found.frames.radar, found.frames.camera) == ("radar_front", "camera_optical")
