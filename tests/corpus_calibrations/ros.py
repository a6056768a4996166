"""What ROS and its tools print and store: static transforms, echoes, URDF, Autoware, Apollo, hand-eye calibrations."""

import json
from typing import Any

import numpy as np

from tests.corpus_calibrations.truth import (
    CAMERA_FROM_RADAR,
    LINK_FROM_OPTICAL,
    RADAR_FROM_CAMERA,
    Calibration,
    inverse,
    posed,
    quaternion,
    rpy,
    words,
)

RADAR, CAMERA, LINK = "radar_front", "camera_color_optical_frame", "camera_link"
RADAR_FROM_LINK = RADAR_FROM_CAMERA @ inverse(LINK_FROM_OPTICAL)
BASE_FROM_RADAR = posed(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), (3.4, 0.2, 0.6))
BASE_FROM_LINK = BASE_FROM_RADAR @ RADAR_FROM_LINK


def _xyz_and_quaternion(matrix: np.ndarray) -> str:
    return words([*matrix[:3, 3], *quaternion(matrix)])


def _tf2_named() -> str:
    labels = ("x", "y", "z", "qx", "qy", "qz", "qw")
    numbers = _xyz_and_quaternion(RADAR_FROM_CAMERA).split()
    flags = " ".join(f"--{label} {number}" for label, number in zip(labels, numbers, strict=True))
    return f"ros2 run tf2_ros static_transform_publisher {flags} --frame-id {RADAR} --child-frame-id {CAMERA}\n"


def _tf1_positional() -> str:
    yaw_pitch_roll = rpy(RADAR_FROM_CAMERA)[::-1]
    numbers = words([*RADAR_FROM_CAMERA[:3, 3], *yaw_pitch_roll])
    return f"rosrun tf static_transform_publisher {numbers} /{RADAR} /{CAMERA} 100\n"


def _launch_xml() -> str:
    args = f"{_xyz_and_quaternion(RADAR_FROM_CAMERA)} {RADAR} {CAMERA}"
    return (
        f'<launch>\n  <arg name="sim" default="false"/>\n  <node pkg="tf2_ros" exec="static_transform_publisher" '
        f'name="cam" args="{args}"/>\n  <node pkg="rviz2" exec="rviz2" name="rviz2"/>\n</launch>\n'
    )


def _launch_py() -> str:
    arguments = [*_xyz_and_quaternion(RADAR_FROM_CAMERA).split(), RADAR, CAMERA]
    return (
        "from launch import LaunchDescription\nfrom launch_ros.actions import Node\n\n"
        "def generate_launch_description():\n    return LaunchDescription([\n"
        f"        Node(package='tf2_ros', executable='static_transform_publisher', arguments={arguments!r}),\n    ])\n"
    )


def _echoed(parent: str, child: str, matrix: np.ndarray, stamp: tuple[str, str], indent: str) -> str:
    """Return one entry of a TFMessage as `topic echo` prints it."""
    translation = "".join(
        f"{indent}    {axis}: {value!r}\n" for axis, value in zip("xyz", matrix[:3, 3].tolist(), strict=True)
    )
    rotation = "".join(
        f"{indent}    {axis}: {value!r}\n" for axis, value in zip("xyzw", quaternion(matrix), strict=True)
    )
    return (
        f"- header:\n{indent}  stamp:\n{indent}    {stamp[0]}: 1742018434\n{indent}    {stamp[1]}: 760327680\n"
        f"{indent}  frame_id: {parent}\n{indent}child_frame_id: {child}\n{indent}transform:\n"
        f"{indent}  translation:\n{translation}{indent}  rotation:\n{rotation}"
    )


def _topic_echo() -> str:
    entries = [
        _echoed(RADAR, CAMERA, RADAR_FROM_CAMERA, ("sec", "nanosec"), "  "),
        _echoed("base_link", "imu", np.eye(4), ("sec", "nanosec"), "  "),
    ]
    return f"transforms:\n{''.join(entries)}---\n"


def _topic_echo_of_two_publishers() -> str:
    entries = [
        _echoed("base_link", "lidar", np.eye(4), ("sec", "nanosec"), "  "),
        _echoed(RADAR, CAMERA, RADAR_FROM_CAMERA, ("sec", "nanosec"), "  "),
    ]
    return "".join(f"transforms:\n{entry}---\n" for entry in entries)


def _rostopic_echo() -> str:
    lines = _echoed(RADAR, CAMERA, RADAR_FROM_CAMERA, ("secs", "nsecs"), "    ").splitlines()
    first = ["  - ", "    header: ", "      seq: 0", *lines[1:]]
    return "transforms: \n" + "\n".join(first) + "\n---\n"


