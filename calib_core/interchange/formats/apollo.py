"""Apollo's extrinsics: a stamped transform, which is also what `ros2 topic echo /tf_static` prints."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.fields import floats
from calib_core.interchange.format import Format, ImportedCalibration, Reads, WrittenPose, posed_between
from calib_core.interchange.formats.pose_parts import Ends, choose_transform
from calib_core.interchange.formats.statement import (
    POSE_ONLY,
    hash_comment,
    stated_check_point,
    stated_frames,
    statement,
)
from calib_core.interchange.rotations import quaternion_xyzw_from_matrix
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.syntax.yaml_text import number_text, quoted


def _write(file: CalibrationFile) -> str:
    """Write Apollo's extrinsics file; any reader of stamped transforms accepts it."""
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


def _recognizes(content: Content) -> bool:
    return "child_frame_id" in content.mapping or "transforms" in content.mapping


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read a stamped transform: Apollo's file, or what `ros2 topic echo /tf_static` prints.

    Raises:
        InputError: a frame name or a number is missing.
    """
    one, text = content.mapping, content.text
    listed = one.get("transforms")
    if isinstance(listed, list) and listed:
        stamped = [entry if isinstance(entry, Mapping) else {} for entry in listed]
        one = stamped[choose_transform([_ends(entry) for entry in stamped], stated_frames(text), source=source)]
    header, transform = one.get("header"), one.get("transform")
    if not isinstance(header, Mapping) or not isinstance(transform, Mapping):
        raise InputError(f"{source}: a stamped transform needs header.frame_id, child_frame_id and transform; add them")
    numbers = []
    for part, keys in (("translation", "xyz"), ("rotation", "xyzw")):
        block = transform.get(part)
        if not isinstance(block, Mapping):
            raise InputError(f"{source}: transform.{part}: missing; add it")
        numbers.append([floats(block.get(k), source=source, place=f"transform.{part}.{k}", length=1)[0] for k in keys])
    parent, child = str(header.get("frame_id") or ""), str(one.get("child_frame_id") or "")
    if not parent or not child:
        raise InputError(f"{source}: header.frame_id or child_frame_id is missing; name both frames")
    written = WrittenPose("quaternion_xyzw", np.array(numbers[1]), np.array(numbers[0]), "radar_from_camera")
    roles = posed_between(parent.lstrip("/"), child.lstrip("/"), stated_frames(text), written)
    return ImportedCalibration(
        "apollo", roles.pose, frames=roles.frames, check_point=stated_check_point(text), assumptions=roles.assumptions
    ).checked(source)


def _ends(stamped: Mapping[str, Any]) -> Ends:
    header = stamped.get("header")
    parent = header.get("frame_id") if isinstance(header, Mapping) else ""
    return Ends(str(parent or ""), str(stamped.get("child_frame_id") or ""))


APOLLO = Format(
    name="apollo",
    title="Apollo extrinsics",
    used_in="Vehicle stacks",
    also="Baidu Cyber RT vehicle",
    numbers="pose of the child (camera, optical) in the parent (radar); quaternion x y z w",
    file_name="radar_camera_extrinsics.yaml",
    camera="none",
    comment="#",
    notes=(POSE_ONLY,),
    write=_write,
    reads=Reads(_recognizes, _read),
)
