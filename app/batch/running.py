"""Run one job: solve, evaluate, report and export a session, in whatever process an engine chooses."""

import hashlib
import socket
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from app.automatic_solving import PlacedClicks, is_doubtful, place_clicks, solve_placed_clicks
from app.batch.job import Job
from app.batch.outcome import OUTCOME_SCHEMA, Outcome, OutcomeFile, OutcomeRun, outcome_text
from app.batch.results_folder import OUTCOME_FILE, ResultsFolder
from app.solving import calibration_text, camera_for
from calib_core.errors import CalibrationError
from calib_core.interchange import CameraFile
from calib_core.interchange.own.clicks_json import ClicksFile, read_clicks_file
from calib_core.measurements import Unsolvable
from calib_core.recordings import Recording, open_recording
from calib_core.results import Calibration
from calib_core.verdict import verdict_on

__all__ = ["run_job"]


def run_job(job: Job, results: Path) -> Outcome:
    """Run a job and write its result; what goes wrong is an outcome, too.

    Args:
        job: to be run.
        results: the folder of results.

    Raises:
        OSError: the result cannot be written.
    """
    folder = ResultsFolder(results)
    begin_s, started = time.monotonic(), datetime.now(UTC)
    with folder.writing(job.digest) as unfinished:
        try:
            found = _solved(job, unfinished)
        except CalibrationError as error:
            found = _outcome(job, "failed", reason=str(error))
        run = OutcomeRun(socket.gethostname(), started.isoformat(timespec="seconds"), time.monotonic() - begin_s)
        found = _with_files(found, unfinished, run)
        (unfinished / OUTCOME_FILE).write_text(outcome_text(found), encoding="utf-8")
    return found


def _solved(job: Job, folder: Path) -> Outcome:
    row = job.row
    camera_file = None if row.camera is None else CameraFile.read(row.camera)
    with open_recording(row.recording, row.topics) as recording:
        camera = camera_for(recording, camera_file)
        file = ClicksFile(()) if row.clicks is None else read_clicks_file(row.clicks.read_text(), str(row.clicks))
        placed: PlacedClicks | Unsolvable = PlacedClicks(file.clicks, file.unconfirmed)
        if row.auto:
            placed = place_clicks(recording, camera, row.options, confirmed=file.clicks)
        outcome = (
            placed if isinstance(placed, Unsolvable) else solve_placed_clicks(recording, placed, camera, row.options)
        )
        if isinstance(outcome, Unsolvable) or isinstance(placed, Unsolvable):
            assert isinstance(outcome, Unsolvable)
            return _outcome(job, "refused", reason=outcome.reason, hint=outcome.hint)
        text = calibration_text(outcome, recording, camera_file=camera_file, unconfirmed=placed.unconfirmed)
        (folder / "calibration.json").write_text(text, encoding="utf-8")
        return _of_calibration(job, outcome, recording)


def _of_calibration(job: Job, calibration: Calibration, recording: Recording) -> Outcome:
    verdict = verdict_on(calibration)
    sigma = np.sqrt(np.diag(calibration.covariance))
    known = bool(np.isfinite(sigma).all())
    return _outcome(
        job,
        "weak" if is_doubtful(calibration) else "solved",
        verdict=verdict.level,
        recorded_ns=int(recording.image_times[0]),
        sigma_deg=float(np.degrees(sigma[3:].max())) if known else None,
        sigma_cm=float(100.0 * sigma[:3].max()) if known else None,
        aed_px=calibration.metrics.aed_px,
        pairs=sum(pair.inlier for pair in calibration.pairs),
        warnings=tuple(warning.code for warning in calibration.warnings),
    )


def _outcome(job: Job, status: str, **found: object) -> Outcome:
    row = job.row
    return Outcome(
        OUTCOME_SCHEMA, job.digest, row.vehicle, row.session, status,  # type: ignore[arg-type]
        vehicle_type=row.vehicle_type, radar_serial=row.radar_serial, camera_serial=row.camera_serial,
        **found,  # type: ignore[arg-type]
    )  # fmt: skip


def _with_files(found: Outcome, folder: Path, run: OutcomeRun) -> Outcome:
    import msgspec

    files = tuple(
        OutcomeFile(path.relative_to(folder).as_posix(), hashlib.sha256(path.read_bytes()).hexdigest())
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    )
    return msgspec.structs.replace(found, files=files, run=run)
