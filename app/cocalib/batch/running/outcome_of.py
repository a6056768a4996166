"""What came of a job, from what its steps made."""

import numpy as np
from msgspec.structs import replace

from calib_core.arrays import Matrix66
from calib_core.measurements import Unsolvable
from calib_core.results.verdict import verdict_on
from cocalib.batch.job import Job
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, Status
from cocalib.batch.running.attempting import Failure
from cocalib.batch.running.solving import SolvedSession
from cocalib.batch.running.steps import SessionResult
from cocalib.platform.resources import version


def outcome_of(job: Job, result: SessionResult) -> Outcome:
    """Return the outcome, without its files and its run."""
    solved = result.solved
    if isinstance(solved, Failure):
        return replace(failed(job, solved), recorded_ns=result.recorded_ns)
    if isinstance(solved, Unsolvable):
        refused = _outcome(job, "refused")
        return replace(refused, reason=solved.reason, hint=solved.hint, recorded_ns=result.recorded_ns)
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
    assert solved.found.file is not None
    sigma_deg, sigma_cm = _largest_sigma(calibration.covariance)
    doubtful = solved.is_weak or verdict.level not in ("good", "usable")
    return replace(
        _outcome(job, "weak" if doubtful else "solved"),
        reason=verdict.reason if doubtful else "",
        hint=verdict.action if doubtful else "",
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
