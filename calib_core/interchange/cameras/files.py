"""Read a camera from the file formats in common use, and write ROS camera_info YAML."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import file_text, read_input
from calib_core.interchange.cameras.fields import FoundCamera, find_cameras
from calib_core.interchange.syntax.opencv_xml import load_opencv_xml
from calib_core.interchange.syntax.strict_json import json_object
from calib_core.interchange.syntax.yaml_text import load_yaml, numbers_text, quoted
from calib_core.lens_models.naming import written_lens

__all__ = ["CameraFile", "camera_info_text", "read_camera", "read_camera_file"]

_MAX_BYTES = 512 * 1024 * 1024
_LOOKED_FOR = (
    "looked for camera_matrix and image_width (ROS, OpenCV), cam0 with intrinsics (Kalibr), K and D (CameraInfo), "
    "model and matrix_px (cocalib)"
)


def read_camera(
    text: str, source: str = "camera", *, name: str | None = None, image_size_px: tuple[int, int] | None = None
) -> Camera:
    """Read a camera from ROS camera_info YAML, OpenCV FileStorage YAML or XML, Kalibr camchain, or our own JSON.

    Args:
        text: the file's content.
        source: the name of the file in error messages.
        name: which camera, if the file has several ("cam1", "M2"); None if it has one.
        image_size_px: width and height, used if the file does not state them.

    Raises:
        InputError: no camera, or an invalid one; the message says what was looked for, what was found and what to do.
    """
    content = _load(text, source=source)
    cameras = find_cameras(content, source=source) if isinstance(content, dict) else ()
    if not cameras:
        found = ", ".join(map(str, list(content)[:12])) if isinstance(content, dict) else type(content).__name__
        raise InputError(f"{source}: no camera in it: {_LOOKED_FOR}; found {found or 'nothing'}")
    return _chosen(cameras, name, source=source).camera(image_size_px=image_size_px, source=source)


@dataclass(frozen=True, slots=True)
class CameraFile:
    """A file with a camera, as it was given: its content can be read as often as needed, and identified.

    Attributes:
        source: its path or name, for error messages.
        data: its content.
        name: which of its cameras; None if it has one.
    """

    source: str
    data: bytes
    name: str | None = None

    @classmethod
    def read(cls, path: str | Path) -> "CameraFile":
        """Read a file; "file.yml#cam1" selects one of its cameras.

        Raises:
            InputError: it cannot be read.
        """
        file, name = Path(path), None
        if not file.exists() and "#" in str(path):
            head, _, name = str(path).rpartition("#")
            file = Path(head)
        try:
            return cls(str(file), read_input(file, max_bytes=_MAX_BYTES, is_what="a camera file"), name)
        except OSError as error:
            raise InputError(f"{file}: cannot be read ({error.strerror or error}); check the path") from None

    def camera(self, *, image_size_px: tuple[int, int] | None = None) -> Camera:
        """Return the camera.

        Args:
            image_size_px: width and height, used if the file does not state them.

        Raises:
            InputError: there is no camera in it.
        """
        try:
            text = file_text(self.data)
        except UnicodeDecodeError:
            raise InputError(f"{self.source}: not a text file; {_LOOKED_FOR}") from None
        return read_camera(text, self.source, name=self.name, image_size_px=image_size_px)


def read_camera_file(path: str | Path, *, image_size_px: tuple[int, int] | None = None) -> Camera:
    """Read a camera from a file; "file.yml#cam1" selects one of several.

    Raises:
        InputError: the file cannot be read, or contains no camera.
    """
    return CameraFile.read(path).camera(image_size_px=image_size_px)


def camera_info_text(camera: Camera, name: str = "camera") -> str:
    """Write ROS camera_info YAML (as camera_calibration does), which image pipelines and `--camera` read.

    Raises:
        InputError: ROS has no name for this lens.
    """
    lens = written_lens(camera.lens, camera.distortion, "camera_info")
    projection = np.hstack([camera.matrix_px, np.zeros((3, 1))])
    return "\n".join(
        [
            f"image_width: {camera.width_px}",
            f"image_height: {camera.height_px}",
            f"camera_name: {quoted(name)}",
            *_ros_matrix("camera_matrix", camera.matrix_px),
            f"distortion_model: {lens.name}",
            *_ros_matrix("distortion_coefficients", np.array([lens.coefficients])),
            *_ros_matrix("rectification_matrix", np.eye(3)),
            *_ros_matrix("projection_matrix", projection),
            "",
        ]
    )


def _ros_matrix(key: str, matrix: np.ndarray) -> list[str]:
    rows, columns = matrix.shape
    return [f"{key}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: [{numbers_text(matrix.ravel())}]"]


def _load(text: str, *, source: str) -> Any:
    start = text.lstrip("\ufeff \t\r\n")[:1]
    if not start:
        raise InputError(f"{source}: empty; {_LOOKED_FOR}")
    if start == "{":
        return json_object(text, source=source)
    if start == "<":
        return load_opencv_xml(text, source=source)
    return load_yaml(text, source=source)


def _chosen(cameras: tuple[FoundCamera, ...], name: str | None, *, source: str) -> FoundCamera:
    names = [camera.name for camera in cameras]
    if name is not None:
        if name not in names:
            raise InputError(f"{source}: no camera {name!r} in it; it contains {', '.join(names)}")
        return cameras[names.index(name)]
    if len(cameras) > 1:
        raise InputError(
            f"{source}: contains {len(cameras)} cameras; choose one: {', '.join(f'{source}#{n}' for n in names)}"
        )
    return cameras[0]
