"""Export a calibration to another format, or refuse with a clear error if the format cannot represent it; show a file as text.

Or export a static transform beside an existing frame tree: to the root of the camera's own chain, never a second parent.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames
from calib_core.interchange.cameras.rectification import maps_npz, rectified_camera, rectified_file
from calib_core.interchange.format import Format, PoseFor, WrittenPose
from calib_core.interchange.formats.registry import format_named, written_formats
from calib_core.interchange.formats.static_transform import ChildFrame, second_parent_notes, write_command, write_python
from calib_core.interchange.formats.urdf import write_joint
from calib_core.interchange.own.calibration_json import calibration_sha256
from calib_core.interchange.own.raw_data import OtherPose, for_raw, other_pose
from calib_core.interchange.statement import missing_map
from calib_core.interchange.syntax.mat_file import load_mat
from calib_core.interchange.syntax.zip_archives import pack, unpack
from calib_core.interchange.trees.frame_tree import FrameTree
from calib_core.radar import RadarErrors

_MAPS_NAME = "rectification.npz"
_SAME_MATRIX_NOTE = (
    "written for rectified images: undistorted with this same camera matrix, no distortion left; "
    "wrong for images as the camera took them"
)
_NEW_MATRIX_NOTE = (
    f"written for rectified images with a camera matrix of their own (fx {{:.6g}}, fy {{:.6g}}, cx {{:.6g}}, cy {{:.6g}} px); "
    f"make them with the maps in {_MAPS_NAME} beside this file: cv2.remap(image, map_x, map_y, cv2.INTER_LINEAR); "
    "if your images are already undistorted with the camera matrix that they were taken with, say so with --rectified "
    "(on the page, tick the box)"
)


@dataclass(frozen=True, slots=True)
class ExtraFile:
    """A file that belongs beside an exported one.

    Attributes:
        file_name: its name.
        data: its bytes.
    """

    file_name: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Export:
    """A file to write.

    Attributes:
        file_name: the default name.
        content: text, or bytes if the format is binary.
        notes: what a user of the file must know; the missing angle map first.
        extra_files: what belongs beside it.
        other_pose: what it could hold instead, for the other kind of radar data; None if there is none, or hardly another.
    """

    file_name: str
    content: str | bytes
    notes: tuple[str, ...] = ()
    extra_files: tuple[ExtraFile, ...] = ()
    other_pose: OtherPose | None = None

    @property
    def data(self) -> bytes:
        """The file's bytes."""
        return self.content.encode() if isinstance(self.content, str) else self.content

    @property
    def download(self) -> ExtraFile:
        """Everything as one file: the file itself, or a zip archive of it and what belongs beside it."""
        if not self.extra_files:
            return ExtraFile(self.file_name, self.data)
        files = {self.file_name: self.data, **{extra.file_name: extra.data for extra in self.extra_files}}
        return ExtraFile(f"{self.file_name.partition('.')[0]}_and_maps.zip", pack(files))


@dataclass(frozen=True, slots=True)
class NotExported:
    """A format that cannot represent a calibration.

    Attributes:
        name: of the format.
        reason: why, and what to use instead.
    """

    name: str
    reason: str


def export_all(
    file: CalibrationFile,
    *,
    parent_from_radar: RigidTransform | None = None,
    rectified: bool = False,
    returns: PoseFor | None = None,
) -> tuple[dict[str, Export], tuple[NotExported, ...]]:
    """Export a calibration to every format that can represent it.

    Args:
        file: what to export.
        parent_from_radar: as for `export`; used by the formats that have a third frame.
        rectified: as for `export`; used by the formats that cannot store distortion.
        returns: as for `export`; used by the formats that cannot store the corrections.

    Returns:
        The files by the name of their format, and the formats that cannot represent it.
    """
    written: dict[str, Export] = {}
    refused = []
    for known in written_formats():
        parent = parent_from_radar if known.write_in_parent else None
        try:
            written[known.name] = export(
                file,
                known.name,
                parent_from_radar=parent,
                rectified=rectified and known.is_for_rectified,
                returns=returns if known.pose_for else None,
            )
        except InputError as error:
            refused.append(NotExported(known.name, str(error)))
    return written, tuple(refused)


