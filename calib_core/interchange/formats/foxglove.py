"""Foxglove's FrameTransform and CameraCalibration messages as JSON."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames
from calib_core.interchange.cameras.fields import find_cameras, floats
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.imported import ImportedCalibration, WrittenPose, posed_between
from calib_core.interchange.own.camera_document import refuse_skew
from calib_core.interchange.rotations import quaternion_xyzw_from_matrix
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.json_text import json_text
from calib_core.lens_models.naming import written_lens

__all__ = ["FOXGLOVE"]

_NOTES = (
    "FrameTransform is the pose of the child (camera, optical) in the parent (radar), rotation named x y z w; "
    "messages have no comments, so the check point is only in calibration.json",
)


def _write(file: CalibrationFile) -> str:
    """Write one object with both messages, ready to publish.

    Raises:
        InputError: CameraCalibration cannot store this camera's skew, or has no name for its lens.
    """
    refuse_skew(file.calibration.camera, "Foxglove's CameraCalibration has")
    radar_from_camera = file.calibration.camera_from_radar.inverse()
    quaternion = quaternion_xyzw_from_matrix(radar_from_camera.rotation) + 0.0
    transform = {
        "timestamp": {"sec": 0, "nsec": 0},
        "parent_frame_id": file.frames.radar,
        "child_frame_id": file.frames.camera,
        "translation": dict(zip("xyz", (radar_from_camera.translation_m + 0.0).tolist(), strict=True)),
        "rotation": dict(zip("xyzw", quaternion.tolist(), strict=True)),
    }
    camera = _camera_message(file.calibration.camera, file.frames.camera)
    return json_text({"FrameTransform": transform, "CameraCalibration": camera})


def _camera_message(camera: Camera, frame: str) -> dict[str, Any]:
    lens = written_lens(camera.lens, camera.distortion, "foxglove")
    return {
        "timestamp": {"sec": 0, "nsec": 0},
        "frame_id": frame,
        "width": camera.width_px,
        "height": camera.height_px,
        "distortion_model": lens.name,
        "D": list(lens.coefficients),
        "K": camera.matrix_px.ravel().tolist(),
        "R": np.eye(3).ravel().tolist(),
        "P": np.hstack([camera.matrix_px, np.zeros((3, 1))]).ravel().tolist(),
    }


def _recognizes(content: Content) -> bool:
    return "FrameTransform" in content.json_mapping or "parent_frame_id" in content.json_mapping


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read a FrameTransform, alone or with a CameraCalibration.

    Raises:
        InputError: a frame name or a number is missing.
    """
    messages = content.mapping
    message = messages.get("FrameTransform", messages)
    if not isinstance(message, Mapping):
        message = {}
    parent, child = (str(message.get(key) or "") for key in ("parent_frame_id", "child_frame_id"))
    if not parent or not child:
        raise InputError(f"{source}: parent_frame_id or child_frame_id is missing; name both frames")
    numbers = []
    for part, keys in (("translation", "xyz"), ("rotation", "xyzw")):
        block = message.get(part)
        if not isinstance(block, Mapping):
            raise InputError(f"{source}: FrameTransform.{part}: missing; add it")
        numbers.append(
            [floats(block.get(k), source=source, place=f"FrameTransform.{part}.{k}", length=1)[0] for k in keys]
        )
    written = WrittenPose("quaternion_xyzw", np.array(numbers[1]), np.array(numbers[0]), "radar_from_camera")
    roles = posed_between(parent, child, _frames_of(messages, parent, child), written)
    cameras = find_cameras(messages, source=source) if "CameraCalibration" in messages else ()
    return ImportedCalibration(
        "foxglove",
        roles.pose,
        camera=cameras[0].camera(image_size_px=None, source=source) if cameras else None,
        frames=roles.frames,
        assumptions=roles.assumptions,
    ).checked(source)


def _frames_of(messages: Mapping[str, Any], parent: str, child: str) -> FrameNames | None:
    """Return which of the two frames is the camera's: the frame of a CameraCalibration, which has optical axes by definition."""
    camera = messages.get("CameraCalibration")
    frame = str(camera.get("frame_id") or "") if isinstance(camera, Mapping) else ""
    return FrameNames(parent if frame == child else child, frame) if frame in (parent, child) else None


FOXGLOVE = Format(
    name="foxglove",
    title="Foxglove messages",
    used_in="Data sets and viewers",
    also="Studio MCAP viewer",
    numbers="FrameTransform: pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
    file_name="foxglove.json",
    camera="lens",
    comment="none",
    notes=_NOTES,
    write=_write,
    reads=Reads(_recognizes, _read),
)
