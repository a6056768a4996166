"""`cocalib solve`: calibrate without a browser."""

import dataclasses
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Self

import numpy as np
import tyro

from app.cli.flags import File
from app.cli.output import (
    explain_unsolvable,
    read_text,
    required_camera,
    seconds_text,
    told_clicks_at_frames,
    write_whole,
)
from app.cli.recording_flags import CameraPosition, MeasuredCamera, Options, Recordings, TopicFlags, Topics
from app.terminal import print_exactly
from app.view import summary_lines
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import name_text
from calib_core.measurements import ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration

if TYPE_CHECKING:
    from calib_core.recordings import Recording

__all__ = ["Solve"]


@dataclass(frozen=True, slots=True)
class Solve:
    """Compute a calibration from a recording and its clicks, or from a file of pairs.

    The same clicks give the same file as the page's download, byte for byte.
    """

    recording: Recordings = ()
    """Bags (.bag, .mcap, .db3, folders), or folders of pictures, radar CSV, videos; several are read as one recording."""
    clicks: File = None
    """Clicks in this recording (cocalib/clicks-1 JSON)."""
    pairs: File = None
    """Instead of a recording: radar positions and pixels (cocalib/pairs-1 JSON), or a calibration to solve again."""
    camera: File = None
    """Intrinsics to use if the recording has none, or instead of its own: camera_info YAML, OpenCV YAML/XML, Kalibr, JSON."""
    out: File = None
    """Output file (cocalib/calibration-1 JSON); stdout if omitted."""
    measured: CameraPosition = field(default_factory=MeasuredCamera)
    topics: Topics = field(default_factory=TopicFlags)
    options: Options = field(default_factory=CalibrationOptions)
    pairs_text: Annotated[str | None, tyro.conf.Suppress] = None
    """What the file of pairs holds, once it has been read: a pipe can be read only once."""

    def file_defaults(self) -> Self | None:
        """Take the options of a calibration that is to be solved again; typed options replace them."""
        if self.pairs is None or self.recording or self.clicks:
            return None
        from calib_core.interchange import CALIBRATION_SCHEMA, names_schema, read_calibration

        text = read_text(self.pairs)
        if not names_schema(text, CALIBRATION_SCHEMA):
            return type(self)(pairs_text=text)
        options = read_calibration(text, str(self.pairs)).calibration.options
        position = options.solving.camera_position
        measured = MeasuredCamera(position.position_m, position.sigma_m) if position else MeasuredCamera()
        free = dataclasses.replace(options, solving=dataclasses.replace(options.solving, camera_position=None))
        return type(self)(options=free, measured=measured, pairs_text=text)

    def run(self) -> int:
        """Solve, write the calibration, print its summary; return the exit code."""
        if self.pairs is not None and (self.recording or self.clicks):
            raise InputError("solve takes either a recording with --clicks, or --pairs, not both")
        if self.pairs is not None and (self.camera or self.topics != TopicFlags()):
            raise InputError(
                "--camera and the options of a recording do not apply to --pairs, which brings its own camera"
            )
        if self.pairs is not None:
            return self._solve_pairs(self.pairs)
        if not self.recording:
            raise InputError("solve needs a recording and --clicks CLICKS.json, or --pairs PAIRS.json")
        if self.clicks is None:
            raise InputError("solve needs the clicks of this recording: --clicks CLICKS.json (the page exports them)")
        return self._solve_recording(self.clicks)

    def _solve_recording(self, clicks_path: Path) -> int:
        from app.solving import calibration_text, solve_clicks
        from calib_core.interchange import CameraFile, read_clicks
        from calib_core.recordings import open_recording

        camera_file = None if self.camera is None else CameraFile.read(self.camera)
        clicks = read_clicks(read_text(clicks_path), source=str(clicks_path))
        with open_recording(self.recording, self.topics) as recording:
            _require_confirmed(recording)
            if recording.radar_choice:
                print(f"radar: {recording.radar_choice}", file=sys.stderr)
            camera = required_camera(recording, camera_file)
            _require_inside(clicks, recording, camera, source=clicks_path)
            clicks = told_clicks_at_frames(clicks, recording, source=str(clicks_path))
            outcome = solve_clicks(recording, clicks, camera, self.measured.over(self.options))
            if isinstance(outcome, Unsolvable):
                return explain_unsolvable(outcome)
            return self._deliver(outcome, calibration_text(outcome, recording, camera_file=camera_file))

    def _solve_pairs(self, path: Path) -> int:
        from app.solving import calibration_text_of_pairs, solve_pairs

        text = read_text(path) if self.pairs_text is None else self.pairs_text
        outcome = solve_pairs(text, source=str(path), options=self.measured.over(self.options))
        if isinstance(outcome, Unsolvable):
            return explain_unsolvable(outcome)
        return self._deliver(outcome, calibration_text_of_pairs(outcome, text, name=name_text(path.name)))

    def _deliver(self, calibration: Calibration, text: str) -> int:
        if self.out is None:
            print_exactly(text)
            return 0
        write_whole(self.out, text)
        print("\n".join([*summary_lines(calibration), f"written to {self.out}"]))
        return 0


def _require_confirmed(recording: "Recording") -> None:
    """Refuse a recording whose units, signs or meanings are assumed.

    Raises:
        InputError: there is an unconfirmed assumption; all are named.
    """
    if recording.assumptions:
        named = "; ".join(f"{one.topic}: {one.text} (confirm: {one.confirm})" for one in recording.assumptions)
        raise InputError(
            f"{recording.name}: the recording does not state everything that is needed: {named}; "
            "state what is right, or confirm all of it with --confirm-assumptions"
        )


def _require_inside(clicks: Sequence[ReflectorClick], recording: "Recording", camera: Camera, *, source: Path) -> None:
    """Refuse clicks that cannot belong to this recording.

    Raises:
        InputError: a click is outside the recording or the image; the first one is named.
    """
    from app.session.click_stamps import half_interval_ns

    first, last = int(recording.image_times[0]), int(recording.image_times[-1])
    half_ns = half_interval_ns(recording.image_times)
    for click in clicks:
        if not first - half_ns <= click.image_time <= last + half_ns:
            raise InputError(
                f"{source}: click {click.id} at {seconds_text(click.image_time)} is outside the recording, "
                f"whose frames run from {seconds_text(TimeNs(first))} to {seconds_text(TimeNs(last))}; "
                "give the clicks of this recording"
            )
        if not camera.in_image(np.array([[click.u_px, click.v_px]]))[0]:
            raise InputError(
                f"{source}: click {click.id} at ({click.u_px:g}, {click.v_px:g}) px is outside the image of "
                f"{camera.width_px} x {camera.height_px} px; give the clicks of this recording"
            )
