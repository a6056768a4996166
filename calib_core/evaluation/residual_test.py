"""Do pairs that took no part in a calibration fit it, as well as its stated uncertainty says?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Flags, Values, frozen_array
from calib_core.estimation.gnc import associate
from calib_core.estimation.measurement_model import pair_measurements
from calib_core.estimation.pair_results import residual_covariances
from calib_core.measurements import Candidate, Pair
from calib_core.options import without_systematic_errors
from calib_core.radar import RadarErrors
from calib_core.results import Calibration

_QUANTILE = 12.591587243743977  # the 95 % quantile of chi2 with 6 degrees of freedom
_OUTSIDE = 5.991464547107979  # the 95 % quantile of chi2 with 2 degrees of freedom
_MISFIT = 13.815510557964274  # its 99.9 % quantile: no noise of this pair explains it


@dataclass(frozen=True, slots=True, eq=False)
class ResidualTest:
    """Residuals of pairs under a calibration, compared with what its covariance and the noise of the pairs allow.

    Attributes:
        ids: of the pairs (n).
        distances_px: (n,) lengths of the residuals, each pair with its best candidate; infinite behind the camera.
        outside: (n,) whether a residual is outside its own 95 % region; all False if no covariance is stated.
        misfits: (n,) whether it is far outside, which no noise explains; these do not count in chi2.
        chi2: of the other residuals together, with the pose's error common to all; NaN if no covariance is stated.
        degrees_of_freedom: of chi2.
        p_value: probability of a chi2 this large if the calibration holds; NaN if chi2 is.
    """

    ids: tuple[str, ...]
    distances_px: Values
    outside: Flags
    misfits: Flags
    chi2: float
    degrees_of_freedom: int
    p_value: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "distances_px", frozen_array(self.distances_px, (None,)))
        object.__setattr__(self, "outside", frozen_array(self.outside, (None,), dtype=np.bool_))
        object.__setattr__(self, "misfits", frozen_array(self.misfits, (None,), dtype=np.bool_))


def residual_test(pairs: Sequence[Pair], calibration: Calibration) -> ResidualTest:
    """Test pairs against a calibration, with its options, its estimated noise level and its covariance.

    Args:
        pairs: at least one; they took no part in the calibration.
        calibration: the calibration.
    """
    corrected = [_corrected(pair, calibration.radar_errors) for pair in pairs]
    options = without_systematic_errors(calibration.options)  # their part is in the pose's covariance
    camera = replace(calibration.camera, covariance=None)
    measurements = pair_measurements(corrected, camera, options).scaled(calibration.noise_scale)
    rows, model = associate(measurements, calibration.camera_from_radar)
    points_radar_m = np.array([one.position_radar_m for pair in corrected for one in pair.candidates])[rows]
    residuals_px = calibration.camera.project(calibration.camera_from_radar @ points_radar_m) - measurements.pixels_px
    seen = np.isfinite(residuals_px).all(axis=1)
    distances_px = np.where(seen, np.linalg.norm(residuals_px, axis=1), np.inf)
    ids, none = tuple(pair.id for pair in pairs), np.zeros(len(pairs), dtype=np.bool_)
    if not np.isfinite(calibration.firm_covariance).all():
        return ResidualTest(ids, distances_px, none, ~seen, float("nan"), 0, float("nan"))
    jacobian = calibration.camera.pose_jacobian(calibration.camera_from_radar, points_radar_m)
    heavier = max(1.0, float(np.nan_to_num(calibration.covariance_quantile)) / _QUANTILE)  # tails than a normal error's
    covariance = calibration.firm_covariance * heavier
    return _tested(ids, distances_px, residuals_px, residual_covariances(model), jacobian, covariance)


def _corrected(pair: Pair, radar_errors: RadarErrors) -> Pair:
    """Take out of a pair's candidates what the radar gets wrong."""

    def true(one: Candidate) -> Candidate:
        return replace(one, position_radar_m=radar_errors.corrected(one.position_radar_m[None])[0])

    return replace(pair, candidates=tuple(map(true, pair.candidates)))


def _tested(
    ids: tuple[str, ...],
    distances_px: Values,
    residuals_px: np.ndarray,
    noise_px2: np.ndarray,
    jacobian: np.ndarray,
    covariance: np.ndarray,
) -> ResidualTest:
    from scipy.special import chdtrc

    own_px2 = noise_px2 + jacobian @ covariance @ np.swapaxes(jacobian, 1, 2)
    seen = np.isfinite(distances_px) & np.isfinite(own_px2).all(axis=(1, 2))
    squared = np.full(len(ids), np.inf)
    solved = np.linalg.solve(own_px2[seen], residuals_px[seen][..., None])[..., 0]
    squared[seen] = np.einsum("ni,ni->n", residuals_px[seen], solved)
    kept = np.flatnonzero(squared <= _MISFIT)
    rows = jacobian[kept].reshape(-1, 6)
    together_px2 = rows @ covariance @ rows.T
    for place, pair in enumerate(kept):
        block = slice(2 * place, 2 * place + 2)
        together_px2[block, block] += noise_px2[pair]
    residual_px = residuals_px[kept].ravel()
    chi2 = float(residual_px @ np.linalg.solve(together_px2, residual_px)) if len(kept) else float("nan")
    freedom = 2 * len(kept)
    p_value = float(chdtrc(freedom, chi2)) if len(kept) else float("nan")
    return ResidualTest(ids, distances_px, squared > _OUTSIDE, squared > _MISFIT, chi2, freedom, p_value)
