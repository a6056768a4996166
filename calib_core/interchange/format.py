"""A calibration file format: its name, what its numbers mean, its writer and its reader, and what a reader found in a file.

A reader returns the pose as written (`WrittenPose`) and what it means (`ImportedCalibration`).
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from calib_core.arrays import Matrix33, Matrix66, Values, Vector2, Vector3, freeze, frozen_array
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, matrix_from_quaternion_wxyz
from calib_core.interchange.calibration_file import CalibrationFile, Evidence, FrameNames
from calib_core.interchange.rotations import LINK_FROM_OPTICAL, looks_forward, matrix_from_rpy, nearest_rotation
from calib_core.interchange.syntax.content import Content

Form = Literal["matrix", "quaternion_xyzw", "quaternion_wxyz", "rpy"]
Direction = Literal["camera_from_radar", "radar_from_camera"]
Axes = Literal["optical", "link"]
AngleUnit = Literal["rad", "deg"]
PoseFor = Literal["raw", "corrected"]
"""Whether a pose is for radar data as reported, or after taking out what the radar gets wrong."""

TRUTH_FORMAT = "truth"
"""The ground truth of a simulation: for comparison, never a calibration."""

_ROUNDING = 2e-3
_LARGEST = 1e12


@dataclass(frozen=True, slots=True, eq=False)
class WrittenPose:
    """A pose as written in the file, before conversion to camera_from_radar.

    Attributes:
        form: how the rotation is written.
        rotation: (3, 3), (4,) in the order of the form, or (3,) roll, pitch, yaw [rad].
        translation_m: (3,).
        direction: which transform the numbers are, in p_target = R p_source + t.
        axes: of the camera frame: optical, or body axes as in camera_link (x forward).
        angle_unit: in which the file states roll, pitch and yaw; the rotation above is in radians in any case.
    """

    form: Form
    rotation: np.ndarray
    translation_m: Vector3
    direction: Direction
    axes: Axes = "optical"
    angle_unit: AngleUnit = "rad"

    def __post_init__(self) -> None:
        shape = {"matrix": (3, 3), "rpy": (3,)}.get(self.form, (4,))
        freeze(self, rotation=shape, translation_m=(3,))
        _refuse_too_large(self.rotation, self.translation_m)

    def rotation_matrix(self) -> np.ndarray:
        """Return the rotation as written, as a matrix.

        Raises:
            ValueError: it is not a rotation.
        """
        if self.form == "matrix":
            return nearest_rotation(self.rotation, tolerance=_ROUNDING)
        if self.form == "rpy":
            return matrix_from_rpy(self.rotation)
        wxyz = np.roll(self.rotation, 1) if self.form == "quaternion_xyzw" else self.rotation
        length = math.hypot(*wxyz)  # does not overflow below the largest float
        if not abs(length - 1.0) <= _ROUNDING:
            raise ValueError(f"the quaternion {self.rotation.tolist()} has length {length:.4g}, not 1")
        return matrix_from_quaternion_wxyz(wxyz)

    def as_written(self) -> RigidTransform:
        """Return the transform as written, whichever two frames it connects.

        Raises:
            ValueError: the rotation is invalid.
        """
        return RigidTransform(self.rotation_matrix(), self.translation_m)

    def camera_from_radar(self) -> RigidTransform:
        """Return the pose in our convention: p_camera = R p_radar + t, optical camera frame.

        Raises:
            ValueError: the rotation is invalid.
        """
        written = self.as_written()
        meant = written if self.direction == "camera_from_radar" else written.inverse()
        return LINK_FROM_OPTICAL.inverse() @ meant if self.axes == "link" else meant


def _refuse_too_large(*arrays: np.ndarray) -> None:
    if not all((np.abs(array) <= _LARGEST).all() for array in arrays):
        raise ValueError("a number is not finite, or too large for a position or a pixel")


@dataclass(frozen=True, slots=True, eq=False)
class StatedCheckPoint:
    """The check point a file states.

    Attributes:
        radar_m: (3,) the point in the radar frame.
        camera_m: (3,) where it must be in the camera frame; None if only the pixel is stated.
        pixel_px: (2,) the pixel it must project to, through the lens; None if it is not stated.
        rectified_px: (2,) its pixel in rectified images, through the camera matrix alone; None if it is not stated.
    """

    radar_m: Vector3
    camera_m: Vector3 | None = None
    pixel_px: Vector2 | None = None
    rectified_px: Vector2 | None = None

    def __post_init__(self) -> None:
        freeze(self, radar_m=(3,))
        for name, length in (("camera_m", 3), ("pixel_px", 2), ("rectified_px", 2)):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen_array(getattr(self, name), (length,)))
        parts = (self.radar_m, self.camera_m, self.pixel_px, self.rectified_px)
        _refuse_too_large(*(part for part in parts if part is not None))


@dataclass(frozen=True, slots=True, eq=False)
class ImportedCalibration:
    """A calibration read from any format.

    Attributes:
        format: the format it was read as.
        pose: the pose as written, with the meaning the file gives it.
        camera: the camera; None if the format or the file has none.
        frames: the two frame names; None if the file has none.
        check_point: None if the file states none.
        assumptions: what the file does not state and reading it takes for granted, one sentence each.
        notes: what reading it did with the numbers, one sentence each.
        faults: the contradictions in the file, one sentence each.
        file: everything else, if it is a calibration-1 file.
        matrix_px: (3, 3) K of images whose size the file does not state; None if it has none, or states the size.
        lens_model: the lens model that belongs to matrix_px.
        distortion: its coefficients.
        evidence: what the pose rests on, as the file states it; None if it states nothing.
        calibration_sha256: of the calibration-1 file that it says it was exported from; None if it states none.
        covariance: (6, 6) of camera_from_radar, in the order of calibration-1; None if it states none. That of a
            calibration-1 file is in `file`.
        for_raw: it states that its pose is for radar data as reported, without corrections.
        in_third_frame: the poses of radar and camera as written, if both are in a third frame and the radar is not its origin.
    """

    format: str
    pose: WrittenPose
    camera: Camera | None = None
    frames: FrameNames | None = None
    check_point: StatedCheckPoint | None = None
    assumptions: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    faults: tuple[str, ...] = ()
    file: CalibrationFile | None = None
    matrix_px: Matrix33 | None = None
    lens_model: str = "pinhole"
    distortion: Values = field(default_factory=lambda: np.zeros(0))
    evidence: Evidence | None = None
    calibration_sha256: str | None = None
    covariance: Matrix66 | None = None
    in_third_frame: tuple[WrittenPose, WrittenPose] | None = None
    for_raw: bool = False

    def camera_for(self, image_size_px: tuple[int, int]) -> Camera | None:
        """Return the camera; one whose size the file does not state gets that of the images. None if there is none.

        Raises:
            ValueError: the matrix is not a camera's.
        """
        if self.camera is not None or self.matrix_px is None:
            return self.camera
        return Camera(self.lens_model, *image_size_px, self.matrix_px, self.distortion)

    @property
    def camera_from_radar(self) -> RigidTransform:
        """The pose in our convention: p_camera = R p_radar + t, optical camera frame."""
        return self.pose.camera_from_radar()

    def checked(self, source: str) -> "ImportedCalibration":
        """Return itself if its rotation is valid.

        Raises:
            InputError: the rotation is mirrored, or not a rotation at all.
        """
        try:
            self.pose.camera_from_radar()
        except ValueError as error:
            raise InputError(f"{source}: {error}; give a proper rotation") from None
        return self


def imported(file: CalibrationFile) -> ImportedCalibration:
    """Return one of our calibrations as if it had been read from its file."""
    pose, check = file.calibration.camera_from_radar, file.check_point
    return ImportedCalibration(
        "json",
        WrittenPose("matrix", pose.rotation, pose.translation_m, "camera_from_radar"),
        camera=file.calibration.camera,
        frames=file.frames,
        check_point=StatedCheckPoint(check.radar_m, pixel_px=check.pixel_px) if check else None,
        file=file,
        evidence=file.rests_on,
    )


Comment = Literal["#", "<!-- -->", "keys", "numbers", "none"]

CameraShare = Literal["none", "matrix", "lens"]
"""How much of the camera a format stores: nothing, its matrix without distortion, or the whole lens."""


@dataclass(frozen=True, slots=True)
class Reads:
    """How a format is read.

    Attributes:
        recognizes: returns whether a file's content is of this format; raises nothing.
        read: returns the calibration in recognized content, given the name of the file for error messages; raises
            InputError if the content is invalid.
        beside: names of files that complete one, if they are in the same folder; they arrive in `Content.beside`.
    """

    recognizes: Callable[[Content], bool]
    read: Callable[[Content, str], ImportedCalibration]
    beside: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One format of calibration files.

    Attributes:
        name: the value of `--to`.
        title: a one-line description.
        numbers: what the numbers in the file mean, in one line: the direction of the transform and the order of the numbers.
        file_name: the default file name.
        camera: how much of the camera it stores.
        comment: where it states its frames and check point: in comments ("#", "<!-- -->"), in keys of its own, as
            numbers without the frames (in formats that hold nothing else), or nowhere.
        write: returns the file content for a calibration; raises InputError for what the format cannot represent. None
            if the format can only be read.
        reads: how it is recognized and read; None if the format can only be written.
        notes: what a user of the file must know, one sentence each.
        write_in_parent: like write, with a given pose of the radar in a third frame (kit, ego); None if it has none.
        used_in: where its files are used: the heading in lists.
        also: other words that someone may search for.
        notes_on: returns more notes, which depend on the calibration; None if there are none.
        pose_for: the radar data that its pose is for, unless the user says: "raw" if the file serves to project returns,
            "corrected" if it states a mounting. None if it stores what the radar gets wrong, too, or no pose.
    """

    name: str
    title: str
    numbers: str
    file_name: str
    camera: CameraShare
    comment: Comment
    write: Callable[[CalibrationFile], str | bytes] | None
    reads: Reads | None
    notes: tuple[str, ...] = ()
    write_in_parent: Callable[[CalibrationFile, RigidTransform], str | bytes] | None = None
    used_in: str = "Other tools"
    also: str = ""
    notes_on: Callable[[CalibrationFile], tuple[str, ...]] | None = None
    pose_for: PoseFor | None = "corrected"

    @property
    def is_for_rectified(self) -> bool:
        """Whether its images must be rectified: it stores a camera matrix but no distortion."""
        return self.camera == "matrix"


