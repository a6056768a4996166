"""An MCAP file that Foxglove opens, with its FrameTransforms and CameraCalibration messages; both are also read as JSON."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames
from calib_core.interchange.cameras.fields import find_cameras
from calib_core.interchange.cameras.numbers import floats
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.formats.statement import STATEMENT_KEY, stated_frames, statement, with_statement
from calib_core.interchange.formats.transform_choice import Ends, choose_transform
from calib_core.interchange.imported import ImportedCalibration, WrittenPose, posed_between
from calib_core.interchange.own.camera_document import refuse_skew
from calib_core.interchange.rotations import quaternion_xyzw_from_matrix
from calib_core.interchange.syntax.content import Content, decoded
from calib_core.interchange.syntax.json_text import json_text
from calib_core.interchange.syntax.mcap_file import McapFile, McapMessage, mcap_bytes
from calib_core.interchange.syntax.strict_json import json_value
from calib_core.lens_models.naming import written_lens

_NOTES = (
    "open it in Foxglove: /tf_static is the pose of the child (camera, optical) in the parent (radar), rotation named x y z w, "
    "/camera_calibration the lens; the check point and where it comes from are in the file's metadata",
)
_TRANSFORMS, _CAMERA = "foxglove.FrameTransforms", "foxglove.CameraCalibration"
_TRANSFORM = "foxglove.FrameTransform"
_READ_SCHEMAS = (_TRANSFORMS, _TRANSFORM)
_TOPICS = {_TRANSFORMS: "/tf_static", _CAMERA: "/camera_calibration"}
_TEXT = "statement"


def _write(file: CalibrationFile) -> bytes:
    """Write an MCAP file with a message of each kind, at the time 0.

    Raises:
        InputError: CameraCalibration cannot store this camera's skew, or has no name for its lens.
    """
    refuse_skew(file.calibration.camera, "Foxglove's CameraCalibration has")
    radar_from_camera = file.calibration.camera_from_radar.inverse()
    quaternion = quaternion_xyzw_from_matrix(radar_from_camera.rotation) + 0.0
    transform = {
        "timestamp": {"sec": 0, "nsec": 0},
        "parent_frame_id": file.frames.radar,
        "child_frame_id": file.frames.camera,
        "translation": dict(zip("xyz", (radar_from_camera.translation_m + 0.0).tolist(), strict=True)),
        "rotation": dict(zip("xyzw", quaternion.tolist(), strict=True)),
    }
    meaning = (
        "FrameTransform is the pose of the child (camera, optical) in the parent (radar); quaternion named x y z w"
    )
    messages = (
        _message(_TRANSFORMS, {"transforms": [transform]}),
        _message(_CAMERA, _camera_message(file.calibration.camera, file.frames.camera)),
    )
    return mcap_bytes(McapFile(messages, {STATEMENT_KEY: {_TEXT: "\n".join(statement(file, meaning))}}))


def _message(name: str, content: dict[str, Any]) -> McapMessage:
    schema = json.dumps({"title": name, **_SCHEMAS[name]}).encode()
    return McapMessage(_TOPICS[name], name, schema, json_text(content).encode())


def _camera_message(camera: Camera, frame: str) -> dict[str, Any]:
    lens = written_lens(camera.lens, camera.distortion, "foxglove")
    return {
        "timestamp": {"sec": 0, "nsec": 0},
        "frame_id": frame,
        "width": camera.width_px,
        "height": camera.height_px,
        "distortion_model": lens.name,
        "D": list(lens.coefficients),
        "K": camera.matrix_px.ravel().tolist(),
        "R": np.eye(3).ravel().tolist(),
        "P": np.hstack([camera.matrix_px, np.zeros((3, 1))]).ravel().tolist(),
    }


def _recognizes(content: Content) -> bool:
    if content.syntax == "mcap":
        return any(message.schema_name in _READ_SCHEMAS for message in content.mcap.messages)
    messages = content.json_mapping
    return "FrameTransform" in messages or bool(_listed(messages)) or "parent_frame_id" in messages


def _listed(messages: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the transforms of a FrameTransforms message, alone or under its name; none if it is another message."""
    named = messages.get("FrameTransforms")
    transforms = (named if isinstance(named, Mapping) else messages).get("transforms")
    listed = transforms if isinstance(transforms, list) else []
    return [one for one in listed if isinstance(one, Mapping) and "parent_frame_id" in one]


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read an MCAP file that we wrote, or as JSON a FrameTransform or the one of FrameTransforms between a radar and a camera.

    A CameraCalibration may be with it.

    Raises:
        InputError: a frame name or a number is missing, or there are several transforms.
    """
    if content.syntax != "mcap":
        return _read_messages(content.json_mapping, None, source)
    text = content.mcap.metadata.get(STATEMENT_KEY, {}).get(_TEXT, "")
    found = _read_messages(_messages(content.mcap, source=source), stated_frames(text), source)
    return with_statement(found, text)


def _messages(file: McapFile, *, source: str) -> dict[str, Any]:
    """Return the transforms and the CameraCalibration of an MCAP file, as they are called in JSON."""
    found: dict[str, Any] = {}
    transforms: list[Any] = []
    for message in file.messages:
        value = json_value(decoded(message.data, source=source), source=source)
        if message.schema_name == _TRANSFORMS and isinstance(value, Mapping):
            listed = value.get("transforms")
            transforms += listed if isinstance(listed, list) else []
        elif message.schema_name == _TRANSFORM:
            transforms.append(value)
        elif message.schema_name == _CAMERA:
            found["CameraCalibration"] = value
    return {"FrameTransforms": {"transforms": transforms}, **found}


def _read_messages(messages: Mapping[str, Any], stated: FrameNames | None, source: str) -> ImportedCalibration:
    message, listed = messages.get("FrameTransform", messages), _listed(messages)
    if listed:
        ends = [Ends(str(one.get("parent_frame_id") or ""), str(one.get("child_frame_id") or "")) for one in listed]
        message = listed[choose_transform(ends, stated, source=source)]
    if not isinstance(message, Mapping):
        message = {}
    parent, child = (str(message.get(key) or "") for key in ("parent_frame_id", "child_frame_id"))
    if not parent or not child:
        raise InputError(f"{source}: parent_frame_id or child_frame_id is missing; name both frames")
    numbers = []
    for part, keys in (("translation", "xyz"), ("rotation", "xyzw")):
        block = message.get(part)
        if not isinstance(block, Mapping):
            raise InputError(f"{source}: FrameTransform.{part}: missing; add it")
        numbers.append(
            [floats(block.get(k), source=source, place=f"FrameTransform.{part}.{k}", length=1)[0] for k in keys]
        )
    written = WrittenPose("quaternion_xyzw", np.array(numbers[1]), np.array(numbers[0]), "radar_from_camera")
    roles = posed_between(parent, child, stated or _frames_of(messages, parent, child), written)
    cameras = find_cameras(messages, source=source) if "CameraCalibration" in messages else ()
    return ImportedCalibration(
        "foxglove",
        roles.pose,
        camera=cameras[0].camera(image_size_px=None, source=source) if cameras else None,
        frames=roles.frames,
        assumptions=roles.assumptions,
    ).checked(source)


def _frames_of(messages: Mapping[str, Any], parent: str, child: str) -> FrameNames | None:
    """Return which of the two frames is the camera's: the frame of a CameraCalibration, which has optical axes by definition."""
    camera = messages.get("CameraCalibration")
    frame = str(camera.get("frame_id") or "") if isinstance(camera, Mapping) else ""
    return FrameNames(parent if frame == child else child, frame) if frame in (parent, child) else None


_NUMBER, _INTEGER, _STRING = ({"type": name} for name in ("number", "integer", "string"))


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


_TIME = _object(sec=_INTEGER, nsec=_INTEGER)
_SCHEMAS: dict[str, dict[str, Any]] = {
    _TRANSFORMS: _object(
        transforms={
            "type": "array",
            "items": _object(
                timestamp=_TIME,
                parent_frame_id=_STRING,
                child_frame_id=_STRING,
                translation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER),
                rotation=_object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER),
            ),
        }
    ),
    _CAMERA: _object(
        timestamp=_TIME,
        frame_id=_STRING,
        width=_INTEGER,
        height=_INTEGER,
        distortion_model=_STRING,
        **{key: {"type": "array", "items": _NUMBER} for key in "DKRP"},
    ),
}

FOXGLOVE = Format(
    name="foxglove",
    title="Foxglove, MCAP",
    used_in="Data sets and viewers",
    also="Studio MCAP viewer",
    numbers="FrameTransform: pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
    file_name="foxglove.mcap",
    camera="lens",
    comment="keys",
    notes=_NOTES,
    write=_write,
    reads=Reads(_recognizes, _read),
)
