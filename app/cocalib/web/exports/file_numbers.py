"""The pose that a file holds, in its own numbers: which way they go, their order and their units."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix
from calib_core.interchange import FrameNames, ImportedCalibration, WrittenPose

_ORDERS = {
    "quaternion_xyzw": ("qx", "qy", "qz", "qw"),
    "quaternion_wxyz": ("qw", "qx", "qy", "qz"),
    "rpy": ("roll", "pitch", "yaw"),
}
_THIRD_FRAMES = {"autoware": "sensor_kit_base_link", "driveworks": "the rig", "nuscenes": "the ego frame"}
_CAMERA_WORDS = {"optical": "z forward", "link": "x forward"}


@dataclass(frozen=True, slots=True)
class NumberRow:
    """One row of a table of numbers.

    Attributes:
        name: of the number, or of the row of a matrix.
        values: one, or the three of a matrix row.
        unit: "m", "rad", "deg" or "".
    """

    name: str
    values: tuple[str, ...]
    unit: str


@dataclass(frozen=True, slots=True)
class FileNumbers:
    """A table of numbers.

    Attributes:
        title: what they are.
        rows: in the order of the file.
    """

    title: str
    rows: tuple[NumberRow, ...]


@dataclass(frozen=True, slots=True)
class PoseInFile:
    """The pose that a file holds, as read back from it.

    Attributes:
        carries: which transform its numbers are.
        words: what they do, in one sentence.
        equation: the same as an equation of points.
        radar_frame: the name of the radar's frame.
        camera_frame: the name of the camera's frame that the numbers are about: optical, or its body frame.
        camera_axes: of that frame: directions of its x, y and z in the radar frame, by rows.
        numbers: of the pose, as the file holds them.
        in_third_frame: instead, if the file poses both sensors in a third frame: the numbers of the radar and of the camera.
    """

    carries: Literal["camera_from_radar", "radar_from_camera"]
    words: str
    equation: str
    radar_frame: str
    camera_frame: str
    camera_axes: tuple[tuple[float, ...], ...]
    numbers: FileNumbers
    in_third_frame: tuple[FileNumbers, ...] = ()


def pose_in_file(found: ImportedCalibration, frames: FrameNames) -> PoseInFile:
    """Describe the pose that was read back from a file.

    Args:
        found: what was read.
        frames: the names that the file was written with.
    """
    pose = found.pose
    camera = frames.camera if pose.axes == "optical" else frames.camera_link
    point = "p_camera" if pose.axes == "optical" else "p_link"
    written = pose.as_written()
    if pose.direction == "camera_from_radar":
        what, equation = f"carry points from {frames.radar!r} to {camera!r}", f"{point} = R p_radar + t"
        title, camera_axes = f"From {frames.radar} to {camera}", written.rotation
    else:
        what = f"are the pose of {camera!r} ({_CAMERA_WORDS[pose.axes]}) in {frames.radar!r}"
        equation = f"p_radar = R {point} + t"
        title, camera_axes = f"Pose of {camera} in {frames.radar}", written.rotation.T
    words = f"The numbers of this file {what}: {equation}."
    both: tuple[FileNumbers, ...] = ()
    if found.in_third_frame is not None:
        third = _THIRD_FRAMES.get(found.format, "the third frame")
        both = tuple(
            FileNumbers(f"Pose of {name} in {third}", _rows(one))
            for name, one in zip((frames.radar, camera), found.in_third_frame, strict=True)
        )
        words = (
            f"The numbers of this file are the poses of {frames.radar!r} and of {camera!r} ({_CAMERA_WORDS[pose.axes]}) in "
            f"{third}. From both follows the pose of {camera!r} in {frames.radar!r}: {equation}."
        )
    return PoseInFile(
        carries=pose.direction,
        words=words,
        equation=equation,
        radar_frame=frames.radar,
        camera_frame=camera,
        camera_axes=tuple(tuple(row) for row in camera_axes.tolist()),
        numbers=FileNumbers(title, _rows(pose)),
        in_third_frame=both,
    )


def our_numbers(camera_from_radar: RigidTransform) -> FileNumbers:
    """Return the calibration's own pose: matrix, translation and quaternion."""
    quaternion = _named(_ORDERS["quaternion_wxyz"], quaternion_wxyz_from_matrix(camera_from_radar.rotation), "")
    return FileNumbers("camera_from_radar of the calibration", (*_matrix_rows(camera_from_radar), *quaternion))


def _rows(pose: WrittenPose) -> tuple[NumberRow, ...]:
    if pose.form == "matrix":
        return _matrix_rows(RigidTransform(pose.rotation_matrix(), pose.translation_m))
    position = _named(("x", "y", "z"), pose.translation_m, "m")
    if pose.form != "rpy":
        return (*position, *_named(_ORDERS[pose.form], pose.rotation, ""))
    if pose.angle_unit == "deg":  # 12 digits: what is left of the way to radians and back
        angles = np.array([float(f"{angle:.12g}") for angle in np.rad2deg(pose.rotation)])
        return (*position, *_named(_ORDERS["rpy"], angles, "deg"))
    return (*position, *_named(_ORDERS["rpy"], pose.rotation, "rad"))


def _matrix_rows(transform: RigidTransform) -> tuple[NumberRow, ...]:
    rows = [NumberRow(f"R row {index}", _rounded(row), "") for index, row in enumerate(transform.rotation, start=1)]
    return (*rows, NumberRow("t", _rounded(transform.translation_m), "m"))


def _rounded(values: np.ndarray) -> tuple[str, ...]:
    return tuple(f"{value:.9f}" for value in (np.round(values, 9) + 0.0).tolist())


def _named(names: tuple[str, ...], values: np.ndarray, unit: str) -> tuple[NumberRow, ...]:
    return tuple(
        NumberRow(name, (repr(value + 0.0),), unit) for name, value in zip(names, values.tolist(), strict=True)
    )
