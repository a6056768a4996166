"""Run one job and keep its result: solve, judge, report and export a session, once, with an outcome whatever goes wrong."""

import dataclasses
import errno
import hashlib
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TypeVar

import numpy as np
from msgspec.structs import replace

from calib_core.arrays import Matrix66
from calib_core.errors import CalibrationError, InputError
from calib_core.evaluation.evaluation_json import evaluation_json
from calib_core.evaluation.figures import Evaluation
from calib_core.interchange.exporting import export
from calib_core.measurements import Unsolvable
from calib_core.recordings import Recording, open_recording
from calib_core.results import InputFile
from calib_core.results.verdict import verdict_on
from calib_core.words.outcomes import outcome_remark
from calib_core.words.verdict import stated_verdict
from cocalib.batch.inputs import all_reached, inputs_of, state_of
from cocalib.batch.job import Job
from cocalib.batch.manifest import ManifestRow
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, OutcomeRun, Status, StepState, outcome_text
from cocalib.batch.results_folder import LOG_FILE, OUTCOME_FILE, ResultsFolder, listed_files
from cocalib.batch.solving import CALIBRATION_FILE, SolvedSession, given_files, solve_session
from cocalib.evaluation.boxes import find_boxes
from cocalib.evaluation.evaluating import evaluation_exit_code, evidence_in, judged
from cocalib.evaluation.recording_check import judged_calibration, other_camera
from cocalib.platform.error_boundary import error_boundary
from cocalib.platform.resources import version
from cocalib.report.making import subject_of, watched
from cocalib.report.page import report_html
from cocalib.report.subject import RecordingEvidence

_Made = TypeVar("_Made")
_UNREACHED = frozenset(
    getattr(errno, name)
    for name in (
        *(
            "ENOENT",
            "EACCES",
            "EPERM",
            "EIO",
            "ENXIO",
            "ENODEV",
            "EBUSY",
            "EAGAIN",
            "ENOMEM",
            "EMFILE",
            "ENFILE",
            "ENOSPC",
        ),
        *("ESTALE", "ETIMEDOUT", "ENOTCONN", "EHOSTDOWN", "EHOSTUNREACH", "ECONNRESET", "EREMOTEIO", "EDQUOT"),
    )
    if hasattr(errno, name)
)
"""Faults of a file system, not of what a file contains."""
EXPORT_FOLDER = "export"
EVALUATION_FILE = "evaluation.json"
REPORT_FILE = "report.html"


def run_once(job: Job, results: Path) -> Outcome:
    """Return what came of a job; it is run only if nobody has run it yet.

    Args:
        job: to be run.
        results: the folder of results.

    Raises:
        InputError: the folder of results is not there, or cannot be written.
    """
    if not results.is_dir():
        raise InputError(
            f"{results}: a worker does not reach this folder of results; "
            "put it, and the recordings, on a file system that all workers share under the same path"
        )
    kept = ResultsFolder(results).outcome(job.digest)
    if kept is not None:
        return kept
    lines: list[str] = []
    with error_boundary(f"a job of a batch, {job.row.name}", lines.append):
        return run_job(job, results)
    return failed_outcome(job, results, reason=lines[0])


def failed_outcome(job: Job, results: Path, *, reason: str, hint: str = "") -> Outcome:
    """Write that a job failed because the program did, or its worker.

    Args:
        job: without an outcome.
        results: the folder of results.
        reason: what happened.
        hint: what to do about it.

    Raises:
        InputError: the result cannot be written.
    """
    row = job.row
    outcome = Outcome(
        OUTCOME_SCHEMA,
        job.digest,
        row.vehicle,
        row.session,
        "failed",
        reason=reason,
        hint=hint,
        is_final=False,
        vehicle_type=row.vehicle_type,
        radar_serial=row.radar_serial,
        camera_serial=row.camera_serial,
        run=OutcomeRun(socket.gethostname(), datetime.now(UTC).isoformat(timespec="seconds"), 0.0),
    )
    try:
        with ResultsFolder(results).writing(job.digest) as unfinished:
            (unfinished / OUTCOME_FILE).write_text(outcome_text(outcome), encoding="utf-8")
    except (OSError, CalibrationError) as error:
        raise InputError(
            f"{results}: the result of {row.name} cannot be written ({getattr(error, 'strerror', None) or error}); "
            "make room or choose another folder, and start the batch again: what is done is kept"
        ) from error
    return outcome


