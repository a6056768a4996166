"""Static transforms of ROS: a command, launch files of ROS 2 and ROS 1. tf2 wants the pose of the child in the parent."""

import ast
import re
import shlex
from xml.sax.saxutils import quoteattr

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.formats.statement import (
    hash_comment,
    stated_check_point,
    stated_frames,
    statement,
    xml_comment,
)
from calib_core.interchange.formats.transform_choice import Ends, the_one_between
from calib_core.interchange.imported import Form, ImportedCalibration, WrittenPose, posed_between
from calib_core.interchange.rotations import quaternion_xyzw_from_matrix
from calib_core.interchange.syntax.opencv_xml import parse_xml
from calib_core.interchange.syntax.yaml_text import number_text

__all__ = [
    "read_launch_python",
    "read_launch_xml",
    "read_tf2_command",
    "write_launch_python",
    "write_ros1_launch",
    "write_ros2_launch_xml",
    "write_tf2_command",
]

_PUBLISHER = "static_transform_publisher"
_LABELS = ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")


def write_tf2_command(file: CalibrationFile) -> str:
    """Write the ROS 2 command that publishes the camera's pose in the radar frame."""
    flags = [f"{label} {number}" for label, number in zip(_LABELS, _numbers(file), strict=True)]
    return (
        "#!/bin/sh\n"
        + hash_comment(statement(file, _meaning(file)))
        + f"ros2 run tf2_ros {_PUBLISHER} {' '.join(flags[:3])} \\\n"
        + f"  {' '.join(flags[3:])} \\\n"
        + f"  --frame-id {shlex.quote(file.frames.radar)} --child-frame-id {shlex.quote(file.frames.camera)}\n"
    )


def write_launch_python(file: CalibrationFile) -> str:
    """Write a ROS 2 launch file in Python."""
    arguments = [part for pair in zip(_LABELS, _numbers(file), strict=True) for part in pair]
    arguments += ["--frame-id", file.frames.radar, "--child-frame-id", file.frames.camera]
    rows = [f"                    {a!a}, {b!a},\n" for a, b in zip(arguments[::2], arguments[1::2], strict=True)]
    return (
        hash_comment(statement(file, _meaning(file)))
        + "from launch import LaunchDescription\n"
        + "from launch_ros.actions import Node\n\n\n"
        + "def generate_launch_description():\n"
        + "    return LaunchDescription(\n        [\n            Node(\n"
        + f'                package="tf2_ros",\n                executable="{_PUBLISHER}",\n'
        + "                arguments=[\n"
        + "".join(rows)
        + "                ],\n            )\n        ]\n    )\n"
    )


def write_ros2_launch_xml(file: CalibrationFile) -> str:
    """Write a ROS 2 launch file in XML."""
    flags = [f"{label} {number}" for label, number in zip(_LABELS, _numbers(file), strict=True)]
    frames = f"--frame-id {shlex.quote(file.frames.radar)} --child-frame-id {shlex.quote(file.frames.camera)}"
    arguments = quoteattr(" ".join([*flags, frames]))
    return (
        '<?xml version="1.0"?>\n'
        + xml_comment(statement(file, _meaning(file)))
        + f'<launch>\n  <node pkg="tf2_ros" exec="{_PUBLISHER}" args={arguments}/>\n</launch>\n'
    )


def write_ros1_launch(file: CalibrationFile) -> str:
    """Write a ROS 1 launch file; tf2_ros takes x y z qx qy qz qw parent child, and latches it."""
    names = [shlex.quote(name) for name in (file.frames.radar, file.frames.camera)]
    arguments = quoteattr(" ".join([*_numbers(file), *names]))
    return (
        '<?xml version="1.0"?>\n'
        + xml_comment(statement(file, _meaning(file)))
        + f'<launch>\n  <node pkg="tf2_ros" type="{_PUBLISHER}" name="camera_in_radar" args={arguments}/>\n</launch>\n'
    )


def read_tf2_command(text: str, source: str) -> ImportedCalibration:
    """Read a command line or a script with one.

    Raises:
        InputError: there is no static_transform_publisher with a pose in it.
    """
    commands = "\n".join(line for line in text.replace("\\\n", " ").splitlines() if not line.lstrip().startswith("#"))
    lines = [line for line in commands.splitlines() if _PUBLISHER in line]
    try:
        found = [shlex.split(line.partition(_PUBLISHER)[2], comments=True) for line in lines]
    except ValueError as error:
        raise InputError(f"{source}: the command cannot be split ({error}); correct its quotes") from None
    return _from_arguments(_chosen(found, text, source=source), text, source=source, name="tf2")


def read_launch_python(text: str, source: str) -> ImportedCalibration:
    """Read the arguments out of a ROS 2 launch file in Python, without running it.

    Raises:
        InputError: there are none, or they are not plain text.
    """
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError, RecursionError) as error:
        raise InputError(f"{source}: not Python ({error}); correct it there") from None
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg == "arguments" and isinstance(node.value, ast.List):
            words = [str(item.value) for item in node.value.elts if isinstance(item, ast.Constant)]
            if len(words) == len(node.value.elts):
                found.append(words)
    if found:
        return _from_arguments(_chosen(found, text, source=source), text, source=source, name="tf2-launch-py")
    raise InputError(f"{source}: no arguments=[...] of plain strings in it; give a file with a {_PUBLISHER}")


