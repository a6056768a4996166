"""Results of a batch, made by calibrating simulated pairs once and moving the pose by what a session gets wrong."""

import dataclasses
import hashlib
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from calib_core.calibration import calibrate_pairs
from calib_core.interchange import calibration_text
from calib_core.results import Calibration
from calib_core.results.verdict import verdict_on
from calib_core.synthetic.simulated_pairs import simulate_pairs
from cocalib.batch.outcome import OUTCOME_SCHEMA, Outcome, OutcomeFile, OutcomeRun, outcome_text
from cocalib.batch.results_folder import OUTCOME_FILE, ResultsFolder

DAY_NS = 86_400_000_000_000
FIRST_NS = 1_790_000_000_000_000_000
_RUN = datetime(2026, 9, 21, 12, tzinfo=UTC)
_MOUNTING_SIGMA = np.array([0.01, 0.01, 0.01, 0.008, 0.008, 0.008])  # m and rad
_AS_IT_IS = np.zeros(6)


@cache
def calibration() -> Calibration:
    """Return a calibration from 24 simulated pairs."""
    simulated = simulate_pairs(24, rng=np.random.default_rng(3), noise="imaging")
    return calibrate_pairs(simulated.pairs, simulated.camera).unwrap()


def session_error(rng: np.random.Generator) -> np.ndarray:
    """Draw the error (6,) of a session, smaller than its covariance allows: part of that is the same in all sessions."""
    return np.asarray(0.5 * np.linalg.cholesky(calibration().covariance) @ rng.standard_normal(6))


def digest_of(vehicle: str, session: str, run: int = 0) -> str:
    """Return the digest of a made job."""
    return hashlib.sha256(f"{vehicle}\0{session}\0{run}".encode()).hexdigest()[:32]


def make_result(
    folder: Path,
    vehicle: str,
    session: str,
    *,
    error: np.ndarray = _AS_IT_IS,
    run: int = 0,
    **changes: Any,
) -> Outcome:
    """Write the result of one job.

    Args:
        folder: of the results.
        vehicle: its name.
        session: its name.
        error: (6,) of the pose.
        run: a later run of the same session has a larger number.
        changes: of the outcome; a status "failed" or "refused" leaves the calibration out.
    """
    digest = digest_of(vehicle, session, run)
    outcome = Outcome(OUTCOME_SCHEMA, digest, vehicle, session, changes.pop("status", "solved"))
    started = (_RUN + timedelta(minutes=run)).isoformat(timespec="seconds")
    with ResultsFolder(folder).writing(digest) as unfinished:
        if outcome.status in ("solved", "weak"):
            outcome = _with_calibration(outcome, unfinished, error)
            (unfinished / "report.html").write_text("<p>report</p>")
        files = tuple(
            OutcomeFile(path.name, hashlib.sha256(path.read_bytes()).hexdigest())
            for path in sorted(unfinished.iterdir())
        )
        is_final = outcome.status != "failed"
        changes = {"files": files, "is_final": is_final, "run": OutcomeRun("host", started, 1.5)} | changes
        outcome = msgspec.structs.replace(outcome, **changes)
        (unfinished / OUTCOME_FILE).write_text(outcome_text(outcome), encoding="utf-8")
    return outcome


def _with_calibration(outcome: Outcome, folder: Path, error: np.ndarray) -> Outcome:
    base = calibration()
    moved = dataclasses.replace(base, camera_from_radar=base.camera_from_radar.perturbed(error))
    (folder / "calibration.json").write_text(calibration_text(moved), encoding="utf-8")
    sigma = np.sqrt(np.diag(base.covariance))
    return msgspec.structs.replace(
        outcome,
        verdict=verdict_on(base).level,
        recorded_ns=FIRST_NS,
        sigma_deg=float(np.degrees(sigma[3:].max())),
        sigma_cm=float(100.0 * sigma[:3].max()),
        aed_px=base.metrics.aed_px,
        pairs=24,
    )


def make_fleet(
    folder: Path, vehicles: int, sessions: int = 2, *, moved: dict[str, np.ndarray] | None = None, seed: int = 5
) -> list[Outcome]:
    """Write the results of vehicles V000, V001, ... of one type "van", each with sessions s0, s1, ... a day apart.

    Args:
        folder: of the results.
        vehicles: how many.
        sessions: of each.
        moved: (6,) by which the last session of a vehicle is moved, by its name.
        seed: of mountings and errors.
    """
    rng = np.random.default_rng(seed)
    made = []
    for name in (f"V{index:03}" for index in range(vehicles)):
        mounting = _MOUNTING_SIGMA * rng.standard_normal(6)
        for index in range(sessions):
            error = mounting + session_error(rng)
            if index == sessions - 1:
                error = error + (moved or {}).get(name, _AS_IT_IS)
            more = {"vehicle_type": "van", "radar_serial": f"R-{name}", "recorded_ns": FIRST_NS + index * DAY_NS}
            made.append(make_result(folder, name, f"s{index}", error=error, **more))
    return made
