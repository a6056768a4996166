"""Which recording a session belongs to: the one with exactly these frames, whatever its file is called now."""

import hashlib
from dataclasses import replace
from pathlib import Path

import msgspec

from app.session import RecordingFacts
from app.session.file.errors import SessionFileError
from app.session.file.step_json import StampForm
from calib_core.measurements import Stamp, TimeNs

__all__ = ["SCHEMA", "RecordingForm", "recording_form", "require_same_recording"]

SCHEMA = "cocalib/session-1"


class RecordingForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A recording as a session file identifies it.

    Attributes:
        name: what the user called it.
        frames: number of frames.
        width_px: columns of a frame.
        height_px: rows of a frame.
        start: stamp of the first frame; None without frames.
        stamps_sha256: of all stamps, as little-endian 64-bit integers.
        radar_axes: what the user specified about the radar's axes; it may change from run to run.
    """

    name: str
    frames: int
    width_px: int
    height_px: int
    start: StampForm | None
    stamps_sha256: str
    radar_axes: str | None = None


def recording_form(facts: RecordingFacts) -> RecordingForm:
    """Return the identity of a recording."""
    times_ns = facts.image_times
    return RecordingForm(
        name=facts.name,
        frames=len(times_ns),
        width_px=facts.width_px,
        height_px=facts.height_px,
        start=StampForm.of(Stamp.of(TimeNs(int(times_ns[0])))) if len(times_ns) else None,
        stamps_sha256=hashlib.sha256(times_ns.astype("<i8").tobytes()).hexdigest(),
        radar_axes=facts.radar_axes,
    )


def require_same_recording(kept: RecordingForm, facts: RecordingFacts, folder: Path) -> None:
    """Refuse a session of another recording: its clicks would belong to no frame, or to the wrong one.

    Raises:
        SessionFileError: frames, stamps or image size differ.
    """
    opened = recording_form(facts)
    if 0 < kept.frames < opened.frames:  # the recording may have grown since
        opened = recording_form(replace(facts, image_times=facts.image_times[: kept.frames]))
    if msgspec.structs.replace(kept, name=opened.name, radar_axes=opened.radar_axes) == opened:
        return
    raise SessionFileError(
        f"{folder}: the session belongs to {_described(kept)}, but the recording is {_described(opened)}; "
        "open the recording and the image topic it was made with, give another --session folder, or start over with --fresh "
        "(a backup is kept)"
    )


def _described(form: RecordingForm) -> str:
    start = f" from {form.start.sec}.{form.start.nanosec:09d} s" if form.start else ""
    return f"'{form.name}' ({form.frames} frames of {form.width_px} x {form.height_px} px{start})"
