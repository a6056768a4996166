"""From clicks or pairs to an answer and its file: the functions that the page and the command line share."""

import dataclasses
import hashlib
import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from weakref import WeakKeyDictionary

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.association.pairing import RadarSource, half_window_s, pair_clicks, scans_around
from calib_core.calibration import calibrate_pairs, calibration_steps, solve_again
from calib_core.camera import Camera
from calib_core.errors import InputError, MessageError, OptionError
from calib_core.input_files import name_text, text_of
from calib_core.interchange.calibration_file import (
    MOST_CHARACTERS,
    AssumptionNote,
    CalibrationFile,
    FrameNames,
    Provenance,
    VehicleNote,
)
from calib_core.interchange.cameras.files import CameraFile
from calib_core.interchange.own.calibration_json import calibration_text as interchange_text
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.interchange.own.documents import CALIBRATION_SCHEMA, names_schema
from calib_core.interchange.own.pairs_files import read_pairs
from calib_core.interchange.pair_tables import PairTable, read_pair_table
from calib_core.measurements import NS_PER_S, Candidate, DataWarning, ReflectorClick, TimeNs, Unsolvable
from calib_core.options import CalibrationOptions, checked_options
from calib_core.recordings import Recording, RecordingOptions, assumption_warnings
from calib_core.recordings.containers.sources import Assumption
from calib_core.recordings.radar.returns_origin import mount_numbers
from calib_core.recordings.recording import plain_options
from calib_core.results import Calibration, InputFile, UnconfirmedClicks
from calib_core.results.confirmation import lost_data, lost_returns
from calib_core.watching.still_image import camera_turn, reduced_grey
from calib_core.watching.turned_camera import FEW_IMAGES, MOST_IMAGES, camera_turned
from calib_core.watching.witnesses import Turn
from calib_core.words.warnings import warning_remark
from cocalib.platform.resources import version
from cocalib.session.state import Outcome

_MOST_CANDIDATES = 50
"""As many as the option allows."""

_MOST_LOST = 0.05
"""Share of the returns."""

VEHICLE_FRAME = "radar-in-vehicle-frame"
_LOST_DATA = ("damaged-recording", "radar-missing", "radar-mostly-missing")
_KEPT_WARNINGS = ("assumed", "nobody-confirmed", "lost-returns", *_LOST_DATA, VEHICLE_FRAME)
"""What solving the same pairs again cannot change."""

_log = logging.getLogger(__name__)


def solve_clicks(
    recording: RadarSource,
    clicks: Sequence[ReflectorClick],
    camera: Camera | None,
    options: CalibrationOptions,
) -> Outcome:
    """Solve for camera_from_radar.

    Args:
        recording: where the radar scans come from.
        clicks: in any order; excluded ones are paired and shown, but not used.
        camera: the intrinsics; without them, the outcome says that they are missing.
        options: of the calibration.

    Raises:
        OptionError: an option is out of range.
        CalibrationError: the recording cannot be read at the clicks.
    """
    *_, outcome = solve_in_steps(recording, clicks, camera, options, preview=False)
    return outcome


def solve_in_steps(
    recording: RadarSource,
    clicks: Sequence[ReflectorClick],
    camera: Camera | None,
    options: CalibrationOptions,
    *,
    previous: Calibration | None = None,
    preview: bool = True,
) -> Iterator[Outcome]:
    """Solve, with a preview of the answer first if there can be one; the last step is what `solve_clicks` returns.

    Args:
        recording: where the radar scans come from.
        clicks: in any order.
        camera: the intrinsics.
        options: of the calibration.
        previous: the answer to nearly the same clicks.
        preview: make one.

    Raises:
        OptionError: an option is out of range.
        CalibrationError: the recording cannot be read at the clicks.
    """
    checked_options(options)
    if camera is None:
        yield Unsolvable("no-camera")
        return
    scans = scans_around(recording, clicks, options)
    of_recording = _of_recording(recording, clicks, options)
    for outcome in calibration_steps(clicks, scans, camera, options, previous=previous, preview=preview):
        if of_recording and isinstance(outcome, Calibration):
            outcome = dataclasses.replace(outcome, warnings=(*of_recording, *outcome.warnings))
        if isinstance(outcome, Calibration) and not outcome.checking and isinstance(recording, Recording):
            warnings = (*outcome.warnings, *camera_turned_warnings(recording, clicks, camera, options))
            apart = tuple(one for one in warnings if one.code != "excluded-by-residual")
            if len(apart) < len(warnings) and is_a_stretch(recording, clicks, camera, options):
                warnings = apart
            outcome = dataclasses.replace(outcome, warnings=warnings)
        yield _with_lost_data(outcome, recording, clicks, options) if isinstance(recording, Recording) else outcome