@dataclass(frozen=True, slots=True, eq=False)
class Roles:
    """Which of two frames is the radar's and which the camera's, and what was assumed.

    Attributes:
        pose: the numbers with the meaning that the frames give them.
        frames: of the radar, and of the camera's optical axes.
        assumptions: what the names do not say, one sentence each.
    """

    pose: WrittenPose
    frames: FrameNames
    assumptions: tuple[str, ...]


def posed_between(parent: str, child: str, stated: FrameNames | None, numbers: WrittenPose) -> Roles:
    """Interpret "the pose of child in parent": which frame is the radar's, and which axes the camera's has.

    A camera frame has body axes unless its name says "optical" (REP 103), or its numbers fit optical axes alone.

    Args:
        parent: name of the frame the pose is given in; its numbers carry child points into it.
        child: name of the other.
        stated: the frames that the file states in a comment, if it does.
        numbers: as written; the direction and axes in it are not looked at.

    Raises:
        InputError: a frame has no name, or by its name the other frame is not the radar's but the vehicle's or another sensor's.
    """
    assumptions: list[str] = []
    if stated is not None and stated.radar in (parent, child):
        radar, camera = stated.radar, child if parent == stated.radar else parent
    else:
        child_is_radar = looks_like_radar(child) and not looks_like_radar(parent)
        parent_is_camera = looks_like_camera(parent) and not looks_like_camera(child)
        radar_first = not (child_is_radar or (parent_is_camera and not looks_like_radar(parent)))
        radar, camera = (parent, child) if radar_first else (child, parent)
        if not (looks_like_radar(radar) and not looks_like_radar(camera)):
            refuse_another_sensor(radar, "radar", "--radar")
            assumptions.append(f"the file does not say which frame is the radar's; assumed {radar!r}")
    pose = replace(numbers, direction="radar_from_camera" if parent == radar else "camera_from_radar", axes="optical")
    axes: Axes = "optical"
    if stated is not None and camera in (stated.camera, stated.camera_link):
        frames, axes = stated, "optical" if camera == stated.camera else "link"
    elif "optical" in camera:
        frames = FrameNames(radar, camera)
    else:
        if not looks_like_camera(camera):
            refuse_another_sensor(camera, "camera", "--camera-frame")
        axes = "optical" if _fits_optical_alone(pose) else "link"
        assumptions.append(_ASSUMED_AXES[axes].format(camera))
        frames = FrameNames(radar, camera if axes == "optical" else _optical_name(camera))
    return Roles(replace(pose, axes=axes), frames, tuple(assumptions))


