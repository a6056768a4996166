"""Ready-made pairs: made from arrays of radar positions and pixels that are already matched, and checked."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from calib_core.arrays import Points2, Points3
from calib_core.errors import InputError
from calib_core.measurements import NS_PER_S, Candidate, Pair
from calib_core.options import NoiseOptions
from calib_core.radar import covariance_from_sigma_polar, sigma_polar_of

_LAST_S = 9.2e9  # nanoseconds of later times do not fit 64 bits


def pairs_from_arrays(
    points_radar_m: Points3,
    pixels_px: Points2,
    *,
    sigma_px: float | None = None,
    sigma_polar: np.ndarray | None = None,
    noise: NoiseOptions | None = None,
    ids: Sequence[str] | None = None,
    times_s: Sequence[float] | np.ndarray | None = None,
) -> tuple[Pair, ...]:
    """Make pairs from matched radar positions and pixels.

    Args:
        points_radar_m: (n, 3) reflector positions in the radar frame: x forward, y left, z up.
        pixels_px: (n, 2) where the reflector's centre was seen; (0, 0) is the centre of the top-left pixel.
        sigma_px: standard deviation of a pixel per axis; None takes the options' value.
        sigma_polar: (3,) or (n, 3) standard deviations of range [m], azimuth and elevation [rad]; None takes `noise`.
        noise: assumed noise of the radar; None takes the defaults.
        ids: (n,) unique names; None numbers the pairs from 1.
        times_s: (n,) when each was seen [s], of any epoch: they tell whether a sensor turned on the way; None if unknown.

    Raises:
        InputError: the arrays differ in length, contain numbers that are not finite, or a position is at the radar.
    """
    points = _numbers(points_radar_m, 3, "points_radar_m")
    pixels = _numbers(pixels_px, 2, "pixels_px")
    names = [f"pair-{i + 1}" for i in range(len(points))] if ids is None else [str(name) for name in ids]
    if not len(points) == len(pixels) == len(names):
        raise InputError(
            f"{len(points)} radar positions, {len(pixels)} pixels and {len(names)} ids: give one of each per pair"
        )
    if len(set(names)) < len(names):
        raise InputError("ids: there are duplicates; give every pair its own id")
    for i, point in enumerate(points):
        if near := too_near(point):
            raise InputError(f"points_radar_m[{i}]: {near}")
    if sigma_px is not None and not (np.isfinite(sigma_px) and sigma_px > 0.0):
        raise InputError(f"sigma_px: is {sigma_px:g}; a standard deviation must be finite and above zero")
    times = np.full(len(points), None) if times_s is None else _times_ns(times_s, len(points))
    sigmas = _sigma_polar_rows(sigma_polar, noise or NoiseOptions(), len(points))
    covariances = covariance_from_sigma_polar(points, sigmas)
    return tuple(
        Pair(name, pixel, (Candidate(point, sigma, covariance),), sigma_px, image_time=time)
        for name, pixel, point, sigma, covariance, time in zip(
            names, pixels, points, sigmas, covariances, times, strict=True
        )
    )


def _numbers(values: Any, columns: int, name: str) -> np.ndarray:
    """Return an array of finite numbers, n x columns; masked entries count as missing."""
    try:
        array = np.asarray(np.ma.filled(np.ma.asarray(values).astype(np.float64, casting="same_kind"), np.nan))
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected an array of n x {columns} real numbers, got {_kind(values)}") from None
    if array.ndim != 2 or array.shape[1] != columns:
        raise InputError(
            f"{name}: expected an array of n x {columns}, got {' x '.join(map(str, array.shape)) or 'one value'}"
        )
    wrong = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if len(wrong):
        raise InputError(f"{name}[{wrong[0]}]: {array[wrong[0]].tolist()} is not finite; remove the pair")
    return array


def _times_ns(times_s: Any, count: int) -> np.ndarray:
    seconds = _numbers(np.reshape(times_s, (-1, 1)), 1, "times_s")[:, 0]
    if len(seconds) != count:
        raise InputError(f"times_s: {len(seconds)} times of {count} pairs; give one per pair")
    if np.abs(seconds).max(initial=0.0) >= _LAST_S:
        raise InputError(f"times_s: {seconds[np.abs(seconds).argmax()]:g} s is beyond the year 2262; give seconds")
    return np.round(seconds * NS_PER_S).astype(np.int64)


def _kind(values: Any) -> str:
    try:
        return f"an array of {np.asarray(values).dtype}"
    except ValueError:
        return "rows of different lengths"


def _sigma_polar_rows(sigma_polar: np.ndarray | None, noise: NoiseOptions, count: int) -> Points3:
    sigmas = np.asarray(sigma_polar_of(noise) if sigma_polar is None else sigma_polar, dtype=np.float64)
    if sigmas.shape not in ((3,), (count, 3)):
        raise InputError(
            f"sigma_polar: expected an array of 3 or of {count} x 3, got {' x '.join(map(str, sigmas.shape))}"
        )
    if not (np.isfinite(sigmas).all() and (sigmas > 0).all()):
        raise InputError("sigma_polar: every standard deviation must be finite and above zero")
    if (widest := float(sigmas[..., 1:].max())) > _WIDEST_RAD:
        raise InputError(f"sigma_polar: {widest:g} rad is no radar's angle; give radians, as np.deg2rad({widest:g})")
    return np.broadcast_to(sigmas, (count, 3)).copy()


_WIDEST_RAD = np.deg2rad(20.0)  # of a standard deviation, a choice: a beam without any interpolation is narrower
NEAREST_RETURN_M = 0.1
"""A reflector nearer than this is not a return of its own; angles of such a position mean nothing."""


def checked_pairs(pairs: Sequence[Pair], *, with_noise: bool) -> Sequence[Pair]:
    """Return the pairs unchanged if every number is possible.

    Args:
        pairs: in any order.
        with_noise: the radar positions need standard deviations.

    Raises:
        InputError: the message names the pair, what is wrong with it, and what to do.
    """
    for pair in pairs:
        _check_click(pair)
        for candidate in pair.candidates:
            _check_candidate(candidate, pair.id, with_noise=with_noise)
    repeated = [name for name, count in Counter(pair.id for pair in pairs).items() if count > 1]
    if repeated:
        raise InputError(f"pair {repeated[0]}: the id occurs more than once; give every pair its own id")
    return pairs


def too_near(position_radar_m: Sequence[float] | np.ndarray) -> str:
    """Return what is wrong with a position that is too near to be a return; empty if it is far enough."""
    range_m = float(np.linalg.norm(position_radar_m))
    if not range_m < NEAREST_RETURN_M:
        return ""
    # millimeters per meter
    where = "at the radar's origin" if range_m == 0.0 else f"{1000.0 * range_m:.3g} mm from the radar's origin"
    return f"is {where}, which cannot be a return; remove the pair, or give positions in metres"


def _check_click(pair: Pair) -> None:
    if not np.isfinite(pair.pixel_px).all():
        raise InputError(
            f"pair {pair.id}: pixel {_name_list(pair.pixel_px)} is not finite; click it again, or remove the pair"
        )
    if pair.sigma_px is not None and not (np.isfinite(pair.sigma_px) and pair.sigma_px > 0.0):
        raise InputError(
            f"pair {pair.id}: sigma_px is {pair.sigma_px:g}; a standard deviation must be finite and above zero, or None "
            "for the option's value"
        )


def _check_candidate(candidate: Candidate, name: str, *, with_noise: bool) -> None:
    position = candidate.position_radar_m
    if not np.isfinite(position).all():
        raise InputError(f"pair {name}: radar position {_name_list(position)} m is not finite; remove the pair")
    if near := too_near(position):
        raise InputError(f"pair {name}: radar position {_name_list(position)} m {near}")
    sigma = candidate.sigma_polar
    if with_noise and not (np.isfinite(sigma).all() and (sigma > 0.0).all()):
        raise InputError(
            f"pair {name}: sigma_polar is {_name_list(sigma)}; the standard deviations of range [m], azimuth and elevation "
            "[rad] must be finite and above zero"
        )


def _name_list(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in values.tolist()) + ")"
