"""Read the recorded intrinsics (sensor_msgs/CameraInfo) and check them against the images."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from calib_core.camera import Camera, CameraModel
from calib_core.errors import RecordingError, word_list
from calib_core.lens_models.registry import LENS_MODELS, lenses_of_opencv, names_in, opencv_lens
from calib_core.measurements import DataWarning
from calib_core.recordings.camera.image_stream import ImageStream
from calib_core.recordings.messages.decoding import Message
from calib_core.recordings.messages.definitions import Definition
from calib_core.recordings.topics import Topic

_WITHOUT_DISTORTION = ("pinhole", "none", "rectified", "perspective", "undistorted", "no_distortion")
"""Names in messages of a lens without distortion, whose coefficients must say the same."""


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

    Region of interest and binning are applied to K.

    Args:
        message: a decoded CameraInfo.
        topic: its name, for the warnings.
        rectified: the image topic is rectified, so P applies and there is no distortion.
    """
    upper = "K" in message
    matrix = message.numbers("K" if upper else "k", 9).reshape(3, 3)
    projection = message.numbers("P" if upper else "p", 12).reshape(3, 4)
    distortion = message.numbers("D" if upper else "d", message.count("D" if upper else "d"))
    model_name = re.sub(r"[\W_]+", "_", message.text("distortion_model").strip().lower())
    if rectified and projection[0, 0] > 0:
        matrix, distortion, model_name = projection[:, :3].copy(), np.zeros(0), ""
    if not (matrix[0, 0] > 0 and matrix[1, 1] > 0 and np.all(np.isfinite(matrix))):
        return _none(topic, "camera-uncalibrated", "has no focal length: the camera was never calibrated")
    model = _model(model_name, distortion)
    if isinstance(model, str):
        return _none(topic, "camera-model", model)
    offset_px, size_px, binning = _window(message)
    if size_px[0] < binning[0] or size_px[1] < binning[1]:
        return _none(topic, "camera-size", f"gives an image size of {size_px[0]} x {size_px[1]} pixels")
    name, coefficients = model
    try:
        camera = Camera(name, *size_px, matrix, coefficients)
        return CameraReading(camera.windowed(offset_px, size_px, binning))
    except ValueError as error:
        return _none(topic, "camera-model", f"cannot be used: {error}")


def _none(topic: str, code: str, what: str) -> CameraReading:
    hint = "give the intrinsics with --camera FILE: camera_info YAML, OpenCV YAML or XML, Kalibr camchain, JSON"
    return CameraReading(None, (DataWarning.reported(code, f"{topic} {what}", hint),))


def _model(name: str, distortion: np.ndarray) -> "tuple[CameraModel, np.ndarray] | str":
    """Return the lens model and its coefficients, or a phrase saying what is wrong."""
    if not np.all(np.isfinite(distortion)):
        return "has distortion coefficients that are not numbers"
    if name in _WITHOUT_DISTORTION and not np.any(distortion):
        name = ""
    lens = next((lens for lens in LENS_MODELS.values() if name in lens.names_in_messages), None)
    if lens is None:
        return f"has unknown lens model '{name}'; {word_list(names_in('camera_info'))} are supported"
    if lens.opencv == "projectPoints":
        return _model_by_count(name, distortion)
    kept = next((count for count in reversed(lens.counts) if count <= len(distortion)), None)
    if kept is None or np.any(distortion[kept:]):
        expected = word_list([str(count) for count in lens.counts], "or")
        return f"has lens model '{name}' with {len(distortion)} coefficients; {expected} are expected"
    return lens.name, distortion[:kept]


def _model_by_count(name: str, distortion: np.ndarray) -> "tuple[CameraModel, np.ndarray] | str":
    """Use the number of coefficients alone, as OpenCV does: drivers mix up the names of these lens models."""
    if not np.any(distortion):
        return opencv_lens(0).name, np.zeros(0)
    lenses = lenses_of_opencv()
    longest = lenses[-1].counts[-1]
    if not np.any(distortion[longest:]):
        distortion = distortion[:longest]
    lens = next((lens for lens in lenses if len(distortion) in lens.counts), None)
    if lens is None:
        known = word_list([str(count) for lens in lenses for count in lens.counts if count], "or")
        return f"has lens model '{name or 'none'}' with {len(distortion)} coefficients; {known} are supported"
    return lens.name, distortion


