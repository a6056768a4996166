"""Where a calibration's transform goes in the tree of a recording, so that no frame gets a second parent."""

from dataclasses import dataclass

import numpy as np

from calib_core.deployment.recorded_frames import Chain, Joint, RecordedFrames
from calib_core.geometry import RigidTransform, rotation_angle_rad

OWN_RADAR_FRAME = "cocalib_radar"
"""The radar's frame where its own cannot be used."""

_SAME_M = 1e-6
_SAME_RAD = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class SensorFrames:
    """The frames in which viewers draw.

    Attributes:
        camera: the optical frame of the pictures.
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
        camera: frame_id of the pictures.
        frames: of the recording.
        own_radar_frame: why the returns need a frame of their own; "" if they do not.
    """
    above_camera, above_radar = frames.chain(camera), frames.chain(radar)
    if own_radar_frame or above_camera.fault or above_radar.fault:
        why = (
            own_radar_frame
            or f"the recording's own transforms are contradictory ({above_camera.fault or above_radar.fault})"
        )
        return _beside(camera_from_radar, camera, frames, why)
    if above_camera.root == above_radar.root:
        return _joined(camera_from_radar, above_camera, above_radar, frames)
    if above_camera.pose_in_root is not None:
        link, link_from_camera = above_camera.root, above_camera.pose_in_root
        radar_from_link = (link_from_camera @ camera_from_radar).inverse()
        joint = Joint(radar, link, radar_from_link)
        return SensorFrames(camera, radar, joint, _about_link(above_camera, joint))
    if above_radar.pose_in_root is not None:
        link_from_radar = above_radar.pose_in_root
        joint = Joint(camera, above_radar.root, camera_from_radar @ link_from_radar.inverse())
        note = f"{camera} moves in the recording's own tree, so {joint.child} is written as its child"
        return SensorFrames(camera, radar, joint, (note,))
    return _beside(camera_from_radar, camera, frames, "camera and radar both move in the recording's own transforms")


def _about_link(above_camera: Chain, joint: Joint) -> tuple[str, ...]:
    if len(above_camera.frames) == 1:
        return ()
    return (
        f"the recording gives {above_camera.frames[0]} the parent {above_camera.frames[1]}; a second parent would break "
        f"the tree, so the pose of {joint.child} is written instead: {joint.parent} -> {joint.child}",
    )


def _joined(
    camera_from_radar: RigidTransform, above_camera: Chain, above_radar: Chain, frames: RecordedFrames
) -> SensorFrames:
    """Compare with what the recording states, and keep clear of it if it differs."""
    camera, radar = above_camera.frames[0], above_radar.frames[0]
    if above_camera.pose_in_root is None or above_radar.pose_in_root is None:
        why = f"the recording's own transforms connect {radar} and {camera} already, through a joint that moves"
        return _beside(camera_from_radar, camera, frames, why)
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
    return _beside(camera_from_radar, camera, frames, why)


def _beside(camera_from_radar: RigidTransform, camera: str, frames: RecordedFrames, why: str) -> SensorFrames:
    """Give the returns a frame of their own below the camera, which is right whatever the rest of the tree says."""
    name = OWN_RADAR_FRAME
    while name in frames.names or name == camera:
        name += "_"
    note = f"{why}; the returns are written in a frame of their own, {name}, whose parent is {camera}"
    return SensorFrames(camera, name, Joint(camera, name, camera_from_radar), (note,))
