"""Find the cameras in a file's parsed values; ROS, OpenCV, Kalibr and CameraInfo each use their own keys."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from calib_core.camera import CameraCovariance
from calib_core.errors import InputError
from calib_core.interchange.cameras.camera_format import FoundCamera, ImageWindow, found_or_refused
from calib_core.interchange.own.documents import CameraDocument, camera_of
from calib_core.interchange.syntax.strict_json import checked
from calib_core.lens_models.registry import LENS_MODELS

_MATRIX_KEYS = {  # key of the camera matrix -> keys of the distortion
    "camera_matrix": ("distortion_coefficients", "dist_coeffs", "distortion_coeffs", "dist_coeff"),
    "Camera_Matrix": ("Distortion_Coefficients",),
    "cameraMatrix": ("distCoeffs",),
    "CameraMat": ("DistCoeff",),
    "mtx": ("dist", "dist_coeffs", "distortion"),
    "intrinsic_matrix": ("distortion", "distortion_coefficients"),
    "K": ("D",),
    "k": ("d",),
}
_WIDTH_KEYS = ("image_width", "image_Width", "width", "width_px")
_HEIGHT_KEYS = ("image_height", "image_Height", "height", "height_px")


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
        return tuple(found_or_refused(key, partial(kalibr_camera, key, content[key], source=source)) for key in kalibr)
    for matrix_key, distortion_keys in _MATRIX_KEYS.items():
        if matrix_key in content:
            return (_flat_camera(content, matrix_key, distortion_keys, source=source),)
    if isinstance(content.get("CameraCalibration"), Mapping):
        return find_cameras(content["CameraCalibration"], source=source)
    if isinstance(content.get("sensors"), list):
        return tuple(_sensor_camera(row, source=source) for row in content["sensors"] if _has_matrix(row))
    named = {"camera": content} if _names_focal_lengths(content) else content
    blocks = [key for key, block in named.items() if _names_focal_lengths(block)]
    if blocks:
        return tuple(replace(_named_numbers(named[key], source=source), name=str(key)) for key in blocks)
    numbered = [match for key in content if (match := re.fullmatch(r"(?:M|K|cameraMatrix)(\d)", str(key)))]
    return tuple(
        _flat_camera(content, match[0], (f"D{match[1]}", f"distCoeffs{match[1]}"), source=source) for match in numbered
    )


def _names_focal_lengths(block: Any) -> bool:
    return isinstance(block, Mapping) and {"fx", "fy"} <= set(block)


def _has_matrix(row: Any) -> bool:
    """Return whether a row of Astyx' list of sensors is a camera's."""
    return isinstance(row, Mapping) and isinstance(row.get("calib_data"), Mapping) and "K" in row["calib_data"]


def _sensor_camera(row: Mapping[str, Any], *, source: str) -> FoundCamera:
    name = str(row.get("sensor_uid"))
    return FoundCamera(name, "pinhole", _matrix(row["calib_data"]["K"], source=source, place=f"{name}.K"), (), None)


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
        covariance=camera.covariance,
    )


def _flat_camera(
    content: Mapping[str, Any], matrix_key: str, distortion_keys: tuple[str, ...], *, source: str
) -> FoundCamera:
    """Read the flat layouts, which have matrix, distortion and size at one level: ROS, OpenCV, CameraInfo."""
    distortion = next((content[key] for key in distortion_keys if content.get(key) is not None), ())
    model = str(content.get("distortion_model") or content.get("model") or content.get("DistModel") or "")
    if str(content.get("fisheye_model", "0")).lower() in ("1", "true"):
        model = "fisheye"
    coefficients = floats(distortion, source=source, place=distortion_keys[0])
    return FoundCamera(
        name=matrix_key,
        model=lens_model_named(
            "none" if model.lower() == "rectified" and not any(coefficients) else model, source=source
        ),
        matrix_px=_matrix(content[matrix_key], source=source, place=matrix_key),
        distortion=coefficients,
        size_px=_size(content, source=source),
        covariance=_covariance(content, source=source),
        window=_window(content, source=source),
    )


def _named_numbers(content: Mapping[str, Any], *, source: str) -> FoundCamera:
    """Read fx, fy and the principal point under their own names, as cameras' software writes them."""
    centre = [next((content[key] for key in keys if key in content), None) for keys in (("cx", "ppx"), ("cy", "ppy"))]
    fx, fy, cx, cy = floats([content["fx"], content["fy"], *centre], source=source, place="fx, fy, cx (ppx), cy (ppy)")
    given = next(
        (content[key] for key in ("coeffs", "distortion", "D", "dist_coeffs", "disto") if key in content), None
    )
    if given is None:
        named = [content.get(key, 0.0) for key in ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")]
        given = named[: 8 if any(named[5:]) else 5] if "k1" in content else ()
    distortion = floats(given, source=source, place="coeffs")
    model = str(content.get("model") or content.get("distortion_model") or "").removeprefix("distortion.").lower()
    if "inverse" in model and any(distortion):
        raise InputError(
            f"{source}: the lens model {model!r} maps from distorted to ideal points, which no other tool does; "
            "calibrate the camera with a board"
        )
    plain = "inverse" in model or model in ("none", "") or not any(distortion)
    return FoundCamera(
        name="camera",
        model="" if plain else lens_model_named(model, source=source),
        matrix_px=(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0),
        distortion=distortion if any(distortion) else (),
        size_px=_size(content, source=source),
    )


def kalibr_camera(key: str, block: Mapping[str, Any], *, source: str) -> FoundCamera:
    """Read a camera of Kalibr's chain by its key.

    Raises:
        InputError: it is no pinhole, or a number is missing.
    """
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


def _window(content: Mapping[str, Any], *, source: str) -> ImageWindow | None:
    """Return the part of the sensor that was published, for K of the full one (REP 104); None for all of it."""
    roi = content.get("roi") if isinstance(content.get("roi"), Mapping) else {}
    numbers = [_count(roi, key, source=source) for key in ("x_offset", "y_offset", "width", "height")]
    binning = tuple(max(1, _count(content, key, source=source)) for key in ("binning_x", "binning_y"))
    x, y, width, height = numbers
    if bool(width) != bool(height):
        raise InputError(f"{source}: roi: width {width} and height {height}: state both, or 0 for the whole image")
    if not any(numbers) and binning == (1, 1):
        return None
    return ImageWindow((x, y), (width, height) if width else None, (binning[0], binning[1]))


def _count(content: Any, key: str, *, source: str) -> int:
    (number,) = floats([content.get(key) or 0], source=source, place=key)
    if number < 0 or number != int(number):
        raise InputError(f"{source}: {key}: {number:g} is not a number of pixels; correct it")
    return int(number)


def _covariance(content: Mapping[str, Any], *, source: str) -> CameraCovariance | None:
    """Read the covariance of the intrinsics from the keys that we add to ROS YAML."""
    order = content.get("camera_covariance_order")
    if order is None:
        return None
    names = tuple(str(name) for name in order) if isinstance(order, list) else ()
    numbers = floats(
        content.get("camera_covariance", ()), source=source, place="camera_covariance", length=len(names) ** 2
    )
    try:
        return CameraCovariance(names, np.reshape(numbers, (len(names), len(names))))
    except ValueError as error:
        raise InputError(f"{source}: camera_covariance: {error}; leave it out or correct it") from None


def lens_model_named(name: str, *, source: str) -> str:
    """Return our name for a lens model as a file names it, such as plumb_bob, "Plumb Bob" or plumb'bob; "" if it does not.

    Raises:
        InputError: it is not supported.
    """
    models = {"": "", **{known: lens.name for lens in LENS_MODELS.values() for known in lens.names_in_files}}
    spelt = re.sub(r"[\W_]+", "_", name.strip().lower())
    if spelt not in models:
        raise InputError(
            f"{source}: the lens model {name!r} is not supported; known: {', '.join(filter(None, models))}"
        )
    return models[spelt]


def _size(content: Mapping[str, Any], *, source: str) -> tuple[int, int] | None:
    width = next((content[key] for key in _WIDTH_KEYS if content.get(key)), None)
    height = next((content[key] for key in _HEIGHT_KEYS if content.get(key)), None)
    if width is None or height is None:
        return None
    w, h = floats([width, height], source=source, place="image size")
    return int(w), int(h)


def _matrix(value: Any, *, source: str, place: str) -> tuple[float, ...]:
    numbers = floats(value, source=source, place=place)
    if len(numbers) == 12:  # a projection K [I | 0]
        numbers = (*numbers[0:3], *numbers[4:7], *numbers[8:11])
    return floats(numbers, source=source, place=place, length=9)


_LARGEST = 1e9


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


def named_numbers(block: Any, keys: Sequence[str], *, source: str, place: str) -> tuple[float, ...]:
    """Return the numbers under some keys of a mapping, in the order of the keys.

    Raises:
        InputError: it is no mapping, or a number is missing.
    """
    if not isinstance(block, Mapping):
        raise InputError(f"{source}: {place}: missing; add it, with {', '.join(keys)}")
    return tuple(floats(block.get(key), source=source, place=f"{place}.{key}", length=1)[0] for key in keys)


def _number(value: Any, *, source: str, place: str) -> float:
    try:
        number = float("nan") if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not abs(number) <= _LARGEST:
        raise InputError(f"{source}: {place}: {str(value)[:60]!r} is not a valid number; correct it")
    return number
