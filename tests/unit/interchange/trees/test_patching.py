"""A calibration written into a vehicle's own file: the chain becomes the calibration, and nothing but numbers changes."""

import dataclasses
import difflib
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from pytransform3d.urdf import UrdfTransformManager
from scipy.spatial.transform import Rotation

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames
from calib_core.interchange.importing import read_any_files, tree_files
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.interchange.trees.frame_choice import WantedFrames
from calib_core.interchange.trees.patching import Patch, patched
from calib_core.interchange.trees.reading import TreeFile, read_tree
from tests.unit.interchange.trees import vehicles

NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
ECHO = TreeFile(vehicles.REALSENSE_ECHO.encode(), "echo.yaml")


@pytest.fixture(scope="module")
def calibration(golden_text: str) -> CalibrationFile:
    return read_calibration(golden_text)


def file(text: str, name: str = "car.urdf") -> TreeFile:
    return TreeFile(text.encode(), name)


def chained(files: list[TreeFile], radar: str, camera: str) -> RigidTransform:
    return read_tree(files).between(camera, radar)


def assert_only_numbers_change(patch: Patch, *, lines: int) -> None:
    """Each changed line differs in numbers alone, and as many lines change as expected."""
    assert re.sub(NUMBER, "#", patch.before) == re.sub(NUMBER, "#", patch.after)
    before, after = patch.before.splitlines(), patch.after.splitlines()
    assert sum(one != other for one, other in zip(before, after, strict=True)) == lines


