"""Every format for the intrinsics of a camera. To add one: write its module in `formats`, and add it here."""

from difflib import get_close_matches

import msgspec

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import CameraFormat
from calib_core.interchange.cameras.formats.colmap import COLMAP_CAMERAS
from calib_core.interchange.cameras.formats.kalibr import KALIBR_CHAIN
from calib_core.interchange.cameras.formats.kitti import KITTI_CAMERAS_FILE
from calib_core.interchange.cameras.formats.matlab import MATLAB_PARAMETERS
from calib_core.interchange.cameras.formats.mrcal import MRCAL
from calib_core.interchange.cameras.formats.opencv import OPENCV_JSON, OPENCV_XML, OPENCV_YAML
from calib_core.interchange.cameras.formats.ros import ROS
from calib_core.interchange.own.camera_document import camera_document
from calib_core.interchange.syntax.json_text import json_text


def _write(camera: Camera, _name: str) -> str:
    return json_text(msgspec.to_builtins(camera_document(camera)))


OWN_JSON = CameraFormat("json", "JSON, with the covariance of the intrinsics", ".json", _write)


CAMERA_FORMATS: dict[str, CameraFormat] = {
    one.name: one
    for one in (
        ROS,
        KALIBR_CHAIN,
        OPENCV_YAML,
        OPENCV_XML,
        OPENCV_JSON,
        MRCAL,
        COLMAP_CAMERAS,
        KITTI_CAMERAS_FILE,
        MATLAB_PARAMETERS,
        OWN_JSON,
    )
}
"""By name, in display order."""


def camera_content(camera: Camera, to: str, name: str = "camera") -> str | bytes:
    """Return the content of a file with a camera's intrinsics.

    Args:
        camera: the intrinsics.
        to: name of the format, one of CAMERA_FORMATS.
        name: of the camera, for formats that state one.

    Raises:
        InputError: there is no such format, or it cannot store this camera.
    """
    if to not in CAMERA_FORMATS:
        near = get_close_matches(to, CAMERA_FORMATS, n=1)
        known = f"did you mean {near[0]}?" if near else f"known: {', '.join(CAMERA_FORMATS)}"
        raise InputError(f"no format {to!r} for intrinsics; {known}")
    return CAMERA_FORMATS[to].write(camera, name)
