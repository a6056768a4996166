"""Autoware's sensor kit: each sensor's pose in sensor_kit_base_link, the camera with body axes."""

from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, rpy_from_matrix
from calib_core.interchange.statement import POSE_ONLY, hash_comment, statement
from calib_core.interchange.syntax.yaml_text import number_text, quoted
from calib_core.interchange.trees.autoware import POSE_KEYS, recognizes_autoware
from calib_core.interchange.trees.posed_in_tree import read_joints

_NOTES = (
    "poses are in sensor_kit_base_link; the radar is at the kit's origin unless its pose is given (--parent-from-radar)",
    POSE_ONLY,
)
_KIT = "sensor_kit_base_link"


def _write(file: CalibrationFile) -> str:
    """Write sensor_kit_calibration.yaml with the radar at the kit's origin."""
    return _write_in_kit(file, RigidTransform.identity())


def _write_in_kit(file: CalibrationFile, kit_from_radar: RigidTransform) -> str:
    """Write sensor_kit_calibration.yaml with the radar at its pose in the kit."""
    frames = file.frames
    kit_from_link = kit_from_radar @ file.calibration.camera_from_radar.inverse() @ LINK_FROM_OPTICAL.inverse()
    meaning = (
        f"each entry is its pose in {_KIT}; angles in radians about fixed axes, R = Rz(yaw) Ry(pitch) Rx(roll); "
        f"{frames.camera_link} has body axes (x forward, y left, z up)"
    )
    return (
        hash_comment(statement(file, meaning))
        + f"{_KIT}:\n"
        + _autoware_entry(frames.radar, kit_from_radar)
        + _autoware_entry(frames.camera_link, kit_from_link)
    )


def _autoware_entry(name: str, kit_from_sensor: RigidTransform) -> str:
    numbers = (*kit_from_sensor.translation_m, *rpy_from_matrix(kit_from_sensor.rotation))
    rows = "".join(f"    {key}: {number_text(value)}\n" for key, value in zip(POSE_KEYS, numbers, strict=True))
    return f"  {quoted(name)}:\n{rows}"


AUTOWARE = Format(
    name="autoware",
    title="Autoware sensor kit",
    used_in="Vehicle stacks",
    also="ROS 2 xacro vehicle kit",
    numbers="pose of each sensor in sensor_kit_base_link, roll pitch yaw about fixed axes; camera_link has body axes",
    file_name="sensor_kit_calibration.yaml",
    camera="none",
    comment="#",
    notes=_NOTES,
    write=_write,
    write_in_parent=_write_in_kit,
    reads=Reads(recognizes_autoware, read_joints),
)