def run_job(job: Job, results: Path) -> Outcome:
    """Run a job and keep its result under its digest.

    Two outcomes are not kept: that an input is no longer what the digest was made of, and that the result cannot be written.

    Args:
        job: to be run.
        results: the folder of results.
    """
    begin_s, started = time.monotonic(), datetime.now(UTC).isoformat(timespec="seconds")

    def run() -> OutcomeRun:
        return OutcomeRun(socket.gethostname(), started, round(time.monotonic() - begin_s, 3))

    inputs = inputs_of(job.row)
    state = state_of(inputs)
    if job.state in ("", state):
        result = run_steps(job.row)
        outcome = outcome_of(job, result)
        if not all_reached(inputs):
            outcome = replace(outcome, is_final=False)
        if state_of(inputs) == state:
            log = "\n\n".join(result.log)
            files = {**result.files, **({LOG_FILE: log.encode(errors="backslashreplace")} if log else {})}
            return _write_outcome(replace(outcome, run=run()), files, job, results)
    changed = Failure(
        f"{job.row.name}: an input changed after the batch was started, so nothing is kept",
        "run the batch again once the files are complete",
    )
    return replace(failed(job, changed), run=run())


def _write_outcome(outcome: Outcome, files: Mapping[str, bytes], job: Job, results: Path) -> Outcome:
    """Write the result; return its outcome with the files listed, or that it cannot be written."""
    try:
        with ResultsFolder(results).writing(job.digest) as folder:
            for name, data in files.items():
                path = folder / name
                path.parent.mkdir(exist_ok=True)
                path.write_bytes(data)
            outcome = replace(outcome, files=listed_files(folder))
            (folder / OUTCOME_FILE).write_text(outcome_text(outcome), encoding="utf-8")
    except (OSError, CalibrationError) as error:
        failure = Failure(
            f"{results}: the result cannot be written: {getattr(error, 'strerror', None) or error}",
            "make room, or name another folder with --out, and run the batch again: what is done is kept",
        )
        return replace(failed(job, failure), run=outcome.run)
    return outcome


@dataclass(frozen=True, slots=True)
class Failure:
    """Why there is no result.

    Attributes:
        reason: what happened.
        hint: what to do about it.
        is_final: the same inputs would give the same.
    """

    reason: str
    hint: str = ""
    is_final: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class JudgedSession:
    """What the recording says of the calibration.

    Attributes:
        evaluation: of what was found in the recording.
        text: of evaluation.json, with what the recording says of the lens.
    """

    evaluation: Evaluation
    text: str


@dataclass(slots=True, eq=False)
class SessionResult:
    """What the steps of a job made; it grows from step to step.

    Attributes:
        solved: the calibration, why there is none, or what went wrong; None until then.
        recorded_ns: first stamp of the recording [ns]; None if it has none.
        states: of the steps after solving.
        failures: of the steps that failed.
        files: of the result by their names in it.
        log: what only a developer needs.
    """

    solved: SolvedSession | Unsolvable | Failure | None = None
    recorded_ns: int | None = None
    states: dict[str, StepState] = field(default_factory=dict)
    failures: dict[str, Failure] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    log: list[str] = field(default_factory=list)


def run_steps(row: ManifestRow) -> SessionResult:
    """Solve, judge, report and export a session; whatever goes wrong is in the result."""
    result = SessionResult()
    failure = attempted(f"cocalib batch, {row.name}", lambda: _on_recording(row, result), result.log)
    if failure is not None:
        result.solved = failure
        result.files.clear()
    return result


