"""URDF: the camera's body frame in the radar frame, and the optical frame attached to it."""

from dataclasses import replace
from xml.etree.ElementTree import Element
from xml.sax.saxutils import quoteattr

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import (
    Format,
    ImportedCalibration,
    Reads,
    WrittenPose,
    looks_like_camera,
    looks_like_radar,
    posed_between,
)
from calib_core.interchange.formats.pose_parts import Ends, choose_transform
from calib_core.interchange.formats.statement import (
    POSE_ONLY,
    stated_check_point,
    stated_frames,
    statement,
    xml_comment,
)
from calib_core.interchange.formats.static_transform import ChildFrame, radar_from_child, second_parent_notes
from calib_core.interchange.rotations import (
    LINK_FROM_OPTICAL,
    OPTICAL_RPY_RAD,
    matrix_from_rpy,
    rpy_from_matrix,
)
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import numbers_text


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


def _recognizes(content: Content) -> bool:
    return content.root.tag == "robot"


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the joint between radar and camera, and the optical joint attached to it, if there is one.

    Raises:
        InputError: no such joint, or it is not fixed.
    """
    joints = [joint for joint in content.root.iter("joint") if _ends(joint) != ("", "")]
    stated = stated_frames(content.text)
    between = [joint for joint in joints if _is_between(joint, stated)]
    if not between:
        raise InputError(
            f"{source}: no joint between a radar and a camera in it; name its links accordingly, for example radar"
        )
    joint = between[choose_transform([Ends(*_ends(one)) for one in between], stated, source=source)]
    if joint.get("type") != "fixed":
        raise InputError(f"{source}: the joint {joint.get('name')!r} is not fixed; a calibration needs a fixed joint")
    parent, child = _ends(joint)
    translation_m, rpy_rad = _origin(joint, source=source)
    numbers = WrittenPose("rpy", np.array(rpy_rad), np.array(translation_m), "radar_from_camera")
    roles = posed_between(parent, child, stated, numbers)
    camera_end = child if roles.pose.direction == "radar_from_camera" else parent
    optical = next((j for j in joints if _ends(j)[0] == camera_end and "optical" in _ends(j)[1]), None)
    pose, frames, assumptions = roles.pose, roles.frames, roles.assumptions
    if optical is not None:
        _refuse_nonstandard_optical(optical, source=source)
        pose, frames, assumptions = replace(pose, axes="link"), FrameNames(roles.frames.radar, _ends(optical)[1]), ()
    return ImportedCalibration(
        format="urdf",
        pose=pose,
        frames=frames,
        check_point=stated_check_point(content.text),
        assumptions=assumptions,
    ).checked(source)


def _ends(joint: Element) -> tuple[str, str]:
    parent, child = joint.find("parent"), joint.find("child")
    if parent is None or child is None:
        return "", ""
    return parent.get("link", ""), child.get("link", "")


def _is_between(joint: Element, stated: FrameNames | None) -> bool:
    names = _ends(joint)
    if stated is not None:
        return stated.radar in names
    return any(map(looks_like_radar, names)) and any(map(looks_like_camera, names))


def _origin(joint: Element, *, source: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    origin = joint.find("origin")
    attributes = origin.attrib if origin is not None else {}
    xyz, rpy = (
        floats(attributes.get(key, "0 0 0").split(), source=source, place=f"origin {key}", length=3)
        for key in ("xyz", "rpy")
    )
    return xyz, rpy


def _refuse_nonstandard_optical(joint: Element, *, source: str) -> None:
    translation_m, rpy_rad = _origin(joint, source=source)
    rotation = matrix_from_rpy(np.array(rpy_rad))
    if any(translation_m) or np.abs(rotation - LINK_FROM_OPTICAL.rotation).max() > 1e-4:
        raise InputError(
            f"{source}: the joint {joint.get('name')!r} is not the standard optical one (rpy -pi/2 0 -pi/2, no offset); "
            "give the pose of the optical frame itself"
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
    reads=Reads(_recognizes, _read),
)