def export(
    file: CalibrationFile,
    name: str,
    *,
    parent_from_radar: RigidTransform | None = None,
    rectified: bool = False,
    frames: FrameNames | None = None,
    returns: PoseFor | None = None,
) -> Export:
    """Export a calibration to another format; the same calibration gives the same bytes.

    Args:
        file: what to export.
        name: of a format that can be written.
        parent_from_radar: the radar's pose in the third frame of "autoware" (kit), "driveworks" (rig) or "nuscenes" (ego).
        rectified: the file is for images undistorted with this same camera matrix, no distortion left. Without it, "kitti"
            and "nuscenes", which cannot store distortion, get the camera matrix of images rectified with maps of ours.
        frames: the frame names to write; None for the calibration's own.
        returns: "raw" writes the pose for radar data as reported, "corrected" the calibration's own; None what the format is for.

    Raises:
        InputError: no such format, or it cannot represent this calibration; the message says why and what to use instead.
    """
    chosen = format_named(name)
    if frames is not None and frames != file.frames:
        file = replace(file, frames=frames, made_from_sha256=calibration_sha256(file))
    if chosen.write is None:
        raise InputError(
            f"the format {name} can only be read; cocalib export --to list shows those that can be written"
        )
    _refuse_rectified(chosen, rectified=rectified)
    meant, kept = posed(file, chosen, returns)
    prepared = _prepared(meant, chosen, rectified=rectified)
    if parent_from_radar is None:
        content = chosen.write(prepared.file)
    elif chosen.write_in_parent is None:
        able = ", ".join(known.name for known in written_formats() if known.write_in_parent)
        raise InputError(f"the format {name} has no third frame to place the radar in; formats that have one: {able}")
    else:
        content = chosen.write_in_parent(prepared.file, parent_from_radar)
    other = other_pose(meant) if chosen.pose_for else None
    choice = () if other is None else (other.note,)
    lost = missing_map(meant.calibration) if chosen.pose_for else ()
    notes_on = chosen.notes_on(meant) if chosen.notes_on else ()
    notes = (*lost, *choice, *kept, *chosen.notes, *notes_on, *prepared.notes)
    return Export(chosen.file_name, content, notes, prepared.extra_files, other)


def posed(file: CalibrationFile, chosen: Format, returns: PoseFor | None) -> tuple[CalibrationFile, tuple[str, ...]]:
    """Return the calibration with the pose that a format is to hold, and why it keeps its own if that is for data as reported.

    Raises:
        InputError: the format stores the corrections, or the pairs determine no such pose.
    """
    if chosen.pose_for is None and returns is not None:
        raise InputError(f"the format {chosen.name} stores the radar's corrections, or no pose; omit --for")
    if (returns or chosen.pose_for) != "raw":
        return file, ()
    if file.calibration.radar_errors == RadarErrors() and file.corrected is None:
        return file, ("no corrections are known: the pose serves for returns as reported",)
    try:
        return for_raw(file), ()
    except InputError as error:
        if returns is not None:
            raise
        return file, (f"the pose is for corrected returns: {error}",)


_JOINING: Mapping[str, Callable[[CalibrationFile, ChildFrame], str]] = {
    "tf2": write_command,
    "tf2-launch-py": write_python,
    "urdf": write_joint,
}


def attached_export(file: CalibrationFile, name: str, tree: FrameTree, *, returns: PoseFor | None = None) -> Export:
    """Export a calibration for use beside a frame tree.

    If the camera's frame has a parent there, the transform leads from the radar to the root of its chain, such as the
    camera_link of its driver.

    Args:
        file: what to export.
        name: of a format that publishes or describes frames.
        tree: of the robot, its driver or a recording.
        returns: as for `export`.

    Raises:
        InputError: the format has no frames, or radar and camera are already connected in the tree.
    """
    if name not in _JOINING:
        raise InputError(
            f"--tree is for formats that add a joint to a frame tree ({', '.join(_JOINING)}), not {name}; omit it"
        )
    plain = export(file, name, returns=returns)
    file, _ = posed(file, format_named(name), returns)
    radar, camera = file.frames.radar, file.frames.camera
    if camera not in tree.frames:
        near = f"the tree has no frame {camera}, so it becomes a new one; if it has another name there, give --camera-frame"
        return replace(plain, notes=(*plain.notes, near))
    root = tree.root_of(camera)
    if radar in tree.frames and tree.root_of(radar) == root:
        way = "; ".join(str(step.joint) for step in tree.path(radar, camera))
        raise InputError(
            f"{radar} and {camera} are already connected ({way}), and another transform would give a frame a second parent; "
            "change a joint of that tree instead: cocalib export CALIBRATION.json --into FILE"
        )
    if root == camera:
        return plain
    content = _JOINING[name](file, ChildFrame(root, tree.between(root, camera)))
    note = (
        f"{camera} already has a parent, {tree.root_of(camera)} is the root of its chain: the transform leads from {radar} to "
        f"{root}, and the chain below it stays its driver's"
    )
    notes = tuple(one for one in plain.notes if one not in second_parent_notes(file))
    return replace(plain, content=content, notes=(*notes, note))


