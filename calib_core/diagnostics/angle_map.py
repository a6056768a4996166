"""Angle map: the radar's smooth angle errors by direction, as corrections to add to a measured azimuth and elevation.

An array's calibration error changes slowly with direction, is stable for years, and cannot be removed by a rigid
transform. The residuals of a calibration show it: the direction of the click minus the direction measured by the radar, at
the radar's range. Each of the two angles is modeled as a Gaussian process over direction,

    y_i = f(x_i) + e_i,   f ~ GP(0, a^2 exp(-|x - x'|^2 / 2 l^2)),   e_i ~ N(0, s^2 + click_i^2),

and every (a, l, s) of a grid is weighted by its marginal likelihood; the grid includes a = 0, so that the map is flat where
the pairs show nothing but independent noise. The map belongs to positions with `radar_errors` taken out, which the estimate
has found already. Pose and errors are fixed: the map is valid for them only.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points2, Points3, Values
from calib_core.camera import Camera
from calib_core.estimation.measurement_model import is_flat
from calib_core.geometry import RigidTransform
from calib_core.radar import AngleMap, cartesian_from_polar, polar_from_cartesian
from calib_core.results import Calibration, PairResult

_LEAST_PAIRS = 8
"""Fewer show little of a smooth error beside the pose's six unknowns (a choice)."""

_MOST_PAIRS = 120
"""Beyond this many the pairs are thinned out, because neighbors are redundant."""

# l in ratios of about sqrt(2): an array's errors change over a part of its field of view (a choice)
_LENGTHS_RAD = np.deg2rad([10.0, 14.0, 20.0, 28.0])
_SMOOTH_RAD = np.deg2rad([0.0, *0.2 * 2.0 ** np.arange(5)])  # a: none, and in factors of 2 (a choice)
_INDEPENDENT_RAD = np.deg2rad(0.05 * 2.0 ** np.arange(6))  # s in factors of 2 (a choice)
_IMPROBABLE = 1e-3  # share of the likeliest model's weight, below which one is left out to save time
_STEP_RAD, _BEYOND_RAD = _LENGTHS_RAD[0] / 2, _LENGTHS_RAD[0]  # the map's lines and its margin, by the shortest length
_ONE_PX = np.array([1.0, 0.0])
_DECIMALS = 6
"""Decimals of the map [rad]: far finer than any radar, and compact in a file."""

_MOST_OFF_RAD = np.deg2rad(15.0)
"""A larger difference is not a smooth error of the radar."""


def learn_angle_map(calibration: Calibration) -> AngleMap | None:
    """Learn the radar's smooth angle errors from the inlier pairs of a calibration.

    None if they cannot be learned: fewer than eight pairs, or a pose without a noise model (the paper's method).

    Args:
        calibration: of the default method.
    """
    pairs = _thinned([pair for pair in calibration.pairs if pair.inlier and not pair.excluded])
    if not calibration.options.models_noise or len(pairs) < _LEAST_PAIRS:
        return None
    observed = _angle_errors(calibration, pairs)
    if len(observed.polar) < _LEAST_PAIRS:
        return None
    directions = observed.polar[:, 1:]
    elevation, azimuth = (_axis(directions[:, angle]) for angle in (1, 0))
    grid = np.stack([*np.meshgrid(azimuth, elevation)], axis=-1).reshape(-1, 2)
    fields = [_learn(directions, observed.off_rad[:, angle], observed.click_rad, grid) for angle in (0, 1)]
    if is_flat(
        np.array([pair.point_radar_m for pair in pairs])
    ):  # a radar without elevation does not show its elevation error
        fields[1] = _Field(*(np.zeros_like(part) for part in (fields[1].mean, fields[1].sigma, fields[1].held_out)))
    polar = observed.polar.copy()
    polar[:, 1:] += np.stack([field.held_out for field in fields], axis=1)
    shape = (len(elevation), len(azimuth), 2)
    return AngleMap(
        azimuth_rad=azimuth.round(_DECIMALS),
        elevation_rad=elevation.round(_DECIMALS),
        correction_rad=np.stack([field.mean for field in fields], axis=1).reshape(shape).round(_DECIMALS),
        sigma_rad=np.stack([field.sigma for field in fields], axis=1).reshape(shape).round(_DECIMALS),
        raw_aed_px=_aed_px(calibration, observed, observed.polar),
        corrected_aed_px=_aed_px(calibration, observed, polar),
    )


def _thinned(pairs: list[PairResult]) -> list[PairResult]:
    if len(pairs) <= _MOST_PAIRS:
        return pairs
    return [pairs[i] for i in np.linspace(0, len(pairs) - 1, _MOST_PAIRS).round().astype(int)]


@dataclass(frozen=True, slots=True, eq=False)
class _AngleErrors:
    """Pixels (n, 2), polar positions (n, 3), clicked minus measured angles (n, 2), their sigma from the click (n,)."""

    pixels_px: Points2
    polar: Points3
    off_rad: Points2
    click_rad: Values