def _on_recording(row: ManifestRow, result: SessionResult) -> None:
    given = given_files(row)
    with open_recording(row.recording, row.topics) as recording:
        times = recording.image_times if len(recording.image_times) else recording.radar_times
        result.recorded_ns = int(times[0]) if len(times) else None
        result.solved = solve_session(row, given, recording)
        if isinstance(result.solved, Unsolvable):
            result.log += [str(one) for one in result.solved.unpaired]
        else:
            result.files |= result.solved.files
            _after_solving(row, result.solved, recording, result)


def _after_solving(row: ManifestRow, solved: SolvedSession, recording: Recording, result: SessionResult) -> None:
    judged = _step("evaluate", result, lambda: judge_session(row, solved, recording))
    if judged is not None:
        result.files[EVALUATION_FILE] = judged.text.encode()
    report = _step("report", result, lambda: report_session(solved, judged, recording))
    if report is not None:
        result.files[REPORT_FILE] = report.encode()
    if not row.exports:
        result.states["export"] = "not asked"
        return
    if verdict_on(solved.calibration).level == "contradictory":
        result.states["export"] = "left out"  # nobody must use its pose
        return
    for name in row.exports:
        files = _step(f"export {name}", result, lambda name=name: export_session(solved, name, [*result.files]))  # type: ignore[misc]
        result.files |= files or {}
    states = [result.states.pop(f"export {name}") for name in dict.fromkeys(row.exports)]
    result.states["export"] = "failed" if "failed" in states else "done"


def _step(name: str, result: SessionResult, work: Callable[[], _Made]) -> _Made | None:
    """Do a step; if it fails, note why."""
    made = attempted(name, work, result.log)
    if isinstance(made, Failure):
        result.states[name] = "failed"
        result.failures[name] = made
        return None
    result.states[name] = "done"
    return made


def attempted(doing: str, work: Callable[[], _Made], log: list[str]) -> _Made | Failure:
    """Do a part of a job.

    Args:
        doing: what it is, for the report of an unforeseen exception.
        work: does it.
        log: takes that report.
    """

    def keep(report: str) -> str:
        log.append(report)
        return f"and its report is in the result's {LOG_FILE}"

    lines: list[str] = []
    with error_boundary(doing, lines.append, keep):
        try:
            return work()
        except CalibrationError as error:
            return Failure(str(error), is_final=not _is_unreached(error))
        except MemoryError:
            return Failure("not enough memory", "run fewer workers at a time, or on a machine with more memory")
        except OSError as error:
            if error.errno not in _UNREACHED:
                raise
            where = f"{error.filename}: " if error.filename else ""
            return Failure(f"{where}{error.strerror or error}", "check that the worker reaches the file")
    return Failure(lines[0])


