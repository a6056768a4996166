"""Solve a session as `cocalib solve` does, from its clicks, without a person, or both."""

from dataclasses import dataclass
from pathlib import Path

from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.calibration_file import VehicleNote
from calib_core.interchange.cameras.files import CameraFile
from calib_core.interchange.format import ImportedCalibration, imported
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.interchange.own.clicks_json import ClicksFile, read_clicks_file, write_clicks
from calib_core.measurements import ReflectorClick, Unsolvable
from calib_core.recordings import Recording
from calib_core.results import Calibration
from calib_core.words.proposing import agreement_text
from cocalib.batch.manifest import ManifestRow
from cocalib.solving.automatic import PlacedClicks, place_clicks, solve_placed_clicks
from cocalib.solving.recorded_clicks import (
    SPEED_UNIT,
    clicks_in_recording,
    file_of_clicks,
    require_confirmed,
    speed_unit_notes,
)
from cocalib.solving.solving import calibration_text, required_camera

CALIBRATION_FILE = "calibration.json"
CLICKS_FILE = "clicks.json"


@dataclass(frozen=True, slots=True, eq=False)
class GivenFiles:
    """The small files of a row, read before the recording is opened.

    Attributes:
        camera: intrinsics; None for the recording's own.
        clicks: None without.
    """

    camera: CameraFile | None
    clicks: ClicksFile | None


@dataclass(frozen=True, slots=True, eq=False)
class SolvedSession:
    """A session with its calibration.

    Attributes:
        calibration: as it was solved.
        found: the calibration as it is read from its file.
        clicks: that it was solved from, at the frames of the recording.
        files: calibration.json, and clicks.json if some were placed automatically.
        notes: for the user.
    """

    calibration: Calibration
    found: ImportedCalibration
    clicks: tuple[ReflectorClick, ...]
    files: dict[str, bytes]
    notes: tuple[str, ...]


def given_files(row: ManifestRow) -> GivenFiles:
    """Read the intrinsics and the clicks of a row.

    Raises:
        InputError: one cannot be read, or they contradict the row.
    """
    camera = None if row.camera is None else CameraFile.read(row.camera, rescale=row.rescale_camera)
    clicks = None if row.clicks is None else file_of_clicks(row.clicks)
    if row.auto and clicks is not None and clicks.unconfirmed is not None:
        raise InputError(
            f"{row.clicks}: {len(clicks.unconfirmed.ids)} of its clicks are unconfirmed; with auto give only clicks that a "
            "person placed"
        )
    return GivenFiles(camera, clicks)


def solve_session(row: ManifestRow, given: GivenFiles, recording: Recording) -> SolvedSession | Unsolvable:
    """Solve a session.

    Args:
        row: of the manifest.
        given: its small files.
        recording: open.

    Raises:
        CalibrationError: the recording cannot be read, states too little, or the clicks are of another one.
    """
    require_confirmed(recording, but=SPEED_UNIT)
    if given.clicks is None and not row.auto:
        return Unsolvable("no-clicks")
    camera = required_camera(recording, given.camera)
    notes = [f"radar: {recording.radar_choice}"] if recording.radar_choice else []
    placed = _clicks_to_solve(row, given.clicks, recording, camera, notes)
    if isinstance(placed, Unsolvable):
        return placed
    outcome = solve_placed_clicks(recording, placed, camera, row.options)
    notes.extend(speed_unit_notes(recording, placed.clicks, camera, row.options, outcome))
    if isinstance(outcome, Unsolvable):
        return outcome
    text = _calibration_text(row, outcome, recording, given, placed)
    files, clicks = {CALIBRATION_FILE: text.encode()}, placed.clicks
    if row.auto:
        clicks_text = write_clicks(clicks, radar_topics=recording.radar_topics, unconfirmed=placed.unconfirmed)
        files[CLICKS_FILE] = clicks_text.encode()
        clicks = clicks_in_recording(
            read_clicks_file(clicks_text, CLICKS_FILE).clicks, recording, camera, source=Path(CLICKS_FILE)
        ).clicks
    calibration = imported(read_calibration(text, CALIBRATION_FILE))
    return SolvedSession(outcome, calibration, clicks, files, tuple(notes))


def _clicks_to_solve(
    row: ManifestRow, file: ClicksFile | None, recording: Recording, camera: Camera, notes: list[str]
) -> PlacedClicks | Unsolvable:
    """Return the clicks to solve with: those of the file, and with auto the ones that are placed automatically."""
    clicks: tuple[ReflectorClick, ...] = ()
    if file is not None and row.clicks is not None:
        at_frames = clicks_in_recording(file.clicks, recording, camera, source=row.clicks)
        notes.extend(at_frames.notes)
        clicks = at_frames.clicks
    if not row.auto:
        return PlacedClicks(clicks, file.unconfirmed if file is not None else None)
    placed = place_clicks(recording, camera, row.options, confirmed=clicks, reflector_m=row.reflector_m)
    if not isinstance(placed, Unsolvable):
        notes.append(f"automatic: {agreement_text(placed.agreement)}")
    return placed


def _calibration_text(
    row: ManifestRow, calibration: Calibration, recording: Recording, given: GivenFiles, placed: PlacedClicks
) -> str:
    """Write calibration.json, with what the row says of vehicle and sensors."""
    vehicle = VehicleNote(row.vehicle, row.vehicle_type, row.session, row.radar_serial, row.camera_serial)
    return calibration_text(
        calibration,
        recording,
        camera_file=given.camera,
        unconfirmed=placed.unconfirmed,
        vehicle=vehicle,
    )
