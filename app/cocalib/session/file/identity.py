"""Which recording a session belongs to: the one that begins with exactly these frames, whatever its file is called now."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from calib_core.arrays import TimesNs
from calib_core.measurements import Stamp, TimeNs
from cocalib.session.file.guarded_folder import SessionFileError
from cocalib.session.state import RecordingFacts

_FIRST_DATE_S = 631_152_000
"""Earlier stamps count from the start of the recording, or of a simulation: 1990."""


class RecordingForm(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A recording as a session file identifies it.

    Attributes:
        name: what the user called it.
        frames: number of frames.
        width_px: columns of a frame.
        height_px: rows of a frame.
        start: stamp of the first frame, or scan; None without either.
        stamps_sha256: of all stamps of the frames, as little-endian 64-bit integers; without frames, of the radar's scans.
        radar_axes: what the user specified about the radar's axes; it may change from run to run.
        scans: number of the radar's scans, if there are no frames.
    """

    name: str
    frames: int
    width_px: int
    height_px: int
    start: Stamp | None
    stamps_sha256: str
    radar_axes: str | None = None
    scans: int = 0


def recording_form(facts: RecordingFacts) -> RecordingForm:
    """Return the identity of a recording."""
    frames = len(facts.image_times)
    times_ns = facts.image_times if frames else facts.radar_times
    return RecordingForm(
        name=facts.name,
        frames=frames,
        width_px=facts.width_px,
        height_px=facts.height_px,
        start=Stamp.of(TimeNs(int(times_ns[0]))) if len(times_ns) else None,
        stamps_sha256=_digest(times_ns),
        radar_axes=facts.radar_axes,
        scans=0 if frames else len(times_ns),
    )


def is_same_recording(kept: RecordingForm, facts: RecordingFacts) -> bool:
    """Return whether a recording begins with the stamps of the kept one: it may have grown since, but not have changed."""
    if kept.frames and (kept.width_px, kept.height_px) != (facts.width_px, facts.height_px):
        return False
    times_ns = facts.image_times if kept.frames else facts.radar_times
    count = kept.frames or kept.scans
    if not count:
        return len(facts.image_times) == len(facts.radar_times) == 0
    return 0 < count <= len(times_ns) and _digest(times_ns[:count]) == kept.stamps_sha256


def require_same_recording(kept: RecordingForm, facts: RecordingFacts, folder: Path) -> None:
    """Refuse a session of another recording: its clicks would belong to no frame, or to the wrong one.

    Raises:
        SessionFileError: stamps or image size differ.
    """
    if is_same_recording(kept, facts):
        return
    raise SessionFileError(
        f"{folder}: the session belongs to {_recording_text(kept)}, but the recording is "
        f"{_recording_text(recording_form(facts))}; "
        "open the recording and the image topic it was made with, give another --session folder, or start over with --fresh "
        "(a backup is kept)"
    )


def has_dates(kept: RecordingForm) -> bool:
    """Return whether the stamps are dates; stamps that count from 0 may be equal in different recordings."""
    return kept.start is not None and kept.start.sec >= _FIRST_DATE_S


def facts_of(kept: RecordingForm) -> RecordingFacts:
    """Return the facts of a recording that is not at hand: every stamp may be that of a frame."""
    nothing = np.zeros(0, dtype=np.int64)
    return _AbsentRecording(kept.name, nothing, kept.width_px, kept.height_px, kept.radar_axes)


@dataclass(frozen=True, slots=True, eq=False)
class _AbsentRecording(RecordingFacts):
    def frame_at(self, time: TimeNs) -> int | None:
        return 0


def _digest(times_ns: TimesNs) -> str:
    return hashlib.sha256(times_ns.astype("<i8").tobytes()).hexdigest()


def _recording_text(form: RecordingForm) -> str:
    start = f" from {form.start.sec}.{form.start.nanosec:09d} s" if form.start else ""
    what = f"{form.frames} frames of {form.width_px} x {form.height_px} px"
    if not form.frames and form.scans:
        what = f"{form.scans} radar scans, no frames"
    return f"'{form.name}' ({what}{start})"
