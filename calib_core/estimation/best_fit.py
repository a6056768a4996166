"""Best fit: from pairs to the errors-in-variables fit of the most likely start, with the test for mirrored axes.

Mirror test: is one radar axis mirrored? Residuals alone do not show it; together with the camera prior they do.
"""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import RADII, GncSolution, associate, solve_gnc
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.marginal_likelihood import log_marginal_likelihood
from calib_core.estimation.measured_position import WeighedPosition, weighed_position
from calib_core.estimation.measurement_model import PairMeasurements
from calib_core.estimation.unsolved import degenerate, disagreeing
from calib_core.measurements import MIN_PAIRS, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration

MIRRORED_GAIN = 10.6
"""Gain in twice the log-likelihood above which the axes are taken as mirrored: right axes lose by a likelihood ratio of 200
in less than one set of 200."""

NOT_MIRRORED_GAIN = -3.0
"""Gain up to which the axes are taken as right, odds of 4.5 to 1: a choice. Between the two limits, the question stays open."""

_STARTS = 2
_DECISIVE_DIFFERENCE = 30.0  # of costs, too large for other noise levels to reverse


def mirror_gain(
    measurements: PairMeasurements,
    best: GncSolution,
    *,
    plain: ErrorsInVariablesFit | None = None,
    estimate_scale: bool,
    seed: int,
) -> float:
    """Return the gain in twice the log marginal likelihood when the radar's y axis is mirrored.

    A radar with one axis mirrored (left-handed axes, or elevation with the wrong sign) cannot be recognised by its
    residuals: placements on the ground fit a camera mirrored below the ground just as well. Only the camera prior, or
    placements at varied heights, distinguish the two. The 24 right-handed conventions need no test: they are rotations,
    and the pose absorbs them. Each handedness is fitted with its own noise level.

    Args:
        measurements: the pairs.
        best: their GNC solution with the axes as given.
        plain: the fit that starts from it, if already computed.
        estimate_scale: estimate the noise level of either fit.
        seed: of the random draws.
    """
    mirrored = measurements.mirrored()
    starts = initial_poses(mirrored, most=_STARTS, rng=np.random.default_rng(seed))
    solutions = solve_gnc(mirrored, starts, estimate_scale=estimate_scale)
    if not solutions:
        return -np.inf
    if abs(best.cost - solutions[0].cost) > _DECISIVE_DIFFERENCE:
        return best.cost - solutions[0].cost
    straight = plain or fit_errors_in_variables(measurements, best, estimate_scale=estimate_scale, coarse=True)
    other = fit_errors_in_variables(mirrored, solutions[0], estimate_scale=estimate_scale, coarse=True)
    return 2.0 * (log_marginal_likelihood(mirrored, other) - log_marginal_likelihood(measurements, straight))


_STARTS_MEASURED, _STARTS_FREE, _STARTS_QUICK = 3, 6, 3
"""Number of starts with a measured camera position, without one, and of a preview. A choice: more miss fewer poses and take
longer."""
_STILL_AGREEING_SHARE = 0.6  # a choice: below it a preview starts anew
# with 0.9, sets with one wrong pair in five had the mirrored fit too, which named no more of 288 mirrored radars
_AGREEING_SHARE = 0.75
_PLAUSIBLE_SCALE = 1.8  # times the assumed noise, a choice
_NEAR_PRIOR = 4.0  # standard deviations
_PAIRS_TO_START = 150  # pairs; more do not improve the initialization