def _echo(matrix: np.ndarray, quaternion_label: str, repeats: int) -> str:
    radians = rpy(matrix)
    block = (
        f"- Translation: [{words(matrix[:3, 3], ', ', '.3f')}]\n"
        f"- Rotation: in {quaternion_label} [{words(quaternion(matrix), ', ', '.3f')}]\n"
        f"- Rotation: in RPY (radian) [{words(radians, ', ', '.3f')}]\n"
        f"- Rotation: in RPY (degree) [{words(list(np.degrees(radians)), ', ', '.3f')}]\n- Matrix:\n"
        + "".join(f" {words(row, ' ', '6.3f')}\n" for row in matrix)
    )
    return "".join(f"At time {index}.0\n{block}" for index in range(repeats))


def _tf2_echo() -> str:
    waiting = (
        f"[INFO] [1770251984.865388082] [tf2_echo]: Waiting for transform {RADAR} ->  {CAMERA}: Invalid frame ID "
        f'"{RADAR}" passed to canTransform argument target_frame - frame does not exist\n'
    )
    return waiting + _echo(RADAR_FROM_CAMERA, "Quaternion (xyzw)", 2)


def _tf_echo() -> str:
    text = _echo(CAMERA_FROM_RADAR, "Quaternion", 3).replace("- Rotation: in RPY", "            in RPY")
    kept = [line for line in text.splitlines() if not line.startswith((" 0", " -0", " 1", "  ", "- Matrix"))]
    rpy_lines = [line for line in text.splitlines() if "in RPY" in line][:2]
    body = "\n".join(part for line in kept for part in ([line, *rpy_lines] if "Quaternion" in line else [line]))
    return f"$ rosrun tf tf_echo {CAMERA} {RADAR}\n{body}\n"


def _tf2_echo_without_names() -> str:
    return _echo(RADAR_FROM_CAMERA, "Quaternion", 1)


def _joint(name: str, parent: str, child: str, matrix: np.ndarray) -> str:
    return (
        f'  <joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{words(matrix[:3, 3])}" rpy="{words(rpy(matrix))}"/></joint>\n'
    )


def _urdf(*joints: str, links: tuple[str, ...]) -> str:
    return (
        '<?xml version="1.0"?>\n<robot name="car">\n'
        + "".join(f'  <link name="{link}"/>\n' for link in links)
        + "".join(joints)
        + "</robot>\n"
    )


def _sensor_urdf() -> str:
    return _urdf(
        _joint("a", RADAR, LINK, RADAR_FROM_LINK),
        _joint("b", LINK, CAMERA, LINK_FROM_OPTICAL),
        links=(RADAR, LINK, CAMERA),
    )


def _vehicle_urdf() -> str:
    return _urdf(
        _joint("radar_mount", "base_link", RADAR, BASE_FROM_RADAR),
        _joint("camera_mount", "base_link", LINK, BASE_FROM_LINK),
        _joint("optical", LINK, CAMERA, LINK_FROM_OPTICAL),
        _joint("wheel", "base_link", "wheel_left", np.eye(4)),
        links=("base_link", RADAR, LINK, CAMERA, "wheel_left"),
    )


def _xacro() -> str:
    return (
        '<?xml version="1.0"?>\n<robot name="car" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
        '  <xacro:property name="height" value="0.6"/>\n'
        '  <xacro:macro name="sensor" params="name parent xyz rpy">\n    <link name="${name}"/>\n'
        '    <joint name="${name}_joint" type="fixed"><parent link="${parent}"/><child link="${name}"/>'
        '<origin xyz="${xyz}" rpy="${rpy}"/></joint>\n  </xacro:macro>\n  <link name="base_link"/>\n'
        f'  <xacro:sensor name="{RADAR}" parent="base_link" xyz="3.4 0.2 ${{height}}" rpy="0 0 ${{pi/2}}"/>\n'
        f'  <xacro:sensor name="{LINK}" parent="base_link" xyz="{words(BASE_FROM_LINK[:3, 3])}" '
        f'rpy="{words(rpy(BASE_FROM_LINK))}"/>\n</robot>\n'
    )


def _kit(parent: str, **children: np.ndarray) -> str:
    keys = ("x", "y", "z", "roll", "pitch", "yaw")
    rows = [f"{parent}:"]
    for name, matrix in children.items():
        rows.append(f"  {name}:")
        numbers = [*matrix[:3, 3], *rpy(matrix)]
        rows += [f"    {key}: {float(value)!r}" for key, value in zip(keys, numbers, strict=True)]
    return "\n".join(rows) + "\n"


def _autoware_two() -> tuple[str, dict[str, str | bytes]]:
    base_from_kit = posed(np.eye(3), (0.9, 0.0, 2.0))
    kit = _kit("sensor_kit_base_link", camera_link=inverse(base_from_kit) @ BASE_FROM_LINK, velodyne_top=np.eye(4))
    base = _kit("base_link", sensor_kit_base_link=base_from_kit, radar_front=BASE_FROM_RADAR)
    return kit, {"sensors_calibration.yaml": base}


def _apollo() -> str:
    t, q = RADAR_FROM_CAMERA[:3, 3].tolist(), quaternion(RADAR_FROM_CAMERA)
    return (
        f"header:\n  seq: 0\n  stamp:\n    secs: 1504765807\n    nsecs: 0\n  frame_id: {RADAR}\n"
        f"transform:\n  rotation:\n    x: {q[0]!r}\n    y: {q[1]!r}\n    z: {q[2]!r}\n    w: {q[3]!r}\n"
        f"  translation:\n    x: {t[0]!r}\n    y: {t[1]!r}\n    z: {t[2]!r}\nchild_frame_id: {CAMERA}\n"
    )


