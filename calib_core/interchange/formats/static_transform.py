"""What publishes a static transform: the command of ROS 2, alone or in a shell script, and launch files.

All of them give tf2's static_transform_publisher the pose of the child in the parent. The command and ROS 2's launch file in
Python are written and read; launch files in XML, of ROS 2 and ROS 1, are read alike.
"""

import ast
import re
import shlex
from dataclasses import dataclass, replace

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import Form, Format, ImportedCalibration, Reads, WrittenPose, posed_between
from calib_core.interchange.formats.pose_parts import Ends, choose_transform
from calib_core.interchange.formats.statement import (
    POSE_ONLY,
    hash_comment,
    stated_check_point,
    stated_frames,
    statement,
)
from calib_core.interchange.rotations import quaternion_xyzw_from_matrix
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import number_text, numbers_text, quoted
from calib_core.parsing import python_tree

PUBLISHER = "static_transform_publisher"
_DRIVERS_ENDING = "_optical_frame"
_LABELS = ("--x", "--y", "--z", "--qx", "--qy", "--qz", "--qw")
_NUMBERS = "pose of the child (camera, optical) in the parent (radar); quaternion x y z w"


@dataclass(frozen=True, slots=True, eq=False)
class ChildFrame:
    """The frame that a file poses in the radar's.

    Attributes:
        name: of the frame: the camera's, or the root of the chain in which its driver publishes it.
        child_from_camera: the camera's pose in it.
    """

    name: str
    child_from_camera: RigidTransform

    def stated(self, camera: str) -> str:
        """Return the words about the chain below it, which reading the file needs; "" if it is the camera's own frame."""
        if self.name == camera:
            return ""
        numbers = (
            *self.child_from_camera.translation_m,
            *quaternion_xyzw_from_matrix(self.child_from_camera.rotation),
        )
        return f"; {quoted(camera)} is fixed in {quoted(self.name)} at x y z qx qy qz qw [{numbers_text(numbers)}]"


def child_of(file: CalibrationFile, child: ChildFrame | None) -> ChildFrame:
    """Return the child frame to write: the camera's own unless another is given."""
    return child or ChildFrame(file.frames.camera, RigidTransform.identity())


def meaning(file: CalibrationFile, child: ChildFrame | None = None) -> str:
    """Return what the numbers mean, for the comment at the top of a file."""
    parent, posed = file.frames.radar, child_of(file, child)
    return (
        f"the numbers are the pose of the child {posed.name} in the parent {parent}; quaternion order x y z w"
        f"{posed.stated(file.frames.camera)}"
    )


def second_parent_notes(file: CalibrationFile) -> tuple[str, ...]:
    """Return a note if the camera frame is called as drivers call it, who publish that frame themselves."""
    camera = file.frames.camera
    if not camera.endswith(_DRIVERS_ENDING):
        return ()
    return (
        f"a camera's driver usually publishes {camera} under its camera_link already, and a frame cannot have two parents: with "
        "`cocalib export --tree FILE` the transform is written to camera_link instead",
    )


def radar_from_child(file: CalibrationFile, child: ChildFrame | None = None) -> RigidTransform:
    """Return the pose of the child frame in the radar frame."""
    return file.calibration.camera_from_radar.inverse() @ child_of(file, child).child_from_camera.inverse()


def pose_numbers(file: CalibrationFile, child: ChildFrame | None = None) -> list[str]:
    """Return x, y, z [m] and the quaternion x, y, z, w of the child in the radar frame, in the order of _LABELS."""
    posed = radar_from_child(file, child)
    quaternion = quaternion_xyzw_from_matrix(posed.rotation)
    return [number_text(value) for value in (*posed.translation_m, *quaternion)]


def _from_publishers(found: list[list[str]], text: str, *, source: str, name: str) -> ImportedCalibration:
    """Return the calibration of the one publisher that is between the radar and the camera.

    Args:
        found: the arguments of each publisher.
        text: of the file, which may name the frames in a comment.
        source: the name of the file in error messages.
        name: of the format.

    Raises:
        InputError: there is none, or more than one, or its arguments are not a pose between two frames.
    """
    return _from_arguments(_choose_publisher(found, text, source=source), text, source=source, name=name)


def _choose_publisher(found: list[list[str]], text: str, *, source: str) -> list[str]:
    """Return the arguments of the one publisher that is between the radar and the camera."""
    if not found:
        return []
    return found[choose_transform([_ends(words) for words in found], stated_frames(text), source=source)]


