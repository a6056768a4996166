"""The pose between the radar and the camera of a frame tree, chained over the joints between them."""

import re
from dataclasses import dataclass, replace

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.cameras.camera_format import with_camera
from calib_core.interchange.format import (
    Axes,
    ImportedCalibration,
    WrittenPose,
    looks_like_lidar,
    of_lidar,
    posed_between,
    refuse_another_sensor,
)
from calib_core.interchange.rotations import LINK_FROM_OPTICAL
from calib_core.interchange.statement import stated_check_point, stated_frames, with_statement
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_choice import ChosenFrames, WantedFrames, choose_frames
from calib_core.interchange.trees.frame_tree import FrameTree, Joint, Place, Sensor, Step, TreePart, joined
from calib_core.interchange.trees.reading import tree_in
from calib_core.parsing import json_value

_STANDARD = 1e-4


@dataclass(frozen=True, slots=True)
class CameraAxes:
    """The axes of a camera's frame, what its optical frame is called, and what was assumed."""

    axes: Axes
    optical_frame: str
    assumptions: tuple[str, ...] = ()


def read_joints(content: Content, source: str) -> ImportedCalibration:
    """Read a file with joints, as `calibration_of_joints`, if the user names no frames."""
    found = calibration_of_joints(content, WantedFrames(), source=source)
    if found is None:
        raise InputError(f"{source}: no transform between two frames in it; give the file that has it")
    return found


def calibration_of_joints(content: Content, frames: WantedFrames, *, source: str) -> ImportedCalibration | None:
    """Return the pose between the radar and the camera of a file with joints; None if it is no such file.

    Args:
        content: of the file.
        frames: that the user names; those that the file states come second, and the names of its frames last.
        source: the name of the file, for messages.

    Raises:
        InputError: the pose cannot be found in it; the message says what to do.
    """
    part = tree_in(content, source)
    if part is None:
        return None
    if not part.joints:
        raise InputError(
            f"{source}: no joint in it that can be read; {part.hint or 'give the file with the transforms'}"
        )
    text = part.statement or content.text
    stated, below = stated_frames(text), stated_joint(text, source)
    if len(part.joints) == 1 and below is None and not frames.is_given:
        found = _of_one_joint(part, stated)
    else:
        joints = (*part.joints, below) if below is not None else part.joints
        found = calibration_in_tree(joined([replace(part, joints=joints)]), frames, source=source, stated=stated)
    found = replace(found, check_point=stated_check_point(text)).checked(source)
    return with_statement(found, text) if part.statement else found


def _of_one_joint(part: TreePart, stated: FrameNames | None) -> ImportedCalibration:
    """Return the pose of the only joint of a file, whose two frames are the radar's and the camera's."""
    joint = part.joints[0]
    moved = joint.transform  # says why it cannot be used
    written = joint.written or WrittenPose("matrix", moved.rotation, moved.translation_m, "radar_from_camera")
    camera = next((one for one in part.sensors if one.kind == "camera" and one.axes == "optical"), None)
    if stated is None and camera is not None and camera.frame in (joint.parent, joint.child):
        other = joint.parent if camera.frame == joint.child else joint.child
        refuse_another_sensor(other, "radar", "--radar")
        stated = FrameNames(other, camera.frame)
    roles = posed_between(joint.parent, joint.child, stated, written)
    found = ImportedCalibration(
        part.format,
        roles.pose,
        frames=roles.frames,
        assumptions=(*roles.assumptions, *part.assumptions),
        notes=part.notes,
    )
    return with_camera(found, camera.lens if camera is not None else None, source=joint.place.source)


def calibration_in_tree(
    tree: FrameTree, wanted: WantedFrames, *, source: str, stated: FrameNames | None = None
) -> ImportedCalibration:
    """Return the pose between the radar and the camera of a tree.

    Args:
        tree: of the files.
        wanted: the frames that the user names.
        source: the name of the files, for messages.
        stated: the frames that the file states, for those that the user does not name.

    Raises:
        InputError: the frames cannot be chosen or chained; the message says what to do.
    """
    ends = [name for name in (stated.camera, stated.camera_link) if name in tree.frames] if stated is not None else []
    if stated is not None and ends and stated.radar in tree.frames:
        known = Sensor(stated.camera, "camera", "optical"), Sensor(stated.camera_link, "camera", "link")
        tree = replace(tree, sensors=(*tree.sensors, *known))
        wanted = WantedFrames(wanted.radar or stated.radar, wanted.camera or ends[0])
    chosen = choose_frames(tree, wanted, source=source)
    is_stated = stated is not None and (chosen.radar, chosen.camera) == (stated.radar, *ends[:1])
    try:
        found = _between_chosen(tree, chosen, is_chained_note=not is_stated)
    except InputError as error:
        raise InputError(str(error) if str(error).startswith(source) else f"{source}: {error}") from None
    sensor = tree.sensor_at(chosen.camera)
    found = with_camera(found, sensor.lens if sensor is not None else None, source=source)
    return (replace(found, frames=stated) if is_stated else found).checked(source)