_greys: WeakKeyDictionary[Recording, dict[int, np.ndarray | None]] = WeakKeyDictionary()
_turns: WeakKeyDictionary[Recording, dict[tuple[int, int], Turn | None]] = WeakKeyDictionary()
"""What was decoded and registered before: on the page, a click brings one image."""
_NO_TURN = Turn(np.zeros(3), np.zeros((3, 3)))


def camera_turned_warnings(
    recording: Recording, clicks: Sequence[ReflectorClick], camera: Camera, options: CalibrationOptions
) -> tuple[DataWarning, ...]:
    """Warn if the camera turned between the images that were clicked; silent where the rig moves."""
    every = np.unique([click.image_time for click in clicks if click.counts]).astype(np.int64)
    warnings: tuple[DataWarning, ...] = ()
    for most in (FEW_IMAGES, MOST_IMAGES):  # only if some show a turn are others looked at, to say when
        times = every[np.unique(np.linspace(0, len(every) - 1, most).round().astype(int))] if len(every) else every
        turns = _turns_since_the_first(recording, times, camera)
        warnings = camera_turned(turns, clicks, camera, sigma_px=options.noise.sigma_px)
        if not warnings:
            return ()
    return warnings


def is_a_stretch(
    recording: Recording, clicks: Sequence[ReflectorClick], camera: Camera, options: CalibrationOptions
) -> bool:
    """Return whether the clicks that are excluded are all on one side of a turn of the camera, and the others on the other."""
    excluded = {click.id for click in clicks if click.excluded}
    every = [dataclasses.replace(click, excluded=False) for click in clicks]
    others = {click.id for click in every if click.counts} - excluded
    found = camera_turned_warnings(recording, every, camera, options) if excluded else ()
    return any(set(one.facts["ids"]) in (excluded, others) for one in found)


def _turns_since_the_first(recording: Recording, times: TimesNs, camera: Camera) -> dict[TimeNs, Turn | None]:
    """Return how the camera turned since the first of some frames, for each that can be read."""
    indices = {TimeNs(time): int(np.searchsorted(recording.image_times, time)) for time in times.tolist()}
    frames = {time: grey for time, index in indices.items() if (grey := _grey(recording, index)) is not None}
    known = _turns.setdefault(recording, {})
    first = min(frames, default=TimeNs(0))
    found: dict[TimeNs, Turn | None] = {}
    for time, grey in frames.items():
        key = indices[first], indices[time]
        if key not in known:
            known[key] = camera_turn(frames[first], grey, camera) if time != first else _NO_TURN
        found[time] = known[key]
    return found


def _grey(recording: Recording, index: int) -> np.ndarray | None:
    """Return a frame, reduced and grey; None if it cannot be read."""
    known = _greys.setdefault(recording, {})
    if index not in known:
        try:
            known[index] = reduced_grey(recording.image(index))
        except (MessageError, IndexError):
            known[index] = None
    return known[index]


def _with_lost_data(
    outcome: Outcome, recording: Recording, clicks: Sequence[ReflectorClick], options: CalibrationOptions
) -> Outcome:
    """Let it lead the verdict if radar data are lost around clicks, or for much of the time; then of course pairs are few."""
    times = {click.id: click.image_time for click in clicks if click.counts}
    begin, end = recording.lost_spans()
    half_ns = round(options.locating.window_s / 2 * NS_PER_S)
    near = {name for name, time in times.items() if ((begin <= time + half_ns) & (end >= time - half_ns)).any()}
    without = {one.id for one in outcome.unpaired if one.id in times and (one.code == "no-scan" or one.id in near)}
    recorded_ns = np.ptp(np.concatenate([recording.radar_times, end])) if len(end) else 1
    warning = lost_data(
        clicks=len(times),
        without=len(without),
        touched=len(without | near),
        share=float((end - begin).sum() / max(recorded_ns, 1)),
        damage=next(iter(recording.damage), None),
    )
    if warning is None:
        return outcome
    if isinstance(outcome, Unsolvable):
        known = warning.facts["damage"] is not None
        return dataclasses.replace(outcome, suspected=(warning, *outcome.suspected)) if known else outcome
    others = (one for one in outcome.warnings if one.code != "few-pairs" or not without)
    return dataclasses.replace(outcome, warnings=(warning, *others))


