"""The frames of a recording, and where a calibration's transform goes among them, so that no frame gets a second parent."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import reduce

import numpy as np

from calib_core.errors import RecordingError
from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.recordings import Recording
from calib_core.recordings.frame_transforms import FrameTransform, is_transforms, transforms_in
from calib_core.recordings.topics import Topic, join_topics

_SAME = 1e-9
OWN_RADAR_FRAME = "cocalib_radar"
"""The radar's frame where its own cannot be used."""
_SAME_M = 1e-6
_SAME_RAD = 1e-6


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
        whole = reduce(_pose_above, steps, RigidTransform.identity())
        return Chain(tuple(frames), None if moving or fault else whole, fault)


def _pose_above(below: RigidTransform, step: RigidTransform) -> RigidTransform:
    return step @ below


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
            for transform in transforms_in(topic.message(row), topic.name):
                _note(transform, joints)
        except (RecordingError, ValueError):  # the latter for a quaternion that is none
            unreadable += 1
    return unreadable


def _note(transform: FrameTransform, joints: dict[str, dict[str, Joint]]) -> None:
    known = joints.setdefault(transform.child, {}).get(transform.parent)
    pose: RigidTransform | None = transform.pose
    if known is not None:
        before = known.parent_from_child
        same = before is not None and np.allclose(before.as_matrix(), transform.pose.as_matrix(), rtol=0, atol=_SAME)
        pose = before if same else None
    joints[transform.child][transform.parent] = Joint(transform.parent, transform.child, pose)


@dataclass(frozen=True, slots=True, eq=False)
class SensorFrames:
    """The frames in which viewers draw.

    Attributes:
        camera: the optical frame of the images.
        radar: the frame of the returns, in the axes of the calibration.
        joint: the transform to write; None if the recording gives it already.
        notes: what the user must know.
    """

    camera: str
    radar: str
    joint: Joint | None
    notes: tuple[str, ...] = ()


def place_transform(
    camera_from_radar: RigidTransform, *, radar: str, camera: str, frames: RecordedFrames, own_radar_frame: str = ""
) -> SensorFrames:
    """Choose the transform to write.

    Args:
        camera_from_radar: the calibration.
        radar: frame_id of the radar messages.
        camera: frame_id of the images.
        frames: of the recording.
        own_radar_frame: why the returns need a frame of their own; "" if they do not.
    """
    above_camera, above_radar = frames.chain(camera), frames.chain(radar)
    if own_radar_frame or above_camera.fault or above_radar.fault:
        why = (
            own_radar_frame
            or f"the recording's own transforms are contradictory ({above_camera.fault or above_radar.fault})"
        )
        return _frames_below_camera(camera_from_radar, camera, frames, why)
    if above_camera.root == above_radar.root:
        return _joined_frames(camera_from_radar, above_camera, above_radar, frames)
    if above_camera.pose_in_root is not None:
        link, link_from_camera = above_camera.root, above_camera.pose_in_root
        radar_from_link = (link_from_camera @ camera_from_radar).inverse()
        joint = Joint(radar, link, radar_from_link)
        return SensorFrames(camera, radar, joint, _link_notes(above_camera, joint))
    if above_radar.pose_in_root is not None:
        link_from_radar = above_radar.pose_in_root
        joint = Joint(camera, above_radar.root, camera_from_radar @ link_from_radar.inverse())
        note = f"{camera} moves in the recording's own tree, so {joint.child} is written as its child"
        return SensorFrames(camera, radar, joint, (note,))
    return _frames_below_camera(
        camera_from_radar, camera, frames, "camera and radar both move in the recording's own transforms"
    )


def _link_notes(above_camera: Chain, joint: Joint) -> tuple[str, ...]:
    if len(above_camera.frames) == 1:
        return ()
    return (
        f"the recording gives {above_camera.frames[0]} the parent {above_camera.frames[1]}; a second parent would break "
        f"the tree, so the pose of {joint.child} is written instead: {joint.parent} -> {joint.child}",
    )


def _joined_frames(
    camera_from_radar: RigidTransform, above_camera: Chain, above_radar: Chain, frames: RecordedFrames
) -> SensorFrames:
    """Compare with what the recording states, and keep clear of it if it differs."""
    camera, radar = above_camera.frames[0], above_radar.frames[0]
    if above_camera.pose_in_root is None or above_radar.pose_in_root is None:
        why = f"the recording's own transforms connect {radar} and {camera} already, through a joint that moves"
        return _frames_below_camera(camera_from_radar, camera, frames, why)
    base_from_camera, base_from_radar = above_camera.pose_in_root, above_radar.pose_in_root
    recorded_camera_from_radar = base_from_camera.inverse() @ base_from_radar
    turned_rad = rotation_angle_rad(recorded_camera_from_radar.rotation.T @ camera_from_radar.rotation)
    recorded_m, calibrated_m = (one.inverse().translation_m for one in (recorded_camera_from_radar, camera_from_radar))
    moved_m = float(np.linalg.norm(recorded_m - calibrated_m))
    if turned_rad < _SAME_RAD and moved_m < _SAME_M:
        note = f"the recording's own transforms state this pose of {camera} and {radar} already; none is added"
        return SensorFrames(camera, radar, None, (note,))
    why = (
        f"the recording's own transforms connect {radar} and {camera} already, and state a pose that differs by "
        f"{np.degrees(turned_rad):.3g} deg and {moved_m * 100:.3g} cm; a second one would break the tree"
    )
    return _frames_below_camera(camera_from_radar, camera, frames, why)


def _frames_below_camera(
    camera_from_radar: RigidTransform, camera: str, frames: RecordedFrames, why: str
) -> SensorFrames:
    """Give the returns a frame of their own below the camera, which is right whatever the rest of the tree says."""
    name = OWN_RADAR_FRAME
    while name in frames.names or name == camera:
        name += "_"
    note = f"{why}; the returns are written in a frame of their own, {name}, whose parent is {camera}"
    return SensorFrames(camera, name, Joint(camera, name, camera_from_radar), (note,))
