"""A calibration in another format: written, or refused in words where the format cannot carry it."""

from dataclasses import dataclass

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.format import Format
from calib_core.interchange.formats.registry import format_named, written_formats

__all__ = ["Export", "export"]

_RECTIFIED_NOTE = (
    "written for rectified pictures, as you say yours are: undistorted with this same camera matrix, no distortion left; "
    "on pictures as the camera took them it is wrong"
)


@dataclass(frozen=True, slots=True)
class Export:
    """A file to write.

    Attributes:
        file_name: what to call it.
        content: text, or bytes where the format is binary.
        notes: what a person must know who uses it.
    """

    file_name: str
    content: str | bytes
    notes: tuple[str, ...] = ()

    @property
    def data(self) -> bytes:
        """The file's bytes."""
        return self.content.encode() if isinstance(self.content, str) else self.content


def export(
    file: CalibrationFile, name: str, *, parent_from_radar: RigidTransform | None = None, rectified: bool = False
) -> Export:
    """Write a calibration in another format: the same calibration gives the same bytes.

    Args:
        file: what to export.
        name: of a format that is written.
        parent_from_radar: the radar's pose in the third frame of "autoware" (kit), "driveworks" (rig) or "nuscenes" (ego).
        rectified: the pictures that the file is for are undistorted with this same camera matrix, no distortion left;
            "kitti" and "nuscenes" have no place for distortion and take a distorted lens only so.

    Raises:
        InputError: no such format, or it cannot carry this calibration: why, and what to take instead.
    """
    chosen = format_named(name)
    if chosen.write is None:
        raise InputError(f"the format {name} is only read; cocalib export --to list names those that are written")
    camera = file.calibration.camera
    _refuse_what_the_lens_forbids(chosen, camera, rectified=rectified)
    if parent_from_radar is None:
        content = chosen.write(file)
    elif chosen.write_in_parent is None:
        able = ", ".join(known.name for known in written_formats() if known.write_in_parent)
        raise InputError(f"the format {name} has no third frame to pose the radar in; those that have: {able}")
    else:
        content = chosen.write_in_parent(file, parent_from_radar)
    notes = (*chosen.notes, _RECTIFIED_NOTE) if chosen.is_for_rectified and camera.is_distorted else chosen.notes
    return Export(chosen.file_name, content, notes)


def _refuse_what_the_lens_forbids(chosen: Format, camera: Camera, *, rectified: bool) -> None:
    if rectified and not chosen.is_for_rectified:
        asking = ", ".join(known.name for known in written_formats() if known.is_for_rectified)
        raise InputError(
            f"rectified pictures concern the formats without a place for distortion ({asking}), and {chosen.name} is none of "
            "them; leave rectified out"
        )
    if chosen.is_for_rectified and camera.is_distorted and not rectified:
        raise InputError(
            f"the format {chosen.name} holds a camera matrix but has no place for the distortion of this {camera.model} lens, "
            "so it would be wrong on the pictures as taken; choose a format that has one, opencv or numpy for example, or say "
            "that your pictures are rectified, undistorted with this same camera matrix (--rectified; on the page, the tick box)"
        )
