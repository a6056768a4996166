"""What the export panel shows of one format: the file's text, what its numbers mean, and the result of reading it back."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from urllib.parse import parse_qs

from app.view import sentence, warning_in_sentences
from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix
from calib_core.interchange import (
    CalibrationFile,
    CheckReport,
    Export,
    check,
    contents_text,
    export,
    format_named,
    imported,
    parent_pose,
    read_any,
    written_formats,
)
from calib_core.results import DataWarning

__all__ = [
    "ExportPreview",
    "FormatRow",
    "NoPreview",
    "export_preview",
    "exported",
    "format_rows",
    "parent_in",
    "rectified_in",
]

_PARENT = "parent_from_radar"
_RECTIFIED = "rectified"


@dataclass(frozen=True, slots=True)
class FormatRow:
    """One line of the list of formats.

    Attributes:
        key: what `--to` takes.
        label: one line for display.
        takes_parent: the radar can be posed in a third frame.
        takes_rectified: the user may state that the pictures are rectified already.
    """

    key: str
    label: str
    takes_parent: bool
    takes_rectified: bool


@dataclass(frozen=True, slots=True)
class ExportPreview:
    """One format, before it is saved.

    Attributes:
        key: of the format.
        file_name: what to call the file: recording, then format.
        text: the file, or its contents as text if it is binary.
        is_binary: the file itself is not text.
        size_bytes: of the file.
        numbers: what the file's numbers mean.
        notes: what a user of the file must know.
        is_for_rectified: it is for rectified pictures: those that the user declared rectified, or those that its maps make.
        carries: direction of the pose in the file, as read back.
        axes: of the camera frame that the file uses: optical, or its body frame.
        check: what `cocalib check` says about the file.
        check_is_good: whether it found no problem.
        radar_frame: name of the radar's frame.
        camera_frame: name of the camera's optical frame.
        rotation: camera_from_radar, by rows.
        translation_m: of camera_from_radar.
        quaternion_xyzw: of camera_from_radar.
        warnings: of the calibration.
    """

    key: str
    file_name: str
    text: str
    is_binary: bool
    size_bytes: int
    numbers: str
    notes: tuple[str, ...]
    is_for_rectified: bool
    carries: Literal["camera_from_radar", "radar_from_camera"]
    axes: Literal["optical", "link"]
    check: str
    check_is_good: bool
    radar_frame: str
    camera_frame: str
    rotation: tuple[tuple[float, ...], ...]
    translation_m: tuple[float, ...]
    quaternion_xyzw: tuple[float, ...]
    warnings: tuple[DataWarning, ...]


@dataclass(frozen=True, slots=True)
class NoPreview:
    """Why there is nothing to save yet, and what to do."""

    reason: str


def format_rows() -> tuple[FormatRow, ...]:
    """Return the list of formats."""
    return tuple(
        FormatRow(form.name, form.title, form.write_in_parent is not None, form.is_for_rectified)
        for form in written_formats()
    )


def parent_in(query: str) -> RigidTransform | None:
    """Return the radar's pose in a third frame from a URL's query, `parent_from_radar=x,y,z,qx,qy,qz,qw`; None without one.

    Raises:
        InputError: it is not seven numbers, or not a pose.
    """
    given = parse_qs(query).get(_PARENT)
    if not given:
        return None
    try:
        numbers = [float(word) for word in given[-1].split(",")]
    except ValueError:
        raise InputError(f"{_PARENT}: {given[-1]!r} is not seven numbers") from None
    return parent_pose(numbers)


def rectified_in(query: str) -> bool:
    """Return whether a URL's query says that the pictures are rectified, `rectified=1`.

    Raises:
        InputError: the value is neither 0 nor 1.
    """
    given = parse_qs(query, keep_blank_values=True).get(_RECTIFIED, ["0"])[-1]
    if given not in ("0", "1"):
        raise InputError(f"{_RECTIFIED}: {given!r} is neither 0 nor 1; 1 means that the pictures are rectified")
    return given == "1"


def exported(file: CalibrationFile, key: str, query: str) -> Export:
    """Write a calibration in a format, with the parent's pose and the rectified flag of a URL's query.

    Raises:
        InputError: the format cannot hold this calibration, or has no third frame.
    """
    return export(file, key, parent_from_radar=parent_in(query), rectified=rectified_in(query))


def export_preview(file: CalibrationFile, key: str, query: str, recording_name: str) -> ExportPreview:
    """Show a calibration in a format before it is saved.

    Args:
        file: the calibration.
        key: of the format.
        query: of the URL; it may give the radar's pose in a third frame, and say that the pictures are rectified.
        recording_name: what the user calls the recording.

    Raises:
        InputError: the format cannot hold this calibration, or has no third frame.
    """
    written, form = exported(file, key, query), format_named(key)
    download = written.download
    whole = imported(file)
    report = check(read_any(written.data, written.file_name) if form.reads else whole, against=whole)
    pose = file.calibration.camera_from_radar
    wxyz = quaternion_wxyz_from_matrix(pose.rotation).tolist()
    warnings = file.calibration.warnings
    return ExportPreview(
        key=key,
        file_name=f"{_slug(recording_name)}_{download.file_name}",
        text=contents_text(written),
        is_binary=isinstance(written.content, bytes) or bool(written.extra_files),
        size_bytes=len(download.data),
        numbers=sentence(form.numbers),
        notes=tuple(sentence(note) for note in written.notes),
        is_for_rectified=form.is_for_rectified and file.calibration.camera.is_distorted,
        carries=report.imported.pose.direction,
        axes=report.imported.pose.axes,
        check=_read_back(report) if form.reads else "Not read back: this format has no pose to read.",
        check_is_good=report.ok,
        radar_frame=file.frames.radar,
        camera_frame=file.frames.camera,
        rotation=tuple(tuple(row) for row in pose.rotation.tolist()),
        translation_m=tuple(pose.translation_m.tolist()),
        quaternion_xyzw=(*wxyz[1:], wxyz[0]),
        warnings=tuple(map(warning_in_sentences, warnings)),
    )


def _read_back(report: CheckReport) -> str:
    """Return the result of reading the file back, in one line."""
    first = report.results[0]
    return "Read back: the pose matches the solved one." if first.code == "agrees" else f"Read back: {first.message}."


def _slug(name: str) -> str:
    """Return a recording's name as the start of a file name: letters, digits and underscores."""
    stem = Path(name).stem if re.search(r"\.\w{2,6}$", name) else name
    return re.sub(r"\W+", "_", stem.removeprefix("the ")).strip("_") or "recording"
