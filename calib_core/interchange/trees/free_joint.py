"""Which joint between the radar and the camera a calibration determines: the camera's mount, unless the user names another."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from calib_core.errors import InputError
from calib_core.interchange.trees.frame_choice import ChosenFrames, is_fixture, is_of_camera, is_of_radar
from calib_core.interchange.trees.frame_tree import FrameTree, Step
from calib_core.interchange.trees.joint import Joint


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
        joint = _named(between, name, path)
        return FreeJoint(joint, f"{_described(joint)}: named with --joint{_moving(tree, joint)}")
    mounts = [step.joint for step in between if step.down and _is_mount_of_camera(tree, step.joint)]
    if mounts:
        return FreeJoint(mounts[-1], f"{_described(mounts[-1])}: the camera's mount{_moving(tree, mounts[-1])}")
    on_camera_side = [step.joint for step in between if step.down and not _is_inside_camera(tree, step.joint)]
    if on_camera_side:
        joint = on_camera_side[-1]
        return FreeJoint(joint, f"{_described(joint)}: the last one before the camera{_moving(tree, joint)}")
    on_radar_side = [step.joint for step in between if not step.down and is_of_radar(tree, step.joint.child)]
    if on_radar_side:
        joint = on_radar_side[0]
        return FreeJoint(
            joint, f"{_described(joint)}: the radar's mount; the camera's is in no file{_moving(tree, joint)}"
        )
    raise InputError(
        f"none of the joints between {chosen.radar} and {chosen.camera} is in the files to change; they are "
        f"{_listed(path)}; give the file of one of them with --into, or name one with --joint"
    )


def _is_mount_of_camera(tree: FrameTree, joint: Joint) -> bool:
    return is_of_camera(tree, joint.child) and not _is_inside_camera(tree, joint)


def _is_inside_camera(tree: FrameTree, joint: Joint) -> bool:
    """Return whether a joint connects two frames of one camera, such as its body and its optical axes."""
    return is_of_camera(tree, joint.parent) and is_of_camera(tree, joint.child) and not is_fixture(joint.parent)


def _named(between: Sequence[Step], name: str, path: Sequence[Step]) -> Joint:
    found = [step.joint for step in between if name.lstrip("/") in (step.joint.name, step.joint.child)]
    if len(found) != 1:
        raise InputError(
            f"--joint: no joint {name!r} that can be changed lies between the radar and the camera; those on the way are "
            f"{_listed(path)}; name one of them by its name or its child frame"
        )
    return found[0]


def _described(joint: Joint) -> str:
    return f"joint {f'{joint.name}, ' if joint.name else ''}{joint}"


def _listed(path: Sequence[Step]) -> str:
    return "; ".join(_described(step.joint).removeprefix("joint ") for step in path)


def _moving(tree: FrameTree, joint: Joint) -> str:
    below = tree.below(joint.child)
    return f"; with it moves {', '.join(below)}" if below else ""
