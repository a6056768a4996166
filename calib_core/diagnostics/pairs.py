"""Warnings about single pairs: ambiguous candidates, the pivotal pair, and pairs that no other pair checks."""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Values
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.results import DataWarning

_DECISIVE_LOSS = 8.0  # ratio of the standard deviations without and with the pair, in the worst direction
_LEAST_PAIRS = 6


def ambiguous_candidates(fit: SolvedFit) -> list[DataWarning]:
    """Name the pairs whose click another return explains as well as the chosen one."""
    ambiguous = [fit.ids[i] for i in np.flatnonzero(fit.refined.rivals >= 0)]
    if not ambiguous:
        return []
    return [
        DataWarning(
            "uncertain-association",
            f"more than one radar position fits the click of {listed(ambiguous)}",
            "choose the return of each on the page (C), or exclude the pair",
        )
    ]


def pivotal_pair(fit: SolvedFit) -> list[DataWarning]:
    """Name the pair without which the others, judged anew, agree on another pose."""
    found = fit.beyond.pivotal
    if found is None:
        return []
    name = fit.ids[found.pair]
    changed = f", and {listed([fit.ids[i] for i in found.switched])} would change sides" if found.switched else ""
    return [
        DataWarning(
            "doubtful-pair",
            f"the pose rests on {name}: without {name} the camera moves {100 * found.camera_move_m:.0f} cm, "
            f"{found.standard_deviations:.1f} standard deviations{changed}",
            f"check the click and the radar position of {name}, or add placements near it",
        )
    ]


def decisive_pair(fit: SolvedFit) -> list[DataWarning]:
    """Name the pair that alone determines some direction of the pose: no other pair would reveal an error in it."""
    if fit.inliers.sum() < _LEAST_PAIRS:
        return []
    loss = _losses(fit)
    most = int(np.argmax(loss))
    if loss[most] < _DECISIVE_LOSS:
        return []
    return [
        DataWarning(
            "one-pair-decides",
            f"part of the pose depends on {fit.ids[most]} alone: without it, that part would be {loss[most]:.0f} times less "
            "certain, so the other pairs cannot check its click",
            f"check the click of {fit.ids[most]} again, and add a placement near it",
        )
    ]


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
    return np.asarray(np.where(fit.inliers, 1.0 / np.sqrt(np.maximum(1.0 - largest, 1e-9)), 0.0))


def listed(names: Sequence[str]) -> str:
    """List the first six names and count the rest."""
    shown = ", ".join(names[:6])
    return shown if len(names) <= 6 else f"{shown} and {len(names) - 6} more"
