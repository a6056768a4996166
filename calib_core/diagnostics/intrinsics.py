"""Score test of the intrinsics: how much of the residuals another focal length or radial distortion would explain.

To first order, a focal length longer by a share a moves a pixel by a d, with d its offset from the principal point; a
radial distortion that is off by b moves it by b |d / f|^2 d, whatever the lens model. With whitened residuals e, whitened
Jacobians J of the pose and of the estimated errors, priors included, g of such an unknown, and M = I - J (J^T J)^-1 J^T,
which removes what these can explain,

    a = g^T M e / g^T M g,    var a = 1 / g^T M g,    F(1, nu - 1) = (a^2 / var a) (nu - 1) / (nu - a^2 / var a),       (8)

because the noise was estimated with nu degrees of freedom from residuals that the wrong intrinsics had made larger. A score
test takes one step from the optimum and needs no second fit. A wrong principal point cannot be detected: the rotation
absorbs it. A scale of the radar's azimuths looks like a focal length and has a prior of its own, so it is not blamed on the
lens (`systematic.angle_scale` names both). A radar without elevation is not tested: its own residuals grow towards the near
placements.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.estimation.prior_rows import prior_rows
from calib_core.results import DataWarning

__all__ = ["LensError", "intrinsics", "lens_errors"]

_LEVEL = 0.0025  # false-alarm probability of each unknown
_LEAST_PAIRS = 10
_LEAST_SQUARED = 8.0  # a smaller statistic is never significant, whatever the degrees of freedom
_LEAST_REDUNDANCY = 0.05  # share of the residual's degrees of freedom that must stay unexplained


@dataclass(frozen=True, slots=True)
class LensError:
    """The estimated error of one of the intrinsics.

    Attributes:
        amount: to be added to the given value; a share of the focal length, or a radial coefficient.
        sigma: its standard deviation.
        chance: probability of an amount as large if the intrinsics were right (p-value).
    """

    amount: float
    sigma: float
    chance: float


def intrinsics(fit: SolvedFit) -> list[DataWarning]:
    """Warn of the focal length or the distortion, whichever explains more of the residuals."""
    if fit.inliers.sum() < _LEAST_PAIRS or fit.measurements.flat:
        return []
    focal, radial = lens_errors(fit)
    if min(focal.chance, radial.chance) >= _LEVEL:
        return []
    what = _focal_text(focal) if focal.chance <= radial.chance else _radial_text(fit, radial)
    return [
        DataWarning(
            "intrinsics-suspected",
            what,
            "check that the intrinsics belong to this camera, lens, zoom and image size, or calibrate the camera again; a radar "
            "with an azimuth scale error of the same size looks the same",
        )
    ]


def _focal_text(focal: LensError) -> str:
    return (
        f"residuals grow with the distance from the picture's centre: the given focal length seems "
        f"{100 * abs(focal.amount):.1f} ± {100 * focal.sigma:.1f} % too {'short' if focal.amount > 0 else 'long'}"
    )


def _radial_text(fit: SolvedFit, radial: LensError) -> str:
    offset_px, share = _offsets(fit)
    outermost = int(np.argmax(np.where(fit.inliers, share, 0.0)))
    reach_px = float(share[outermost] * np.linalg.norm(offset_px[outermost]))
    return (
        "residuals grow with the cube of the distance from the picture's centre: the given lens distortion seems off by "
        f"{abs(radial.amount) * reach_px:.0f} ± {radial.sigma * reach_px:.0f} px at the outermost click"
    )


def lens_errors(fit: SolvedFit) -> tuple[LensError, LensError]:
    """Estimate the errors of the focal length and of the radial distortion, each as if the other were right."""
    refined = fit.refined
    offset_px, share = _offsets(fit)
    root = np.sqrt(refined.weights)[:, None]
    prior_residual, prior_jacobian = prior_rows(refined.measurements, refined.camera_from_radar)
    moves_px = np.stack([offset_px, offset_px * share[:, None]], axis=2)
    gains = ((refined.model.whitening @ moves_px) * root[:, :, None]).reshape(-1, 2)
    unknowns = prior_jacobian.shape[1]
    fitted = np.concatenate([(refined.model.jacobian * root[:, :, None]).reshape(-1, unknowns), prior_jacobian])
    residual = np.concatenate([(refined.model.residual * root).reshape(-1), prior_residual])
    explained, _ = np.linalg.qr(fitted)
    gains = np.concatenate([gains, np.zeros((len(prior_residual), 2))])
    gains = gains - explained @ (explained.T @ gains)
    focal, radial = (_lens_error(gain, residual, refined.degrees_of_freedom) for gain in gains.T)
    return focal, radial


def _offsets(fit: SolvedFit) -> tuple[np.ndarray, Values]:
    """Return each click's offset from the principal point (n, 2) [px], and the square (n,) of that in focal lengths."""
    matrix_px = fit.measurements.camera.matrix_px
    offset_px = fit.measurements.pixels_px - matrix_px[:2, 2]
    return offset_px, np.asarray(((offset_px / matrix_px[[0, 1], [0, 1]]) ** 2).sum(axis=1))


def _lens_error(gain: Values, residual: Values, degrees_of_freedom: float) -> LensError:
    """Evaluate equation (8); with the noise known, nu is infinite."""
    information = float(gain @ gain)
    if information <= 0.0:
        return LensError(0.0, float("inf"), 1.0)
    amount = float(gain @ residual) / information
    squared, shrink = amount**2 * information, 1.0
    if degrees_of_freedom > 2.0:
        left = max(degrees_of_freedom - squared, _LEAST_REDUNDANCY * degrees_of_freedom)
        shrink = left / (degrees_of_freedom - 1.0)
    return LensError(amount, float(np.sqrt(shrink / information)), _chance(squared / shrink, degrees_of_freedom))


def _chance(squared: float, degrees_of_freedom: float) -> float:
    if squared < _LEAST_SQUARED:
        return 1.0
    from scipy.special import chdtrc, fdtrc

    nu = degrees_of_freedom
    return float(fdtrc(1.0, nu - 1.0, squared) if nu > 2.0 else chdtrc(1.0, squared))
