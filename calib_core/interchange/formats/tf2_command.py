"""The ROS 2 command that publishes a static transform, alone or in a shell script."""

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


def write_command(file: CalibrationFile, child: ChildFrame | None = None) -> str:
    """Write the ROS 2 command that publishes the camera's pose in the radar frame."""
    flags = [f"{label} {number}" for label, number in zip(LABELS, pose_numbers(file, child), strict=True)]
    return (
        "#!/bin/sh\n"
        + hash_comment(statement(file, meaning(file, child)))
        + f"ros2 run tf2_ros {PUBLISHER} {' '.join(flags[:3])} \\\n"
        + f"  {' '.join(flags[3:])} \\\n"
        + f"  --frame-id {shlex.quote(file.frames.radar)} --child-frame-id {shlex.quote(child_of(file, child).name)}\n"
    )


def _recognizes(content: Content) -> bool:
    return any(PUBLISHER in line for line in content.lines)


def _read(content: Content, source: str) -> ImportedCalibration:
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
    return from_publishers(found, text, source=source, name="tf2")


TF2 = Format(
    name="tf2",
    title="ROS 2 command",
    used_in="ROS",
    also="tf tf_static transform broadcaster rviz",
    numbers=NUMBERS,
    file_name="static_transform.sh",
    camera="none",
    comment="#",
    notes=(POSE_ONLY,),
    notes_on=second_parent_notes,
    write=write_command,
    reads=Reads(_recognizes, _read),
)