def read_launch_xml(text: str, source: str) -> ImportedCalibration:
    """Read a launch file of ROS 2 or ROS 1.

    Raises:
        InputError: there is no static_transform_publisher in it.
    """
    nodes = parse_xml(text, source=source).iter("node")
    publishers = [node for node in nodes if _PUBLISHER in (node.get("exec"), node.get("type"))]
    if not publishers:
        raise InputError(f"{source}: no <node> that runs {_PUBLISHER}; give a file with one")
    try:
        found = [shlex.split(node.get("args", "")) for node in publishers]
    except ValueError as error:
        raise InputError(f"{source}: args cannot be split ({error}); correct its quotes") from None
    name = "tf2-launch-xml" if publishers[0].get("exec") else "tf1-launch"
    return _from_arguments(_chosen(found, text, source=source), text, source=source, name=name)


def _chosen(found: list[list[str]], text: str, *, source: str) -> list[str]:
    """Return the arguments of the one publisher that is between the radar and the camera."""
    if not found:
        return []
    return found[the_one_between([_ends(words) for words in found], stated_frames(text), source=source)]


def _ends(arguments: list[str]) -> Ends:
    flags = _flags(arguments)
    if flags:
        return Ends(flags.get("frame-id", ""), flags.get("child-frame-id", ""))
    words = [word for word in arguments if ":=" not in word]
    names = words[-3:-1] if words and _is_number(words[-1]) else words[-2:]
    return Ends(*names) if len(names) == 2 else Ends("", "")


def _meaning(file: CalibrationFile) -> str:
    parent, child = file.frames.radar, file.frames.camera
    return f"the numbers are the pose of the child {child} in the parent {parent}; quaternion order x y z w"


def _numbers(file: CalibrationFile) -> list[str]:
    radar_from_camera = file.calibration.camera_from_radar.inverse()
    quaternion = quaternion_xyzw_from_matrix(radar_from_camera.rotation)
    return [number_text(value) for value in (*radar_from_camera.translation_m, *quaternion)]


def _from_arguments(arguments: list[str], text: str, *, source: str, name: str) -> ImportedCalibration:
    flags = _flags(arguments)
    if flags:
        parent, child = flags.pop("frame-id", ""), flags.pop("child-frame-id", "")
        form, rotation, translation = _by_name(flags, source=source)
    elif len(arguments) >= 8:
        form, rotation, translation, parent, child = _by_place(arguments, source=source)
    else:
        raise InputError(f"{source}: no {_PUBLISHER} with a pose and two frames in it; give a command or a launch file")
    if not parent or not child:
        raise InputError(f"{source}: a frame's name is missing; add --frame-id and --child-frame-id")
    roles = posed_between(parent.lstrip("/"), child.lstrip("/"), stated_frames(text))
    return ImportedCalibration(
        format=name,
        pose=WrittenPose(form, np.array(rotation), np.array(translation), roles.direction, roles.axes),
        frames=roles.frames,
        check_point=stated_check_point(text),
        notes=roles.notes,
    ).checked(source)


def _flags(arguments: list[str]) -> dict[str, str]:
    """Return the named arguments: "--x 1" and "--x=1"."""
    joined = " ".join(shlex.quote(word) for word in arguments)
    words = shlex.split(re.sub(r"(^| )(--[a-z-]+)=", r"\1\2 ", joined))
    return {
        words[index][2:]: words[index + 1]
        for index in range(len(words) - 1)
        if words[index].startswith("--") and words[index][2:3].isalpha()
    }


def _by_name(flags: dict[str, str], *, source: str) -> tuple[Form, tuple[float, ...], tuple[float, ...]]:
    def numbers(*labels: str) -> tuple[float, ...]:
        return tuple(
            value
            for label in labels
            for value in floats(flags.get(label, "1" if label == "qw" else "0"), source=source, place=f"--{label}")
        )

    translation = numbers("x", "y", "z")
    if {"qx", "qy", "qz", "qw"} & set(flags):
        return "quaternion_xyzw", numbers("qx", "qy", "qz", "qw"), translation
    return "rpy", numbers("roll", "pitch", "yaw"), translation


def _by_place(arguments: list[str], *, source: str) -> tuple[Form, tuple[float, ...], tuple[float, ...], str, str]:
    """Read the positional form: x y z, then yaw pitch roll (this order) or qx qy qz qw, the frames, perhaps a period."""
    words = [word for word in arguments if ":=" not in word]
    angles = len(words) == 8 or (len(words) == 9 and not _is_number(words[6]))
    count = 6 if angles else 7
    if not count + 2 <= len(words) <= count + 3:
        raise InputError(
            f"{source}: expected 6 or 7 numbers and two frames, found {len(words)} words; correct the command"
        )
    numbers = floats(words[:count], source=source, place="the command's numbers")
    rotation = numbers[5:2:-1] if angles else numbers[3:]
    return "rpy" if angles else "quaternion_xyzw", rotation, numbers[:3], words[count], words[count + 1]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
