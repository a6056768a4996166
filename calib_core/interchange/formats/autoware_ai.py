"""Calibrations of Autoware.AI's camera-lidar calibrators: CameraExtrinsicMat and CameraMat in OpenCV's FileStorage."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import FoundCamera, with_camera
from calib_core.interchange.cameras.fields import find_cameras, floats
from calib_core.interchange.format import ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.pose_parts import direction_by_facing, rigid_rows
from calib_core.interchange.syntax.content import Content

_KEY = "CameraExtrinsicMat"
_ASSUMPTION = (
    f"the file does not say which way {_KEY} goes; read as Autoware.AI publishes it, the camera's pose (optical axes) "
    "in the lidar, with the radar in the lidar's place"
)


def _recognizes(content: Content) -> bool:
    return _KEY in content.mapping


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the camera's pose and the camera.

    Raises:
        InputError: it contains intrinsics only, or goes the other way by where the camera would look.
    """
    values = content.mapping
    matrix = rigid_rows(values[_KEY], source=source, place=_KEY)
    if np.abs(matrix - np.eye(3, 4)).max() == 0:
        raise InputError(
            f"{source}: {_KEY} is the identity, as the tool writes for intrinsics alone; give the file of the extrinsic "
            "calibration (as intrinsics: --camera FILE)"
        )
    if direction_by_facing(matrix[:, :3]) == "camera_from_radar":
        raise InputError(
            f"{source}: {_KEY}: as the camera's pose in the radar the camera looks away from it, and would not if the matrix "
            "were inverted; invert it, or write it to a text file as camera_from_radar"
        )
    calibration = ImportedCalibration(
        "autoware-ai",
        WrittenPose("matrix", matrix[:, :3], matrix[:, 3], "radar_from_camera"),
        assumptions=(_ASSUMPTION,),
    ).checked(source)
    return with_camera(calibration, _camera(values, source=source), source=source)


def _camera(values: Mapping[str, Any], *, source: str) -> FoundCamera | None:
    size = values.get("ImageSize") or ()
    size = floats(size.split() if isinstance(size, str) else size, source=source, place="ImageSize")
    size_px = (int(size[0]), int(size[1])) if len(size) == 2 and all(size) else None
    return next((replace(camera, size_px=size_px) for camera in find_cameras(values, source=source)), None)


AUTOWARE_AI = Reads(_recognizes, _read)
