"""One line of a TUM trajectory: timestamp tx ty tz qx qy qz qw."""

import math

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.format import ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.formats.pose_parts import direction_by_facing, rigid
from calib_core.interchange.syntax.content import Content

_COUNT = 8
_UNIT_LENGTH = 1e-2
_NAMED = {
    "radar_from_camera": "the pose of the camera in the radar, as the format defines with the radar as its world",
    "camera_from_radar": "the pose of the radar in the camera",
}


def _recognizes(content: Content) -> bool:
    return content.syntax == "lines" and bool(content.lines) and all(map(_is_pose, content.lines))


def _is_pose(line: str) -> bool:
    try:
        numbers = [float(word) for word in line.split()]
    except ValueError:
        return False
    return len(numbers) == _COUNT and abs(math.hypot(*numbers[4:]) - 1.0) <= _UNIT_LENGTH


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the one pose; the direction follows from where the camera would look.

    Raises:
        InputError: there are several poses, or neither direction lets the camera look where the radar does.
    """
    if len(content.lines) > 1:
        raise InputError(f"{source}: a trajectory of {len(content.lines)} poses, not a calibration; keep one line")
    numbers = np.array(content.lines[0].split(), dtype=np.float64)
    pose = rigid("quaternion_xyzw", numbers[4:], numbers[1:4], source=source)
    direction = direction_by_facing(pose.rotation)
    if direction is None:
        raise InputError(
            f"{source}: one pose without frame names, and where the camera looks does not tell which way it goes; give it "
            "with names, for example as the arguments of static_transform_publisher"
        )
    assumption = (
        f"the file names no frames; assumed {_NAMED[direction]}, because the camera then looks where the radar does"
    )
    written = WrittenPose("quaternion_xyzw", numbers[4:], numbers[1:4], direction)
    return ImportedCalibration("tum", written, assumptions=(assumption,)).checked(source)


TUM_POSE = Reads(_recognizes, _read)
