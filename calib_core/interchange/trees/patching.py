"""Patch a frame tree's file in place so that its chain from radar to camera is a calibration; only the numbers of the one free
joint change.
"""

import codecs
import difflib
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Form
from calib_core.interchange.own.raw_data import other_pose
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, quaternion_xyzw_from_matrix, rpy_from_matrix
from calib_core.interchange.statement import missing_map
from calib_core.interchange.syntax.yaml_text import number_text
from calib_core.interchange.trees.frame_choice import (
    ChosenFrames,
    WantedFrames,
    choose_frames,
    is_fixture,
    is_of_camera,
    is_of_radar,
)
from calib_core.interchange.trees.frame_tree import FrameTree, Joint, JointNumbers, Slot, Step
from calib_core.interchange.trees.posed_in_tree import axes_of_camera
from calib_core.interchange.trees.reading import TreeFile, joined_tree

_DIGITS = 9
_READ_BACK = 1e-6


@dataclass(frozen=True, slots=True)
class Patch:
    """A change of one file, which has been read back.

    Attributes:
        source: the file.
        before: its text.
        after: its text with other numbers.
        data: its new bytes.
        why: which joint was solved for, and why this one.
        notes: what a user of it must know, one sentence each.
    """

    source: str
    before: str
    after: str
    data: bytes
    why: str
    notes: tuple[str, ...]

    def diff(self) -> str:
        """Return the change as a unified diff; "" if nothing changes."""
        before, after = (text.splitlines(keepends=True) for text in (self.before, self.after))
        return "".join(
            line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"
            for line in difflib.unified_diff(before, after, self.source, self.source)
        )


def patched(
    files: Sequence[TreeFile],
    recorded: Sequence[Joint],
    calibration: CalibrationFile,
    wanted: WantedFrames,
    *,
    joint: str | None = None,
) -> Patch:
    """Solve for the free joint and write its numbers into the text of its file.

    Args:
        files: of the tree; one of them is changed.
        recorded: joints of a recording or another file, which are not changed, such as those of the camera's driver.
        calibration: what the chain must become.
        wanted: the frames of radar and camera; those not named are the calibration's own if they are in the tree.
        joint: the name of the joint to solve for, or of its child; None for the camera's mount.

    Raises:
        InputError: the frames or the joint cannot be chosen, or its numbers cannot be changed in place; the message says
            which numbers to write where.
    """
    tree = joined_tree(files, recorded)
    source = ", ".join(file.source for file in files)
    known = tree.frames
    chosen = choose_frames(
        tree,
        WantedFrames(
            wanted.radar or (calibration.frames.radar if calibration.frames.radar in known else None),
            wanted.camera or (calibration.frames.camera if calibration.frames.camera in known else None),
        ),
        source=source,
    )
    free = free_joint(tree, chosen, [file.source for file in files], joint)
    target, notes = _target(tree, chosen, calibration)
    parent_from_child = _solved(tree, chosen, free.joint, target)
    other = other_pose(calibration)
    file = next(file for file in files if file.source == free.joint.place.source)
    after = _with_numbers(file, free.joint, parent_from_child)
    again = joined_tree([TreeFile(after.encode(), one.source) if one is file else one for one in files], recorded)
    _refuse_other_reading(tree, again, free.joint, chosen, target)
    return Patch(
        file.source,
        file.text,
        after,
        (codecs.BOM_UTF8 if file.data.startswith(codecs.BOM_UTF8) else b"") + after.encode(),
        free.why,
        (*chosen.notes, *notes, *missing_map(calibration.calibration), *([] if other is None else [other.note])),
    )


def _target(
    tree: FrameTree, chosen: ChosenFrames, calibration: CalibrationFile
) -> tuple[RigidTransform, tuple[str, ...]]:
    """Return radar_from_frame for the chosen camera frame, in its axes, and what was assumed about them."""
    known = axes_of_camera(tree, chosen)
    notes = list(known.assumptions)
    if calibration.frames.camera not in tree.frames:
        notes.append(
            f"{calibration.frames.camera}, the camera frame of the calibration, is not in the tree: {chosen.camera} is taken for "
            "the same place; if a driver publishes the frames between them, give its transforms with --tree RECORDING"
        )
    target = calibration.calibration.camera_from_radar.inverse()
    return target if known.axes == "optical" else target @ LINK_FROM_OPTICAL.inverse(), tuple(notes)


def _solved(tree: FrameTree, chosen: ChosenFrames, joint: Joint, target: RigidTransform) -> RigidTransform:
    """Return parent_from_child of a joint on the way from radar to camera with which the chain is the target."""
    down = next(step.down for step in tree.path(chosen.radar, chosen.camera) if step.joint is joint)
    near, far = (joint.parent, joint.child) if down else (joint.child, joint.parent)
    near_from_far = tree.between(near, chosen.radar) @ target @ tree.between(chosen.camera, far)
    return near_from_far if down else near_from_far.inverse()


def _with_numbers(file: TreeFile, joint: Joint, parent_from_child: RigidTransform) -> str:
    """Write the numbers of a joint into the text; numbers that stay the same keep their text."""
    if joint.problem or joint.numbers is None:
        form: Form = joint.numbers.form if joint.numbers is not None else "rpy"
        words = _in_words(form, _values(form, parent_from_child))
        reason = joint.problem or "its numbers cannot be changed in place"
        raise InputError(
            f"{joint.place}: the joint from {joint.parent} to {joint.child} is not changed: {reason}. "
            f"Write there by hand: {words}"
        )
    if file.data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise InputError(f"{file.source}: is UTF-16; save it as UTF-8 to patch it")
    text, parts, at = file.text, [], 0
    for slot, value in _edits(joint.numbers, _values(joint.numbers.form, parent_from_child), text):
        parts += [text[at : slot.start], slot.before, value, slot.after]
        at = slot.end
    return "".join([*parts, text[at:]])


