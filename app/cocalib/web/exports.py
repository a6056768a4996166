"""What the page Deliver says: its formats and fields; of a file its numbers, their direction and the check point."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, cast, get_args
from urllib.parse import parse_qs

import numpy as np

from calib_core.arrays import Vector2
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames
from calib_core.interchange.exporting import parent_pose
from calib_core.interchange.format import Format, ImportedCalibration, PoseFor, WrittenPose
from calib_core.interchange.formats.registry import written_formats
from calib_core.measurements import TimeNs

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


def pose_in_file(imported: ImportedCalibration, frames: FrameNames) -> PoseInFile:
    """Describe the pose that was read back from a file.

    Args:
        imported: what was read.
        frames: the names that the file was written with.
    """
    pose = imported.pose
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
    if imported.in_third_frame is not None:
        third = _THIRD_FRAMES.get(imported.format, "the third frame")
        both = tuple(
            FileNumbers(f"Pose of {name} in {third}", _rows(one))
            for name, one in zip((frames.radar, camera), imported.in_third_frame, strict=True)
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
    quaternion = _named_numbers(_ORDERS["quaternion_wxyz"], quaternion_wxyz_from_matrix(camera_from_radar.rotation), "")
    return FileNumbers("camera_from_radar of the calibration", (*_matrix_rows(camera_from_radar), *quaternion))


def _rows(pose: WrittenPose) -> tuple[NumberRow, ...]:
    if pose.form == "matrix":
        return _matrix_rows(RigidTransform(pose.rotation_matrix(), pose.translation_m))
    position = _named_numbers(("x", "y", "z"), pose.translation_m, "m")
    if pose.form != "rpy":
        return (*position, *_named_numbers(_ORDERS[pose.form], pose.rotation, ""))
    if pose.angle_unit == "deg":  # 12 digits: what is left of the way to radians and back
        angles = np.array([float(f"{angle:.12g}") for angle in np.rad2deg(pose.rotation)])
        return (*position, *_named_numbers(_ORDERS["rpy"], angles, "deg"))
    return (*position, *_named_numbers(_ORDERS["rpy"], pose.rotation, "rad"))


def _matrix_rows(transform: RigidTransform) -> tuple[NumberRow, ...]:
    rows = [NumberRow(f"R row {index}", _rounded(row), "") for index, row in enumerate(transform.rotation, start=1)]
    return (*rows, NumberRow("t", _rounded(transform.translation_m), "m"))


def _rounded(values: np.ndarray) -> tuple[str, ...]:
    return tuple(f"{value:.9f}" for value in (np.round(values, 9) + 0.0).tolist())


def _named_numbers(names: tuple[str, ...], values: np.ndarray, unit: str) -> tuple[NumberRow, ...]:
    return tuple(
        NumberRow(name, (repr(value + 0.0),), unit) for name, value in zip(names, values.tolist(), strict=True)
    )


_SAME_M = 2e-3
"""The check point is the true position of a pair, rounded to a millimetre in each coordinate."""


@dataclass(frozen=True, slots=True)
class CheckPointRow:
    """The check point, for display.

    Attributes:
        words: what must come out of a reader of the file.
        u_px: column of its pixel in the image as taken.
        v_px: row of it.
        width_px: of that image.
        height_px: of that image.
        pair: id of the pair whose image shows it; "" if none does.
    """

    words: str
    u_px: float
    v_px: float
    width_px: int
    height_px: int
    pair: str


def check_point_row(file: CalibrationFile, form: Format, read_back: ImportedCalibration) -> CheckPointRow | None:
    """Describe the check point of a calibration in a format; None if the calibration has none.

    Args:
        file: the calibration.
        form: the format.
        read_back: what was read from the file in that format.
    """
    check, camera = file.check_point, file.calibration.camera
    if check is None:
        return None
    point = f"The radar point ({', '.join(f'{value:.3f}' for value in check.radar_m)}) m"
    pixel = _pixel_words(check.pixel_px)
    camera_m = (file.calibration.camera_from_radar @ check.radar_m[None])[0]
    if form.is_for_rectified and camera.is_distorted:
        rectified = _pixel_words(_rectified_pixel(camera, read_back, camera_m))
        words = f"{point} must project to {rectified} of the rectified image, which is {pixel} of the image as taken"
    else:
        words = f"{point} must project to {pixel}"
    words += ": recompute it with your reader to test it."
    if form.camera == "none":
        at = ", ".join(f"{value:.3f}" for value in camera_m)
        words += f" This file holds no lens: expect ({at}) m in {file.frames.camera!r}, and the pixel through your own."
    return CheckPointRow(
        words=words,
        u_px=float(check.pixel_px[0]),
        v_px=float(check.pixel_px[1]),
        width_px=camera.width_px,
        height_px=camera.height_px,
        pair=_pair_at(file) or "",
    )


def image_of(file: CalibrationFile) -> TimeNs | None:
    """Return the stamp of the frame in which the check point was clicked; None if it is no pair's position."""
    pair = _pair_at(file)
    return next((one.image_time for one in file.calibration.pairs if one.id == pair), None)


