"""What one file says about a frame tree, before the files are joined."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.interchange.trees.frame_tree import FrameTree, Joint, Sensor


@dataclass(frozen=True, slots=True, eq=False)
class TreePart:
    """The joints and sensors of one file.

    Attributes:
        format: of the file.
        joints: in the order of the file.
        sensors: what it says about sensors besides their pose.
        hint: what may be missing from it, such as macros that were not expanded; "" if nothing.
        notes: what a user of it must know, one sentence each.
    """

    format: str
    joints: tuple[Joint, ...]
    sensors: tuple[Sensor, ...] = ()
    hint: str = ""
    notes: tuple[str, ...] = ()


def joined(parts: Sequence[TreePart]) -> FrameTree:
    """Join what several files say into one tree.

    Raises:
        InputError: a frame has two parents, or is its own ancestor.
    """
    return FrameTree(
        tuple(joint for part in parts for joint in part.joints),
        tuple(sensor for part in parts for sensor in part.sensors),
        parts[0].format,
        "; ".join(part.hint for part in parts if part.hint),
        tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )
