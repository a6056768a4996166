"""Mirror test: is one radar axis mirrored? Residuals alone do not show it; together with the camera prior they do."""

import numpy as np

from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution, mixture_cost, solve_gnc
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.measurement_model import PairMeasurements

MIRRORED_GAIN = 10.6
"""Gain in twice the log-likelihood above which the axes are taken as mirrored: right axes lose by a likelihood ratio of 200
in less than one set of 200."""

NOT_MIRRORED_GAIN = -3.0
"""Gain up to which the axes are taken as right; between the two limits, the question stays open."""

_STARTS = 2
_DECISIVE_DIFFERENCE = 30.0  # of costs, too large for other noise levels to reverse
_COARSE_ERROR = 0.5  # of a gain from coarse fits, slightly above the largest observed


def mirror_gain(
    measurements: PairMeasurements,
    best: GncSolution,
    *,
    plain: ErrorsInVariablesFit | None = None,
    estimate_scale: bool,
    seed: int,
) -> float:
    """Return the gain in twice the log-likelihood when the radar's y axis is mirrored.

    A radar with one axis mirrored (left-handed axes, or elevation with the wrong sign) cannot be recognised by its
    residuals: placements on the ground fit a camera mirrored below the ground just as well. Only the camera prior, or
    placements at varied heights, distinguish the two. The 24 right-handed conventions need no test: they are rotations,
    and the pose absorbs them. Each handedness is fitted with its own noise level, first coarsely: the gain is then
    accurate to a few tenths, and it is refined only if it is close to a limit.

    Args:
        measurements: the pairs.
        best: their GNC solution with the axes as given.
        plain: the fit that starts from it, if already computed.
        estimate_scale: estimate the noise level of either fit.
        seed: of the random draws.
    """
    mirrored = measurements.mirrored()
    starts = initial_poses(mirrored, most=_STARTS, rng=np.random.default_rng(seed))
    found = solve_gnc(mirrored, starts, estimate_scale=estimate_scale)
    if not found:
        return -np.inf
    if abs(best.cost - found[0].cost) > _DECISIVE_DIFFERENCE:
        return best.cost - found[0].cost
    gain = -np.inf
    for coarse in (True, False):
        straight = plain or fit_errors_in_variables(measurements, best, estimate_scale=estimate_scale, coarse=coarse)
        other = fit_errors_in_variables(mirrored, found[0], estimate_scale=estimate_scale, coarse=coarse)
        gain = _cost(straight) - _cost(other)
        if all(abs(gain - limit) > _COARSE_ERROR for limit in (NOT_MIRRORED_GAIN, MIRRORED_GAIN)):
            break
    return gain


def _cost(fit: ErrorsInVariablesFit) -> float:
    return mixture_cost(fit.measurements, fit.camera_from_radar)
