"""Intrinsics from sensor_msgs/CameraInfo."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix33
from calib_core.camera import Camera, CameraModel
from calib_core.recordings.messages.decoding import Message
from calib_core.recordings.messages.definitions import Definition
from calib_core.results import DataWarning

__all__ = ["CameraReading", "camera_from_info", "is_camera_info"]

_FISHEYE = ("equidistant", "fisheye", "kannala_brandt", "kannala_brandt4")
_BROWN_CONRADY = ("plumb_bob", "rational_polynomial", "radtan", "brown_conrady", "")


@dataclass(frozen=True, slots=True, eq=False)
class CameraReading:
    """The result of reading a CameraInfo: a camera, or None, with warnings."""

    camera: Camera | None
    warnings: tuple[DataWarning, ...] = ()


def is_camera_info(definition: Definition) -> bool:
    """Return whether a message is laid out as sensor_msgs/CameraInfo, of ROS 1 (D K R P) or ROS 2 (d k r p)."""
    return {"distortion_model", "height", "width"} <= definition.names and {"k", "d"} <= {
        name.lower() for name in definition.names
    }


def camera_from_info(message: Message, *, topic: str, rectified: bool = False) -> CameraReading:
    """Build the camera, for the pixels of the image as it was published.

    Region of interest and binning are applied to K: column u of the full sensor becomes
    (u - x_offset + 1/2) / binning - 1/2, which keeps pixel centres at integers.

    Args:
        message: a decoded CameraInfo.
        topic: its name, for the warnings.
        rectified: the image topic is rectified, so P applies and there is no distortion.
    """
    upper = "K" in message
    matrix = message.numbers("K" if upper else "k", 9).reshape(3, 3)
    projection = message.numbers("P" if upper else "p", 12).reshape(3, 4)
    distortion = message.numbers("D" if upper else "d", message.count("D" if upper else "d"))
    model_name = message.text("distortion_model").strip().lower()
    if rectified and projection[0, 0] > 0:
        matrix, distortion, model_name = projection[:, :3].copy(), np.zeros(0), ""
    if not (matrix[0, 0] > 0 and matrix[1, 1] > 0 and np.all(np.isfinite(matrix))):
        return _none(topic, "camera-uncalibrated", "has no focal length: the camera was never calibrated")
    model = _model(model_name, distortion)
    if isinstance(model, str):
        return _none(topic, "camera-model", model)
    matrix, width, height = _published(message, matrix)
    if width < 1 or height < 1:
        return _none(topic, "camera-size", f"gives an image size of {width} x {height} pixels")
    name, coefficients = model
    try:
        return CameraReading(Camera(name, width, height, matrix, coefficients))
    except ValueError as error:
        return _none(topic, "camera-model", f"cannot be used: {error}")


def _none(topic: str, code: str, what: str) -> CameraReading:
    hint = "give the intrinsics with --camera FILE, or estimate them with cocalib intrinsics"
    return CameraReading(None, (DataWarning(code, f"{topic} {what}", hint),))


def _model(name: str, distortion: np.ndarray) -> "tuple[CameraModel, np.ndarray] | str":
    """Return the lens model and its coefficients, or a phrase saying what is wrong."""
    count = len(distortion)
    if not np.all(np.isfinite(distortion)):
        return "has distortion coefficients that are not numbers"
    if name in _FISHEYE:
        if count < 4 or np.any(distortion[4:]):
            return f"has lens model '{name}' with {count} coefficients; 4 are expected"
        return "equidistant", distortion[:4]
    if name not in _BROWN_CONRADY:
        return f"has unknown lens model '{name}'; plumb_bob, rational_polynomial and equidistant are supported"
    if not np.any(distortion):
        return "pinhole", np.zeros(0)
    if count in (4, 5):
        return "plumb_bob", distortion
    if count >= 8 and not np.any(distortion[8:]):
        return "rational_polynomial", distortion[:8]
    return f"has lens model '{name or 'none'}' with {count} coefficients; 4, 5 or 8 are supported"


def _published(message: Message, matrix: Matrix33) -> tuple[Matrix33, int, int]:
    """Convert K and size of the full sensor to those of the published image."""
    width, height = message.whole("width"), message.whole("height")
    binning = np.array([max(message.whole("binning_x"), 1), max(message.whole("binning_y"), 1)], dtype=np.float64)
    offset = np.zeros(2)
    roi = message.message("roi")
    if roi.whole("width") and roi.whole("height"):
        offset = np.array([roi.whole("x_offset"), roi.whole("y_offset")], dtype=np.float64)
        width, height = roi.whole("width"), roi.whole("height")
    adjusted = matrix.copy()
    adjusted[:2, :2] /= binning[:, None]
    adjusted[:2, 2] = (matrix[:2, 2] - offset + 0.5) / binning - 0.5
    return adjusted, int(width // binning[0]), int(height // binning[1])