def _pixel_words(pixel_px: Vector2) -> str:
    return f"pixel ({pixel_px[0]:.2f}, {pixel_px[1]:.2f})"


def _rectified_pixel(camera: Camera, read_back: ImportedCalibration, camera_m: np.ndarray) -> Vector2:
    """Project with the matrix that the file holds, or with the lens's own if reading it back gave none."""
    size_px = (camera.width_px, camera.height_px)
    rectified = read_back.camera_for(size_px) or Camera("pinhole", *size_px, camera.matrix_px)
    return rectified.project(camera_m[None])[0]


def _pair_at(file: CalibrationFile) -> str | None:
    """Return the id of the pair whose true position is the check point, if it was clicked in an image."""
    pairs = [pair for pair in file.calibration.pairs if pair.inlier and pair.image_time is not None]
    if file.check_point is None or not pairs:
        return None
    true_m = file.calibration.radar_errors.corrected(np.array([pair.point_radar_m for pair in pairs]))
    apart_m = np.linalg.norm(true_m - file.check_point.radar_m, axis=1)
    nearest = int(np.argmin(apart_m))
    return pairs[nearest].id if apart_m[nearest] < _SAME_M else None


Field = Literal["frames", "parent", "rectified", "returns", "despite_verdict"]
"""A part of the panel that the user fills in."""

_RADAR_FRAME, _CAMERA_FRAME, _PARENT = "radar_frame", "camera_frame", "parent_from_radar"


class FieldError(InputError):
    """What is in a field cannot be used, or the format needs it filled in.

    Attributes:
        field: which one.
    """

    def __init__(self, field: Field, reason: str) -> None:
        super().__init__(reason)
        self.field: Field = field


@dataclass(frozen=True, slots=True)
class Fields:
    """What the user filled in.

    Attributes:
        frames: the names to write.
        parent_from_radar: the radar's pose in a third frame; None for the radar as origin.
        rectified: the images are rectified.
        returns: the radar data that the pose is to be for; None for what the format is used for.
        despite_verdict: a contradictory calibration is to be written, too.
    """

    frames: FrameNames
    parent_from_radar: RigidTransform | None
    rectified: bool
    returns: PoseFor | None
    despite_verdict: bool


def fields_in(query: str, usual: FrameNames) -> Fields:
    """Return the fields in the query of a URL.

    Args:
        query: `radar_frame=`, `camera_frame=`, `parent_from_radar=x,y,z,qx,qy,qz,qw`, `rectified=1`,
            `returns=raw` or `corrected`, and `despite_verdict=1`, each optional.
        usual: the calibration's frame names, for what the query does not name.

    Raises:
        FieldError: a name cannot be a frame's, a pose is none, or another field has no such value.
    """
    given = {key: values[-1] for key, values in parse_qs(query, keep_blank_values=True).items()}
    try:
        frames = FrameNames(given.get(_RADAR_FRAME, usual.radar), given.get(_CAMERA_FRAME, usual.camera))
    except InputError as error:
        raise FieldError("frames", str(error)) from None
    return Fields(
        frames,
        _parent_in(given.get(_PARENT, "")),
        _yes_or_no("rectified", given),
        _returns_in(given.get("returns")),
        _yes_or_no("despite_verdict", given),
    )


def _parent_in(text: str) -> RigidTransform | None:
    if not text:
        return None
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        raise FieldError("parent", f"{_PARENT}: {text!r} is not seven numbers") from None
    try:
        return parent_pose(numbers)
    except InputError as error:
        raise FieldError("parent", str(error)) from None


def _returns_in(text: str | None) -> PoseFor | None:
    if text not in (None, *get_args(PoseFor)):
        raise FieldError("returns", f"returns: {text!r} is neither raw nor corrected")
    return cast(PoseFor | None, text)


def _yes_or_no(field: Literal["rectified", "despite_verdict"], given: Mapping[str, str]) -> bool:
    text = given.get(field, "0")
    if text not in ("0", "1"):
        raise FieldError(field, f"{field}: {text!r} is neither 0 nor 1; 1 means yes")
    return text == "1"


@dataclass(frozen=True, slots=True)
class FormatRow:
    """One line of the list of formats.

    Attributes:
        key: what `--to` takes.
        label: one line for display.
        group: the heading it stands under.
        also: other words to find it by.
        takes_parent: the radar can be posed in a third frame.
        takes_rectified: the user may have to state that the images are rectified.
    """

    key: str
    label: str
    group: str
    also: str
    takes_parent: bool
    takes_rectified: bool


def format_rows() -> tuple[FormatRow, ...]:
    """Return the list of formats, group by group, each in the order of the registry."""
    formats = written_formats()
    groups = list(dict.fromkeys(form.used_in for form in formats))
    return tuple(
        FormatRow(
            form.name,
            form.title,
            form.used_in,
            f"{form.used_in} {form.also} {form.file_name}",
            takes_parent=form.write_in_parent is not None,
            takes_rectified=form.is_for_rectified,
        )
        for form in sorted(formats, key=lambda form: groups.index(form.used_in))
    )
