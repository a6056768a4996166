"""Which fits of three sectors show the inner corner of a reflector, and not an edge, a line, a tip, an X or texture."""

from dataclasses import dataclass

import numpy as np

from calib_core.vision.sector_fit import SectorFit


@dataclass(frozen=True, slots=True)
class _Limits:
    """What a fit must show, for discs from a radius on: the smaller the disc, the more often chance looks like a corner.

    Attributes:
        from_px: the radius [px].
        contrast: least step between two sheets, in standard deviations of what the fit leaves.
        least_contrast: the same, at the worst place along a boundary.
        step_grey: least step [linear grey levels of 255].
        explained: least share of the variance.
        narrowest_deg: least angle of a sheet.
        widest_deg: greatest angle of a sheet: an edge or the tip of a sheet has 180 deg or more.
        blur: greatest blur, relative to the radius: smooth shading has no edges.
        score: least score of the proposal.
    """

    from_px: float
    contrast: float
    least_contrast: float
    step_grey: float
    explained: float
    narrowest_deg: float
    widest_deg: float
    blur: float
    score: float


_STRICT = (
    _Limits(12.0, 4.0, 2.5, 8.0, 0.98, 85.0, 157.0, 0.25, 0.50),
    _Limits(6.0, 4.0, 2.5, 8.0, 0.965, 85.0, 157.0, 0.30, 0.55),
    _Limits(4.0, 4.0, 2.5, 12.0, 0.94, 85.0, 155.0, 0.25, 0.55),
    _Limits(0.0, 6.0, 6.0, 16.0, 0.95, 86.0, 152.0, 0.30, 0.60),
)
_LOOSE = _Limits(0.0, 1.5, 0.0, 2.0, 0.70, 40.0, 170.0, 1.0, 0.0)
_STEEPEST = 2.2
"""Greatest change within a sheet, relative to the smallest step between two."""
_HALF_TURN = (-0.90, -0.15)
"""Correlation of a disc with itself turned by 180 deg: -1 for a straight edge, 1 for a line or the X of a checkerboard."""


def may_be_corner(fit: SectorFit) -> bool:
    """Return whether a larger disc is worth a try."""
    return _within(fit, _LOOSE)


def has_angles_of_corner(fit: SectorFit) -> bool:
    """Return whether the angles of the three sectors are those of three sheets seen from inside."""
    return _angles_within(fit, next(one for one in _STRICT if fit.radius_px >= one.from_px))


def is_corner(fit: SectorFit, score: float, half_turn: float) -> bool:
    """Return whether a fit shows three sheets that meet in one point.

    Args:
        fit: the fit.
        score: of the proposal that it began with.
        half_turn: the correlation of its disc with itself turned by 180 deg.
    """
    limits = next(one for one in _STRICT if fit.radius_px >= one.from_px)
    steady = fit.slope_grey <= _STEEPEST * fit.step_grey
    return steady and score >= limits.score and _HALF_TURN[0] <= half_turn <= _HALF_TURN[1] and _within(fit, limits)


def _within(fit: SectorFit, limits: _Limits) -> bool:
    return bool(
        fit.contrast >= limits.contrast
        and fit.least_step_grey >= limits.least_contrast * fit.residual_grey
        and fit.step_grey >= limits.step_grey
        and fit.explained >= limits.explained
        and fit.blur_px <= limits.blur * fit.radius_px
        and _angles_within(fit, limits)
    )


def _angles_within(fit: SectorFit, limits: _Limits) -> bool:
    widths_deg = np.rad2deg(fit.widths_rad)
    return bool(widths_deg.min() >= limits.narrowest_deg and widths_deg.max() <= limits.widest_deg)


def half_turn_correlation(grey: np.ndarray, fit: SectorFit) -> float:
    """Return the correlation of the disc around the fitted apex with itself turned by 180 deg; 1 if it leaves the picture.

    Args:
        grey: (h, w) the picture of the fit.
        fit: the fit.
    """
    half = int(np.ceil(fit.radius_px))
    column, row = (round(float(v)) for v in fit.apex_px)
    if not (half <= column < grey.shape[1] - half and half <= row < grey.shape[0] - half):
        return 1.0
    x, y = np.meshgrid(np.arange(-half, half + 1), np.arange(-half, half + 1))
    levels = grey[row - half : row + half + 1, column - half : column + half + 1][x * x + y * y <= fit.radius_px**2]
    levels = levels - levels.mean()
    return float(levels @ levels[::-1]) / max(float(levels @ levels), 1e-9)
