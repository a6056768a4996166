"""Autoware's sensor kit, Apollo's extrinsics and Kalibr's camera chain."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import find_cameras, floats
from calib_core.interchange.formats.statement import hash_comment, stated_check_point, stated_frames, statement
from calib_core.interchange.formats.transform_choice import Ends, the_one_between
from calib_core.interchange.imported import (
    ImportedCalibration,
    WrittenPose,
    looks_like_camera,
    looks_like_radar,
    posed_between,
)
from calib_core.interchange.own.camera_document import refuse_skew
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, quaternion_xyzw_from_matrix, rpy_from_matrix
from calib_core.interchange.syntax.yaml_text import number_text, numbers_text, quoted
from calib_core.lens_models.naming import written_lens

__all__ = [
    "read_autoware",
    "read_kalibr",
    "read_transform_stamped",
    "write_apollo",
    "write_autoware",
    "write_autoware_in_kit",
    "write_kalibr",
]

_KIT = "sensor_kit_base_link"
_POSE_KEYS = ("x", "y", "z", "roll", "pitch", "yaw")


def write_autoware(file: CalibrationFile) -> str:
    """Write sensor_kit_calibration.yaml with the radar at the kit's origin."""
    return write_autoware_in_kit(file, RigidTransform.identity())


def write_autoware_in_kit(file: CalibrationFile, kit_from_radar: RigidTransform) -> str:
    """Write sensor_kit_calibration.yaml with the radar where it sits in the kit."""
    frames = file.frames
    kit_from_link = kit_from_radar @ file.calibration.camera_from_radar.inverse() @ LINK_FROM_OPTICAL.inverse()
    meaning = (
        f"each entry is its pose in {_KIT}; angles in radians about fixed axes, R = Rz(yaw) Ry(pitch) Rx(roll); "
        f"{frames.camera_link} has body axes (x forward, y left, z up)"
    )
    return (
        hash_comment(statement(file, meaning))
        + f"{_KIT}:\n"
        + _autoware_entry(frames.radar, kit_from_radar)
        + _autoware_entry(frames.camera_link, kit_from_link)
    )


def _autoware_entry(name: str, kit_from_sensor: RigidTransform) -> str:
    numbers = (*kit_from_sensor.translation_m, *rpy_from_matrix(kit_from_sensor.rotation))
    rows = "".join(f"    {key}: {number_text(value)}\n" for key, value in zip(_POSE_KEYS, numbers, strict=True))
    return f"  {quoted(name)}:\n{rows}"


def read_autoware(content: Mapping[str, Any], text: str, source: str) -> ImportedCalibration:
    """Read a kit that holds one radar and one camera.

    Raises:
        InputError: it holds others, or a number is missing.
    """
    kit_name, kit = next(((str(key), value) for key, value in content.items() if _is_kit(value)), ("", {}))
    stated = stated_frames(text)
    kit = {str(name): entry for name, entry in kit.items() if isinstance(entry, Mapping)}
    radars = [name for name in kit if (stated.radar == name if stated else looks_like_radar(name))]
    cameras = [name for name in kit if name not in radars and (stated or looks_like_camera(name))]
    if len(radars) != 1 or len(cameras) != 1:
        raise InputError(
            f"{source}: {kit_name}: holds {len(radars)} radars and {len(cameras)} cameras by name; keep one of each"
        )
    radar, camera = radars[0], cameras[0]
    roles = posed_between(radar, camera, stated)
    radar_numbers, camera_numbers = (
        np.array(
            [
                floats(kit[name].get(key), source=source, place=f"{kit_name}.{name}.{key}", length=1)[0]
                for key in _POSE_KEYS
            ]
        )
        for name in (radar, camera)
    )
    pose = WrittenPose("rpy", camera_numbers[3:], camera_numbers[:3], "radar_from_camera", roles.axes)
    if radar_numbers.any():
        kit_from_radar = WrittenPose("rpy", radar_numbers[3:], radar_numbers[:3], "radar_from_camera").as_written()
        kit_from_camera = WrittenPose("rpy", camera_numbers[3:], camera_numbers[:3], "radar_from_camera").as_written()
        radar_from_camera = kit_from_radar.inverse() @ kit_from_camera
        pose = WrittenPose(
            "matrix", radar_from_camera.rotation, radar_from_camera.translation_m, "radar_from_camera", roles.axes
        )
    return ImportedCalibration(
        "autoware", pose, frames=roles.frames, check_point=stated_check_point(text), notes=roles.notes
    ).checked(source)


def _is_kit(value: Any) -> bool:
    return isinstance(value, Mapping) and any(isinstance(entry, Mapping) and "yaw" in entry for entry in value.values())


