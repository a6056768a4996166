"""Errors of many trials become figures relative to the bound."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.cases import Case, bound, trials
from benchmarks.accuracy.methods import METHODS, Estimate
from calib_core.synthetic import SimulatedPairs

__all__ = ["Score", "score_case"]

_FAILED = 6.0  # times the bound


@dataclass(frozen=True, slots=True)
class Score:
    """One method in one case.

    Attributes:
        rotation: RMSE of the rotation over its bound, trials without a pose left out.
        position: the same for the camera position.
        median_rotation: median instead of RMSE, over the bound.
        failed: share of trials without a pose, or with a rotation beyond six times the bound.
        coverage: share of trials whose truth lies in the stated 95 % ellipsoid; NaN where none is stated.
        bound_deg: the bound of the rotation.
        bound_cm: of the camera position.
    """

    rotation: float
    position: float
    median_rotation: float
    failed: float
    coverage: float
    bound_deg: float
    bound_cm: float


def score_case(case: Case, methods: Sequence[str], count: int) -> dict[str, Score]:
    """Run every method on the same trials."""
    drawn = list(trials(case, count))
    bounds = np.array([_squares_of(bound(simulated, case)) for simulated in drawn])
    return {name: _score([METHODS[name](one, case) for one in drawn], drawn, bounds) for name in methods}


def _squares_of(covariance: np.ndarray) -> tuple[float, float]:
    return float(np.trace(covariance[3:, 3:])), float(np.trace(covariance[:3, :3]))


def _score(estimates: Sequence[Estimate | None], drawn: Sequence[SimulatedPairs], bounds: np.ndarray) -> Score:
    solved = [i for i, estimate in enumerate(estimates) if estimate is not None]
    bound_rotation, bound_position = np.sqrt(bounds.mean(axis=0))
    if not solved:
        nothing = float("nan")
        return Score(nothing, nothing, nothing, 1.0, nothing, np.rad2deg(bound_rotation), 100 * bound_position)
    errors = np.array([_error(estimates[i], drawn[i]) for i in solved])
    far = int((errors[:, 0] > _FAILED * np.sqrt(bounds[solved, 0])).sum())
    covered = [one for i in solved if (one := _covered(estimates[i], drawn[i])) is not None]
    return Score(
        rotation=float(np.sqrt((errors[:, 0] ** 2).mean() / bounds[solved, 0].mean())),
        position=float(np.sqrt((errors[:, 1] ** 2).mean() / bounds[solved, 1].mean())),
        median_rotation=float(np.median(errors[:, 0] / np.sqrt(bounds[solved, 0]))),
        failed=(far + len(estimates) - len(solved)) / len(estimates),
        coverage=float(np.mean(covered)) if covered else float("nan"),
        bound_deg=float(np.rad2deg(bound_rotation)),
        bound_cm=float(100 * bound_position),
    )


def _error(estimate: Estimate | None, simulated: SimulatedPairs) -> tuple[float, float]:
    assert estimate is not None
    error = simulated.camera_from_radar.error_from(estimate.camera_from_radar)
    centre = estimate.camera_from_radar.inverse().translation_m
    return float(np.linalg.norm(error[3:])), float(np.linalg.norm(centre - simulated.rig.camera_position_radar_m))


def _covered(estimate: Estimate | None, simulated: SimulatedPairs) -> bool | None:
    if estimate is None or estimate.calibration is None:
        return None
    error = simulated.camera_from_radar.error_from(estimate.camera_from_radar)
    squared = float(error @ np.linalg.solve(estimate.calibration.covariance, error))
    return squared <= estimate.calibration.covariance_quantile