@dataclass(frozen=True, slots=True, eq=False)
class BestFit:
    """The fit from the most likely start.

    Attributes:
        refined: the fit.
        found: the GNC solutions of all starts, the most likely first.
        measurements: all pairs with the assumed noise.
        position: what the pairs alone leave of a measured camera position; None without one.
    """

    refined: ErrorsInVariablesFit
    found: tuple[GncSolution, ...]
    measurements: PairMeasurements
    position: WeighedPosition | None = None

    @property
    def weighed(self) -> PairMeasurements:
        """All pairs with the assumed noise and the camera prior of the fit."""
        return self.measurements if self.position is None else replace(self.measurements, prior=self.position.prior)

    def mirror_gain(self, options: CalibrationOptions) -> float:
        """Return the gain in twice the log-likelihood with mirrored radar axes; negative if they fit worse."""
        if _clearly_not_mirrored(self.measurements, self.refined):
            return -np.inf
        few = _some_pairs(self.measurements)
        plain = self.refined if few is self.measurements and self.position is None else None
        estimate_scale, seed = options.noise.estimate_scale, options.solving.seed
        return mirror_gain(few, self.found[0], plain=plain, estimate_scale=estimate_scale, seed=seed)


def best_fit(measurements: PairMeasurements, options: CalibrationOptions) -> BestFit | Unsolvable:
    """Run GNC from several initial poses and fit errors in variables from the most likely solution."""
    estimate_scale = options.noise.estimate_scale
    most = _STARTS_MEASURED if measurements.prior.measured else _STARTS_FREE
    solutions = _found(measurements, options, most=most)
    if not solutions:
        return degenerate(len(measurements))
    if measurements.prior.measured:
        position, refined = weighed_position(measurements, solutions[0], estimate_scale=estimate_scale)
        best = BestFit(refined, solutions, measurements, position)
    else:
        refined = fit_errors_in_variables(measurements, solutions[0], estimate_scale=estimate_scale)
        best = BestFit(refined, solutions, measurements)
    inliers = int(refined.inliers.sum())
    if inliers < MIN_PAIRS:
        return disagreeing(inliers, len(measurements), mirrored=best.mirror_gain(options) > MIRRORED_GAIN)
    return best


def _found(measurements: PairMeasurements, options: CalibrationOptions, *, most: int) -> tuple[GncSolution, ...]:
    """Run GNC from a few initial poses; also from poses free of a measured camera position that most pairs disagree with."""
    few, estimate_scale = _some_pairs(measurements), options.noise.estimate_scale
    rng = np.random.default_rng(options.solving.seed)
    starts = initial_poses(few, most=most, rng=rng)
    solutions = solve_gnc(few, starts, estimate_scale=estimate_scale)
    if not measurements.prior.measured or (solutions and _mostly_agreeing(few, solutions[0])):
        return solutions
    free = replace(few, prior=few.prior.weakened())
    return solve_gnc(few, (*starts, *initial_poses(free, most=_STARTS_FREE, rng=rng)), estimate_scale=estimate_scale)


def _mostly_agreeing(measurements: PairMeasurements, solution: GncSolution) -> bool:
    """Return whether most pairs are as near as the assumed noise lets them be."""
    return bool(np.median(associate(measurements, solution.camera_from_radar)[1].squared) < RADII[-1] ** 2)


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
    solutions = _found(measurements, options, most=_STARTS_QUICK)
    if not solutions:
        return None
    fit = fit_errors_in_variables(measurements, solutions[0], estimate_scale=estimate_scale, coarse=True)
    return fit if fit.inliers.sum() >= MIN_PAIRS else None


def _clearly_not_mirrored(measurements: PairMeasurements, refined: ErrorsInVariablesFit) -> bool:
    """Return whether pairs and a measured camera position agree so well that mirrored axes need no test."""
    if not measurements.prior.measured or refined.inliers.mean() < _AGREEING_SHARE:
        return False
    pose = refined.camera_from_radar
    near = float(measurements.prior.squared(pose.rotation, pose.translation_m)) < _NEAR_PRIOR**2
    return near and float(refined.noise_scale.max()) < _PLAUSIBLE_SCALE


def _some_pairs(measurements: PairMeasurements) -> PairMeasurements:
    if len(measurements) <= _PAIRS_TO_START:
        return measurements
    return measurements.some(np.linspace(0, len(measurements) - 1, _PAIRS_TO_START).round().astype(np.int64))