def _ends(arguments: list[str]) -> Ends:
    flags = _flags(arguments)
    if flags:
        return Ends(flags.get("frame-id", ""), flags.get("child-frame-id", ""))
    words = [word for word in arguments if ":=" not in word]
    names = words[-3:-1] if words and _is_number(words[-1]) else words[-2:]
    return Ends(*names) if len(names) == 2 else Ends("", "")


def _from_arguments(arguments: list[str], text: str, *, source: str, name: str) -> ImportedCalibration:
    flags = _flags(arguments)
    if flags:
        parent, child = flags.pop("frame-id", ""), flags.pop("child-frame-id", "")
        form, rotation, translation = _by_name(flags, source=source)
    elif len(arguments) >= 8:
        form, rotation, translation, parent, child = _by_place(arguments, source=source)
    else:
        raise InputError(f"{source}: no {PUBLISHER} with a pose and two frames in it; give a command or a launch file")
    if not parent or not child:
        raise InputError(f"{source}: a frame's name is missing; add --frame-id and --child-frame-id")
    numbers = WrittenPose(form, np.array(rotation), np.array(translation), "radar_from_camera")
    roles = posed_between(parent.lstrip("/"), child.lstrip("/"), stated_frames(text), numbers)
    return ImportedCalibration(
        format=name,
        pose=roles.pose,
        frames=roles.frames,
        check_point=stated_check_point(text),
        assumptions=roles.assumptions,
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
    """Read the positional form: x y z, then yaw pitch roll (this order) or qx qy qz qw, the frames, and possibly a period."""
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


def write_command(file: CalibrationFile, child: ChildFrame | None = None) -> str:
    """Write the ROS 2 command that publishes the camera's pose in the radar frame."""
    flags = [f"{label} {number}" for label, number in zip(_LABELS, pose_numbers(file, child), strict=True)]
    return (
        "#!/bin/sh\n"
        + hash_comment(statement(file, meaning(file, child)))
        + f"ros2 run tf2_ros {PUBLISHER} {' '.join(flags[:3])} \\\n"
        + f"  {' '.join(flags[3:])} \\\n"
        + f"  --frame-id {shlex.quote(file.frames.radar)} --child-frame-id {shlex.quote(child_of(file, child).name)}\n"
    )


def _recognizes_command(content: Content) -> bool:
    return any(PUBLISHER in line for line in content.lines)


def _read_command(content: Content, source: str) -> ImportedCalibration:
    """Read a command line or a script with one.

    Raises:
        InputError: there is no static_transform_publisher with a pose in it.
    """
    text = content.text
    commands = "\n".join(line for line in text.replace("\\\n", " ").splitlines() if not line.lstrip().startswith("#"))
    lines = [line for line in commands.splitlines() if PUBLISHER in line]
    try:
        found = [shlex.split(line.partition(PUBLISHER)[2], comments=True) for line in lines]
    except ValueError as error:
        raise InputError(f"{source}: the command cannot be split ({error}); correct the quotes") from None
    return _from_publishers(found, text, source=source, name="tf2")


TF2 = Format(
    name="tf2",
    title="ROS 2 command",
    used_in="ROS",
    also="tf tf_static transform broadcaster rviz",
    numbers=_NUMBERS,
    file_name="static_transform.sh",
    camera="none",
    comment="#",
    notes=(POSE_ONLY,),
    notes_on=second_parent_notes,
    write=write_command,
    reads=Reads(_recognizes_command, _read_command),
)


def write_python(file: CalibrationFile, child: ChildFrame | None = None) -> str:
    """Write a ROS 2 launch file in Python."""
    arguments = [part for pair in zip(_LABELS, pose_numbers(file, child), strict=True) for part in pair]
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
    tree = python_tree(content.text, source=source)
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg == "arguments" and isinstance(node.value, ast.List):
            words = [str(item.value) for item in node.value.elts if isinstance(item, ast.Constant)]
            if len(words) == len(node.value.elts):
                found.append(words)
    if found:
        return _from_publishers(found, content.text, source=source, name="tf2-launch-py")
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
    return _from_publishers(found, content.text, source=source, name=name)


LAUNCH_XML = Reads(_recognizes_xml, _read_xml)

TF2_LAUNCH_PY = replace(
    TF2,
    name="tf2-launch-py",
    title="ROS 2 launch file, Python",
    file_name="radar_camera.launch.py",
    write=write_python,
    reads=Reads(_recognizes_python, _read_python),
)
