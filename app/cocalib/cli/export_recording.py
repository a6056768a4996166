"""`cocalib export --to mcap`: write a recording again with its calibration."""

import errno
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from calib_core.errors import InputError, RecordingError
from cocalib.cli.output import progress_bar, write_whole
from cocalib.cli.recording_flags import TopicFlags
from cocalib.platform.files import writing_whole

if TYPE_CHECKING:
    from calib_core.deployment import RecordingWritten
    from calib_core.interchange import CalibrationFile, Provenance
    from calib_core.recordings import Recording

MCAP = "mcap"
_LAYOUT_ENDING = ".foxglove-layout.json"


def export_recording(
    file: "CalibrationFile", paths: Sequence[Path], out: Path, *, topics: TopicFlags, force: bool
) -> int:
    """Write the new recording and a layout for Foxglove beside it; return the exit code.

    Args:
        file: the calibration.
        paths: of the recording.
        out: the new recording.
        topics: of the recording; those of the calibration where the user names none.
        force: overwrite existing files.

    Raises:
        InputError: a file cannot be written, or the calibration is not of this recording.
        RecordingError: the recording cannot be read.
    """
    from calib_core.deployment import write_into_recording
    from cocalib.platform.resources import version

    if out.is_dir():
        out = out / f"{paths[0].stem}-calibrated.mcap"
    if out.suffix.lower() != ".mcap":
        raise InputError(f"{out}: the new recording is an MCAP file; name it NAME.mcap")
    layout = out.with_name(out.stem + _LAYOUT_ENDING)
    with _opened(paths, topics, file.provenance) as recording:
        _refuse_overwriting(recording, (out, layout), force=force)
        try:
            with writing_whole(out) as stream, progress_bar("writing messages") as progress:
                written = write_into_recording(recording, file, stream, version=version(), progress=progress)
        except OSError as error:
            raise InputError(f"{out}: {_why(error, recording)}") from error
        write_whole(layout, written.layout)
        _report(recording, written, out, layout)
    return 0


def _opened(paths: Sequence[Path], topics: TopicFlags, provenance: "Provenance") -> "Recording":
    """Open the recording with the topics and columns of the calibration, unless the user names others."""
    from calib_core.recordings import open_recording

    if topics == TopicFlags():
        like_before = replace(
            topics,
            radar_topic=",".join(provenance.radar_topics) or provenance.radar_topic,
            image_topic=provenance.image_topic,
            radar_axes=provenance.radar_axes,
            map=provenance.column_map,
        )
        try:
            return open_recording(tuple(paths), like_before, require=("image",))
        except RecordingError:
            pass  # another recording of the same sensors may have other topics
    return open_recording(tuple(paths), topics, require=("image",))


def _refuse_overwriting(recording: "Recording", files: Sequence[Path], *, force: bool) -> None:
    """Refuse to write over the recording, and over anything else unless told to.

    Raises:
        InputError: one of the files exists.
    """
    for file in files:
        if not file.exists():
            continue
        for original in (*recording.paths, *(source.path for source in recording.sources)):
            if original.exists() and original.samefile(file):
                raise InputError(
                    f"{file}: is the recording itself, which is never changed; choose another name for --out"
                )
        if not force:
            raise InputError(f"{file}: already exists; choose another name, or overwrite it with --force")


def _why(error: OSError, recording: "Recording") -> str:
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        size_gb = sum(source.size_bytes for source in recording.sources) / 1e9
        return (
            f"the disk is full: the new recording needs about {size_gb:.3g} GB; nothing was left behind. Free some space, or "
            "write to another disk"
        )
    return f"cannot be written: {error.strerror or error}"


def _report(recording: "Recording", written: "RecordingWritten", out: Path, layout: Path) -> None:
    """Print what was written, what was added, and what was lost."""
    from calib_core.recordings import about_assumptions

    for note in written.notes:
        print(f"note: {note}", file=sys.stderr)
    for warning in about_assumptions(recording.assumptions):
        print(f"note: {warning.message}; {warning.hint}", file=sys.stderr)
    lost = sum(written.lost.values())
    if lost:
        where = ", ".join(f"{count} of {topic}" for topic, count in sorted(written.lost.items()))
        print(f"note: {lost} messages cannot be read and are left out ({where}): {written.fault}", file=sys.stderr)
    added = ", ".join(f"{count} on {topic}" for topic, count in sorted(written.added.items())) or "none"
    print(f"written to {out}: {written.copied} messages of the recording, unchanged; added: {added}")
    print(f"Foxglove layout: {layout} (in Foxglove: layout menu, Import from file)")