def write_apollo(file: CalibrationFile) -> str:
    """Write Apollo's extrinsics file; any reader of a stamped transform takes it too."""
    radar_from_camera = file.calibration.camera_from_radar.inverse()
    quaternion = quaternion_xyzw_from_matrix(radar_from_camera.rotation)
    frames = file.frames
    meaning = (
        f"the numbers are the pose of the child {frames.camera} in the parent {frames.radar}; quaternion named x y z w"
    )
    translation = zip("xyz", radar_from_camera.translation_m, strict=True)
    rotation = zip("xyzw", quaternion, strict=True)
    return (
        hash_comment(statement(file, meaning))
        + f"header:\n  seq: 0\n  stamp:\n    secs: 0\n    nsecs: 0\n  frame_id: {quoted(frames.radar)}\n"
        + f"child_frame_id: {quoted(frames.camera)}\ntransform:\n  translation:\n"
        + "".join(f"    {key}: {number_text(value)}\n" for key, value in translation)
        + "  rotation:\n"
        + "".join(f"    {key}: {number_text(value)}\n" for key, value in rotation)
    )


def read_transform_stamped(content: Mapping[str, Any], text: str, source: str) -> ImportedCalibration:
    """Read a stamped transform: Apollo's file, or what `ros2 topic echo /tf_static` prints.

    Raises:
        InputError: a frame's name or a number is missing.
    """
    listed = content.get("transforms")
    if isinstance(listed, list) and listed:
        stamped = [one if isinstance(one, Mapping) else {} for one in listed]
        content = stamped[the_one_between([_ends(one) for one in stamped], stated_frames(text), source=source)]
    header, transform = content.get("header"), content.get("transform")
    if not isinstance(header, Mapping) or not isinstance(transform, Mapping):
        raise InputError(f"{source}: a stamped transform needs header.frame_id, child_frame_id and transform; add them")
    numbers = []
    for part, keys in (("translation", "xyz"), ("rotation", "xyzw")):
        block = transform.get(part)
        if not isinstance(block, Mapping):
            raise InputError(f"{source}: transform.{part}: missing; add it")
        numbers.append([floats(block.get(k), source=source, place=f"transform.{part}.{k}", length=1)[0] for k in keys])
    parent, child = str(header.get("frame_id") or ""), str(content.get("child_frame_id") or "")
    if not parent or not child:
        raise InputError(f"{source}: header.frame_id or child_frame_id is missing; name both frames")
    roles = posed_between(parent.lstrip("/"), child.lstrip("/"), stated_frames(text))
    pose = WrittenPose("quaternion_xyzw", np.array(numbers[1]), np.array(numbers[0]), roles.direction, roles.axes)
    return ImportedCalibration(
        "apollo", pose, frames=roles.frames, check_point=stated_check_point(text), notes=roles.notes
    ).checked(source)


def _ends(stamped: Mapping[str, Any]) -> Ends:
    header = stamped.get("header")
    parent = header.get("frame_id") if isinstance(header, Mapping) else ""
    return Ends(str(parent or ""), str(stamped.get("child_frame_id") or ""))


def write_kalibr(file: CalibrationFile) -> str:
    """Write a camera chain of one camera, with T_cam_radar beside Kalibr's own keys.

    Raises:
        InputError: Kalibr has no model for this lens.
    """
    calibration = file.calibration
    camera = calibration.camera
    refuse_skew(camera, "Kalibr's pinhole model has")
    lens = written_lens(camera.lens, camera.distortion, "kalibr")
    k = camera.matrix_px
    rows = "".join(f"  - [{numbers_text(row)}]\n" for row in calibration.camera_from_radar.as_matrix())
    meaning = (
        "T_cam_radar carries radar points into the camera (our key, after Kalibr's T_cam_imu); rows of a 4x4 matrix"
    )
    return (
        hash_comment(statement(file, meaning))
        + "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n"
        + f"  intrinsics: [{numbers_text((k[0, 0], k[1, 1], k[0, 2], k[1, 2]))}]\n"
        + f"  distortion_model: {lens.name}\n  distortion_coeffs: [{numbers_text(lens.coefficients)}]\n"
        + f"  resolution: [{camera.width_px}, {camera.height_px}]\n"
        + f"  rostopic: {quoted(file.provenance.image_topic or '')}\n"
        + f"  T_cam_radar:\n{rows}"
    )


def read_kalibr(content: Mapping[str, Any], text: str, source: str) -> ImportedCalibration:
    """Read the camera of a chain that holds T_cam_radar.

    Raises:
        InputError: a number is missing, or several cameras hold one.
    """
    key, *others = [key for key, value in content.items() if isinstance(value, Mapping) and "T_cam_radar" in value]
    if others:
        raise InputError(
            f"{source}: T_cam_radar stands in {key}, {', '.join(map(str, others))}; keep the camera that is meant"
        )
    matrix = floats(content[key]["T_cam_radar"], source=source, place=f"{key}.T_cam_radar", length=16)
    rows = np.reshape(matrix, (4, 4))
    cameras = find_cameras({key: content[key]}, source=source) if "intrinsics" in content[key] else ()
    return ImportedCalibration(
        "kalibr",
        WrittenPose("matrix", rows[:3, :3], rows[:3, 3], "camera_from_radar"),
        camera=cameras[0].camera(image_size_px=None, source=source) if cameras else None,
        frames=stated_frames(text),
        check_point=stated_check_point(text),
    ).checked(source)
