"""Our own JSON: the camera object of pairs-1 and calibration-1, with its covariance."""

import msgspec

from calib_core.camera import Camera
from calib_core.interchange.cameras.camera_format import CameraFormat
from calib_core.interchange.own.camera_document import camera_document
from calib_core.interchange.syntax.json_text import json_text


def _write(camera: Camera, _name: str) -> str:
    return json_text(msgspec.to_builtins(camera_document(camera)))


OWN_JSON = CameraFormat("json", "JSON, with the covariance of the intrinsics", ".json", _write)
