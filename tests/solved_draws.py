"""Simulated pairs with their fit, for tests of what follows the fit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.simulated_pairs import SimulatedPairs
from calib_core.estimation.covariance import PoseCovariance, pose_covariance
from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import solve_gnc
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.measurement_model import PairMeasurements, pair_measurements
from calib_core.measurements import Pair
from calib_core.options import (
    CalibrationOptions,
    CameraPositionPrior,
    NoiseOptions,
    SolvingOptions,
    without_systematic_errors,
)
from calib_core.synthetic.scene.scenes import PairsLayout

NARROW = PairsLayout(max_range_m=20.0, max_lateral_m=1.0)
"""An aisle of 2 m."""


@dataclass(frozen=True, slots=True, eq=False)
class SolvedDraw:
    """The pairs' arrays, in the order of the draw, their fit, and its covariance."""

    measurements: PairMeasurements
    refined: ErrorsInVariablesFit
    uncertainty: PoseCovariance


def solve_draw(
    simulated: SimulatedPairs,
    *,
    pairs: Sequence[Pair] | None = None,
    tape: bool = False,
    estimate_scale: bool = True,
    exact: bool = True,
) -> SolvedDraw:
    """Fit simulated pairs, or others with the same camera, as the default method does, told whether the instruments are exact."""
    prior = CameraPositionPrior((0.0, 0.0, 0.045)) if tape else None
    options = CalibrationOptions(
        noise=NoiseOptions(estimate_scale=estimate_scale), solving=SolvingOptions(camera_position=prior)
    )
    options = without_systematic_errors(options) if exact else options
    measurements = pair_measurements(simulated.pairs if pairs is None else pairs, simulated.camera, options)
    starts = initial_poses(measurements, most=6, rng=np.random.default_rng(1))
    found = solve_gnc(measurements, starts, estimate_scale=estimate_scale)
    refined = fit_errors_in_variables(measurements, found[0], estimate_scale=estimate_scale)
    return SolvedDraw(measurements, refined, pose_covariance(refined))
