"""Warnings about the posterior: other poses that are possible, and pairs that the pose rests on or that point elsewhere."""

import numpy as np

from calib_core.arrays import Values
from calib_core.diagnostics.pairs import listed
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.results import DataWarning

_LEAST_PROBABILITY = 0.05
_OTHER_POSE_SIGMAS = 4.0


def possible_poses(fit: SolvedFit) -> list[DataWarning]:
    """Warn if the samples of the posterior lie about several separate poses."""
    here = fit.refined.camera_from_radar
    for other in fit.beyond.possible:
        error = other.camera_from_radar.error_from(here)
        sigmas = float(np.sqrt(error @ np.linalg.solve(fit.uncertainty.covariance, error)))
        if other.probability >= _LEAST_PROBABILITY and sigmas > _OTHER_POSE_SIGMAS:
            return [
                DataWarning(
                    "two-poses",
                    f"another pose, {_away(error)}, has a probability of {100 * other.probability:.0f} %: which of the pairs "
                    "are wrong is not clear",
                    "measure the camera position with a tape, or add placements nearer and farther than the present ones",
                )
            ]
    return []


def pivotal_pair(fit: SolvedFit) -> list[DataWarning]:
    """Name the pair without which the others, judged anew, agree on another pose."""
    found = fit.beyond.pivotal
    if found is None or any(influential.pair == found.pair for influential in fit.influential_pairs):
        return []
    name = fit.ids[found.pair]
    changed = f", and {listed([fit.ids[i] for i in found.switched])} would change sides" if len(found.switched) else ""
    return [
        DataWarning(
            "doubtful-pair",
            f"the pose rests on {name}: without {name} the camera moves {100 * found.camera_move_m:.0f} cm, "
            f"{found.standard_deviations:.1f} standard deviations{changed}",
            f"check the click and the radar position of {name}, or add placements near it",
        )
    ]


def agreeing_outliers(fit: SolvedFit) -> list[DataWarning]:
    """Name the outliers that agree among themselves on another pose."""
    found = fit.beyond.agreeing
    if found is None:
        return []
    names = [fit.ids[i] for i in found.pairs]
    return [
        DataWarning(
            "agreeing-outliers",
            f"{len(names)} pairs that were set aside agree on another pose, {_away(found.difference)}: {listed(names)}",
            "check which group shows the reflector: an object that always stands near it, such as a cart, or a second "
            "reflector gives such a group; exclude the wrong one",
        )
    ]


def _away(error: Values) -> str:
    """Return in words how far a pose error (6,) is."""
    return f"{np.rad2deg(np.linalg.norm(error[3:])):.1f} deg and {100 * np.linalg.norm(error[:3]):.0f} cm away"