def refuse_another_sensor(frame: str, kind: str, flag: str) -> None:
    """Refuse to take a frame for the radar's or the camera's that is named like the vehicle's or another sensor's.

    Raises:
        InputError: it is.
    """
    if _OTHER_NAME.search(frame):
        raise InputError(
            f"{frame!r} is no {kind} by its name; if it is the {kind}'s frame, say so with {flag} {frame}, or rename it; "
            f"else give the pose of the {kind} as well"
        )


_RADAR_NAME = re.compile(r"radar|rdr|mmwave|umrr|ars\d|srr|mrr|lrr", re.IGNORECASE)

_LIDAR = r"lidar|laser|velo(?!c)|livox|ouster|hesai|pandar|robosense|(?<![a-z])(?:ldr|os[012]|vlp|hdl|rs_?16)(?![a-z])"
_LIDAR_NAME = re.compile(_LIDAR, re.IGNORECASE)

_OTHER_NAME = re.compile(
    rf"base|{_LIDAR}|imu|gps|gnss|novatel|vehicle|chassis|robot|world|\bego|\brig\b|\bmap\b|odom|gripper|tool\d",
    re.IGNORECASE,
)

_CAMERA_NAME = re.compile(r"cam|optical|image|rgb", re.IGNORECASE)

_ASSUMED_AXES = {
    "link": "assumed that {!r} has body axes (x forward), as frames without _optical in their name (REP 103)",
    "optical": "assumed that {!r} has optical axes (z forward): its name does not say so, but its numbers fit no others",
}


