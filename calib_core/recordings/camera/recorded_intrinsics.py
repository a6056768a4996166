"""Read the recorded intrinsics and check them against the images."""

from pathlib import Path
from typing import Protocol

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import RecordingError
from calib_core.recordings.camera.camera_info import CameraReading, camera_from_info
from calib_core.recordings.camera.image_stream import ImageStream
from calib_core.recordings.topics import Topic
from calib_core.results import DataWarning


class PublishedCamera(Protocol):
    """Intrinsics that stand in a file beside the pictures."""

    @property
    def file(self) -> Path:
        """The file."""
        ...

    @property
    def doubt(self) -> str:
        """What is not certain about them; "" if nothing."""
        ...

    def camera(self, picture_size_px: tuple[int, int]) -> Camera:
        """Return the camera; raises ValueError if the numbers are not a camera's."""
        ...


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
        return None, [DataWarning("camera-unreadable", f"{published.file}: {error}", hint)]
    warnings = [DataWarning("camera-changes", f"{published.file}: {published.doubt}", hint)] if published.doubt else []
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
        return None, [DataWarning("camera-unreadable", str(error), "give the intrinsics with --camera FILE")]
    warnings = list(reading.warnings)
    if reading.camera is None:
        return None, warnings
    if other.camera is None or not np.array_equal(other.camera.matrix_px, reading.camera.matrix_px):
        warnings.append(
            DataWarning(
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
        return fitted, [*warnings, DataWarning("camera-scaled", f"{sizes}: the intrinsics were scaled", hint)]
    hint = "give the intrinsics of these images with --camera FILE"
    return None, [*warnings, DataWarning("camera-size", f"{sizes}: the intrinsics cannot be used", hint)]