def _is_unreached(error: BaseException) -> bool:
    """Return whether an error was caused by a fault of the file system."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and cause.errno in _UNREACHED:
            return True
        if isinstance(cause, MemoryError):
            return True
        cause = cause.__cause__ or cause.__context__
    return False


def judge_session(row: ManifestRow, solved: SolvedSession, recording: Recording) -> JudgedSession:
    """Judge a calibration by the clicks that it was solved from, and by boxes if the row names some.

    Raises:
        CalibrationError: the boxes cannot be read, or are of another recording.
    """
    known = judged_calibration(solved.found, Path(CALIBRATION_FILE), recording)
    boxes = None if row.boxes is None else find_boxes(str(row.boxes), recording)
    evidence = evidence_in(recording, known.calibration.camera, clicks=solved.clicks, boxes=boxes)
    evaluation = judged(known.calibration, evidence)
    told = dataclasses.replace(evaluation, warnings=(*known.warnings, *evaluation.warnings))
    names = [path.name for path in row.recording]
    code = evaluation_exit_code(told)
    text = evaluation_json(told, calibration=CALIBRATION_FILE, recording=names, exit_code=code)
    return JudgedSession(evaluation, text)


def report_session(solved: SolvedSession, judged: JudgedSession | None, recording: Recording) -> str:
    """Return the report as HTML.

    Args:
        solved: the session.
        judged: what the recording says of it; None if that is not known.
        recording: open.

    Raises:
        CalibrationError: the recording's camera is another one, or the recording can no longer be read.
    """
    calibration = judged_calibration(solved.found, Path(CALIBRATION_FILE), recording).calibration
    doubts = other_camera(solved.found, recording.camera())
    data = solved.files[CALIBRATION_FILE]
    own = InputFile(CALIBRATION_FILE, len(data), hashlib.sha256(data).hexdigest())
    subject = dataclasses.replace(
        subject_of(solved.found, calibration, CALIBRATION_FILE),
        inputs=(own,),
        recording=watched(recording, calibration, recording.fingerprint(), doubts),
        judged=None if judged is None else RecordingEvidence(judged.evaluation, solved.clicks),
    )
    return report_html(subject)


def export_session(solved: SolvedSession, name: str, taken: Sequence[str]) -> dict[str, bytes]:
    """Return the files of an export by their names in the result.

    Args:
        solved: the session.
        name: of the format.
        taken: names that are in use.

    Raises:
        InputError: the format cannot hold this calibration, or its file has the name of another format's.
    """
    assert solved.found.file is not None
    written = export(solved.found.file, name)
    files = {f"{EXPORT_FOLDER}/{written.file_name}": written.data}
    files |= {f"{EXPORT_FOLDER}/{extra.file_name}": extra.data for extra in written.extra_files}
    for path in sorted(set(files) & set(taken)):
        raise InputError(f"its file {path} is that of another format; export it alone")
    return files


def outcome_of(job: Job, result: SessionResult) -> Outcome:
    """Return the outcome, without its files and its run."""
    solved = result.solved
    if isinstance(solved, Failure):
        return replace(failed(job, solved), recorded_ns=result.recorded_ns)
    if isinstance(solved, Unsolvable):
        refused = _outcome(job, "refused")
        said = outcome_remark(solved)
        return replace(refused, reason=str(said.message), hint=str(said.hint), recorded_ns=result.recorded_ns)
    assert solved is not None, "the steps end with an answer or a failure"
    return replace(
        _of_calibration(job, solved),
        recorded_ns=result.recorded_ns,
        steps=result.states,
        step_reasons={name: failure.reason for name, failure in result.failures.items()},
        is_final=all(failure.is_final for failure in result.failures.values()),
    )


def failed(job: Job, failure: Failure) -> Outcome:
    """Return the outcome of a job that could not be done."""
    outcome = _outcome(job, "failed")
    return replace(outcome, reason=failure.reason, hint=failure.hint, is_final=failure.is_final)


def _of_calibration(job: Job, solved: SolvedSession) -> Outcome:
    calibration, verdict = solved.calibration, verdict_on(solved.calibration)
    stated = stated_verdict(verdict)
    assert solved.found.file is not None
    sigma_deg, sigma_cm = _largest_sigma(calibration.covariance)
    doubtful = verdict.level not in ("good", "usable")
    return replace(
        _outcome(job, "weak" if doubtful else "solved"),
        reason=stated.reason if doubtful else "",
        hint=stated.action if doubtful else "",
        verdict=verdict.level,
        sigma_deg=sigma_deg,
        sigma_cm=sigma_cm,
        aed_px=calibration.metrics.aed_px,
        pairs=sum(pair.inlier for pair in calibration.pairs),
        warnings=tuple(warning.code for warning in solved.found.file.calibration.warnings),
        notes=solved.notes,
    )


def _largest_sigma(covariance: Matrix66) -> tuple[float | None, float | None]:
    """Return the largest standard deviation of the rotation [deg] and of the position [cm]; None if they are not known."""
    sigma = np.sqrt(np.diag(covariance))
    if not np.isfinite(sigma).all():
        return None, None
    return float(np.degrees(sigma[3:].max())), float(100.0 * sigma[:3].max())


def _outcome(job: Job, status: Status) -> Outcome:
    row = job.row
    return Outcome(
        OUTCOME_SCHEMA,
        job.digest,
        row.vehicle,
        row.session,
        status,
        vehicle_type=row.vehicle_type,
        radar_serial=row.radar_serial,
        camera_serial=row.camera_serial,
        version=version(),
    )