def _of_recording(
    recording: RadarSource, clicks: Sequence[ReflectorClick], options: CalibrationOptions
) -> tuple[DataWarning, ...]:
    """Warn if returns are in a vehicle's frame, or lost: around the clicks, or more than 5 % of those read so far."""
    if not isinstance(recording, Recording):
        return ()
    moved = (warning for warning in recording.warnings if warning.code == VEHICLE_FRAME)
    return (*moved, *_lost_returns(recording, clicks, options))


def _lost_returns(
    recording: Recording, clicks: Sequence[ReflectorClick], options: CalibrationOptions
) -> tuple[DataWarning, ...]:
    near = recording.losses([click.image_time for click in clicks], half_window_s(options))
    if near.lost:
        return (lost_returns(near.lost, near.read, "the radar around the clicks"),)
    everywhere = recording.losses()
    return (lost_returns(everywhere.lost, everywhere.read, "the radar"),) if everywhere.share > _MOST_LOST else ()


def window_candidates(
    recording: RadarSource, click: ReflectorClick, options: CalibrationOptions
) -> tuple[Candidate, ...]:
    """Return every static return of a click's window as a candidate, also those that were too implausible for its pair.

    Raises:
        CalibrationError: the recording cannot be read at the click.
    """
    scans = scans_around(recording, [click], options)
    all_of_them = dataclasses.replace(
        options, locating=dataclasses.replace(options.locating, max_candidates=_MOST_CANDIDATES)
    )
    alone = dataclasses.replace(click, chosen=None, mark="clicked")
    return tuple(candidate for pair in pair_clicks([alone], scans, all_of_them).pairs for candidate in pair.candidates)


_OPTIONS_OF_PAIRING = (
    *("gating.max_speed_mps", "gating.min_range_m", "gating.max_range_m"),
    *("locating.window_s", "locating.max_candidates", "locating.max_time_gap_s"),
    *("paper.z_score_threshold", "paper.window_s", "paper.max_range_m", "paper.max_speed_mps"),
)
"""Options that choose radar returns: they cannot change pairs that exist already."""


@dataclass(frozen=True, slots=True, eq=False)
class GivenPairs:
    """A file of pairs, or a calibration that is to be solved again.

    Attributes:
        data: its content.
        source: its path, for error messages.
        file: what it says, if it is a calibration.
        table: what it says, if it is a table of pairs or holds arrays.
        camera_file: the intrinsics for a table; None for the others, which bring their own.
    """

    data: bytes
    source: str
    file: CalibrationFile | None
    table: PairTable | None = None
    camera_file: CameraFile | None = None

    @classmethod
    def read(
        cls,
        content: str | bytes,
        source: str,
        camera_file: CameraFile | None = None,
        options: RecordingOptions | None = None,
    ) -> "GivenPairs":
        """Read a calibration or a table; a file of pairs is read when the options are known.

        Args:
            content: of the file.
            source: its path.
            camera_file: for a table.
            options: how a table is read: its map and radar_axes.

        Raises:
            InputError: it is not valid, or a camera is given for a file that brings one, or none for a table.
        """
        data = content.encode() if isinstance(content, str) else content
        is_table = data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] not in (b"{", b"[")
        if is_table and camera_file is None:
            raise InputError(f"{source}: not JSON; if it is a table of pairs (x, y, z, u, v), add --camera FILE")
        if is_table:
            how = plain_options(options or RecordingOptions())
            return cls(data, source, None, read_pair_table(data, source=source, options=how), camera_file)
        if camera_file is not None:
            raise InputError(f"{source}: brings its own camera; leave out --camera")
        if options and (options.map or options.radar_axes):
            raise InputError(f"{source}: states its units and axes; leave out --map and --radar-axes")
        text = text_of(data, source, is_what="a file of pairs")
        file = read_calibration(text, source) if names_schema(text, CALIBRATION_SCHEMA) else None
        return cls(text.encode(), source, file)

    @property
    def assumed(self) -> tuple[Assumption, ...]:
        """What a table does not state, in units and axes."""
        return self.table.assumptions if self.table else ()


