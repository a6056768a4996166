"""Camera poses in the files of labeling services: Scale AI (frames and camera extrinsics) and Segments.ai (images)."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.cameras.camera_format import FoundCamera, with_camera
from calib_core.interchange.cameras.fields import floats, named_numbers
from calib_core.interchange.format import ImportedCalibration, Reads, WrittenPose
from calib_core.interchange.pose_parts import pinhole_matrix, rigid
from calib_core.interchange.syntax.content import Content

_AS_RADAR = "the sensor that the file calls {} is taken to be the radar, x forward, y left, z up"
_OPENGL_FROM_OPTICAL = RigidTransform(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
_BROWN = ("k1", "k2", "p1", "p2", "k3")
_FISHEYE = ("k1", "k2", "k3", "k4")
_OTHERS = ("k4", "k5", "k6", "lx", "ly", "xi")


def _images(content: Content) -> list[Mapping[str, Any]]:
    """Return the images of a sample or frame, which may be alone or inside "attributes"."""
    top = content.json_mapping
    inner = top.get("attributes")
    sample = inner if isinstance(inner, Mapping) else top
    images = sample.get("images")
    return [image for image in (images if isinstance(images, list) else [top]) if isinstance(image, Mapping)]


def _choose_sensor(images: list[Mapping[str, Any]], key: str, *, source: str) -> Mapping[str, Any]:
    posed = [image for image in images if key in image]
    if len(posed) != 1:
        raise InputError(f"{source}: images: {len(posed)} cameras with a pose; keep only the intended one")
    return posed[0]


def _recognizes_scale(content: Content) -> bool:
    return any({"position", "heading"} <= set(image) for image in _images(content))


def _read_scale(content: Content, source: str) -> ImportedCalibration:
    """Read a frame, whose cameras and device are posed in the world, or a camera's extrinsics in the device.

    Raises:
        InputError: there are several cameras, the device's pose is missing, or a number is.
    """
    image = _choose_sensor(_images(content), "heading", source=source)
    pose, place = _scale_pose(image, "", source=source), "device"
    if image is not content.mapping:
        frame = content.mapping
        if "device_heading" not in frame:
            raise InputError(
                f"{source}: no device_heading, so the camera's pose in the device is unknown; add it and device_position"
            )
        pose = _scale_pose(frame, "device_", source=source).inverse() @ pose
    calibration = _calibration_of("scale", pose, (_AS_RADAR.format(place),), source=source)
    return with_camera(calibration, _scale_camera(image, source=source), source=source)


def _scale_pose(block: Mapping[str, Any], prefix: str, *, source: str) -> RigidTransform:
    """Return a pose from position and heading, by name or in the order w x y z."""
    parts: dict[str, tuple[float, ...]] = {}
    for key, names in ((f"{prefix}position", "xyz"), (f"{prefix}heading", "wxyz")):
        value = block.get(key)
        if isinstance(value, list):
            parts[key] = floats(value, source=source, place=key, length=len(names))
        else:
            parts[key] = named_numbers(value, names, source=source, place=key)
    return rigid("quaternion_wxyz", parts[f"{prefix}heading"], parts[f"{prefix}position"], source=source)


def _scale_camera(image: Mapping[str, Any], *, source: str) -> FoundCamera | None:
    if not {"fx", "fy", "cx", "cy"} <= set(image) or any(image.get(key) for key in _OTHERS if key != "k4"):
        return None
    model: Literal["", "equidistant"] = "equidistant" if image.get("camera_model") == "fisheye" else ""
    if image.get("camera_model") not in (None, "", "brown_conrady", "pinhole", "fisheye") or (
        not model and image.get("k4")
    ):
        return None
    matrix = pinhole_matrix(*named_numbers(image, ("fx", "fy", "cx", "cy"), source=source, place="image"))
    coefficients = {key: image.get(key) or 0.0 for key in (_FISHEYE if model else _BROWN)}
    return _lens(model, matrix, coefficients, source=source)


def _lens(model: str, matrix: tuple[float, ...], coefficients: Mapping[str, Any], *, source: str) -> FoundCamera:
    distortion = tuple(floats(value, source=source, place=key, length=1)[0] for key, value in coefficients.items())
    return FoundCamera("image", model, matrix, distortion if model or any(distortion) else (), None)


def _recognizes_segments(content: Content) -> bool:
    posed = (image.get("extrinsics") for image in _images(content))
    return any(isinstance(extrinsics, Mapping) and "translation" in extrinsics for extrinsics in posed)


def _read_segments(content: Content, source: str) -> ImportedCalibration:
    """Read the pose of the one calibrated image in the frame of the point cloud.

    Raises:
        InputError: there are several cameras, a number is missing, or the convention is unknown.
    """
    image = _choose_sensor(_images(content), "extrinsics", source=source)
    extrinsics = image["extrinsics"]
    translation_m = named_numbers(extrinsics.get("translation"), "xyz", source=source, place="extrinsics.translation")
    rotation = named_numbers(
        extrinsics.get("rotation"), ("qx", "qy", "qz", "qw"), source=source, place="extrinsics.rotation"
    )
    pose = rigid("quaternion_xyzw", rotation, translation_m, source=source)
    convention = str(image.get("camera_convention") or "")
    if convention.lower() not in ("", "opengl", "opencv"):
        raise InputError(f"{source}: camera_convention: {convention!r} is neither OpenGL nor OpenCV; correct it")
    assumptions = [_AS_RADAR.format("ego")]
    if not convention:
        assumptions.append("no camera_convention: assumed OpenGL axes (y up, z backwards), the service's default")
    if convention.lower() != "opencv":
        pose = pose @ _OPENGL_FROM_OPTICAL
    calibration = _calibration_of("segments", pose, tuple(assumptions), source=source)
    return with_camera(calibration, _segments_camera(image, source=source), source=source)


def _segments_camera(image: Mapping[str, Any], *, source: str) -> FoundCamera | None:
    intrinsics = image.get("intrinsics")
    if not isinstance(intrinsics, Mapping) or "intrinsic_matrix" not in intrinsics:
        return None
    matrix = floats(intrinsics["intrinsic_matrix"], source=source, place="intrinsic_matrix", length=9)
    distortion = image.get("distortion")
    if not isinstance(distortion, Mapping):
        return FoundCamera("image", "", matrix, (), None)
    given = distortion.get("coefficients")
    model = {"fisheye": "equidistant", "brown-conrady": ""}.get(str(distortion.get("model")))
    if model is None or not isinstance(given, Mapping):
        raise InputError(f"{source}: distortion: give the model fisheye or brown-conrady, and its coefficients")
    keys = _FISHEYE if model else _BROWN
    return _lens(model, matrix, {key: given.get(key) or 0.0 for key in keys}, source=source)


def _calibration_of(
    name: str, radar_from_camera: RigidTransform, assumptions: tuple[str, ...], *, source: str
) -> ImportedCalibration:
    pose = WrittenPose("matrix", radar_from_camera.rotation, radar_from_camera.translation_m, "radar_from_camera")
    return ImportedCalibration(name, pose, assumptions=assumptions).checked(source)


SCALE = Reads(_recognizes_scale, _read_scale)
SEGMENTS = Reads(_recognizes_segments, _read_segments)
