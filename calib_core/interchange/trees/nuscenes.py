"""The joints of nuScenes' tables: each record of calibrated_sensor.json is a sensor in the ego frame, named by sensor.json."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.cameras.camera_format import FoundCamera
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import Form, WrittenPose
from calib_core.interchange.statement import STATEMENT_KEY, stated_frames, stated_lines
from calib_core.interchange.syntax.content import Content, decoded
from calib_core.interchange.trees.frame_tree import Joint, Place, Sensor, TreePart
from calib_core.parsing import json_value

SENSORS, CALIBRATED = "sensor.json", "calibrated_sensor.json"
_EGO = "ego"
_NOTE = "nuScenes' camera frames have optical axes, and its images are undistorted"
_NO_RADAR = "no radar record; assumed that the ego frame is the radar frame"
_ONLY_OTHER = "the sensor without camera_intrinsic is taken to be the radar"
_W_LAST = "the rotations are read in the order x y z w: in nuScenes' order w x y z sensors would hang upside down or look inwards"
_EITHER_ORDER = (
    "the rotations are read in nuScenes' order w x y z; in the order x y z w the sensors would stand as well, up to {:.2g} deg "
    "turned: check which order was written"
)
_CLEARLY = 1.0
_AT_ORIGIN_M = 0.1
_ALIKE_DEG = 0.01


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


def recognizes_nuscenes(content: Content) -> bool:
    """Return whether a file is that table or an archive with it, or holds single records of it."""
    if content.members:
        return _member(content, CALIBRATED, "") is not None
    return recognizes_poses(content) or any("camera_intrinsic" in record for record in _records(content))


def read_nuscenes_alone(content: Content, source: str) -> TreePart:
    """Read the poses of one file.

    Raises:
        InputError: it has more sensors than their intrinsics tell apart, or a number is missing.
    """
    poses, sensors = _member(content, CALIBRATED, source) or content, _member(content, SENSORS, source)
    return read_nuscenes(poses, source, sensors)


def _member(content: Content, name: str, source: str) -> Content | None:
    """Return a table in a zip archive, in whichever folder it is."""
    data = next((data for member, data in content.members.items() if member.rsplit("/", 1)[-1] == name), None)
    if data is None:
        return None
    text = decoded(data, source=source)
    return Content("json", text=text, value=json_value(text, source=source))


def _records(content: Content) -> list[Mapping[str, Any]]:
    listed = content.value if content.syntax == "json" and isinstance(content.value, list) else [content.json_mapping]
    return [record for record in listed if isinstance(record, Mapping) and "rotation" in record]


def read_nuscenes(poses: Content, source: str, sensors: Content | None) -> TreePart:
    """Read the pose of every sensor.

    A sensor that is calibrated several times alike is one frame, called as its channel; otherwise each calibration is a frame
    of its own, CHANNEL@TOKEN with the first eight characters of the token.

    Args:
        poses: of calibrated_sensor.json.
        source: its name, for messages.
        sensors: of sensor.json; None if it was not given: then one camera and at most one other sensor, the radar, are read.

    Raises:
        InputError: a number is missing, or is none; or there are other sensors than these without sensor.json.
    """
    records = _records(poses)
    form, said = _order(records, source)
    text = next(filter(None, (stated_lines(record.get(STATEMENT_KEY)) for record in records)), "")
    if sensors is None:
        named, assumption = _by_intrinsics(records, stated_frames(text) or FrameNames(), source)
    else:
        named, assumption = {str(record["token"]): record for record in sensors.value}, ""
    by_channel: dict[str, list[Joint]] = {}
    kept: dict[int, Mapping[str, Any]] = {}
    for number, record in enumerate(records):
        sensor = named.get(str(record.get("sensor_token") if sensors is not None else number), {})
        channel = str(sensor.get("channel") or str(record.get("sensor_token"))[:8])
        place = Place(source, _line_of(record, poses.text))
        parent = str(sensor.get("parent") or _EGO)
        joint = Joint.posed(parent, channel, _pose(record, form, str(place), f"{channel}: "), place)
        same = by_channel.setdefault(channel, [])
        if not any(joint.repeats(other) for other in same):
            same.append(joint)
            kept[id(joint)] = {**record, "modality": sensor.get("modality")}
    joints, known = [], []
    for channel, found in by_channel.items():
        for joint in found:
            record = kept[id(joint)]
            frame = channel if len(found) == 1 else f"{channel}@{str(record.get('token'))[:8]}"
            joints.append(replace(joint, child=frame))
            known.append(_sensor(record, frame, source))
    assumptions = tuple(filter(None, (assumption, said)))
    return TreePart("nuscenes", tuple(joints), tuple(known), notes=(_NOTE,), assumptions=assumptions, statement=text)


def _by_intrinsics(
    records: Sequence[Mapping[str, Any]], frames: FrameNames, source: str
) -> tuple[dict[str, Mapping[str, Any]], str]:
    """Return which record is the camera's and which the radar's, by number, and what was assumed.

    Raises:
        InputError: there are others.
    """
    cameras = [number for number, record in enumerate(records) if record.get("camera_intrinsic")]
    others = [number for number in range(len(records)) if number not in cameras]
    if len(cameras) != 1 or len(others) > 1:
        raise InputError(
            f"{source}: does not name its {len(records)} sensors, {len(cameras)} of them with camera_intrinsic; give sensor.json "
            "of the same folder as well, or keep one camera and one radar"
        )
    camera = {"channel": frames.camera, "modality": "camera", "parent": _EGO if others else frames.radar}
    radar = {"channel": frames.radar, "modality": "radar"}
    named: dict[str, Mapping[str, Any]] = {str(cameras[0]): camera, **{str(number): radar for number in others}}
    return named, _ONLY_OTHER if others else _NO_RADAR


_ORDERS: tuple[Form, Form] = ("quaternion_wxyz", "quaternion_xyzw")


def _order(records: Sequence[Mapping[str, Any]], source: str) -> tuple[Form, str]:
    """Return the order of the rotations, nuScenes' own unless the sensors stand clearly better in the other; and what to say."""
    listed = [record for record in records if not isinstance(record.get("rotation"), Mapping)]
    try:
        first, last = ([_pose(one, form, source).as_written() for one in listed] for form in _ORDERS)
    except (InputError, ValueError):
        return _ORDERS[0], ""  # reading them one by one says what is wrong
    better = sum(map(_standing, listed, last)) - sum(map(_standing, listed, first))
    if better > _CLEARLY:
        return _ORDERS[1], _W_LAST
    turns = (rotation_angle_rad(a.rotation @ b.rotation.T) for a, b in zip(first, last, strict=True))
    apart_deg = np.degrees(max(turns, default=0.0))
    return _ORDERS[0], _EITHER_ORDER.format(apart_deg) if better > -_CLEARLY and apart_deg > _ALIKE_DEG else ""


def _standing(record: Mapping[str, Any], pose: RigidTransform) -> float:
    """Return how a sensor stands on a vehicle: 1 for upright, and 1 for looking away from the origin; less for others."""
    camera = bool(record.get("camera_intrinsic"))
    forward, up = (pose.rotation[:, 2], -pose.rotation[:, 1]) if camera else (pose.rotation[:, 0], pose.rotation[:, 2])
    away_m = pose.translation_m[:2]
    return float(up[2] + forward[:2] @ away_m / max(float(np.linalg.norm(away_m)), _AT_ORIGIN_M))


def _pose(record: Mapping[str, Any], form: Form, source: str, place: str = "") -> WrittenPose:
    """Return the pose of a sensor in the ego frame: a translation, and a quaternion in the order given or by names.

    Raises:
        InputError: a number is missing, or is none.
    """
    rotation = record.get("rotation")
    named = isinstance(rotation, Mapping)
    numbers = [rotation.get(key) for key in "wxyz"] if isinstance(rotation, Mapping) else rotation
    return WrittenPose(
        _ORDERS[0] if named else form,
        np.array(floats(numbers, source=source, place=f"{place}rotation", length=4)),
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