def _angle_errors(calibration: Calibration, pairs: list[PairResult]) -> _AngleErrors:
    """Measure the angle errors: the reflector lies on the click's ray at the radar's range."""
    pixels = np.array([pair.pixel_px for pair in pairs])
    reported = np.array([pair.point_radar_m for pair in pairs])
    polar = polar_from_cartesian(calibration.radar_errors.corrected(reported))
    by_click, distance_m = _on_the_rays(calibration.camera, calibration.camera_from_radar, pixels, polar[:, 0])
    shifted, _ = _on_the_rays(calibration.camera, calibration.camera_from_radar, pixels + _ONE_PX, polar[:, 0])
    one_px = np.hypot(*(shifted - by_click).T)
    off = by_click - polar[:, 1:]
    off[:, 0] = (off[:, 0] + np.pi) % (2 * np.pi) - np.pi
    with np.errstate(invalid="ignore"):
        kept = (distance_m > 0) & (np.abs(off) < _MOST_OFF_RAD).all(axis=1) & np.isfinite(one_px)
    click = calibration.options.noise.sigma_px * one_px
    return _AngleErrors(pixels[kept], polar[kept], off[kept], click[kept])


def _on_the_rays(
    camera: Camera, camera_from_radar: RigidTransform, pixels_px: Points2, range_m: Values
) -> tuple[Points2, Values]:
    """Return azimuth and elevation (n, 2) of the point on each pixel's ray at this radar range, and its distance (n,)."""
    direction = camera.rays(pixels_px) @ camera_from_radar.rotation
    centre = camera_from_radar.inverse().translation_m
    along = direction @ centre
    with np.errstate(invalid="ignore"):
        distance_m = -along + np.sqrt(along**2 - centre @ centre + range_m**2)
    return polar_from_cartesian(centre + distance_m[:, None] * direction)[:, 1:], distance_m


def _aed_px(calibration: Calibration, observed: _AngleErrors, polar: Points3) -> float:
    projected = calibration.camera.project(calibration.camera_from_radar @ cartesian_from_polar(polar))
    return float(np.nanmean(np.linalg.norm(projected - observed.pixels_px, axis=1)))


def _axis(angles_rad: Values) -> Values:
    """Return grid lines that cover these angles with a margin, at multiples of the step."""
    first = np.floor((angles_rad.min() - _BEYOND_RAD) / _STEP_RAD)
    last = np.ceil((angles_rad.max() + _BEYOND_RAD) / _STEP_RAD)
    return np.asarray(np.arange(first, last + 1) * _STEP_RAD)


@dataclass(frozen=True, slots=True, eq=False)
class _Field:
    """One angle's smooth error: mean and sigma (g,) on the grid, and its leave-one-out prediction at each pair (n,)."""

    mean: Values
    sigma: Values
    held_out: Values


def _learn(directions: Points2, off_rad: Values, click_rad: Values, grid: Points2) -> _Field:
    """Regress one angle's error on direction, with the same click noise for all pairs.

    All covariances of one length then share the kernel's eigenvectors U: K = U diag(k) U^T, V = U diag(a^2 k + s^2) U^T.
    """
    noise = np.repeat(_INDEPENDENT_RAD**2, len(_SMOOTH_RAD)) + float(np.median(click_rad)) ** 2
    smooth = np.tile(_SMOOTH_RAD**2, len(_INDEPENDENT_RAD))
    flat = np.where(
        smooth == 0.0, np.log(len(_LENGTHS_RAD)), 0.0
    )  # without a smooth part all lengths are the same model
    between, to_grid = _squared(directions, directions), _squared(grid, directions)
    bases = [np.linalg.eigh(np.exp(-0.5 * between / length_rad**2)) for length_rad in _LENGTHS_RAD]
    precisions = [1.0 / (np.outer(smooth, np.maximum(strength, 0.0)) + noise[:, None]) for strength, _ in bases]
    log_likelihood = np.array(
        [
            -0.5 * (precision @ (axes.T @ off_rad) ** 2 - np.log(precision).sum(axis=1)) - flat
            for precision, (_, axes) in zip(precisions, bases, strict=True)
        ]
    )
    shares = np.exp(log_likelihood - log_likelihood.max())
    shares = np.where(shares > _IMPROBABLE, shares, 0.0) / shares[shares > _IMPROBABLE].sum()
    mean, square, held_out = np.zeros(len(grid)), np.zeros(len(grid)), np.zeros(len(off_rad))
    for length_rad, share, precision, (_, axes) in zip(_LENGTHS_RAD, shares, precisions, bases, strict=True):
        kept = np.flatnonzero(share)
        if not kept.size:
            continue
        share, amplitude, precision = share[kept], smooth[kept, None], precision[kept]
        on_grid = np.exp(-0.5 * to_grid / length_rad**2) @ axes
        pull = precision * (axes.T @ off_rad)
        means = amplitude * (pull @ on_grid.T)
        spread = amplitude - amplitude**2 * (precision @ (on_grid**2).T)
        mean += share @ means
        square += share @ (np.maximum(spread, 0.0) + means**2)
        held_out += share @ (off_rad - (pull @ axes.T) / (precision @ (axes**2).T))
    return _Field(mean, np.sqrt(np.maximum(square - mean**2, 0.0)), held_out)


def _squared(a: Points2, b: Points2) -> np.ndarray:
    return np.asarray(((a[:, None] - b[None]) ** 2).sum(axis=2))