def _fits_optical_alone(pose: WrittenPose) -> bool:
    """Return whether the camera looks where the radar looks with optical axes, and does not with body axes."""
    try:
        with_optical, with_body = (replace(pose, axes=axes).camera_from_radar() for axes in ("optical", "link"))
    except ValueError:  # not a rotation, which the reader reports
        return False
    return looks_forward(with_optical) and not looks_forward(with_body)


def _optical_name(camera: str) -> str:
    """Return what the optical frame of a camera's body frame is called by custom."""
    stem = camera.removesuffix("_link")
    return f"{stem.removesuffix('_frame')}_optical_frame" if stem.endswith("_frame") else f"{stem}_optical"


def looks_like_camera(name: str) -> bool:
    """Return whether a frame name looks like a camera's."""
    return bool(_CAMERA_NAME.search(name))


def looks_like_lidar(name: str) -> bool:
    """Return whether a name looks like a lidar's."""
    return bool(_LIDAR_NAME.search(name))


def of_lidar(name: str) -> str:
    """Return what is assumed of a pose whose names mention a lidar."""
    return f"{name!r} names a lidar, not a radar: the pose is taken for the radar's"


def looks_like_radar(name: str) -> bool:
    """Return whether a frame name looks like a radar's."""
    return bool(_RADAR_NAME.search(name)) and not _CAMERA_NAME.search(name)