def _easy_handeye() -> str:
    keys = ("qw", "qx", "qy", "qz", "x", "y", "z")
    q = quaternion(RADAR_FROM_CAMERA)
    numbers = dict(zip(keys, [q[3], *q[:3], *RADAR_FROM_CAMERA[:3, 3].tolist()], strict=True))
    rows = "".join(f"  {key}: {value!r}\n" for key, value in numbers.items())
    return (
        "parameters:\n  eye_on_hand: false\n  freehand_robot_movement: false\n  move_group: manipulator\n"
        f"  move_group_namespace: /\n  namespace: /cam_eye_on_base/\n  robot_base_frame: {RADAR}\n"
        f"  robot_effector_frame: reflector\n  tracking_base_frame: {CAMERA}\n  tracking_marker_frame: marker\n"
        f"transformation:\n{rows}"
    )


def _easy_handeye2() -> str:
    t, q = RADAR_FROM_CAMERA[:3, 3].tolist(), quaternion(RADAR_FROM_CAMERA)
    return (
        "parameters:\n  name: cam\n  calibration_type: eye_in_hand\n  robot_base_frame: base_link\n"
        f"  robot_effector_frame: {RADAR}\n  tracking_base_frame: {CAMERA}\n  tracking_marker_frame: marker\n"
        "  freehand_robot_movement: true\n  move_group_namespace: /\n  move_group: manipulator\n"
        f"transform:\n  translation:\n    x: {t[0]!r}\n    y: {t[1]!r}\n    z: {t[2]!r}\n"
        f"  rotation:\n    x: {q[0]!r}\n    y: {q[1]!r}\n    z: {q[2]!r}\n    w: {q[3]!r}\n"
    )


def _easy_handeye_of_a_robot() -> str:
    return _easy_handeye().replace(RADAR, "panda_link0")


def _frame_transform(parent: str, child: str, matrix: np.ndarray) -> dict[str, Any]:
    return {
        "timestamp": {"sec": 1, "nsec": 0},
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": dict(zip("xyz", matrix[:3, 3].tolist(), strict=True)),
        "rotation": dict(zip("xyzw", quaternion(matrix), strict=True)),
    }


def _foxglove_transforms() -> str:
    listed = [
        _frame_transform("base_link", "lidar", np.eye(4)),
        _frame_transform(RADAR, CAMERA, RADAR_FROM_CAMERA),
    ]
    return json.dumps({"transforms": listed})


KIT, BESIDE_KIT = _autoware_two()
PRINTED = 1e-3

ROS = (
    Calibration("tf2 command", "static_tf.sh", _tf2_named()),
    Calibration("tf 1 command", "static_tf.sh", _tf1_positional()),
    Calibration("ROS 2 launch, XML", "sensors.launch.xml", _launch_xml()),
    Calibration("ROS 2 launch, Python", "sensors.launch.py", _launch_py()),
    Calibration("ros2 topic echo", "tf_static.txt", _topic_echo()),
    Calibration("ros2 topic echo, two messages", "tf_static.txt", _topic_echo_of_two_publishers()),
    Calibration("rostopic echo", "tf_static.txt", _rostopic_echo()),
    Calibration("tf2_echo", "echo.txt", _tf2_echo(), close=PRINTED),
    Calibration("tf_echo", "echo.txt", _tf_echo(), close=PRINTED),
    Calibration("tf2_echo without names", "echo.txt", _tf2_echo_without_names(), close=PRINTED),
    Calibration("URDF of the sensors", "sensors.urdf", _sensor_urdf()),
    Calibration("URDF of a vehicle", "vehicle.urdf", _vehicle_urdf()),
    Calibration("xacro with macros", "vehicle.urdf.xacro", _xacro(), refused="xacro|<robot>|joint"),
    Calibration("Autoware kit", "kit.yaml", _kit("sensor_kit_base_link", radar=np.eye(4), camera_link=RADAR_FROM_LINK)),
    Calibration("Autoware, two files", "sensor_kit_calibration.yaml", KIT, beside=BESIDE_KIT, folder=True),
    Calibration("Apollo", "radar_front_camera_extrinsics.yaml", _apollo()),
    Calibration("easy_handeye", "cam_eye_on_base.yaml", _easy_handeye()),
    Calibration("easy_handeye2", "cam.calib", _easy_handeye2()),
    Calibration("easy_handeye of a robot", "arm.yaml", _easy_handeye_of_a_robot(), refused="panda_link0"),
    Calibration("foxglove.FrameTransform", "tf.json", json.dumps(_frame_transform(CAMERA, RADAR, CAMERA_FROM_RADAR))),
    Calibration("foxglove.FrameTransforms", "tf.json", _foxglove_transforms()),
)
