"""Is one radar axis mirrored? Residuals alone cannot tell; residuals and what is known of the camera can."""

import numpy as np

from calib_core.estimation.errors_in_variables import ErrorsInVariablesFit, fit_errors_in_variables
from calib_core.estimation.gnc import GncSolution, mixture_cost, solve_gnc
from calib_core.estimation.initialization import initial_poses
from calib_core.estimation.measurement_model import PairMeasurements

__all__ = ["MIRRORED_GAIN", "NOT_MIRRORED_GAIN", "mirror_gain"]

MIRRORED_GAIN = 10.6
"""From how large a gain in twice the log-likelihood on mirrored axes are the likelier ones: right axes lose by a likelihood
ratio of 200 in less than one set of 200."""

NOT_MIRRORED_GAIN = -3.0
"""Up to how large a gain the axes are taken to be right; between the two, the question stays open."""

_STARTS = 2
_BEYOND_DOUBT = 30.0  # a difference that noise levels cannot turn
_COARSE_ERROR = 0.5  # of a gain from coarse fits, a little more than the largest seen


def mirror_gain(
    measurements: PairMeasurements,
    best: GncSolution,
    *,
    plain: ErrorsInVariablesFit | None = None,
    estimate_scale: bool,
    seed: int,
) -> float:
    """Return by how much twice the log-likelihood rises when the radar's y axis is mirrored.

    A radar with one axis mirrored (left-handed axes, or elevation with the wrong sign) cannot be told by its residuals:
    placements on the ground fit a camera mirrored below the ground just as well. Only what is known of the camera
    position, or placements at varied heights, tell the two apart. The 24 right-handed conventions need no test: they are
    rotations, and the pose absorbs them. Each hand is fitted with its own noise level, coarsely
    at first: the gain is then good to a few tenths, and only next to what it is judged by more is asked of it.

    Args:
        measurements: the pairs.
        best: what they agree on, axes as they are.
        plain: the fit that starts there, where it has been made already.
        estimate_scale: estimate the noise level of either fit.
        seed: of the draws.
    """
    mirrored = measurements.mirrored()
    starts = initial_poses(mirrored, most=_STARTS, rng=np.random.default_rng(seed))
    found = solve_gnc(mirrored, starts, estimate_scale=estimate_scale)
    if not found:
        return -np.inf
    if abs(best.cost - found[0].cost) > _BEYOND_DOUBT:
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
