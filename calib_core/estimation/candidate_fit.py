"""Candidate fit: how well each radar return that may belong to a click explains it under a solved pose."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values, Vector2, frozen_array
from calib_core.measurements import Candidate, Pair
from calib_core.radar import covariance_from_sigma_polar
from calib_core.results import Calibration

_NONE_OF_THEM = 0.1
"""Probability, before the click is compared, that none of the candidates is the reflector."""


@dataclass(frozen=True, slots=True, eq=False)
class CandidateFit:
    """One candidate of a click under a solved pose.

    Attributes:
        projected_px: (2,) its reprojection; NaN if the camera does not see it.
        distance_px: from the click; NaN likewise.
        squared: Mahalanobis distance squared of the click from the reprojection, two degrees of freedom; NaN if the
            candidate or the pose has no noise model.
        probability: that it is the reflector, given the click, the pose and the other candidates; NaN likewise.
    """

    projected_px: Vector2
    distance_px: float
    squared: float
    probability: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "projected_px", frozen_array(self.projected_px, (2,)))


def candidate_fits(calibration: Calibration, pair: Pair, candidates: Sequence[Candidate]) -> tuple[CandidateFit, ...]:
    """Evaluate candidates of a click under a pose.

    The probability weighs each candidate's score with the density of the click under the noise of click, return and pose,
    against an even density over the image for none of them.

    Args:
        calibration: the solved pose.
        pair: the click.
        candidates: any radar positions that may belong to it.
    """
    if not candidates:
        return ()
    points = np.array([one.position_radar_m for one in candidates])
    projected = calibration.reproject(points)
    away = projected - pair.pixel_px
    covariances = _covariances(calibration, pair, candidates)
    with np.errstate(invalid="ignore"):
        squared = np.einsum("ni,nij,nj->n", away, np.linalg.pinv(np.nan_to_num(covariances)), away)
    squared[~np.isfinite(covariances).all(axis=(1, 2))] = np.nan
    scores = np.array([one.score for one in candidates])
    probabilities = _probabilities(calibration, scores, squared, covariances)
    distances = np.linalg.norm(away, axis=1).tolist()
    rows = zip(projected, distances, squared.tolist(), probabilities.tolist(), strict=True)
    return tuple(CandidateFit(*row) for row in rows)


def _covariances(calibration: Calibration, pair: Pair, candidates: Sequence[Candidate]) -> np.ndarray:
    """Return the covariance (n, 2, 2) [px^2] of click minus reprojection; NaN where it is not known."""
    noise = calibration.noise_scale
    sigma_px = calibration.options.noise.sigma_px if pair.sigma_px is None else pair.sigma_px
    reported = np.array([one.position_radar_m for one in candidates])
    sigmas = np.array([one.sigma_polar for one in candidates]) * noise[1:]
    true_points = calibration.radar_errors.corrected(reported)
    camera_from_radar = calibration.camera_from_radar
    _, by_point = calibration.camera.project_with_jacobian(camera_from_radar @ true_points)
    by_radar = by_point @ camera_from_radar.rotation
    of_return = by_radar @ covariance_from_sigma_polar(reported, sigmas) @ np.swapaxes(by_radar, 1, 2)
    return np.asarray(
        (sigma_px * noise[0]) ** 2 * np.eye(2) + of_return + calibration.pixel_covariance(true_points), dtype=np.float64
    )


def _probabilities(calibration: Calibration, scores: Values, squared: Values, covariances: np.ndarray) -> Values:
    """Return the probability (n,) of each candidate; NaN where its fit is not known."""
    known = np.isfinite(squared)
    if not known.any():
        return np.full(len(scores), np.nan)
    camera = calibration.camera
    density = np.zeros(len(scores))
    spread = np.sqrt(np.linalg.det(covariances[known]))
    density[known] = np.exp(-0.5 * squared[known]) / (2.0 * np.pi * spread)
    weight = (1.0 - _NONE_OF_THEM) * np.clip(scores, 1e-6, 1.0) * density
    nothing = _NONE_OF_THEM / (camera.width_px * camera.height_px)
    return np.where(known, weight / (weight.sum() + nothing), np.nan)
