"""Clicks of a file for a recording: checked that they are of it, and moved to its frames."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import read_text
from calib_core.interchange.own.clicks_json import ClicksFile, read_clicks_file
from calib_core.measurements import ReflectorClick, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.recordings import Recording
from calib_core.recordings.field_words import units_for
from calib_core.results import Calibration
from cocalib.session.click_stamps import ClicksAtFrames, clicks_at_frames
from cocalib.session.state import Outcome
from cocalib.solving.solving import solve_clicks

SPEED_UNIT = "speed-unit"
"""The key of the assumption that asks nothing where no unit changes the pose."""
_SAME_POSE = 0.1
_FASTEST_MPS = 100.0


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


def require_confirmed(recording: Recording, *, but: str = "") -> None:
    """Refuse a recording whose units, signs or meanings are assumed.

    Args:
        recording: what will be solved.
        but: the key of assumptions that may wait.

    Raises:
        InputError: there is an unconfirmed assumption; all are named.
    """
    waiting = [assumption for assumption in recording.assumptions if assumption.key != but]
    if waiting:
        named = "; ".join(
            f"{assumption.topic}: {assumption.text} (confirm: {assumption.confirm})" for assumption in waiting
        )
        raise InputError(
            f"{recording.name}: the recording does not state everything that is needed: {named}; "
            "state what is right, or confirm all of it with --confirm-assumptions"
        )


def speed_unit_notes(
    recording: Recording,
    clicks: Sequence[ReflectorClick],
    camera: Camera,
    options: CalibrationOptions,
    outcome: Outcome,
) -> tuple[str, ...]:
    """Return what to note about the assumed unit of a speed that cannot change the pose.

    Args:
        recording: what was solved.
        clicks: what it was solved with.
        camera: the intrinsics.
        options: of the calibration.
        outcome: with the assumed unit.

    Raises:
        InputError: in another unit there is another pose, or none.
    """
    speeds = [assumption for assumption in recording.assumptions if assumption.key == SPEED_UNIT]
    if not speeds:
        return ()
    assumed = {row.unit for row in recording.radar_columns if row.quantity in ("doppler", "velocity")}
    units = units_for("doppler")
    scale = next((unit.scale for unit in units if unit.name in assumed), 1.0)
    others = [unit for unit in units if unit.name not in assumed]
    for unit in others:
        other = solve_clicks(recording, clicks, camera, _with_slower_gate(options, scale / unit.scale))
        if isinstance(outcome, Unsolvable) or isinstance(other, Unsolvable) or not _same_pose(outcome, other):
            require_confirmed(recording)
    return tuple(f"{one.words}; in {', '.join(unit.name for unit in others)} the pose is the same" for one in speeds)


def _with_slower_gate(options: CalibrationOptions, factor: float) -> CalibrationOptions:
    """Return options that keep the returns which are static if all speeds are divided by a factor."""
    gating_mps, paper_mps = (min(one.max_speed_mps * factor, _FASTEST_MPS) for one in (options.gating, options.paper))
    gating = dataclasses.replace(options.gating, max_speed_mps=gating_mps)
    paper = dataclasses.replace(options.paper, max_speed_mps=paper_mps)
    return dataclasses.replace(options, gating=gating, paper=paper)


def _same_pose(first: Calibration, second: Calibration) -> bool:
    """Return whether poses differ by less than a tenth of their standard deviations."""
    error = second.camera_from_radar.error_from(first.camera_from_radar)
    return bool(np.all(np.abs(error) <= _SAME_POSE * np.sqrt(np.diag(first.covariance))))


def _require_inside(clicks: Sequence[ReflectorClick], camera: Camera, *, source: Path) -> None:
    """Refuse clicks outside the image; the first one is named."""
    for click in clicks:
        if not camera.in_image(np.array([[click.u_px, click.v_px]]))[0]:
            raise InputError(
                f"{source}: click {click.id} at ({click.u_px:g}, {click.v_px:g}) px is outside the image of "
                f"{camera.width_px} x {camera.height_px} px; give the clicks of this recording, in its pixels, column first"
            )
