"""The pose between the radar and the camera of a frame tree, chained over the joints between them."""

import re
from dataclasses import dataclass, replace

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.format import (
    Axes,
    ImportedCalibration,
    StatedCheckPoint,
    WrittenPose,
    looks_like_lidar,
    of_lidar,
    posed_between,
)
from calib_core.interchange.formats.statement import stated_check_point, stated_frames
from calib_core.interchange.rotations import LINK_FROM_OPTICAL
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_choice import ChosenFrames, WantedFrames, choose_frames
from calib_core.interchange.trees.frame_tree import FrameTree, Joint, Place, Sensor, joined
from calib_core.interchange.trees.reading import may_have_several_joints, tree_in
from calib_core.parsing import json_value

_STANDARD = 1e-4


@dataclass(frozen=True, slots=True)
class CameraAxes:
    """The axes of a camera's frame, what its optical frame is called, and what was assumed."""

    axes: Axes
    optical_frame: str
    assumptions: tuple[str, ...] = ()


def chained_calibration(content: Content, frames: WantedFrames, *, source: str) -> ImportedCalibration | None:
    """Return the pose between the radar and the camera of a file with several joints; None if it is no such file.

    A file that states its two frames in a comment, as ours do, has its own reader, unless the user names others.

    Args:
        content: of the file.
        frames: that the user names.
        source: the name of the file, for messages.

    Raises:
        InputError: it is such a file, and the pose cannot be found in it; the message says what to do.
    """
    stated, below = stated_frames(content.text), stated_joint(content.text, source)
    if not frames.is_given and below is None and (stated is not None or not may_have_several_joints(content)):
        return None
    part = tree_in(content, content.text, source)
    if part is not None and not part.joints and part.hint:
        raise InputError(f"{source}: no joint in it that can be read; {part.hint}")
    if part is None or not part.joints or (len(part.joints) < 2 and below is None and not frames.is_given):
        return None
    if below is not None and stated is not None:
        sensor = Sensor(stated.camera, "camera", "optical")
        part = replace(part, joints=(*part.joints, below), sensors=(*part.sensors, sensor))
        frames = WantedFrames(frames.radar or stated.radar, frames.camera or stated.camera)
    return calibration_in_tree(joined([part]), frames, source=source, check_point=stated_check_point(content.text))


def calibration_in_tree(
    tree: FrameTree, wanted: WantedFrames, *, source: str, check_point: StatedCheckPoint | None = None
) -> ImportedCalibration:
    """Return the pose between the radar and the camera of a tree.

    Args:
        tree: of the files.
        wanted: the frames that the user names.
        source: the name of the files, for messages.
        check_point: that the files state.

    Raises:
        InputError: the frames cannot be chosen or chained; the message says what to do.
    """
    chosen = choose_frames(tree, wanted, source=source)
    try:
        pose, used = _pose(tree, chosen.radar, chosen.camera)
        known = axes_of_camera(tree, chosen)
        frames = FrameNames(chosen.radar, known.optical_frame)
    except InputError as error:
        raise InputError(str(error) if str(error).startswith(source) else f"{source}: {error}") from None
    sensor = tree.sensor_at(chosen.camera)
    way = f"chained over {len(used)} joints: {'; '.join(map(str, used))}" if len(used) > 1 else ""
    return ImportedCalibration(
        tree.format,
        pose if known.axes == "optical" else replace(pose, axes="link"),
        frames=frames,
        check_point=check_point,
        assumptions=(*((of_lidar(chosen.radar),) if looks_like_lidar(chosen.radar) else ()), *known.assumptions),
        notes=tuple(note for note in (*chosen.notes, way, *tree.notes) if note),
        matrix_px=sensor.matrix_px if sensor is not None else None,
    ).checked(source)


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


def _pose(tree: FrameTree, radar: str, camera: str) -> tuple[WrittenPose, tuple[Joint, ...]]:
    """Return the pose as written if one joint gives it, otherwise the product of the joints; and the joints."""
    steps = tree.path(radar, camera)
    if not steps:
        raise InputError(f"{radar} cannot be the frame of the radar and of the camera; name two frames")
    joints = tuple(step.joint for step in steps)
    for step in steps:
        _ = step.transform  # says which joint cannot be used
    written = steps[0].joint.written
    if written is not None and len(steps) == 1:
        return replace(written, direction="radar_from_camera" if steps[0].down else "camera_from_radar"), joints
    if written is not None and len(steps) == 2 and steps[0].down and _is_standard(joints[1]):
        return replace(written, direction="radar_from_camera", axes="link"), joints
    radar_from_camera = tree.between(radar, camera)
    return (
        WrittenPose("matrix", radar_from_camera.rotation, radar_from_camera.translation_m, "radar_from_camera"),
        joints,
    )


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
