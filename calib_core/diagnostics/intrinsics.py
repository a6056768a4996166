"""Warnings about refined intrinsics: changed too far, or not told apart from the radar. Given ones are tested in `causes`.

A focal length longer by a share a moves every pixel almost as angles reported too large by a share -a, so pairs
show the sum of the two well, and how it divides only by the priors. With C the covariance of all unknowns, f the focal length
and s the scales,

    C_fs C_ss^-1 C_sf / C_ff

is the part of the focal length's variance that knowing the scales would remove.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values
from calib_core.diagnostics.solved_fit import SolvedFit
from calib_core.results import DataWarning
from calib_core.results.systematic_errors import LensPrior, is_beyond_its_prior

_SCALES = ("azimuth_scale", "elevation_scale")
_UNTOLD_SHARE = 0.5  # of the focal length's variance
_NOTABLE_FOCAL = 0.002  # share: a focal length known better is no concern, 2 px at 1,000 px from the middle (a choice)


@dataclass(frozen=True, slots=True)
class _Focal:
    """The refined focal length: change of the given one as a share, its standard deviation, and the part of the scales."""

    change: float
    sigma: float
    scale_share: float


def lens_or_scale(fit: SolvedFit) -> list[DataWarning]:
    """Warn that the refined focal length and the radar's angle scale cannot be told apart."""
    focal = _focal(fit)
    if focal is None or focal.sigma < _NOTABLE_FOCAL or focal.scale_share < _UNTOLD_SHARE:
        return []
    scales = [error for error in fit.uncertainty.systematic_errors if error.name in _SCALES]
    return [
        DataWarning(
            "lens-or-radar-scale",
            {"change": focal.change, "sigma": focal.sigma, "scales": scales},
        )
    ]


def refined_too_far(fit: SolvedFit) -> list[DataWarning]:
    """Warn of refined intrinsics so far from the given ones that these, or what was stated of them, cannot be right."""
    errors = fit.refined.measurements.errors
    if errors.refined.start == errors.refined.stop:
        return []
    beyond = [error for error in fit.uncertainty.systematic_errors if error.of_lens and is_beyond_its_prior(error)]
    if not beyond:
        return []
    return [DataWarning("intrinsics-suspected", {"refined_too_far": beyond})]


def _focal(fit: SolvedFit) -> _Focal | None:
    """Return what is known of the refined focal length; None if it was not refined together with a scale."""
    errors = fit.refined.measurements.errors
    scales = [6 + k for k, one in enumerate(errors.estimated) if one.name in _SCALES]
    places = errors.refined
    if errors.lens is None or places.start == places.stop or not scales:
        return None
    along = _focal_along(errors.lens)
    covariance = np.linalg.inv(fit.uncertainty.information)
    lens = list(range(6 + places.start, 6 + places.stop))
    variance = float(along @ covariance[np.ix_(lens, lens)] @ along)
    if variance <= 0.0:
        return None
    mixed = covariance[np.ix_(scales, lens)] @ along
    removed = float(mixed @ np.linalg.solve(covariance[np.ix_(scales, scales)], mixed))
    stated = fit.uncertainty.lens
    sigma = float(np.sqrt(variance if stated is None else along @ stated @ along))
    return _Focal(float(along @ errors.values[places]), sigma, removed / variance)


def _focal_along(lens: LensPrior) -> Values:
    """Return by what share both focal lengths together change along each axis of the prior: (r,)."""
    return np.asarray((lens.along_axes[:2] / lens.camera.parameters[:2, None]).mean(axis=0))