def _edits(numbers: JointNumbers, values: np.ndarray, text: str) -> list[tuple[Slot, str]]:
    pairs = zip(numbers.slots, values.tolist(), strict=True)
    changed = [
        (slot, number_text(value)) for slot, value in pairs if slot.end == slot.start or not _is(text, slot, value)
    ]
    return sorted(changed, key=_start)


def _start(edit: tuple[Slot, str]) -> int:
    return edit[0].start


def _is(text: str, slot: Slot, value: float) -> bool:
    return abs(float(text[slot.start : slot.end]) - value) <= 0.5 * 10**-_DIGITS


def _values(form: Form, parent_from_child: RigidTransform) -> np.ndarray:
    rotation = (rpy_from_matrix if form == "rpy" else quaternion_xyzw_from_matrix)(parent_from_child.rotation)
    return np.round(np.concatenate([parent_from_child.translation_m, rotation]), _DIGITS) + 0.0


def _in_words(form: Form, values: np.ndarray) -> str:
    words = [number_text(value) for value in values.tolist()]
    if form == "rpy":
        return f'xyz="{" ".join(words[:3])}" rpy="{" ".join(words[3:])}" (meters, radians)'
    return f"x y z {' '.join(words[:3])} (meters), qx qy qz qw {' '.join(words[3:])}"


def _refuse_other_reading(
    tree: FrameTree, again: FrameTree, joint: Joint, chosen: ChosenFrames, target: RigidTransform
) -> None:
    """Compare the tree of the patched text: refuse it unless the chain is the target and every other joint is as it was."""
    off = np.abs(again.between(chosen.radar, chosen.camera).as_matrix() - target.as_matrix()).max()
    same = len(tree.joints) == len(again.joints) and all(
        was is joint or now.repeats(was) or (bool(was.problem) and now.problem == was.problem)
        for was, now in zip(tree.joints, again.joints, strict=True)
    )
    if not (off <= _READ_BACK and same):
        raise InputError(
            f"{joint.place}: the patched text does not read back as the calibration (off by {off:.2g}), so nothing is changed; "
            "write each number of this joint once, on its own, and try again"
        )


@dataclass(frozen=True, slots=True)
class FreeJoint:
    """The joint to solve for, and why this one."""

    joint: Joint
    why: str


def free_joint(tree: FrameTree, chosen: ChosenFrames, sources: Collection[str], name: str | None) -> FreeJoint:
    """Choose the joint to solve for.

    Args:
        tree: of the files and the recording.
        chosen: the radar's and the camera's frame.
        sources: the files that may be changed.
        name: of the joint, or of its child frame, as the user says; None for the camera's mount.

    Raises:
        InputError: no joint between the two frames can be changed, or the named one is not between them.
    """
    path = tree.path(chosen.radar, chosen.camera)
    between = [step for step in path if step.joint.place.source in sources]
    if name is not None:
        joint = _find_joint(between, name, path)
        return FreeJoint(joint, f"{_joint_text(joint)}: named with --joint{_moving(tree, joint)}")
    mounts = [step.joint for step in between if step.down and _is_mount_of_camera(tree, step.joint)]
    if mounts:
        return FreeJoint(mounts[-1], f"{_joint_text(mounts[-1])}: the camera's mount{_moving(tree, mounts[-1])}")
    on_camera_side = [step.joint for step in between if step.down and not _is_inside_camera(tree, step.joint)]
    if on_camera_side:
        joint = on_camera_side[-1]
        return FreeJoint(joint, f"{_joint_text(joint)}: the last one before the camera{_moving(tree, joint)}")
    on_radar_side = [step.joint for step in between if not step.down and is_of_radar(tree, step.joint.child)]
    if on_radar_side:
        joint = on_radar_side[0]
        return FreeJoint(
            joint, f"{_joint_text(joint)}: the radar's mount; the camera's is in no file{_moving(tree, joint)}"
        )
    raise InputError(
        f"none of the joints between {chosen.radar} and {chosen.camera} is in the files to change; they are "
        f"{_joint_list(path)}; give the file of one of them with --into, or name one with --joint"
    )


def _is_mount_of_camera(tree: FrameTree, joint: Joint) -> bool:
    return is_of_camera(tree, joint.child) and not _is_inside_camera(tree, joint)


def _is_inside_camera(tree: FrameTree, joint: Joint) -> bool:
    """Return whether a joint connects two frames of one camera, such as its body and its optical axes."""
    return is_of_camera(tree, joint.parent) and is_of_camera(tree, joint.child) and not is_fixture(joint.parent)


def _find_joint(between: Sequence[Step], name: str, path: Sequence[Step]) -> Joint:
    joints = [step.joint for step in between if name.lstrip("/") in (step.joint.name, step.joint.child)]
    if len(joints) != 1:
        raise InputError(
            f"--joint: no joint {name!r} that can be changed lies between the radar and the camera; those on the way are "
            f"{_joint_list(path)}; name one of them by its name or its child frame"
        )
    return joints[0]


def _joint_text(joint: Joint) -> str:
    return f"joint {f'{joint.name}, ' if joint.name else ''}{joint}"


def _joint_list(path: Sequence[Step]) -> str:
    return "; ".join(_joint_text(step.joint).removeprefix("joint ") for step in path)


def _moving(tree: FrameTree, joint: Joint) -> str:
    below = tree.below(joint.child)
    return f"; with it moves {', '.join(below)}" if below else ""
