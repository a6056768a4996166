"""Clicks of a file for a recording: checked that they are of it, and moved to its frames."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import read_text
from calib_core.interchange.own.clicks_json import ClicksFile, read_clicks_file
from calib_core.measurements import ReflectorClick, TimeNs, time_parts
from calib_core.recordings import Recording
from cocalib.session.click_stamps import ClicksAtFrames, clicks_at_frames


def file_of_clicks(path: Path) -> ClicksFile:
    """Read a clicks-1 file.

    Raises:
        InputError: it cannot be read.
    """
    return read_clicks_file(read_text(path), source=str(path))


def clicks_in_recording(
    clicks: Sequence[ReflectorClick], recording: Recording, camera: Camera, *, source: Path
) -> ClicksAtFrames:
    """Return the clicks of a file at the frames of a recording, and which ones were moved to them or set aside.

    Raises:
        InputError: the clicks are not of this recording, or one is outside its image.
    """
    frames = clicks_at_frames(clicks, recording.image_times, source=str(source), others=recording.other_image_times)
    _require_inside(frames.clicks, camera, source=source)
    return frames


def require_confirmed(recording: Recording) -> None:
    """Refuse a recording whose units, signs or meanings are assumed.

    Raises:
        InputError: there is an unconfirmed assumption; all are named.
    """
    if recording.assumptions:
        named = "; ".join(
            f"{assumption.topic}: {assumption.text} (confirm: {assumption.confirm})"
            for assumption in recording.assumptions
        )
        raise InputError(
            f"{recording.name}: the recording does not state everything that is needed: {named}; "
            "state what is right, or confirm all of it with --confirm-assumptions"
        )


def _require_inside(clicks: Sequence[ReflectorClick], camera: Camera, *, source: Path) -> None:
    """Refuse clicks outside the image; the first one is named."""
    for click in clicks:
        if not camera.in_image(np.array([[click.u_px, click.v_px]]))[0]:
            raise InputError(
                f"{source}: click {click.id} at ({click.u_px:g}, {click.v_px:g}) px is outside the image of "
                f"{camera.width_px} x {camera.height_px} px; give the clicks of this recording, in its pixels, column first"
            )


def seconds_text(time: TimeNs) -> str:
    """Write a stamp as seconds with all its digits."""
    sec, nanosec = time_parts(time)
    return f"{sec}.{nanosec:09d} s"
