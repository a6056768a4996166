"""Where each pair's radar position falls in the picture, for all pairs of an answer at once.

Pixels are rounded to steps of at most 1 % of the pair's ellipse and a quarter of a pixel, which cannot be seen: with many clicks,
one more then leaves most pairs as they are, and only the others are sent to the page. The length of a residual is read as a
number, so it is rounded by itself, to the next finer power of ten.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from calib_core.arrays import Flags, Values
from calib_core.radar import polar_from_cartesian
from calib_core.results import PairResult
from cocalib.view.model import Ellipse

_CHI2_95_2D = 5.991464547107979  # 95 % quantile of chi-squared with 2 degrees of freedom
_SHARE, _FINEST_PX, _COARSEST_PX = 0.01, 2.0**-7, 0.25
"""Steps of pixels: this share of the ellipse's semi-major axis, within these limits, then down to a power of two."""
_DECIMALS_RAD, _DECIMALS_POSITION, _DECIMALS_PROBABILITY = 2, 4, 3


@dataclass(frozen=True, slots=True)
class Reprojection:
    """One pair under the solved pose, as it is drawn.

    Attributes:
        projected_px: (u, v), in whole steps; None if the radar position lies behind the camera.
        step_px: to which pixels of this pair are rounded.
        pixel_px: (u, v) of the click that was solved.
        distance_px: from there to the reprojection before it was rounded; None if the radar position lies behind the camera.
        ellipse: None if the method has no noise model.
        range_m: of the radar position.
        azimuth_deg: of the radar position, positive to the left.
        elevation_deg: of the radar position, positive upwards.
        inlier: it took part in the pose.
        excluded: the user had left it out.
        outlier_probability: 0 to 1, to 0.001; None if the method has none.
    """

    projected_px: tuple[float, float] | None
    step_px: float
    pixel_px: tuple[float, float]
    distance_px: float | None
    ellipse: Ellipse | None
    range_m: float
    azimuth_deg: float
    elevation_deg: float
    inlier: bool
    excluded: bool
    outlier_probability: float | None


@lru_cache(maxsize=2)
def reprojections(pairs: tuple[PairResult, ...]) -> Mapping[str, Reprojection]:
    """Return the reprojection of each pair, by id."""
    if not pairs:
        return {}
    ellipses = ellipses_of([pair.expected_covariance_px2 for pair in pairs])
    steps_px = _steps_px(ellipses)
    projected = np.round(np.array([pair.projected_px for pair in pairs]) / steps_px[:, None]) * steps_px[:, None]
    polar = polar_from_cartesian(np.array([pair.point_radar_m for pair in pairs]))
    polar[:, 1:] = np.rad2deg(polar[:, 1:])
    positions = np.round(polar, _DECIMALS_POSITION)
    rows = zip(pairs, projected.tolist(), steps_px.tolist(), ellipses, positions.tolist(), strict=True)
    return {
        pair.id: Reprojection(
            projected_px=(u_px, v_px) if math.isfinite(u_px) and math.isfinite(v_px) else None,
            step_px=step_px,
            pixel_px=(float(pair.pixel_px[0]), float(pair.pixel_px[1])),
            distance_px=length_px(pair.distance_px, step_px) if math.isfinite(pair.distance_px) else None,
            ellipse=None if ellipse is None else _in_steps(ellipse, step_px),
            range_m=range_m,
            azimuth_deg=azimuth_deg,
            elevation_deg=elevation_deg,
            inlier=pair.inlier,
            excluded=pair.excluded,
            outlier_probability=_rounded(pair.outlier_probability),
        )
        for pair, (u_px, v_px), step_px, ellipse, (range_m, azimuth_deg, elevation_deg) in rows
    }


def length_px(distance_px: float, step_px: float) -> float:
    """Round the length of a residual to a power of ten, the largest that is not above the step."""
    return round(distance_px, -math.floor(math.log10(step_px)))


def _rounded(probability: float) -> float | None:
    return None if math.isnan(probability) else round(float(probability), _DECIMALS_PROBABILITY)


def _steps_px(ellipses: Sequence[Ellipse | None]) -> Values:
    """Return the step (n,) to which pixels of each pair are rounded [px]."""
    lengths_px = np.array([0.0 if ellipse is None else ellipse.semi_major_px for ellipse in ellipses])
    return np.asarray(2.0 ** np.floor(np.log2(np.clip(_SHARE * lengths_px, _FINEST_PX, _COARSEST_PX))))


def _in_steps(ellipse: Ellipse, step_px: float) -> Ellipse:
    major_px, minor_px = (round(axis / step_px) * step_px for axis in (ellipse.semi_major_px, ellipse.semi_minor_px))
    return Ellipse(major_px, minor_px, ellipse.angle_rad)


def ellipses_of(covariances_px2: Sequence[np.ndarray]) -> list[Ellipse | None]:
    """Return the 95 % ellipses of covariances (n, 2, 2) [px^2]; None where one is not known."""
    covariances = np.asarray(covariances_px2, dtype=np.float64).reshape(-1, 2, 2)
    known: Flags = np.all(np.isfinite(covariances), axis=(1, 2))
    symmetric = (covariances[known] + covariances[known].swapaxes(1, 2)) / 2.0
    squares, axes = np.linalg.eigh(symmetric)
    minor_and_major = np.sqrt(np.maximum(squares, 0.0) * _CHI2_95_2D)
    angles = np.round(np.arctan2(axes[:, 1, 1], axes[:, 0, 1]) % np.pi, _DECIMALS_RAD)
    ellipses: list[Ellipse | None] = [None] * len(covariances)
    for place, (minor, major), angle in zip(
        np.flatnonzero(known), minor_and_major.tolist(), angles.tolist(), strict=True
    ):
        ellipses[place] = Ellipse(major, minor, angle)
    return ellipses
