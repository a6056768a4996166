"""Where each pair's radar position falls in the picture, for all pairs of an answer at once.

Numbers are rounded to what can be seen: with many clicks, one more then leaves most of them as they are.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from app.view.model import Ellipse
from calib_core.arrays import Flags
from calib_core.radar import polar_from_cartesian
from calib_core.results import PairResult

__all__ = ["Reprojection", "ellipses_of", "reprojections"]

_CHI2_95_2D = 5.991464547107979  # 95 % quantile of chi-squared with 2 degrees of freedom
_DECIMALS_PX, _DECIMALS_RAD, _DECIMALS_POSITION, _DECIMALS_PROBABILITY = 2, 3, 4, 4


@dataclass(frozen=True, slots=True)
class Reprojection:
    """One pair under the solved pose, as it is drawn.

    Attributes:
        projected_px: (u, v), to 0.01 px; None if the radar position lies behind the camera.
        ellipse: None if the method has no noise model.
        range_m: of the radar position.
        azimuth_deg: of the radar position, positive to the left.
        elevation_deg: of the radar position, positive upwards.
        inlier: it took part in the pose.
        excluded: the user had left it out.
        outlier_probability: 0 to 1, to 0.0001; None if the method has none.
    """

    projected_px: tuple[float, float] | None
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
    projected = np.round([pair.projected_px for pair in pairs], _DECIMALS_PX)
    polar = polar_from_cartesian(np.array([pair.point_radar_m for pair in pairs]))
    polar[:, 1:] = np.rad2deg(polar[:, 1:])
    rows = zip(
        pairs,
        projected.tolist(),
        np.round(polar, _DECIMALS_POSITION).tolist(),
        ellipses_of([pair.expected_covariance_px2 for pair in pairs]),
        strict=True,
    )
    return {
        pair.id: Reprojection(
            projected_px=(u_px, v_px) if math.isfinite(u_px) and math.isfinite(v_px) else None,
            ellipse=ellipse,
            range_m=range_m,
            azimuth_deg=azimuth_deg,
            elevation_deg=elevation_deg,
            inlier=pair.inlier,
            excluded=pair.excluded,
            outlier_probability=_rounded(pair.outlier_probability),
        )
        for pair, (u_px, v_px), (range_m, azimuth_deg, elevation_deg), ellipse in rows
    }


def _rounded(probability: float) -> float | None:
    return None if math.isnan(probability) else round(float(probability), _DECIMALS_PROBABILITY)


def ellipses_of(covariances_px2: Sequence[np.ndarray]) -> list[Ellipse | None]:
    """Return the 95 % ellipses of covariances (n, 2, 2) [px^2]; None where one is not known."""
    covariances = np.asarray(covariances_px2, dtype=np.float64).reshape(-1, 2, 2)
    known: Flags = np.all(np.isfinite(covariances), axis=(1, 2))
    symmetric = (covariances[known] + covariances[known].swapaxes(1, 2)) / 2.0
    squares, axes = np.linalg.eigh(symmetric)
    minor_and_major = np.round(np.sqrt(np.maximum(squares, 0.0) * _CHI2_95_2D), _DECIMALS_PX)
    angles = np.round(np.arctan2(axes[:, 1, 1], axes[:, 0, 1]) % np.pi, _DECIMALS_RAD)
    ellipses: list[Ellipse | None] = [None] * len(covariances)
    for place, (minor, major), angle in zip(
        np.flatnonzero(known), minor_and_major.tolist(), angles.tolist(), strict=True
    ):
        ellipses[place] = Ellipse(major, minor, angle)
    return ellipses