def solve_pairs(given: GivenPairs, options: CalibrationOptions | None = None) -> Outcome:
    """Solve for camera_from_radar from a pairs-1 file or a table of pairs, or again from a calibration-1 file.

    Args:
        given: the file.
        options: for the solver; None takes those of a calibration-1 file, and the defaults for a pairs-1 file, whose
            own statements about noise replace the options.

    Raises:
        InputError: it is neither, or a calibration without the candidates of its pairs.
        OptionError: an option, or what the file says about noise, is out of range or cannot apply.
    """
    if given.file is not None:
        calibration = given.file.calibration
        if options is not None:
            _require_same_pairing(calibration.options, options, given.source)
        try:
            return solve_again(calibration, options)
        except InputError as error:
            raise InputError(f"{given.source}: {error}") from None
    options = checked_options(options or CalibrationOptions())
    if given.table is None or given.camera_file is None:
        pairs_file = read_pairs(given.data.decode(), given.source, noise=options.noise)
    else:
        pairs_file = given.table.pairs(given.camera_file.camera(), options.noise, source=given.source)
    return calibrate_pairs(pairs_file.pairs, pairs_file.camera, pairs_file.options(options))


def _require_same_pairing(kept: CalibrationOptions, given: CalibrationOptions, source: str) -> None:
    """Refuse options that chose the radar returns of a calibration and now differ.

    Raises:
        OptionError: names the first such option.
    """
    for path in _OPTIONS_OF_PAIRING:
        value_of = attrgetter(path)
        if value_of(kept) != value_of(given):
            raise OptionError(
                f"{source}: {path} chooses radar returns, and the pairs of this calibration were made with "
                f"{value_of(kept):g}; to change it, solve from the recording"
            )


def camera_for(recording: Recording, camera_file: CameraFile | None) -> Camera | None:
    """Return the intrinsics to solve with: the file's if one is given, else the recording's, else None.

    Raises:
        InputError: the file contains no camera, or one with an image size other than the recording's.
    """
    if camera_file is None:
        return recording.camera()
    image = recording.image_bytes(0)
    camera = camera_file.camera(image_size_px=(image.width_px, image.height_px))
    if (camera.width_px, camera.height_px) != (image.width_px, image.height_px):
        raise InputError(
            f"{camera_file.source}: calibrated for {camera.width_px} x {camera.height_px} px, but the frames have "
            f"{image.width_px} x {image.height_px} px; give the intrinsics of these frames, or "
            "--rescale-camera if they are the calibrated ones resized"
        )
    return camera


def intrinsics_near(paths: Sequence[Path]) -> Path | None:
    """Return a file of intrinsics in or next to a recording, by its name; None if there is none."""
    folders = dict.fromkeys(path if path.is_dir() else path.parent for path in paths)
    names = ("*camera*.y*ml", "*intrinsic*.y*ml", "*camchain*.y*ml", "*calib*.y*ml")
    found = (file for folder in folders for name in names for file in sorted(folder.glob(name)))
    return next((file for file in found if file.is_file()), None)


def calibration_text(
    calibration: Calibration,
    recording: Recording,
    confirmed: Sequence[str] = (),
    camera_file: CameraFile | None = None,
    unconfirmed: UnconfirmedClicks | None = None,
    vehicle: VehicleNote | None = None,
) -> str:
    """Write a calibration-1 file; the page and the command line give the same bytes for the same clicks.

    Args:
        calibration: what was solved.
        recording: what it was solved from; assumptions about it that nobody has confirmed become warnings of the file.
        confirmed: texts of the assumptions that were confirmed after the recording was opened.
        camera_file: the file whose intrinsics were used; None for the recording's own.
        unconfirmed: clicks that nobody confirmed.
        vehicle: which vehicle it is of; None if nobody said.
    """
    assumed = [
        (assumption.assumption, assumption.confirmed or assumption.assumption.words in confirmed)
        for assumption in recording.stated_assumptions
    ]
    unsure = assumption_warnings([assumption for assumption, sure in assumed if not sure])
    if unsure:
        calibration = dataclasses.replace(calibration, warnings=(*calibration.warnings, *unsure))
    provenance = Provenance(
        damage=tuple(str(warning_remark(one).message) for one in recording.damage),
        inputs=(
            *recording.fingerprint(),
            *([] if camera_file is None else [_input_file(camera_file.source, camera_file.data)]),
        ),
        radar_topic=recording.radar_topic,
        radar_topics=recording.radar_topics,
        radar_choice=recording.radar_choice,
        image_topic=recording.image_topic,
        camera_info_topic=recording.camera_info_topic,
        radar_clock=recording.radar_clock,
        image_clock=recording.image_clock,
        radar_axes=recording.radar_axes,
        video_start=recording.video_start,
        version=version(),
        column_map=recording.column_map,
        assumptions=(
            *(AssumptionNote(assumption.words, sure) for assumption, sure in assumed),
            *(AssumptionNote(note, True) for note in recording.radar_option_notes),
        ),
        unconfirmed=unconfirmed,
    )
    return interchange_text(calibration, _frame_names(recording), provenance, vehicle=_mounted(recording, vehicle))


