"""Read a camera from the file formats in common use, and write it in them."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from calib_core.camera import Camera
from calib_core.errors import InputError, meant
from calib_core.input_files import file_text, no_text, read_input
from calib_core.interchange.cameras.camera_format import CameraFormat, FoundCamera
from calib_core.interchange.cameras.colmap import COLMAP_CAMERAS, COLMAP_LINES
from calib_core.interchange.cameras.fields import find_cameras
from calib_core.interchange.cameras.kalibr import KALIBR_CHAIN
from calib_core.interchange.cameras.kitti import KITTI_CAMERAS_FILE
from calib_core.interchange.cameras.matlab import MATLAB_PARAMETERS
from calib_core.interchange.cameras.mrcal import MRCAL
from calib_core.interchange.cameras.opencv import OPENCV_NPZ, OPENCV_YAML
from calib_core.interchange.cameras.ros import ROS
from calib_core.interchange.own.documents import camera_document
from calib_core.interchange.syntax.content import readings
from calib_core.interchange.syntax.strict_json import json_text

_MAX_BYTES = 512 * 1024 * 1024
_LOOKED_FOR = (
    "looked for camera_matrix and image_width (ROS, OpenCV), cam0 with intrinsics (Kalibr), K and D (CameraInfo), "
    "fx and fy, lensmodel (mrcal), lines of COLMAP or KITTI, model and matrix_px (cocalib)"
)


def read_camera(
    text: str, source: str = "camera", *, name: str | None = None, image_size_px: tuple[int, int] | None = None
) -> Camera:
    """Read a camera from a file of any format in `written.CAMERA_FORMATS`, recognized by its content.

    Args:
        text: the file's content.
        source: the name of the file in error messages.
        name: which camera, if the file has several ("cam1", "M2"); None if it has one.
        image_size_px: width and height, used if the file does not state them.

    Raises:
        InputError: no camera, or an invalid one; the message says what was looked for, what was found and what to do.
    """
    cameras = _own_syntax(text, source=source) or _keyed(text, source=source)
    return _choose_camera(cameras, name, source=source).camera(image_size_px=image_size_px, source=source)


@dataclass(frozen=True, slots=True)
class CameraFile:
    """A file with a camera, as it was given: its content can be read as often as needed, and identified.

    Attributes:
        source: its path or name, for error messages.
        data: its content.
        name: which of its cameras; None if it has one.
        rescale: whether to scale it to images that are the calibrated ones resized.
    """

    source: str
    data: bytes
    name: str | None = None
    rescale: bool = False

    @classmethod
    def read(cls, path: str | Path, *, rescale: bool = False) -> "CameraFile":
        """Read a file; "file.yml#cam1" selects one of its cameras.

        Args:
            path: of the file.
            rescale: whether to scale the camera to images that are the calibrated ones resized.

        Raises:
            InputError: it cannot be read.
        """
        file, name = Path(path), None
        if not file.exists() and "#" in str(path):
            head, _, name = str(path).rpartition("#")
            file = Path(head)
        return cls(str(file), read_input(file, max_bytes=_MAX_BYTES, is_what="a camera file"), name, rescale)

    def camera(self, *, image_size_px: tuple[int, int] | None = None) -> Camera:
        """Return the camera.

        Args:
            image_size_px: width and height, used if the file does not state them.

        Raises:
            InputError: there is no camera in it.
        """
        binary = _own_syntax(self.data, source=self.source)
        if binary:
            found = _choose_camera(binary, self.name, source=self.source)
            camera = found.camera(image_size_px=image_size_px, source=self.source)
        else:
            try:
                text = file_text(self.data)
            except UnicodeDecodeError:
                raise InputError(f"{self.source}: {no_text(self.data, 'a camera file')}; {_LOOKED_FOR}") from None
            camera = read_camera(text, self.source, name=self.name, image_size_px=image_size_px)
        return self._rescaled(camera, image_size_px) if self.rescale and image_size_px else camera

    def _rescaled(self, camera: Camera, size_px: tuple[int, int]) -> Camera:
        """Return the camera for images of another size, if they can be the same ones, resized.

        Raises:
            InputError: their aspect ratio differs.
        """
        width, height = size_px
        if abs(camera.width_px * height - camera.height_px * width) > max(camera.width_px, camera.height_px):
            raise InputError(
                f"{self.source}: calibrated for {camera.width_px} x {camera.height_px} px; images of {width} x {height} px are "
                "not the same ones resized (another aspect ratio): calibrate the camera at this size"
            )
        scaled = camera.scaled(width / camera.width_px)
        return replace(scaled, width_px=width, height_px=height)


def read_camera_file(path: str | Path, *, image_size_px: tuple[int, int] | None = None) -> Camera:
    """Read a camera from a file; "file.yml#cam1" selects one of several.

    Raises:
        InputError: the file cannot be read, or contains no camera.
    """
    return CameraFile.read(path).camera(image_size_px=image_size_px)


def holds_camera(text: str, source: str = "camera") -> bool:
    """Return whether a text has a camera that `read_camera` finds, or several."""
    try:
        return bool(_own_syntax(text, source=source) or _keyed(text, source=source))
    except InputError:
        return False


def _own_syntax(content: str | bytes, *, source: str) -> tuple[FoundCamera, ...]:
    """Return the cameras in a file of a format with a syntax of its own; none if it is of no such format."""
    for syntax in (COLMAP_LINES, MRCAL, KITTI_CAMERAS_FILE, MATLAB_PARAMETERS, OPENCV_NPZ):
        if syntax.recognizes(content):
            return syntax.read(content, source)
    return ()


def _keyed(text: str, *, source: str) -> tuple[FoundCamera, ...]:
    """Return the cameras in a JSON, YAML or XML file by its keys.

    Raises:
        InputError: there are none.
    """
    content = _load(text, source=source)
    cameras = find_cameras(content, source=source) if isinstance(content, dict) else ()
    if not cameras:
        found = ", ".join(map(str, list(content)[:12])) if isinstance(content, dict) else "no keys, such as fx: 500"
        raise InputError(f"{source}: no camera in it: {_LOOKED_FOR}; found {found or 'nothing'}")
    return cameras


def _load(text: str, *, source: str) -> Any:
    """Return the values of JSON, YAML or FileStorage XML; None of other XML."""
    text = text.lstrip("\ufeff \t\r\n")
    if not text:
        raise InputError(f"{source}: empty; {_LOOKED_FOR}")
    try:
        return [reading.value for reading in readings(text, source=source)][-1]
    except InputError as error:
        raise error if text[0] in "{<" else InputError(f"{error}; {_LOOKED_FOR}") from None


def _choose_camera(cameras: tuple[FoundCamera, ...], name: str | None, *, source: str) -> FoundCamera:
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


def _write(camera: Camera, _name: str) -> str:
    return json_text(msgspec.to_builtins(camera_document(camera)))


OWN_JSON = CameraFormat("json", ".json", _write)


CAMERA_FORMATS: dict[str, CameraFormat] = {
    one.name: one
    for one in (
        ROS,
        KALIBR_CHAIN,
        OPENCV_YAML,
        COLMAP_CAMERAS,
        OWN_JSON,
    )
}
"""By name, in display order."""


def camera_content(camera: Camera, to: str, name: str = "camera") -> str:
    """Return the content of a file with a camera's intrinsics.

    Args:
        camera: the intrinsics.
        to: name of the format, one of CAMERA_FORMATS.
        name: of the camera, for formats that state one.

    Raises:
        InputError: there is no such format, or it cannot store this camera.
    """
    if to not in CAMERA_FORMATS:
        raise InputError(f"no format {to!r} for intrinsics; {meant(to, CAMERA_FORMATS)}")
    form = CAMERA_FORMATS[to]
    return form.write(camera, name) + form.ending
