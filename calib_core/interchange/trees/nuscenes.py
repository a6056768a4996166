"""The joints of nuScenes' tables: each record of calibrated_sensor.json is a sensor in the ego frame, named by sensor.json."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from calib_core.interchange.cameras.camera_format import FoundCamera
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import WrittenPose
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.frame_tree import Joint, Place, Sensor, TreePart

_EGO = "ego"
_NOTE = "nuScenes' camera frames have optical axes, and its images are undistorted"


def recognizes_poses(content: Content) -> bool:
    """Return whether JSON is the table calibrated_sensor."""
    return _is_table(content, {"sensor_token", "rotation", "translation"})


def recognizes_sensors(content: Content) -> bool:
    """Return whether JSON is the table sensor, which names them."""
    return _is_table(content, {"token", "channel", "modality"})


def _is_table(content: Content, keys: set[str]) -> bool:
    records = content.value
    is_list = content.syntax == "json" and isinstance(records, list) and bool(records)
    return is_list and all(isinstance(record, Mapping) and keys <= set(record) for record in records)


def read_nuscenes(poses: Content, source: str, sensors: Content | None) -> TreePart:
    """Read the pose of every sensor.

    A sensor that is calibrated several times alike is one frame, called as its channel; otherwise each calibration is a frame
    of its own, CHANNEL@TOKEN with the first eight characters of the token.

    Args:
        poses: of calibrated_sensor.json.
        source: its name, for messages.
        sensors: of sensor.json; None if it was not given, and the frames are then called by their tokens.

    Raises:
        InputError: a number is missing, or is none.
    """
    named = {str(record["token"]): record for record in sensors.value} if sensors is not None else {}
    by_channel: dict[str, list[Joint]] = {}
    records: dict[int, Mapping[str, Any]] = {}
    for record in poses.value:
        sensor = named.get(str(record["sensor_token"]), {})
        channel = str(sensor.get("channel") or str(record["sensor_token"])[:8])
        joint = _joint(record, channel, poses.text, source)
        same = by_channel.setdefault(channel, [])
        if not any(joint.repeats(other) for other in same):
            same.append(joint)
            records[id(joint)] = {**record, "modality": sensor.get("modality")}
    joints, known = [], []
    for channel, found in by_channel.items():
        for joint in found:
            record = records[id(joint)]
            frame = channel if len(found) == 1 else f"{channel}@{str(record.get('token'))[:8]}"
            joints.append(replace(joint, child=frame))
            known.append(_sensor(record, frame, source))
    return TreePart("nuscenes", tuple(joints), tuple(known), notes=(_NOTE,))


def _joint(record: Mapping[str, Any], channel: str, text: str, source: str) -> Joint:
    place = Place(source, _line_of(record, text))
    return Joint.posed(_EGO, channel, pose_of(record, source=str(place), place=f"{channel}: "), place)


def pose_of(record: Mapping[str, Any], *, source: str, place: str = "") -> WrittenPose:
    """Return the pose of a sensor in the ego frame: a translation, and a quaternion in the order w x y z or by names.

    Raises:
        InputError: a number is missing, or is none.
    """
    rotation = record.get("rotation")
    wxyz = [rotation.get(key) for key in "wxyz"] if isinstance(rotation, Mapping) else rotation
    return WrittenPose(
        "quaternion_wxyz",
        np.array(floats(wxyz, source=source, place=f"{place}rotation", length=4)),
        np.array(floats(record.get("translation"), source=source, place=f"{place}translation", length=3)),
        "radar_from_camera",
    )


def _line_of(record: Mapping[str, Any], text: str) -> int | None:
    at = text.find(f'"{record.get("token")}"')
    return text.count("\n", 0, at) + 1 if at >= 0 else None


def _sensor(record: Mapping[str, Any], frame: str, source: str) -> Sensor:
    intrinsic: Sequence[Any] = record.get("camera_intrinsic") or ()
    modality = str(record.get("modality") or ("camera" if intrinsic else "other"))
    if modality == "camera":
        if not intrinsic:
            return Sensor(frame, "camera", "optical")
        matrix = floats(intrinsic, source=source, place=f"{frame}: camera_intrinsic", length=9)
        return Sensor(frame, "camera", "optical", FoundCamera("camera_intrinsic", "pinhole", matrix, (), None))
    return Sensor(frame, "radar" if modality == "radar" else "other")