def refusal(*args: object, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        patched(*args, **options)
    return str(caught.value)


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_the_cameras_mount_in_a_cars_urdf_is_patched_and_comments_stay(calibration, newline):
    text = vehicles.CAR_URDF.replace("\n", newline)
    wanted = WantedFrames("radar_front", "camera_front_optical_frame")
    patch = patched([file(text)], (), calibration, wanted)

    manager = UrdfTransformManager()
    manager.load_urdf(patch.after)
    np.testing.assert_allclose(
        manager.get_transform("radar_front", "camera_front_optical_frame"),
        calibration.calibration.camera_from_radar.as_matrix(),
        rtol=0,
        atol=1e-6,
    )
    assert_only_numbers_change(patch, lines=1)
    assert "tape measure, redo!" in next(line for line in patch.diff().splitlines() if line.startswith("+ "))
    assert patch.why.startswith("joint camera_front_joint, roof_rack ->")
    assert "camera_front_link (car.urdf:32): " in patch.why
    assert patch.why.endswith("with it moves camera_front_optical_frame")
    assert patch.data == patch.after.encode()
    assert [line[:1] for line in patch.diff().splitlines()[3:] if line[:1] in "+-"] == ["-", "+"]


def test_a_patched_file_needs_no_other_patch(calibration):
    wanted = WantedFrames("radar_front", "camera_front_optical_frame")
    once = patched([file(vehicles.CAR_URDF)], (), calibration, wanted)
    twice = patched([TreeFile(once.data, "car.urdf")], (), calibration, wanted)

    assert twice.diff() == ""


def test_another_joint_is_solved_for_by_name_also_on_the_radars_side(calibration):
    wanted = WantedFrames("radar_front", "camera_front_optical_frame")
    for name, line in (("roof_rack_joint", "roof_rack"), ("radar_front", "radar_front")):
        patch = patched([file(vehicles.CAR_URDF)], (), calibration, wanted, joint=name)
        off = chained([TreeFile(patch.data, "")], "radar_front", "camera_front_optical_frame").as_matrix()
        np.testing.assert_allclose(off, calibration.calibration.camera_from_radar.as_matrix(), rtol=0, atol=1e-6)
        assert f"-> {line} " in patch.why
    assert "no joint 'wheel_left_joint'" in refusal(
        [file(vehicles.CAR_URDF)], (), calibration, wanted, joint="wheel_left_joint"
    )


def test_the_drivers_own_chain_stays_and_the_joint_above_it_is_written(calibration):
    named = dataclasses.replace(calibration, frames=FrameNames("radar", "camera_color_optical_frame"))
    driver = read_tree([ECHO]).joints
    patch = patched([file(vehicles.REALSENSE_URDF)], driver, named, WantedFrames())

    again = chained([TreeFile(patch.data, "cart.urdf"), ECHO], "radar", "camera_color_optical_frame")
    expected = calibration.calibration.camera_from_radar.as_matrix()
    np.testing.assert_allclose(again.as_matrix(), expected, rtol=0, atol=1e-6)
    assert "base_link -> camera_link" in patch.why
    added = [
        line for line in difflib.ndiff(patch.before.splitlines(), patch.after.splitlines()) if line.startswith("+ ")
    ]
    assert len(added) == 1
    assert '<child link="camera_link"/><origin xyz="' in added[0]

    alone = patched([file(vehicles.REALSENSE_URDF)], (), named, WantedFrames())
    assert any("camera_color_optical_frame" in note and "not in the tree" in note for note in alone.notes)


def test_an_origin_without_angles_gets_them(calibration):
    patch = patched([file(vehicles.REALSENSE_URDF)], (), calibration, WantedFrames(), joint="radar_joint")

    assert re.search(rf'<origin xyz="{NUMBER} {NUMBER} {NUMBER}" rpy="{NUMBER} {NUMBER} {NUMBER}"/>', patch.after)


def test_autowares_kit_is_patched_as_pyyaml_reads_it(tmp_path, calibration):
    for name in ("SENSORS_CALIBRATION", "SENSOR_KIT_CALIBRATION"):
        (tmp_path / f"{name.lower()}.yaml").write_text(getattr(vehicles, name), encoding="utf-8")
    patch = patched(tree_files([tmp_path]), (), calibration, WantedFrames(camera="camera0/camera_link"))

    assert patch.source.endswith("sensor_kit_calibration.yaml")
    assert_only_numbers_change(patch, lines=6)
    assert "# from the drawing" in patch.after
    base = yaml.safe_load(vehicles.SENSORS_CALIBRATION)["base_link"]
    kit = yaml.safe_load(patch.after)["sensor_kit_base_link"]

    def posed(entry: dict[str, float]) -> np.ndarray:
        matrix = np.eye(4)
        matrix[:3, :3] = Rotation.from_euler("xyz", [entry[key] for key in ("roll", "pitch", "yaw")]).as_matrix()
        matrix[:3, 3] = [entry[axis] for axis in "xyz"]
        return matrix

    base_from_link = posed(base["sensor_kit_base_link"]) @ posed(kit["camera0/camera_link"])
    radar_from_link = np.linalg.inv(posed(base["front_center/radar_link"])) @ base_from_link
    link_from_camera = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    np.testing.assert_allclose(
        np.linalg.inv(radar_from_link @ link_from_camera),
        calibration.calibration.camera_from_radar.as_matrix(),
        rtol=0,
        atol=1e-6,
    )


def test_apollos_extrinsics_are_patched(tmp_path, calibration):
    folder = vehicles.write_apollo(tmp_path)
    patch = patched(tree_files([folder]), (), calibration, WantedFrames())

    assert patch.source.endswith("front_6mm_extrinsics.yaml")
    assert_only_numbers_change(patch, lines=2)
    Path(patch.source).write_bytes(patch.data)
    found = read_any_files([folder]).camera_from_radar
    np.testing.assert_allclose(
        found.as_matrix(), calibration.calibration.camera_from_radar.as_matrix(), rtol=0, atol=1e-6
    )


@pytest.mark.parametrize(
    "text",
    [
        "ros2 run tf2_ros static_transform_publisher 1 0 0.5 0.1 0 0 base radar &  # bumper\n"
        "ros2 run tf2_ros static_transform_publisher --x 1.2 --z=1 \\\n  --frame-id base --child-frame-id camera_optical\n",
        '<launch>\n<node type="static_transform_publisher" name="a" args="1 0 0.5 0.1 0 0 base radar 100"/>\n<!-- c -->\n'
        '<node type="static_transform_publisher" name="b"\n  args="1 0 0 0 0 0 1 base camera_optical 100"/>\n</launch>\n',
        "def generate_launch_description():\n"
        "    é = Node(executable='static_transform_publisher', arguments=['1', '0', '0.5', '0', '0', '0', 'base', 'radar'])\n"
        "    x = Node(executable='static_transform_publisher',\n"
        "        arguments=['0', '0', '1', '0', '0', '0', '1', 'base', 'camera_optical'])  # c\n",
    ],
    ids=["script", "launch", "python"],
)
def test_static_transform_publishers_are_patched(calibration, text):
    patch = patched([file(text, "f.launch")], (), calibration, WantedFrames())

    again = chained([TreeFile(patch.data, "f.launch")], "radar", "camera_optical")
    np.testing.assert_allclose(
        again.as_matrix(), calibration.calibration.camera_from_radar.as_matrix(), rtol=0, atol=1e-6
    )
    changed = [line for line in patch.diff().splitlines() if line.startswith("-")][1:]
    assert 0 < len(changed) <= 2
    assert not any("radar" in line for line in changed)


def test_expressions_and_moving_joints_are_refused_with_the_numbers_to_write(calibration):
    text = vehicles.CAR_URDF.replace('"0.25 -0.02 0.11"', '"${camera_x} -0.02 0.11"')
    wanted = WantedFrames("radar_front", "camera_front_optical_frame")

    message = refusal([file(text, "car.xacro")], (), calibration, wanted)
    assert message.startswith("car.xacro:32: ")
    assert "its origin is an" in message
    numbers = re.search(r'Write there by hand: xyz="(.*?)" rpy="(.*?)"', message)
    by_hand = re.sub(r'xyz="\$.*?" rpy=".*?"', f'xyz="{numbers[1]}" rpy="{numbers[2]}"', text)
    again = chained([file(by_hand)], "radar_front", "camera_front_optical_frame")
    np.testing.assert_allclose(
        again.as_matrix(), calibration.calibration.camera_from_radar.as_matrix(), rtol=0, atol=1e-6
    )
    pan = vehicles.CAR_URDF.replace('"camera_front_joint" type="fixed"', '"camera_front_joint" type="revolute"')
    assert "it is revolute" in refusal([file(pan)], (), calibration, wanted)


def test_numbers_that_yaml_shares_by_an_anchor_are_refused(calibration):
    base = file(vehicles.SENSORS_CALIBRATION, "a.yaml")
    for again in ("y: 0.56343", "x: -0.10731"):
        kit = vehicles.SENSOR_KIT_CALIBRATION.replace("x: 0.10731  #", "x: &x 0.10731  #").replace(
            again, f"{again[0]}: *x"
        )
        wanted = WantedFrames(camera="camera0/camera_link")
        message = refusal([base, file(kit, "kit.yaml")], (), calibration, wanted)
        assert "kit.yaml:3: " in message
        assert "not changed: its numbers" in message


def test_a_tree_whose_joints_between_are_in_no_file_is_refused(calibration):
    between = read_tree([file(vehicles.REALSENSE_URDF)]).joints
    message = refusal([ECHO], between, calibration, WantedFrames("radar", "camera_color_optical_frame"))

    assert "radar and camera_color_optical_frame is" in message