def _window(message: Message) -> tuple[tuple[int, int], tuple[int, int], tuple[int, int]]:
    """Return offset, size and binning of the part of the full sensor that was published."""
    binning = max(message.whole("binning_x"), 1), max(message.whole("binning_y"), 1)
    roi = message.message("roi")
    if roi.whole("width") and roi.whole("height"):
        return (roi.whole("x_offset"), roi.whole("y_offset")), (roi.whole("width"), roi.whole("height")), binning
    return (0, 0), (message.whole("width"), message.whole("height")), binning


class PublishedCamera(Protocol):
    """Intrinsics that stand in a file beside the images."""

    @property
    def file(self) -> Path:
        """The file."""

    @property
    def doubt(self) -> str:
        """What is not certain about them; "" if nothing."""

    def camera(self, image_size_px: tuple[int, int]) -> Camera:
        """Return the camera; raises ValueError if the numbers are not a camera's."""


def published_camera(published: PublishedCamera, images: ImageStream) -> tuple[Camera | None, list[DataWarning]]:
    """Read the intrinsics of a data set and check them against the images.

    Args:
        published: what the data set states.
        images: the image stream.
    """
    hint = "give the intrinsics with --camera FILE"
    try:
        camera = published.camera(images.size_px(0))
    except (ValueError, RecordingError) as error:
        return None, [DataWarning.reported("camera-unreadable", f"{published.file}: {error}", hint)]
    warnings = (
        [DataWarning.reported("camera-changes", f"{published.file}: {published.doubt}", hint)]
        if published.doubt
        else []
    )
    return _fitted(camera, images, str(published.file), warnings)


def recorded_camera(topic: Topic | None, images: ImageStream | None) -> tuple[Camera | None, list[DataWarning]]:
    """Read the intrinsics and check them against the images.

    Args:
        topic: the camera-info topic, if any.
        images: the image stream, if any.
    """
    if topic is None or not len(topic):
        return None, []
    try:
        reading, other = (_reading(topic, row, images) for row in (0, len(topic) - 1))
    except RecordingError as error:
        return None, [DataWarning.reported("camera-unreadable", str(error), "give the intrinsics with --camera FILE")]
    warnings = list(reading.warnings)
    if reading.camera is None:
        return None, warnings
    if other.camera is None or not np.array_equal(other.camera.matrix_px, reading.camera.matrix_px):
        warnings.append(
            DataWarning.reported(
                "camera-changes",
                f"{topic.name} has different intrinsics at its beginning and end; the first are used",
                "disable autofocus and zoom, or give the intrinsics with --camera FILE",
            )
        )
    if images is None or not len(images.times_ns):
        return reading.camera, warnings
    return _fitted(reading.camera, images, topic.name, warnings)


def _reading(topic: Topic, row: int, images: ImageStream | None) -> CameraReading:
    rectified = images is not None and "rect" in images.topic.name.rpartition("/image")[2]
    return camera_from_info(topic.message(row), topic=topic.name, rectified=rectified)


def _fitted(
    camera: Camera, images: ImageStream, name: str, warnings: list[DataWarning]
) -> tuple[Camera | None, list[DataWarning]]:
    """Scale the camera if its images are resized; refuse it if their aspect ratio differs."""
    try:
        width, height = images.size_px(0)
    except RecordingError:
        return camera, warnings
    if (camera.width_px, camera.height_px) == (width, height):
        return camera, warnings
    sizes = f"{name} is for {camera.width_px} x {camera.height_px} pixels, the images have {width} x {height}"
    if abs(camera.width_px * height - camera.height_px * width) <= 0.005 * camera.width_px * height:
        scaled = camera.scaled(width / camera.width_px)
        fitted = Camera(scaled.model, width, height, scaled.matrix_px, scaled.distortion)
        hint = "this is correct for resized images; for cropped images give the intrinsics with --camera FILE"
        return fitted, [*warnings, DataWarning.reported("camera-scaled", f"{sizes}: the intrinsics were scaled", hint)]
    hint = "give the intrinsics of these images with --camera FILE"
    return None, [*warnings, DataWarning.reported("camera-size", f"{sizes}: the intrinsics cannot be used", hint)]
