"""What came of a job, from what its steps made."""

import numpy as np
from msgspec.structs import replace

from app.batch.job import Job
from app.batch.outcome import OUTCOME_SCHEMA, Outcome, PriorUse, Status
from app.batch.running.attempting import Failure
from app.batch.running.solving import SolvedSession
from app.batch.running.steps import SessionResult
from app.resources import version
from calib_core.fleet_prior import FleetAnswer
from calib_core.measurements import Unsolvable
from calib_core.verdict import verdict_on

__all__ = ["failed", "outcome_of"]


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
    sigma = np.sqrt(np.diag(calibration.covariance))
    known = bool(np.isfinite(sigma).all())
    doubtful = solved.is_weak or verdict.level not in ("good", "usable")
    return replace(
        _outcome(job, "weak" if doubtful else "solved"),
        reason=verdict.reason if doubtful else "",
        hint=verdict.action if doubtful else "",
        verdict=verdict.level,
        sigma_deg=float(np.degrees(sigma[3:].max())) if known else None,
        sigma_cm=float(100.0 * sigma[:3].max()) if known else None,
        aed_px=calibration.metrics.aed_px,
        pairs=sum(pair.inlier for pair in calibration.pairs),
        fleet_prior=_prior_use(calibration.fleet),
        warnings=tuple(warning.code for warning in solved.found.file.calibration.warnings),
        notes=solved.notes,
    )


def _prior_use(fleet: FleetAnswer | None) -> PriorUse | None:
    if fleet is None:
        return None
    if not fleet.used:
        return "contradicted"
    return "untested" if fleet.data_alone is None else "used"


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
