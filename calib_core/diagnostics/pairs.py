"""Warnings about single pairs: ambiguous candidates, and pairs that no other pair checks."""

import numpy as np

from calib_core.arrays import Values
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.results import DataWarning

_DECISIVE_LOSS = 8.0  # ratio of the standard deviations without and with the pair, in the worst direction
_LEAST_PAIRS = 6  # three determine a pose, so of a few each decides something (a choice)


def ambiguous_candidates(fit: SolvedFit) -> list[DataWarning]:
    """Name the pairs whose click another return explains as well as the chosen one."""
    ambiguous = [fit.ids[i] for i in np.flatnonzero(fit.refined.rivals >= 0)]
    if not ambiguous:
        return []
    return [DataWarning("uncertain-association", {"ids": ambiguous})]


def decisive_pair(fit: SolvedFit) -> list[DataWarning]:
    """Name the pair that alone determines some direction of the pose: no other pair would reveal an error in it."""
    if fit.inliers.sum() < _LEAST_PAIRS:
        return []
    loss = _losses(fit)
    most = int(np.argmax(loss))
    if loss[most] < _DECISIVE_LOSS:
        return []
    return [DataWarning("one-pair-decides", {"pair": fit.ids[most], "loss": float(loss[most])})]


def _losses(fit: SolvedFit) -> Values:
    """Return the factor (n,) by which the standard deviation grows without each pair, in the worst direction.

    Leaving out w J^T J of the information H turns the variance along a direction from v into v / (1 - h); the largest h is
    the largest eigenvalue of w J H^-1 J^T.
    """
    refined = fit.refined
    inverse = np.linalg.inv(fit.uncertainty.information)
    jacobian = refined.model.jacobian
    share = refined.weights[:, None, None] * (jacobian @ inverse @ np.swapaxes(jacobian, 1, 2))
    largest = np.linalg.eigvalsh(share)[:, -1]
    # a share of the variance: what one pair alone determines loses a factor of 3e4, not infinity
    return np.asarray(np.where(fit.inliers, 1.0 / np.sqrt(np.maximum(1.0 - largest, 1e-9)), 0.0))
