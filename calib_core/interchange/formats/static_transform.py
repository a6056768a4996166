"""What publishes a static transform: the command of ROS 2 in a shell script, and its launch file in Python.

Both give tf2's static_transform_publisher the pose of the child in the parent.
"""

import shlex
from dataclasses import dataclass, replace

from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.rotations import quaternion_xyzw_from_matrix
from calib_core.interchange.statement import POSE_ONLY, hash_comment, statement
from calib_core.interchange.syntax.yaml_text import number_text, numbers_text, quoted
from calib_core.interchange.trees.posed_in_tree import read_joints
from calib_core.interchange.trees.publishers import PUBLISHER, recognizes_publishers

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
    reads=Reads(recognizes_publishers, read_joints),
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


TF2_LAUNCH_PY = replace(
    TF2,
    name="tf2-launch-py",
    title="ROS 2 launch file, Python",
    file_name="radar_camera.launch.py",
    write=write_python,
)
