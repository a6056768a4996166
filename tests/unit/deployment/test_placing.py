"""Where the transform goes among the frames of a recording: every frame keeps one parent, and the overlay is right."""

import io
import itertools

import numpy as np
import pytest

from calib_core.deployment import write_into_recording
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix, rotation_exp
from calib_core.recordings import RecordingOptions, open_recording
from tests.unit.deployment.conftest import CAMERA_FROM_RADAR, START_NS, Ros, calibration_file, exported, without_info

CAMERA_LINK_FROM_CAMERA = RigidTransform(np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]), np.array([0.01, 0.02, 0.0]))
BASE_FROM_RADAR = RigidTransform(rotation_exp(np.array([0.0, 0.1, 0.5])), np.array([1.0, 0.2, 0.6]))
BASE_FROM_CAMERA_LINK = RigidTransform(rotation_exp(np.array([0.0, 0.0, -0.2])), np.array([0.5, 0.0, 1.2]))


def transform(ros, parent, child, parent_from_child, at=START_NS):
    types = ros.store.types
    w, x, y, z = quaternion_wxyz_from_matrix(parent_from_child.rotation)
    pose = types["geometry_msgs/msg/Transform"](
        translation=types["geometry_msgs/msg/Vector3"](*parent_from_child.translation_m),
        rotation=types["geometry_msgs/msg/Quaternion"](x, y, z, w),
    )
    return types["geometry_msgs/msg/TransformStamped"](
        header=ros.header(at, parent), child_frame_id=child, transform=pose
    )


def message(ros, *joints):
    return ros.new("tf2_msgs/msg/TFMessage", transforms=list(joints))


def tree(written):
    """Read all transforms with mcap's decoder: the parent of each frame, and its pose there."""
    found = {}
    for one in written.messages:
        if not one.topic.startswith("/tf"):
            continue
        for joint in one.decoded.transforms:
            found.setdefault(joint.child_frame_id.lstrip("/"), {})[joint.header.frame_id.lstrip("/")] = joint.transform
    return found


def in_root(found, frame):
    """Return the root of a frame, and its pose there."""
    root_from_frame = np.eye(4)
    while frame in found:
        ((frame, pose),) = found[frame].items()
        q, t = pose.rotation, pose.translation
        x, y, z, w = q.x, q.y, q.z, q.w
        step = np.eye(4)
        step[:3, :3] = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        step[:3, 3] = t.x, t.y, t.z
        root_from_frame = step @ root_from_frame
    return frame, root_from_frame


def assert_overlay(written, radar):
    """Each frame has one parent, and the transform from the radar to the camera is the calibration's."""
    found = tree(written)
    assert all(len(parents) == 1 for parents in found.values())
    (camera_root, root_from_camera), (radar_root, root_from_radar) = (
        in_root(found, name) for name in ("camera", radar)
    )
    assert camera_root == radar_root
    np.testing.assert_allclose(
        np.linalg.inv(root_from_camera) @ root_from_radar, CAMERA_FROM_RADAR.as_matrix(), atol=1e-9
    )


@pytest.fixture
def with_frames(rows, write):
    """Return the function that writes a ROS 2 recording with transforms at its beginning, and exports into it."""

    def build(*joints, moving=(), options=None, container="mcap", **frames):
        ros = Ros(2)
        some = without_info(rows(ros))
        static = (
            [("/tf_static", START_NS, message(ros, *(transform(ros, *joint) for joint in joints)))] if joints else []
        )
        for number, joint in itertools.product(range(3), moving):
            parent, child, pose = joint
            turned = RigidTransform(rotation_exp(np.array([0, 0, 0.1 * number])) @ pose.rotation, pose.translation_m)
            at = START_NS + number * 10**8
            some.append(("/tf", at, message(ros, transform(ros, parent, child, turned, at))))
        path = write(ros, [*static, *sorted(some, key=lambda row: row[1])], container)
        return exported(path, calibration_file(**frames), options)

    return build


def test_without_other_transforms_the_camera_is_the_radars_child(with_frames):
    written = with_frames()
    assert tree(written).keys() == {"camera"}
    assert_overlay(written, "radar")


def test_a_driver_that_gives_the_camera_a_parent_keeps_it(with_frames):
    written = with_frames(("camera_link", "camera", CAMERA_LINK_FROM_CAMERA))
    assert {child: list(parents) for child, parents in tree(written).items()} == {
        "camera": ["camera_link"],
        "camera_link": ["radar"],
    }
    assert "a second parent" in written.notes
    assert_overlay(written, "radar")