def _between_chosen(tree: FrameTree, chosen: ChosenFrames, *, is_chained_note: bool) -> ImportedCalibration:
    pose, used = _pose(tree, chosen.radar, chosen.camera)
    known = axes_of_camera(tree, chosen)
    lidar = (of_lidar(chosen.radar),) if looks_like_lidar(chosen.radar) else ()
    way = f"chained over {len(used)} joints: {'; '.join(str(step.joint) for step in used)}"
    return ImportedCalibration(
        tree.format,
        pose if known.axes == "optical" else replace(pose, axes="link"),
        frames=FrameNames(chosen.radar, known.optical_frame),
        assumptions=(*lidar, *known.assumptions, *tree.assumptions),
        notes=(*chosen.notes, *((way,) if len(used) > 1 and is_chained_note else ()), *tree.notes),
        in_third_frame=_in_third_frame(used),
    )


def _in_third_frame(used: tuple[Step, ...]) -> tuple[WrittenPose, WrittenPose] | None:
    """Return the poses of radar and camera if the joints are those of the two in one frame."""
    if [step.down for step in used] != [False, True]:
        return None
    radar, camera = (step.joint.written for step in used)
    return (radar, camera) if radar is not None and camera is not None else None


def axes_of_camera(tree: FrameTree, chosen: ChosenFrames) -> CameraAxes:
    """Return the axes of the camera's frame: as the files say, by its name, or by its numbers.

    Args:
        tree: of the files.
        chosen: the radar's frame and the camera's.

    Raises:
        InputError: its name cannot be written to a file.
    """
    sensor = tree.sensor_at(chosen.camera)
    if sensor is not None and sensor.axes is not None:
        optical = chosen.camera if sensor.axes == "optical" else FrameNames("radar", chosen.camera).camera
        return CameraAxes(sensor.axes, optical)
    # The radar's frame is already chosen, so its real name decides nothing here.
    roles = posed_between("radar", chosen.camera, None, _numbers(tree, chosen))
    return CameraAxes(roles.pose.axes, roles.frames.camera, roles.assumptions)


def _numbers(tree: FrameTree, chosen: ChosenFrames) -> WrittenPose:
    """Return the camera frame's pose in the radar's; none, which fits no axes, if a joint between them cannot be used."""
    usable = not any(step.joint.problem for step in tree.path(chosen.radar, chosen.camera))
    between = tree.between(chosen.radar, chosen.camera) if usable else RigidTransform.identity()
    return WrittenPose("matrix", between.rotation, between.translation_m, "radar_from_camera")


def _pose(tree: FrameTree, radar: str, camera: str) -> tuple[WrittenPose, tuple[Step, ...]]:
    """Return the pose as written if one joint gives it, otherwise the product of the joints; and the joints that turn or move."""
    path = tree.path(radar, camera)
    if not path:
        raise InputError(f"{radar} cannot be the frame of the radar and of the camera; name two frames")
    steps = tuple(step for step in path if np.any(step.transform.as_matrix() != np.eye(4))) or path
    written = steps[0].joint.written
    if written is not None and len(steps) == 1:
        return replace(written, direction="radar_from_camera" if steps[0].down else "camera_from_radar"), steps
    if written is not None and len(steps) == 2 and steps[0].down and _is_standard(steps[1].joint):
        return replace(written, direction="radar_from_camera", axes="link"), steps
    radar_from_camera = tree.between(radar, camera)
    return WrittenPose(
        "matrix", radar_from_camera.rotation, radar_from_camera.translation_m, "radar_from_camera"
    ), steps


def _is_standard(joint: Joint) -> bool:
    """Return whether a joint only turns body axes into optical axes."""
    if "optical" not in joint.child:
        return False
    return bool(np.abs(joint.transform.as_matrix() - LINK_FROM_OPTICAL.as_matrix()).max() <= _STANDARD)


_STRING = r'"(?:[^"\\]|\\.)*"'
_FIXED = re.compile(rf"; ({_STRING}) is fixed in ({_STRING}) at x y z qx qy qz qw \[([^\]]*)\]")


def stated_joint(text: str, source: str) -> Joint | None:
    """Return the camera's pose in the frame that a file poses, as its comment states it; None if it states none."""
    match = _FIXED.search(text)
    if match is None:
        return None
    try:
        numbers = np.array(match[3].split(","), dtype=np.float64)
        written = WrittenPose("quaternion_xyzw", numbers[3:], numbers[:3], "radar_from_camera")
        place = Place(source, text.count("\n", 0, match.start()) + 1)
        parent, child = json_value(match[2], source=source), json_value(match[1], source=source)
        return Joint.posed(parent, child, written, place)
    except ValueError:
        return None
