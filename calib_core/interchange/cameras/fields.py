"""Find the cameras in a file's parsed values; ROS, OpenCV, Kalibr and CameraInfo each use their own keys."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.own.camera_document import camera_of
from calib_core.interchange.own.documents import CameraDocument
from calib_core.interchange.syntax.strict_json import checked
from calib_core.lens_models.naming import lenses_named, opencv_lens
from calib_core.lens_models.registry import LENS_MODELS

__all__ = ["FoundCamera", "find_cameras", "floats", "lens_model_named"]

_MATRIX_KEYS = {  # key of the camera matrix -> keys of the distortion
    "camera_matrix": ("distortion_coefficients", "dist_coeffs", "distortion_coeffs", "dist_coeff"),
    "Camera_Matrix": ("Distortion_Coefficients",),
    "cameraMatrix": ("distCoeffs",),
    "intrinsic_matrix": ("distortion", "distortion_coefficients"),
    "K": ("D",),
    "k": ("d",),
}
_LARGEST = 1e9
_WIDTH_KEYS = ("image_width", "image_Width", "width", "width_px")
_HEIGHT_KEYS = ("image_height", "image_Height", "height", "height_px")


@dataclass(frozen=True, slots=True, eq=False)
class FoundCamera:
    """What a file says about one camera, before any check.

    Attributes:
        name: its key in the file.
        model: our name for its lens model; "" if the file implies it by the number of coefficients.
        matrix_px: (9,) row-major.
        distortion: the coefficients, as many as the file has.
        size_px: width and height; None if the file does not state them.
    """

    name: str
    model: str
    matrix_px: tuple[float, ...]
    distortion: tuple[float, ...]
    size_px: tuple[int, int] | None

    def camera(self, *, image_size_px: tuple[int, int] | None, source: str) -> Camera:
        """Return the camera.

        Raises:
            InputError: the image size is missing, or a parameter is invalid.
        """
        size = self.size_px or image_size_px
        if size is None:
            raise InputError(
                f"{source}: {self.name}: the image size is missing; add image_width and image_height to the file"
            )
        model, distortion = self.lens(source=source)
        try:
            return Camera(model, *size, np.reshape(self.matrix_px, (3, 3)), np.array(distortion))
        except ValueError as error:
            raise InputError(f"{source}: {self.name}: {error}; correct it or calibrate the camera again") from None

    def lens(self, *, source: str) -> tuple[str, tuple[float, ...]]:
        """Return the lens model and its coefficients.

        Raises:
            InputError: the model does not take that number of coefficients.
        """
        return _lens(self.model, self.distortion, source=source, name=self.name)


def find_cameras(content: Mapping[str, Any], *, source: str) -> tuple[FoundCamera, ...]:
    """Find every camera in a file's values, in file order.

    Raises:
        InputError: a camera is incomplete, or a value is not a number.
    """
    ours = _our_camera(content, source=source)
    if ours:
        return (ours,)
    kalibr = [key for key, value in content.items() if isinstance(value, Mapping) and "intrinsics" in value]
    if kalibr:
        return tuple(_kalibr_camera(key, content[key], source=source) for key in kalibr)
    for matrix_key, distortion_keys in _MATRIX_KEYS.items():
        if matrix_key in content:
            return (_flat_camera(content, matrix_key, distortion_keys, source=source),)
    if isinstance(content.get("CameraCalibration"), Mapping):
        return find_cameras(content["CameraCalibration"], source=source)
    numbered = [match for key in content if (match := re.fullmatch(r"(?:M|K|cameraMatrix)(\d)", str(key)))]
    return tuple(
        _flat_camera(content, match[0], (f"D{match[1]}", f"distCoeffs{match[1]}"), source=source) for match in numbered
    )


def _our_camera(content: Mapping[str, Any], *, source: str) -> FoundCamera | None:
    """Read the camera of pairs-1 or calibration-1, or a camera object on its own."""
    nested = isinstance(content.get("camera"), Mapping)
    inner = content["camera"] if nested else content
    if not {"matrix_px", "width_px", "height_px"} & set(inner):
        return None
    document = checked(inner, CameraDocument, source=source, place="camera" if nested else "")
    camera = camera_of(document, source=source)
    return FoundCamera(
        name="camera",
        model=camera.model,
        matrix_px=tuple(camera.matrix_px.ravel().tolist()),
        distortion=tuple(camera.distortion.tolist()),
        size_px=(camera.width_px, camera.height_px),
    )


def _flat_camera(
    content: Mapping[str, Any], matrix_key: str, distortion_keys: tuple[str, ...], *, source: str
) -> FoundCamera:
    """Read the flat layouts, which have matrix, distortion and size at one level: ROS, OpenCV, CameraInfo."""
    distortion = next((content[key] for key in distortion_keys if content.get(key) is not None), ())
    model = str(content.get("distortion_model") or content.get("model") or "")
    if str(content.get("fisheye_model", "0")).lower() in ("1", "true"):
        model = "fisheye"
    _refuse_crop(content, source=source)
    return FoundCamera(
        name=matrix_key,
        model=lens_model_named(model, source=source),
        matrix_px=_matrix(content[matrix_key], source=source, place=matrix_key),
        distortion=floats(distortion, source=source, place=distortion_keys[0]),
        size_px=_size(content, source=source),
    )


def _kalibr_camera(key: str, block: Mapping[str, Any], *, source: str) -> FoundCamera:
    if block.get("camera_model", "pinhole") != "pinhole":
        raise InputError(
            f"{source}: {key}.camera_model: {block['camera_model']!r} is not supported; "
            "calibrate with pinhole-radtan or pinhole-equi"
        )
    intrinsics = floats(block["intrinsics"], source=source, place=f"{key}.intrinsics", length=4)
    fu, fv, pu, pv = intrinsics
    size = floats(block.get("resolution", ()), source=source, place=f"{key}.resolution")
    if len(size) not in (0, 2):
        raise InputError(
            f"{source}: {key}.resolution: expected width and height, found {len(size)} numbers; correct it"
        )
    return FoundCamera(
        name=key,
        model=lens_model_named(str(block.get("distortion_model", "")), source=source),
        matrix_px=(fu, 0.0, pu, 0.0, fv, pv, 0.0, 0.0, 1.0),
        distortion=floats(block.get("distortion_coeffs", ()), source=source, place=f"{key}.distortion_coeffs"),
        size_px=(int(size[0]), int(size[1])) if size else None,
    )


def _refuse_crop(content: Mapping[str, Any], *, source: str) -> None:
    """Refuse a camera matrix that does not belong to the recorded picture (REP-104)."""
    roi = content.get("roi")
    cropped = isinstance(roi, Mapping) and any(roi.get(key) for key in ("x_offset", "y_offset"))
    if cropped or any(content.get(key) not in (None, 0, 1) for key in ("binning_x", "binning_y")):
        raise InputError(
            f"{source}: binning or a region of interest is set; give the intrinsics of the recorded picture"
        )


def lens_model_named(name: str, *, source: str) -> str:
    """Return our name for a lens model as a file names it; "" if the file does not.

    Raises:
        InputError: it is not supported.
    """
    if not name:
        return ""
    models = {known: lens.name for lens in LENS_MODELS.values() for known in lens.names_in_files}
    if name.lower() not in models:
        raise InputError(f"{source}: the lens model {name!r} is not supported; known: {', '.join(models)}")
    return models[name.lower()]


def _lens(model: str, distortion: tuple[float, ...], *, source: str, name: str) -> tuple[str, tuple[float, ...]]:
    """Determine model and coefficients: an unnamed model follows from their number as in OpenCV; surplus zeros are dropped."""
    lens = LENS_MODELS[model] if model else opencv_lens(len(distortion))
    if not distortion:  # ROS also calls a pinhole plumb_bob
        lens = next((bare for bare in lenses_named("camera_info", lens.name) if 0 in bare.counts), lens)
    longest = lens.counts[-1]
    if len(distortion) > longest and not any(distortion[longest:]):
        distortion = distortion[:longest]
    if len(distortion) not in lens.counts:
        wanted = " or ".join(map(str, lens.counts))
        raise InputError(
            f"{source}: {name}: {lens.name} takes {wanted} distortion coefficients, found {len(distortion)} "
            "(thin prism and tilt are not supported); calibrate the camera with that model"
        )
    return lens.name, distortion


def _size(content: Mapping[str, Any], *, source: str) -> tuple[int, int] | None:
    width = next((content[key] for key in _WIDTH_KEYS if content.get(key)), None)
    height = next((content[key] for key in _HEIGHT_KEYS if content.get(key)), None)
    if width is None or height is None:
        return None
    w, h = floats([width, height], source=source, place="image size")
    return int(w), int(h)


def _matrix(value: Any, *, source: str, place: str) -> tuple[float, ...]:
    return floats(value, source=source, place=place, length=9)


def floats(value: Any, *, source: str, place: str, length: int | None = None) -> tuple[float, ...]:
    """Return the finite numbers in a list, a list of rows, or an OpenCV or ROS matrix, row by row.

    Raises:
        InputError: an entry is not a finite number, or there are too few or too many.
    """
    if isinstance(value, Mapping):
        value = value.get("data", ())
    flat: list[float] = []
    for item in value if isinstance(value, list | tuple) else [value]:
        for number in item if isinstance(item, list | tuple) else [item]:
            flat.append(_number(number, source=source, place=place))
    if length is not None and len(flat) != length:
        raise InputError(f"{source}: {place}: expected {length} numbers, found {len(flat)}; correct it")
    return tuple(flat)


def _number(value: Any, *, source: str, place: str) -> float:
    try:
        number = float("nan") if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not abs(number) <= _LARGEST:
        raise InputError(f"{source}: {place}: {str(value)[:60]!r} is not a valid number; correct it")
    return number