def test_a_radar_with_a_parent_keeps_it_too(with_frames):
    written = with_frames(
        ("camera_link", "camera", CAMERA_LINK_FROM_CAMERA), ("base_link", "/radar", BASE_FROM_RADAR), container="db3"
    )
    assert list(tree(written)["camera_link"]) == ["radar"]
    assert_overlay(written, "radar")


def test_a_tree_that_states_another_pose_is_left_alone(with_frames):
    written = with_frames(
        ("base_link", "camera_link", BASE_FROM_CAMERA_LINK),
        ("camera_link", "camera", CAMERA_LINK_FROM_CAMERA),
        ("base_link", "radar", BASE_FROM_RADAR),
    )
    assert "differs by" in written.notes
    assert_overlay(written, "cocalib_radar")
    (cloud, *_) = written.on("/cocalib/radar_points")
    assert cloud.decoded.header.frame_id == "cocalib_radar"
    assert "/cocalib/radar_points" in written.said.layout


def test_a_tree_that_states_the_calibration_gets_nothing(with_frames):
    radar_from_base = BASE_FROM_RADAR.inverse()
    base_from_camera = radar_from_base.inverse() @ CAMERA_FROM_RADAR.inverse()
    written = with_frames(("base_link", "radar", BASE_FROM_RADAR), ("base_link", "camera", base_from_camera))
    assert "/tf_static" not in written.said.added
    assert_overlay(written, "radar")


def test_a_camera_that_pans_carries_the_radar_instead(with_frames):
    written = with_frames(
        ("base_link", "pan", BASE_FROM_CAMERA_LINK), moving=[("pan", "camera", CAMERA_LINK_FROM_CAMERA)]
    )
    assert list(tree(written)["radar"]) == ["camera"]
    assert_overlay(written, "radar")


def test_a_radar_joined_through_a_moving_joint_gets_a_frame_of_its_own(with_frames):
    written = with_frames(
        ("base_link", "radar", BASE_FROM_RADAR), moving=[("base_link", "camera", CAMERA_LINK_FROM_CAMERA)]
    )
    assert "joint that moves" in written.notes
    assert_overlay(written, "cocalib_radar")


def test_a_recording_whose_camera_has_two_parents_is_not_made_worse(with_frames):
    written = with_frames(("a", "camera", CAMERA_LINK_FROM_CAMERA), ("b", "camera", BASE_FROM_CAMERA_LINK))
    assert "camera has several parents" in written.notes
    assert list(tree(written)["cocalib_radar"]) == ["camera"]


def test_frames_that_are_each_others_parents_end(with_frames):
    written = with_frames(("a", "camera", CAMERA_LINK_FROM_CAMERA), ("camera", "a", BASE_FROM_CAMERA_LINK))
    assert "its own ancestor" in written.notes


def test_the_recordings_own_frame_names_are_used_and_said(with_frames):
    written = with_frames(radar_frame="front_radar", camera_frame="cam_optical")
    assert_overlay(written, "radar")
    assert "is written as 'radar'" in written.notes
    assert "calls it 'front_radar'" in written.notes
    assert "calls it 'cam_optical'" in written.notes


def test_returns_read_in_other_axes_get_a_frame_of_their_own(with_frames):
    written = with_frames(options=RecordingOptions(radar_axes="forward,right,up"))
    assert "the calibration (forward,right,up)" in written.notes
    assert_overlay(written, "cocalib_radar")
    raw, own = (
        np.frombuffer(written.on(topic)[0].decoded.data, "<f4").reshape(-1, 5)[:, :3]
        for topic in ("/radar/points", "/cocalib/radar_points")
    )
    np.testing.assert_array_equal(own, raw * np.array([1, -1, 1], dtype=np.float32))


def test_sensors_with_one_frame_id_are_told_apart(rows, write):
    ros = Ros(2)
    some = without_info(rows(ros))
    for _, _, one in some:
        one.header.frame_id = "camera"
    written = exported(write(ros, some), calibration_file())
    assert "same frame_id 'camera'" in written.notes
    assert_overlay(written, "cocalib_radar")


def test_transforms_of_ros1_are_read_too(rows, write):
    ros = Ros(1)
    ros.define("tf2_msgs/msg/TFMessage", "geometry_msgs/TransformStamped[] transforms\n")
    static = message(ros, transform(ros, "/camera_link", "/camera", CAMERA_LINK_FROM_CAMERA))
    path = write(ros, [("/tf_static", START_NS, static), *without_info(rows(ros))])
    out = io.BytesIO()
    with open_recording(path) as recording:
        said = write_into_recording(recording, calibration_file(), out, version="0")
    assert any("camera_link is written instead" in note for note in said.notes)
