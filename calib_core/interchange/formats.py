"""Every format we write, in one table."""

from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.calibration_json import write_calibration
from calib_core.interchange.ros_formats import (
    write_launch_python,
    write_ros1_launch,
    write_ros2_launch_xml,
    write_tf2_command,
)
from calib_core.interchange.urdf_format import write_urdf

__all__ = ["FORMATS", "ExportBytes", "ExportText", "Format", "export", "format_named"]

Comment = Literal["#", "<!-- -->", "keys", "none"]


@dataclass(frozen=True, slots=True)
class Format:
    """One format we write.

    Attributes:
        name: what `--to` takes.
        title: one line for people.
        file_name: what the file is called unless a person says otherwise.
        carries_camera: whether the camera's intrinsics are in it too.
        comment: how it says its frames and check point in words: "#", "<!-- -->", its own keys, or none.
        write: turns a calibration into the file's content; refuses in words what the format cannot carry.
        notes: what a person must know who uses it, one sentence each.
    """

    name: str
    title: str
    file_name: str
    carries_camera: bool
    comment: Comment
    write: Callable[[CalibrationFile], str | bytes]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ExportText:
    """A text file to write.

    Attributes:
        file_name: what to call it.
        text: its content.
        notes: what a person must know who uses it.
    """

    file_name: str
    text: str
    notes: tuple[str, ...] = ()

    @property
    def data(self) -> bytes:
        """The file's bytes."""
        return self.text.encode()


@dataclass(frozen=True, slots=True)
class ExportBytes:
    """A binary file to write.

    Attributes:
        file_name: what to call it.
        data: its content.
        notes: what a person must know who uses it.
    """

    file_name: str
    data: bytes
    notes: tuple[str, ...] = ()


_CAMERA_APART = "carries the pose only; export the camera with --to opencv, or keep your camera_info"

FORMATS: tuple[Format, ...] = (
    Format("tf2", "ROS 2 command (static_transform_publisher)", "static_transform.sh", False, "#", write_tf2_command),
    Format("tf2-launch-py", "ROS 2 launch file, Python", "radar_camera.launch.py", False, "#", write_launch_python),
    Format(
        "tf2-launch-xml", "ROS 2 launch file, XML", "radar_camera.launch.xml", False, "<!-- -->", write_ros2_launch_xml
    ),
    Format("tf1-launch", "ROS 1 launch file", "radar_camera.launch", False, "<!-- -->", write_ros1_launch),
    Format("urdf", "URDF with camera_link and optical frame", "radar_camera.urdf", False, "<!-- -->", write_urdf),
    Format("json", "cocalib's own calibration-1", "calibration.json", True, "keys", write_calibration),
)


def format_named(name: str) -> Format:
    """Return a format by its name.

    Raises:
        InputError: there is none of that name.
    """
    for known in FORMATS:
        if known.name == name:
            return known
    names = [known.name for known in FORMATS]
    near = get_close_matches(name, names, n=1)
    raise InputError(
        f"no format {name!r}; did you mean {near[0]}?" if near else f"no format {name!r}; there are {', '.join(names)}"
    )


def export(file: CalibrationFile, name: str) -> ExportText | ExportBytes:
    """Write a calibration in another format: the same calibration gives the same bytes.

    Args:
        file: what to export.
        name: one of FORMATS.

    Raises:
        InputError: no such format, or it cannot carry this calibration: why, and what to take instead.
    """
    chosen = format_named(name)
    content = chosen.write(file)
    if isinstance(content, bytes):
        return ExportBytes(chosen.file_name, content, chosen.notes)
    return ExportText(chosen.file_name, content, chosen.notes)
