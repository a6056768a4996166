"""`cocalib solve`: calibrate without a browser."""

import dataclasses
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.input_files import MAX_TEXT_BYTES, read_input
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from calib_core.results.verdict import verdict_on
from calib_core.words.verdict import verdict_line
from cocalib.cli.exit_codes import exit_code
from cocalib.cli.flags import MORE, File, MoreSwitch, OutFile, Output, OutputFlags, Require, Switch
from cocalib.cli.output import (
    explain_unsolvable,
    on_terminal,
    recorded_clicks,
    shown_progress,
    tell_choices,
)
from cocalib.cli.recording_flags import (
    CameraFlags,
    GivenCamera,
    OptionFlags,
    Options,
    Recorded,
    RecordedFlags,
    TopicFlags,
    Vehicle,
    VehicleFlags,
    checked_reflector_m,
)
from cocalib.platform.files import write_whole
from cocalib.platform.terminal import print_exactly
from cocalib.view.build import summary_lines

if TYPE_CHECKING:
    from calib_core.interchange.calibration_file import VehicleNote
    from calib_core.interchange.own.clicks_json import ClicksFile
    from calib_core.recordings import Recording
    from cocalib.solving.automatic import PlacedClicks

_REFLECTOR_M = 0.24


@dataclass(frozen=True, slots=True)
class Solve:
    """Compute a calibration from a recording and its clicks, or from a file of pairs.

    The same clicks give the same file as the page's download, byte for byte.
    """

    NAMED = CalibrationOptions

    clicks: File = None
    """Clicks in this recording (cocalib/clicks-1 JSON)."""
    auto: Switch = False
    """Place clicks automatically where images and radar agree; with --clicks, only at placements without a click."""
    propose: Switch = False
    """Solve nothing: list where the reflector probably stood, for a person or a script to confirm; --out keeps it as JSON."""
    clicks_out: OutFile = None
    """With --auto: write the clicks to this file (cocalib/clicks-1 JSON), to look at on the page."""
    reflector_m: Annotated[float, MORE] = _REFLECTOR_M
    """With --auto or --propose: width of the reflector as the camera sees it [m]."""
    json: MoreSwitch = False
    """With --propose: print everything as JSON (cocalib/proposals-1)."""
    pairs: File = None
    """Instead of a recording: radar positions and pixels (cocalib/pairs-1 JSON, or with --camera a CSV, npy or npz of x, y, z,
    u, v), or a calibration to solve again."""
    camera: GivenCamera = field(default_factory=CameraFlags)
    out: OutFile = None
    """Output file (cocalib/calibration-1 JSON); stdout if omitted."""
    refine_intrinsics: MoreSwitch = False
    """Estimate focal length, principal point and k1 with the pose; their covariance or the refining options say how sure."""
    require: Require = None
    """Exit code 3 for a verdict below this."""
    vehicle: Vehicle = field(default_factory=VehicleFlags)
    recorded: Recorded = field(default_factory=RecordedFlags)
    options: Options = field(default_factory=OptionFlags)
    output: Output = field(default_factory=OutputFlags)

    def run(self) -> int:
        """Solve, write the calibration, print its summary; return the exit code."""
        if self.propose:
            return self._propose()
        vehicle = self.vehicle.note()
        self._require_fitting()
        return self._solve_recording(vehicle) if self.pairs is None else self._solve_pairs(self.pairs, vehicle)

    def _require_fitting(self) -> None:
        """Refuse options that say nothing together.

        Raises:
            InputError: they do not fit, or there is nothing to solve.
        """
        if self.json:
            raise InputError("--json applies with --propose only; a calibration is JSON already")
        if not self.auto and (self.clicks_out is not None or self.reflector_m != _REFLECTOR_M):
            raise InputError("--clicks-out and --reflector-m apply with --auto only; add it")
        if self.pairs is not None:
            if self.recorded.recording or self.clicks or self.auto:
                raise InputError("solve takes either a recording with --clicks or --auto, or --pairs, not both")
            if dataclasses.replace(self.recorded.topics, map=(), radar_axes=None) != TopicFlags():
                raise InputError("of the options of a recording only --map and --radar-axes apply to --pairs")
            return
        if not self.recorded.recording:
            raise InputError("solve needs a recording and --clicks CLICKS.json or --auto, or --pairs PAIRS.json")
        if self.clicks is None and not self.auto:
            raise InputError(
                "solve needs the clicks of this recording: --clicks CLICKS.json (the page exports them), or --auto to do "
                "without a person"
            )

    def _propose(self) -> int:
        from cocalib.cli.propose import Shown, propose

        fitting = Solve(
            clicks=self.clicks,
            propose=True,
            reflector_m=self.reflector_m,
            json=self.json,
            camera=self.camera,
            out=self.out,
            recorded=self.recorded,
            options=self.options,
            output=self.output,
        )
        if fitting != self:
            raise InputError(
                "--propose solves nothing: give a recording, and --clicks, --camera, --reflector-m, --out or --json"
            )
        return propose(
            self.recorded,
            self._all_options(),
            Shown(self.out, self.json),
            camera=self.camera,
            clicks_file=self.clicks,
            reflector_m=self.reflector_m,
        )

    def _all_options(self, base: CalibrationOptions | None = None) -> CalibrationOptions:
        """Return the options with what has a flag of its own.

        Args:
            base: what is not typed; None takes the defaults.
        """
        options = self.options.all(base)
        if not self.refine_intrinsics:
            return options
        return dataclasses.replace(options, refining=dataclasses.replace(options.refining, intrinsics=True))

    def _solve_recording(self, vehicle: "VehicleNote") -> int:
        from cocalib.solving.automatic import solve_placed_clicks
        from cocalib.solving.recorded_clicks import SPEED_UNIT, require_confirmed, speed_unit_notes
        from cocalib.solving.solving import VEHICLE_FRAME, calibration_text, required_camera

        self._require_folders()
        camera_file = self.camera.read()
        options = self._all_options()
        file = self._clicks_file()
        with self.recorded.open() as recording:
            require_confirmed(recording, but=SPEED_UNIT)
            tell_choices(recording, but=VEHICLE_FRAME)
            camera = required_camera(recording, camera_file)
            placed = self._clicks_to_solve(file, recording, camera, options)
            if isinstance(placed, Unsolvable):
                return explain_unsolvable(placed)
            outcome = solve_placed_clicks(recording, placed, camera, options)
            for note in speed_unit_notes(recording, placed.clicks, camera, options, outcome):
                print(f"note: {note}", file=sys.stderr)
            if isinstance(outcome, Unsolvable):
                return explain_unsolvable(outcome)
            self._write_clicks(placed, recording)
            text = calibration_text(
                outcome,
                recording,
                camera_file=camera_file,
                unconfirmed=placed.unconfirmed,
                vehicle=vehicle,
            )
            return self._deliver(outcome, text)

    def _require_folders(self) -> None:
        """Refuse output files that cannot be written, before a search that takes long.

        Raises:
            InputError: a folder is missing.
        """
        for path in (self.out, self.clicks_out):
            if self.auto and path is not None and not path.absolute().parent.is_dir():
                raise InputError(f"{path}: the folder {path.parent} does not exist; create it first")

    def _clicks_file(self) -> "ClicksFile":
        from calib_core.interchange.own.clicks_json import ClicksFile
        from cocalib.solving.recorded_clicks import file_of_clicks

        return ClicksFile(()) if self.clicks is None else file_of_clicks(self.clicks)

    def _clicks_to_solve(
        self, file: "ClicksFile", recording: "Recording", camera: Camera, options: CalibrationOptions
    ) -> "PlacedClicks | Unsolvable":
        """Return the clicks to solve with: those of the file, and with --auto the ones that are placed automatically."""
        from cocalib.solving.automatic import PlacedClicks, place_clicks

        clicks = file.clicks
        if self.clicks is not None:
            clicks = recorded_clicks(clicks, recording, camera, source=self.clicks)
        if not self.auto:
            return PlacedClicks(clicks, file.unconfirmed)
        if file.unconfirmed is not None:
            raise InputError(
                f"{self.clicks}: {len(file.unconfirmed.ids)} of its clicks are unconfirmed; with --auto give only clicks that a "
                "person placed"
            )
        reflector_m = checked_reflector_m(self.reflector_m)
        with shown_progress() as progress:
            placed = place_clicks(
                recording, camera, options, confirmed=clicks, reflector_m=reflector_m, progress=progress
            )
        if not isinstance(placed, Unsolvable):
            print(f"automatic: {_placed_words(placed)}", file=sys.stderr)
        return placed

    def _write_clicks(self, placed: "PlacedClicks", recording: "Recording") -> None:
        if self.clicks_out is None:
            return
        from calib_core.interchange.own.clicks_json import write_clicks

        text = write_clicks(placed.clicks, radar_topics=recording.radar_topics, unconfirmed=placed.unconfirmed)
        write_whole(self.clicks_out, text)
        print(f"clicks written to {self.clicks_out}", file=sys.stderr)

    def _solve_pairs(self, path: Path, vehicle: "VehicleNote") -> int:
        from cocalib.solving.solving import GivenPairs, calibration_text_of_pairs, solve_pairs

        data = read_input(path, max_bytes=MAX_TEXT_BYTES, is_what="a file of pairs")
        given = GivenPairs.read(data, str(path), self.camera.read(), self.recorded.topics)
        for assumption in given.assumed:
            print(f"note: {path}: {assumption.text} (state it: {assumption.confirm})", file=sys.stderr)
        again = None if given.file is None else given.file.calibration.options
        outcome = solve_pairs(given, self._all_options(again))
        if isinstance(outcome, Unsolvable):
            return explain_unsolvable(outcome)
        return self._deliver(outcome, calibration_text_of_pairs(outcome, given, vehicle))

    def _deliver(self, calibration: Calibration, text: str) -> int:
        verdict = verdict_on(calibration)
        code = exit_code(verdict.level, None, self.require, calibration.warnings)
        if self.camera.camera is not None and not len(calibration.camera.distortion):
            print(f"note: {self.camera.camera} states no distortion: the lens is taken to have none", file=sys.stderr)
        if self.out is None:
            print_exactly(text)
            print(f"verdict: {on_terminal(verdict_line(verdict))}", file=sys.stderr)
            return code
        write_whole(self.out, text)
        print("\n".join([*map(on_terminal, summary_lines(calibration)), f"written to {self.out}"]))
        return code


def _placed_words(placed: "PlacedClicks") -> str:
    """Say how many clicks were placed, and how sure they are."""
    from calib_core.words.proposing import agreement_text
    from calib_core.words.warnings import probability_text

    if placed.unconfirmed is None:
        return agreement_text(placed.agreement)
    count = len(placed.unconfirmed.ids)
    return (
        f"{count} {'click' if count == 1 else 'clicks'} placed automatically, unconfirmed (confidence "
        f"{probability_text(placed.unconfirmed.confidence)}): {agreement_text(placed.agreement)}"
    )