@dataclass(frozen=True, slots=True, eq=False)
class _Prepared:
    """What a format is given to write."""

    file: CalibrationFile
    notes: tuple[str, ...] = ()
    extra_files: tuple[ExtraFile, ...] = ()


def _prepared(file: CalibrationFile, chosen: Format, *, rectified: bool) -> _Prepared:
    """Return the calibration as the format can hold it: that of rectified images if it stores no distortion.

    Raises:
        InputError: no rectified image can be cut from this lens.
    """
    camera = file.calibration.camera
    if not (chosen.is_for_rectified and camera.is_distorted):
        return _Prepared(file)
    if rectified:
        same = Camera("pinhole", camera.width_px, camera.height_px, camera.matrix_px)
        return _Prepared(rectified_file(file, same), (_SAME_MATRIX_NOTE,))
    new = rectified_camera(camera)
    k = new.matrix_px
    note = _NEW_MATRIX_NOTE.format(k[0, 0], k[1, 1], k[0, 2], k[1, 2])
    return _Prepared(rectified_file(file, new), (note,), (ExtraFile(_MAPS_NAME, maps_npz(camera, new)),))


def _refuse_rectified(chosen: Format, *, rectified: bool) -> None:
    if rectified and not chosen.is_for_rectified:
        asking = ", ".join(known.name for known in written_formats() if known.is_for_rectified)
        raise InputError(
            f"rectified applies only to formats that cannot store distortion ({asking}), not to {chosen.name}; omit it"
        )


_MAT_TEXT_BYTES = 116


def contents_text(written: Export) -> str:
    """Return a text file unchanged, and a binary file as text, one member after the other."""
    content = written.content
    if isinstance(content, str):
        return content
    if content.startswith(b"PK"):
        members = unpack(content, source=written.file_name)
        return "\n".join(f"[{name}]\n{data.decode('utf-8', errors='replace')}" for name, data in members.items())
    comment = content[:_MAT_TEXT_BYTES].decode("ascii", errors="replace").rstrip("\0 ")
    return "\n".join([comment, "", *_variables(load_mat(content, source=written.file_name))]) + "\n"


def _variables(values: Mapping[str, Any], owner: str = "") -> Iterator[str]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _variables(value, f"{owner}{key}.")
            continue
        array = np.asarray(value)
        if array.dtype.kind in "US":
            lines = [line for text in array.ravel().tolist() for line in str(text).splitlines()]
            yield from (
                [f"{owner}{key} = {lines[0]!r}"]
                if len(lines) == 1
                else [f"{owner}{key}", *(f"    {line}" for line in lines)]
            )
            continue
        yield f"{owner}{key}  {array.dtype}  {' x '.join(map(str, array.shape)) or 'scalar'}"
        yield from (f"    {row}" for row in _rows(array))


def _rows(array: np.ndarray) -> list[str]:
    """Format an array row by row, each number with six significant digits."""
    rows = np.atleast_2d(array)
    return ["".join(f"{value:>13.6g}" for value in row.ravel().tolist()) for row in rows]


_NAMES = "x y z qx qy qz qw"


def parent_pose(numbers: Sequence[float]) -> RigidTransform:
    """Return parent_from_radar from x, y, z [m] and the quaternion qx, qy, qz, qw.

    Raises:
        InputError: there are not seven numbers, one is not finite, or the quaternion's length is not 1.
    """
    if len(numbers) != 7 or not all(map(math.isfinite, numbers)):
        raise InputError(
            f"the pose of the radar in its parent takes seven finite numbers: {_NAMES} (meters, quaternion)"
        )
    try:
        pose = WrittenPose("quaternion_xyzw", np.array(numbers[3:]), np.array(numbers[:3]), "camera_from_radar")
        return pose.as_written()
    except ValueError as error:
        raise InputError(f"the pose of the radar in its parent: {error}; the order is {_NAMES}, qw last") from None
