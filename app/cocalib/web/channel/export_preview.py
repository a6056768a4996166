"""What the page Deliver shows of one format: the file's text, what its numbers mean, and the result of reading it back."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile, Evidence
from calib_core.interchange.check.report import CheckReport, check
from calib_core.interchange.exporting import Export, contents_text, export, posed
from calib_core.interchange.format import PoseFor, imported
from calib_core.interchange.formats.registry import format_named
from calib_core.interchange.importing import read_any
from calib_core.interchange.statement import missing_map
from cocalib.view.wording import sentence
from cocalib.web.exports import (
    CheckPointRow,
    Field,
    FieldError,
    Fields,
    FileNumbers,
    PoseInFile,
    check_point_row,
    fields_in,
    our_numbers,
    pose_in_file,
)

_EVIDENCE: dict[Evidence, str] = {
    "clicked": "Rests on clicks",
    "imported_proven": "Imported; a check point, pairs or another calibration proved what its numbers mean",
    "imported_assumed": "Imported; what its numbers mean was assumed, nothing proves it",
    "automatic": "Rests on automatic, unconfirmed clicks",
    "carried": "Carried forward from an older calibration by a turn that was watched",
}


@dataclass(frozen=True, slots=True)
class PoseChoice:
    """The pose for the other kind of radar data.

    Attributes:
        is_for: the radar data that it is for: "raw" as reported, or "corrected".
        gain: what it would change.
    """

    is_for: PoseFor
    gain: str


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
        is_for_rectified: it is for rectified images: those that the user declared rectified, or those that its maps make.
        pose: the pose in the file, as read back: its direction, its frames and its numbers; None if it holds none.
        our_pose: camera_from_radar of the calibration.
        check_point: what a reader of the file must get; None if the calibration has none, or the file no pose.
        check: what `cocalib check` says about the file.
        check_is_good: whether it found no problem.
        radar_frame: the calibration's name of the radar's frame.
        camera_frame: its name of the camera's optical frame.
        names_frames: the file holds frame names.
        evidence: what the pose rests on.
        missing: what the calibration has and this file cannot hold; "" if nothing.
        other_pose: what the file could hold instead, for the other kind of radar data; None if nothing else.
        asks_despite_verdict: the calibration is contradictory: whoever saves it says so.
    """

    key: str
    file_name: str
    text: str
    is_binary: bool
    size_bytes: int
    numbers: str
    notes: tuple[str, ...]
    is_for_rectified: bool
    pose: PoseInFile | None
    our_pose: FileNumbers
    check_point: CheckPointRow | None
    check: str
    check_is_good: bool
    radar_frame: str
    camera_frame: str
    names_frames: bool
    evidence: str
    missing: str
    other_pose: PoseChoice | None
    asks_despite_verdict: bool


@dataclass(frozen=True, slots=True)
class NoPreview:
    """Why there is nothing to save yet, and what to do.

    Attributes:
        reason: in sentences.
        field: the part of the panel that the user has to fill in or correct; "" if none.
    """

    reason: str
    field: Field | None = None


def exported(file: CalibrationFile, key: str, query: str) -> Export:
    """Write a calibration in a format, with what the user filled in, from a URL's query.

    Raises:
        FieldError: a field cannot be used, the format needs it, or the calibration is contradictory and nobody said to write it.
        InputError: the format cannot hold this calibration, or has no third frame.
    """
    fields = fields_in(query, file.frames)
    if _asks_despite_verdict(file, key) and not fields.despite_verdict:
        raise FieldError(
            "despite_verdict", "the calibration is contradictory; tick that it is to be written nevertheless"
        )
    return _exported(file, key, fields)


def export_preview(file: CalibrationFile, key: str, query: str, recording_name: str) -> ExportPreview:
    """Show a calibration in a format before it is saved.

    Args:
        file: the calibration.
        key: of the format.
        query: of the URL, with what the user filled in.
        recording_name: what the user calls the recording.

    Raises:
        FieldError: a field cannot be used, or the format needs it.
        InputError: the format cannot hold this calibration, or has no third frame.
    """
    fields = fields_in(query, file.frames)
    written, form = _exported(file, key, fields), format_named(key)
    file, _ = posed(file, form, fields.returns if form.pose_for else None)
    named = replace(file, frames=fields.frames)
    whole = imported(named)
    report = check(read_any(written.data, written.file_name) if form.reads else whole, against=whole)
    saved = written.download
    lost, other = missing_map(file.calibration) if form.pose_for else (), written.other_pose
    told = (*lost, other.note) if other else lost
    return ExportPreview(
        key=key,
        file_name=f"{_slug(recording_name)}_{saved.file_name}",
        text=contents_text(written),
        is_binary=isinstance(written.content, bytes) or bool(written.extra_files),
        size_bytes=len(saved.data),
        numbers=sentence(form.numbers),
        notes=tuple(sentence(note) for note in written.notes if note not in told),
        is_for_rectified=form.is_for_rectified and file.calibration.camera.is_distorted,
        pose=pose_in_file(report.imported, fields.frames) if form.reads else None,
        our_pose=our_numbers(file.calibration.camera_from_radar),
        check_point=check_point_row(named, form, report.imported) if form.reads else None,
        check=_read_back(report) if form.reads else "Not read back: this format has no pose to read.",
        check_is_good=report.ok,
        radar_frame=file.frames.radar,
        camera_frame=file.frames.camera,
        names_frames=report.imported.frames is not None,
        evidence=_evidence(file),
        missing=" ".join(map(sentence, lost)),
        other_pose=PoseChoice(other.is_for, other.gain) if other else None,
        asks_despite_verdict=_asks_despite_verdict(file, key),
    )


def _asks_despite_verdict(file: CalibrationFile, key: str) -> bool:
    """Return whether to ask before saving: not for our own format, whose readers know the verdict."""
    return file.is_contradictory and key != "json"


def _exported(file: CalibrationFile, key: str, fields: Fields) -> Export:
    form = format_named(key)
    try:
        return export(
            file,
            key,
            parent_from_radar=fields.parent_from_radar,
            rectified=fields.rectified,
            frames=fields.frames,
            returns=fields.returns if form.pose_for else None,
        )
    except InputError as error:
        if form.is_for_rectified and file.calibration.camera.is_distorted and not fields.rectified:
            raise FieldError("rectified", str(error)) from None
        raise


def _evidence(file: CalibrationFile) -> str:
    """Return what the pose rests on, with the verdict, in one or two sentences."""
    clicks = sum(1 for pair in file.calibration.pairs if pair.inlier)
    words = f"Rests on {clicks} clicks" if file.rests_on == "clicked" and clicks else _EVIDENCE[file.rests_on]
    verdict = f" {sentence(f'verdict: {file.verdict.line}')}" if file.verdict is not None else ""
    return f"{words}.{verdict}"


def _read_back(report: CheckReport) -> str:
    """Return the result of reading the file back, in one line."""
    first = report.results[0]
    return "Read back: the pose matches the solved one." if first.code == "agrees" else f"Read back: {first.message}."


def _slug(name: str) -> str:
    """Return a recording's name as the start of a file name: letters, digits and underscores."""
    stem = Path(name).stem if re.search(r"\.\w{2,6}$", name) else name
    return re.sub(r"\W+", "_", stem.removeprefix("the ")).strip("_") or "recording"
