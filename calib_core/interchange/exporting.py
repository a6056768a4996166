"""Export a calibration to another format, or refuse with a clear error if the format cannot represent it."""

from dataclasses import dataclass, replace

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile, FrameNames
from calib_core.interchange.format import Format
from calib_core.interchange.formats.registry import format_named, written_formats

__all__ = ["Export", "export"]

_RECTIFIED_NOTE = (
    "written for rectified pictures: undistorted with this same camera matrix, no distortion left; "
    "wrong for pictures as the camera took them"
)


@dataclass(frozen=True, slots=True)
class Export:
    """A file to write.

    Attributes:
        file_name: the default name.
        content: text, or bytes if the format is binary.
        notes: what a user of the file must know.
        extra_files: further files that belong to it, each a name and its bytes.
    """

    file_name: str
    content: str | bytes
    notes: tuple[str, ...] = ()
    extra_files: tuple[tuple[str, bytes], ...] = ()

    @property
    def data(self) -> bytes:
        """The file's bytes."""
        return self.content.encode() if isinstance(self.content, str) else self.content


def export(
    file: CalibrationFile,
    name: str,
    *,
    parent_from_radar: RigidTransform | None = None,
    rectified: bool = False,
    frames: FrameNames | None = None,
) -> Export:
    """Export a calibration to another format; the same calibration gives the same bytes.

    Args:
        file: what to export.
        name: of a format that can be written.
        parent_from_radar: the radar's pose in the third frame of "autoware" (kit), "driveworks" (rig) or "nuscenes" (ego).
        rectified: the file is for pictures undistorted with this same camera matrix, no distortion left; required for
            a distorted lens by "kitti" and "nuscenes", which cannot store distortion.
        frames: the frame names to write; None for the calibration's own.

    Raises:
        InputError: no such format, or it cannot represent this calibration; the message says why and what to use instead.
    """
    chosen = format_named(name)
    if frames is not None:
        file = replace(file, frames=frames)
    if chosen.write is None:
        raise InputError(
            f"the format {name} can only be read; cocalib export --to list shows those that can be written"
        )
    camera = file.calibration.camera
    _check_lens(chosen, camera, rectified=rectified)
    if parent_from_radar is None:
        content = chosen.write(file)
    elif chosen.write_in_parent is None:
        able = ", ".join(known.name for known in written_formats() if known.write_in_parent)
        raise InputError(f"the format {name} has no third frame to place the radar in; formats that have one: {able}")
    else:
        content = chosen.write_in_parent(file, parent_from_radar)
    notes = (*chosen.notes, _RECTIFIED_NOTE) if chosen.is_for_rectified and camera.is_distorted else chosen.notes
    return Export(chosen.file_name, content, notes)


def _check_lens(chosen: Format, camera: Camera, *, rectified: bool) -> None:
    if rectified and not chosen.is_for_rectified:
        asking = ", ".join(known.name for known in written_formats() if known.is_for_rectified)
        raise InputError(
            f"rectified applies only to formats that cannot store distortion ({asking}), not to {chosen.name}; omit it"
        )
    if chosen.is_for_rectified and camera.is_distorted and not rectified:
        raise InputError(
            f"the format {chosen.name} stores a camera matrix but not the distortion of this {camera.model} lens, so it would "
            "be wrong for pictures as taken; use a format that stores it, such as opencv or numpy, or, if your pictures are "
            "undistorted with this same camera matrix, say so with --rectified (on the page, tick the box)"
        )