def _mounted(recording: Recording, vehicle: VehicleNote | None) -> VehicleNote | None:
    """Add the vehicle's frame, and the mount that returns were taken back by."""
    origin = recording.returns_origin
    if origin is None or origin.moved_by is None:
        return vehicle
    named = VehicleNote(frame=origin.frame[:MOST_CHARACTERS] or None, radar_mount=mount_numbers(origin.moved_by))
    return named.over(vehicle or VehicleNote())


def _input_file(source: str, data: bytes) -> InputFile:
    """Identify a file by its content."""
    return InputFile(name_text(Path(source).name), len(data), hashlib.sha256(data).hexdigest())


def _frame_names(recording: Recording) -> FrameNames:
    """Return the recording's frame names, or the defaults if these are unusable: that must not cost the calibration."""
    usual = FrameNames()
    try:
        return FrameNames(recording.radar_frame or usual.radar, recording.camera_frame or usual.camera)
    except InputError as error:
        _log.warning(
            "the recording's frame names cannot be used; using %s and %s: %s", usual.radar, usual.camera, error
        )
        return usual


def calibration_text_of_pairs(calibration: Calibration, given: GivenPairs, vehicle: VehicleNote | None = None) -> str:
    """Write a calibration-1 file for a calibration solved from a pairs-1 file, or again from a calibration-1 file.

    Args:
        calibration: what was solved.
        given: the file.
        vehicle: which vehicle it is of; what it leaves out is taken from a calibration-1 file.
    """
    vehicle = vehicle or VehicleNote()
    camera_file = given.camera_file
    inputs = (
        _input_file(given.source, given.data),
        *([] if camera_file is None else [_input_file(camera_file.source, camera_file.data)]),
    )
    if (file := given.file) is not None:
        provenance = dataclasses.replace(file.provenance, inputs=inputs, version=version())
        kept = tuple(warning for warning in file.calibration.warnings if warning.code in _KEPT_WARNINGS)
        calibration = dataclasses.replace(calibration, warnings=(*calibration.warnings, *kept))
        return interchange_text(calibration, file.frames, provenance, vehicle=vehicle.over(file.vehicle))
    warnings = (*calibration.warnings, *assumption_warnings(given.assumed))
    provenance = Provenance(
        inputs=inputs, version=version(), assumptions=tuple(AssumptionNote(one.text, False) for one in given.assumed)
    )
    return interchange_text(dataclasses.replace(calibration, warnings=warnings), provenance=provenance, vehicle=vehicle)


def required_camera(recording: Recording, camera_file: CameraFile | None) -> Camera:
    """Return the intrinsics: from the file if one is given, else from the recording.

    Raises:
        InputError: there are none.
    """
    camera = camera_for(recording, camera_file)
    if camera is None:
        found = (
            f"{recording.camera_info_topic} has none that can be used"
            if recording.camera_info_topic
            else "it has no CameraInfo topic"
        )
        near = intrinsics_near(recording.paths)
        raise InputError(
            f"{recording.paths[0].name}: no intrinsics for {recording.image_topic}: {found}; "
            "give them with --camera FILE (ROS camera_info YAML, OpenCV YAML or XML, Kalibr camchain, JSON)"
            + (f", such as --camera {near}" if near else "")
            + "; or calibrate the lens from images of a board: cocalib intrinsics --help"
        )
    return camera
