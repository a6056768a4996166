"""URDF: the camera's body frame in the radar frame, and the optical frame attached to it."""

from xml.sax.saxutils import quoteattr

import numpy as np

from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.formats.static_transform import ChildFrame, radar_from_child, second_parent_notes
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, OPTICAL_RPY_RAD, rpy_from_matrix
from calib_core.interchange.statement import POSE_ONLY, statement, xml_comment
from calib_core.interchange.syntax.yaml_text import numbers_text
from calib_core.interchange.trees.posed_in_tree import read_joints
from calib_core.interchange.trees.urdf import recognizes_urdf


def _write(file: CalibrationFile) -> str:
    """Write a robot of three links, whose two joints can be copied into another URDF."""
    frames = file.frames
    radar_from_camera = file.calibration.camera_from_radar.inverse()
    radar_from_link = radar_from_camera @ LINK_FROM_OPTICAL.inverse()
    links = "".join(f"  <link name={quoteattr(name)}/>\n" for name in (frames.radar, frames.camera_link, frames.camera))
    meaning = (
        "each origin is the pose of the child in the parent; rpy in radians about fixed axes, "
        f"R = Rz(yaw) Ry(pitch) Rx(roll); {frames.camera_link} has body axes (x forward, y left, z up)"
    )
    return (
        '<?xml version="1.0"?>\n'
        + xml_comment(statement(file, meaning))
        + '<robot name="radar_camera">\n'
        + links
        + _joint(frames.radar, frames.camera_link, radar_from_link, rpy_from_matrix(radar_from_link.rotation))
        + _joint(frames.camera_link, frames.camera, RigidTransform.identity(), np.array(OPTICAL_RPY_RAD))
        + "</robot>\n"
    )


def write_joint(file: CalibrationFile, child: ChildFrame) -> str:
    """Write a robot of two links, whose joint can be copied into another URDF that has the camera's own chain."""
    frames, posed = file.frames, radar_from_child(file, child)
    links = "".join(f"  <link name={quoteattr(name)}/>\n" for name in (frames.radar, child.name))
    meaning = (
        f"the origin is the pose of the child {child.name} in the parent {frames.radar}; rpy in radians about fixed axes, "
        f"R = Rz(yaw) Ry(pitch) Rx(roll){child.stated(frames.camera)}"
    )
    return (
        '<?xml version="1.0"?>\n'
        + xml_comment(statement(file, meaning))
        + '<robot name="radar_camera">\n'
        + links
        + _joint(frames.radar, child.name, posed, rpy_from_matrix(posed.rotation))
        + "</robot>\n"
    )


def _joint(parent: str, child: str, parent_from_child: RigidTransform, rpy_rad: np.ndarray) -> str:
    return (
        f'  <joint name={quoteattr(f"{parent}_to_{child}")} type="fixed">\n'
        f"    <parent link={quoteattr(parent)}/>\n"
        f"    <child link={quoteattr(child)}/>\n"
        f'    <origin xyz="{numbers_text(parent_from_child.translation_m, " ")}" rpy="{numbers_text(rpy_rad, " ")}"/>\n'
        "  </joint>\n"
    )


URDF = Format(
    name="urdf",
    title="URDF: camera_link and optical frame",
    used_in="ROS",
    also="ROS 2 robot description xacro robot_state_publisher joint",
    numbers="pose of camera_link (body axes) in the radar, roll pitch yaw about fixed axes; then the optical joint",
    file_name="radar_camera.urdf",
    camera="none",
    comment="<!-- -->",
    notes=(POSE_ONLY,),
    notes_on=second_parent_notes,
    write=_write,
    reads=Reads(recognizes_urdf, read_joints),
)
