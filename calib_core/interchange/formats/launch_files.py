"""Launch files with a static transform: ROS 2 in Python, written and read; ROS 2 and ROS 1 in XML, read alike."""

import ast
import shlex

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Format, ImportedCalibration, Reads
from calib_core.interchange.formats.statement import POSE_ONLY, hash_comment, statement
from calib_core.interchange.formats.static_transform import (
    LABELS,
    NUMBERS,
    PUBLISHER,
    ChildFrame,
    child_of,
    from_publishers,
    meaning,
    pose_numbers,
    second_parent_notes,
)
from calib_core.interchange.syntax.content import Content


def write_python(file: CalibrationFile, child: ChildFrame | None = None) -> str:
    """Write a ROS 2 launch file in Python."""
    arguments = [part for pair in zip(LABELS, pose_numbers(file, child), strict=True) for part in pair]
    arguments += ["--frame-id", file.frames.radar, "--child-frame-id", child_of(file, child).name]
    rows = [f"                    {a!a}, {b!a},\n" for a, b in zip(arguments[::2], arguments[1::2], strict=True)]
    return (
        hash_comment(statement(file, meaning(file, child)))
        + "from launch import LaunchDescription\n"
        + "from launch_ros.actions import Node\n\n\n"
        + "def generate_launch_description():\n"
        + "    return LaunchDescription(\n        [\n            Node(\n"
        + f'                package="tf2_ros",\n                executable="{PUBLISHER}",\n'
        + "                arguments=[\n"
        + "".join(rows)
        + "                ],\n            )\n        ]\n    )\n"
    )


def _recognizes_python(content: Content) -> bool:
    return content.syntax == "lines" and "generate_launch_description" in content.text


def _read_python(content: Content, source: str) -> ImportedCalibration:
    """Read the arguments in a ROS 2 launch file in Python, without running it.

    Raises:
        InputError: there are none, or they are not plain strings.
    """
    try:
        tree = ast.parse(content.text)
    except (SyntaxError, ValueError, RecursionError) as error:
        raise InputError(f"{source}: not Python ({error}); correct it there") from None
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg == "arguments" and isinstance(node.value, ast.List):
            words = [str(item.value) for item in node.value.elts if isinstance(item, ast.Constant)]
            if len(words) == len(node.value.elts):
                found.append(words)
    if found:
        return from_publishers(found, content.text, source=source, name="tf2-launch-py")
    raise InputError(f"{source}: no arguments=[...] of plain strings in it; give a file with a {PUBLISHER}")


def _recognizes_xml(content: Content) -> bool:
    return content.root.tag == "launch"


def _read_xml(content: Content, source: str) -> ImportedCalibration:
    """Read a launch file of ROS 2 or ROS 1.

    Raises:
        InputError: there is no static_transform_publisher in it.
    """
    nodes = content.root.iter("node")
    publishers = [node for node in nodes if PUBLISHER in (node.get("exec"), node.get("type"))]
    if not publishers:
        raise InputError(f"{source}: no <node> that runs {PUBLISHER}; give a file with one")
    try:
        found = [shlex.split(node.get("args", "")) for node in publishers]
    except ValueError as error:
        raise InputError(f"{source}: args cannot be split ({error}); correct the quotes") from None
    name = "tf2-launch-xml" if publishers[0].get("exec") else "tf1-launch"
    return from_publishers(found, content.text, source=source, name=name)


LAUNCH_XML = Reads(_recognizes_xml, _read_xml)

TF2_LAUNCH_PY = Format(
    name="tf2-launch-py",
    title="ROS 2 launch file, Python",
    used_in="ROS",
    also="tf tf_static transform broadcaster rviz",
    numbers=NUMBERS,
    file_name="radar_camera.launch.py",
    camera="none",
    comment="#",
    notes=(POSE_ONLY,),
    notes_on=second_parent_notes,
    write=write_python,
    reads=Reads(_recognizes_python, _read_python),
)
