"""Best fit: from pairs to the errors-in-variables fit of the most likely start, with the test for mirrored axes."""

from dataclasses import dataclass

import numpy as np

from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution, associate, solve_gnc
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.estimation.mirror_test import MIRRORED_GAIN, mirror_gain
from calib_core.estimation.unsolved import degenerate, mirrored, no_pose
from calib_core.measurements import MIN_PAIRS, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration

_STARTS_MEASURED = 3
_STARTS_FREE = 6
_STARTS_QUICK = 3
_STILL_AGREEING_SHARE = 0.6
_AGREEING_SHARE = 0.9
_PLAUSIBLE_SCALE = 1.8
_NEAR_PRIOR = 4.0  # standard deviations
_PAIRS_TO_START = 150  # more do not improve the initialization


@dataclass(frozen=True, slots=True, eq=False)
class BestFit:
    """The fit from the most likely start.

    Attributes:
        refined: the fit.
        found: the GNC solutions of all starts, the most likely first.
        mirror_gain: gain in twice the log-likelihood with mirrored radar axes; negative if they fit worse.
    """

    refined: ErrorsInVariablesFit
    found: tuple[GncSolution, ...]
    mirror_gain: float


def best_fit(measurements: PairMeasurements, options: CalibrationOptions) -> BestFit | Unsolvable:
    """Run GNC from several initial poses and fit errors in variables from the most likely solution."""
    estimate_scale, seed = options.noise.estimate_scale, options.solving.seed
    few = _some_pairs(measurements)
    most = _STARTS_MEASURED if measurements.prior.measured else _STARTS_FREE
    starts = initial_poses(few, most=most, rng=np.random.default_rng(seed))
    found = solve_gnc(few, starts, estimate_scale=estimate_scale)
    if not found:
        return degenerate(len(measurements))
    refined = fit_errors_in_variables(measurements, found[0], estimate_scale=estimate_scale)
    gain = -np.inf
    if not _clearly_not_mirrored(measurements, refined):
        fitted = refined if few is measurements else None
        gain = mirror_gain(few, found[0], plain=fitted, estimate_scale=estimate_scale, seed=seed)
    inliers = int(refined.inliers.sum())
    if inliers < MIN_PAIRS:
        reason = f"only {inliers} of {len(measurements)} pairs agree on any pose"
        return mirrored(reason) if gain > MIRRORED_GAIN else no_pose(reason)
    return BestFit(refined, found, gain)


def quick_fit(
    measurements: PairMeasurements, options: CalibrationOptions, previous: Calibration | None
) -> ErrorsInVariablesFit | None:
    """Fit once, coarsely, from a known pose, or from the most likely of a few starts; None if too few pairs agree.

    Args:
        measurements: the pairs.
        options: of the solver.
        previous: the answer to nearly the same pairs; it is left if too few pairs agree on its pose.
    """
    estimate_scale = options.noise.estimate_scale
    if previous is not None:
        near = fit_errors_in_variables(
            measurements,
            GncSolution(previous.camera_from_radar, 0.0, 1.0),
            estimate_scale=estimate_scale,
            coarse=True,
            noise_scale=previous.noise_scale if estimate_scale else None,
        )
        if near.inliers.mean() >= _STILL_AGREEING_SHARE:
            return near
    few = _some_pairs(measurements)
    starts = initial_poses(few, most=_STARTS_QUICK, rng=np.random.default_rng(options.solving.seed))
    found = solve_gnc(few, starts, estimate_scale=estimate_scale)
    if not found:
        return None
    fit = fit_errors_in_variables(measurements, found[0], estimate_scale=estimate_scale, coarse=True)
    return fit if fit.inliers.sum() >= MIN_PAIRS else None


def _clearly_not_mirrored(measurements: PairMeasurements, refined: ErrorsInVariablesFit) -> bool:
    """Return whether pairs and a measured camera position agree so well that mirrored axes need no test."""
    agreeing = refined.inliers.mean() >= _AGREEING_SHARE and float(refined.noise_scale.max()) < _PLAUSIBLE_SCALE
    corrected = measurements.with_errors(refined.measurements.errors.values)
    assumed = associate(corrected, refined.camera_from_radar)[1].squared.mean() / 2.0
    agreeing = agreeing and float(assumed) < _PLAUSIBLE_SCALE**2
    prior_residual = measurements.prior.rows(refined.camera_from_radar)[0]
    return measurements.prior.measured and bool(agreeing) and float(np.linalg.norm(prior_residual)) < _NEAR_PRIOR


def _some_pairs(measurements: PairMeasurements) -> PairMeasurements:
    if len(measurements) <= _PAIRS_TO_START:
        return measurements
    return measurements.some(np.linspace(0, len(measurements) - 1, _PAIRS_TO_START).round().astype(np.int64))
