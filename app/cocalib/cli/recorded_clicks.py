"""Clicks of a file for a recording, with a note on stderr for each that is moved to a frame."""

from collections.abc import Sequence
from pathlib import Path

from calib_core.camera import Camera
from calib_core.measurements import ReflectorClick
from calib_core.recordings import Recording
from cocalib.cli.output import tell_notes
from cocalib.solving.recorded_clicks import clicks_in_recording


def recorded_clicks(
    clicks: Sequence[ReflectorClick], recording: Recording, camera: Camera, *, source: Path
) -> tuple[ReflectorClick, ...]:
    """Return the clicks of a file at the frames of a recording.

    Raises:
        InputError: a click is not of this recording.
    """
    found = clicks_in_recording(clicks, recording, camera, source=source)
    tell_notes(found.moved)
    return found.clicks
