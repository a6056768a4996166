"""The frames of a recording: which transforms its /tf and /tf_static messages give, and whether they ever change."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import reduce

import numpy as np

from calib_core.errors import RecordingError
from calib_core.geometry import RigidTransform, matrix_from_quaternion_wxyz
from calib_core.recordings import Recording
from calib_core.recordings.messages.decoding import Message
from calib_core.recordings.messages.definitions import short_type
from calib_core.recordings.topics import Topic, join_topics

_TYPES = ("tf2_msgs/TFMessage", "tf/tfMessage")
_SAME = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A transform between two frames.

    Attributes:
        parent: frame_id of the parent.
        child: frame_id of the child.
        parent_from_child: the pose of the child in the parent; None if it changes during the recording.
    """

    parent: str
    child: str
    parent_from_child: RigidTransform | None


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """The frames above a frame.

    Attributes:
        frames: from the frame itself to the root.
        pose_in_root: the pose of the frame in the root; None if it changes, or if the chain is broken.
        fault: what is wrong with the chain; "" if nothing.
    """

    frames: tuple[str, ...]
    pose_in_root: RigidTransform | None
    fault: str = ""

    @property
    def root(self) -> str:
        """The frame without a parent."""
        return self.frames[-1]


@dataclass(frozen=True, slots=True, eq=False)
class RecordedFrames:
    """All transforms of a recording.

    Attributes:
        joints: by child, then by parent; a sound recording has one parent for each child.
        topics: where they come from.
        unreadable: number of messages that could not be read.
    """

    joints: Mapping[str, Mapping[str, Joint]] = field(default_factory=dict[str, Mapping[str, Joint]])
    topics: tuple[str, ...] = ()
    unreadable: int = 0

    @property
    def names(self) -> frozenset[str]:
        """Every frame that occurs."""
        return frozenset(self.joints) | {parent for parents in self.joints.values() for parent in parents}

    def parent(self, frame: str) -> str | None:
        """Return a frame's parent, the first of several; None for a root."""
        return next(iter(self.joints.get(frame, ())), None)

    def chain(self, frame: str) -> Chain:
        """Follow the parents of a frame to the root."""
        frames, steps, moving, fault = [frame], [], False, ""
        while parents := self.joints.get(frames[-1]):
            if len(parents) > 1:
                fault = f"{frames[-1]} has several parents: {', '.join(parents)}"
            joint = next(iter(parents.values()))
            if joint.parent in frames:
                return Chain(tuple(frames), None, f"{joint.parent} is its own ancestor")
            if joint.parent_from_child is None:
                moving = True
            else:
                steps.append(joint.parent_from_child)
            frames.append(joint.parent)
        whole = reduce(_above, steps, RigidTransform.identity())
        return Chain(tuple(frames), None if moving or fault else whole, fault)


def _above(below: RigidTransform, step: RigidTransform) -> RigidTransform:
    return step @ below


def is_transforms(kind: str) -> bool:
    """Return whether messages of a type hold transforms."""
    return short_type(kind) in _TYPES


def read_frames(recording: Recording) -> RecordedFrames:
    """Read every transform of a recording; a transform that takes several values has none of its own."""
    names = [topic.name for topic in recording.topics if is_transforms(topic.type) and topic.count]
    topics = join_topics(recording.sources, names)[0] if names else ()
    joints: dict[str, dict[str, Joint]] = {}
    unreadable = sum(_read(topic, joints) for topic in topics)
    return RecordedFrames(joints, tuple(topic.name for topic in topics), unreadable)


def _read(topic: Topic, joints: dict[str, dict[str, Joint]]) -> int:
    """Add the transforms of a topic; return how many messages could not be read."""
    unreadable = 0
    for row in range(len(topic)):
        try:
            for message in topic.message(row).messages("transforms"):
                _note(message, joints)
        except (RecordingError, ValueError):  # the latter for a quaternion that is none
            unreadable += 1
    return unreadable


def _note(message: Message, joints: dict[str, dict[str, Joint]]) -> None:
    parent = message.message("header").text("frame_id").lstrip("/")
    child = message.text("child_frame_id").lstrip("/")
    known = joints.setdefault(child, {}).get(parent)
    if known is not None and known.parent_from_child is None:
        return
    translation_m = np.array([message.number(f"transform.translation.{axis}") for axis in "xyz"])
    quaternion = np.array([message.number(f"transform.rotation.{axis}") for axis in "wxyz"])
    pose = RigidTransform(matrix_from_quaternion_wxyz(quaternion), translation_m)
    if known is None or known.parent_from_child is None:
        joints[child][parent] = Joint(parent, child, pose)
    elif not np.allclose(known.parent_from_child.as_matrix(), pose.as_matrix(), rtol=0, atol=_SAME):
        joints[child][parent] = Joint(parent, child, None)
