"""Checks of ready-made pairs: numbers that cannot be a click, a return or a standard deviation."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from calib_core.errors import InputError
from calib_core.measurements import Candidate, Pair

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
    where = "at the radar's origin" if range_m == 0.0 else f"{1000.0 * range_m:.3g} mm from the radar's origin"
    return f"is {where}, which cannot be a return; remove the pair, or give positions in metres"


def _check_click(pair: Pair) -> None:
    if not np.isfinite(pair.pixel_px).all():
        raise InputError(
            f"pair {pair.id}: pixel {_numbers(pair.pixel_px)} is not finite; click it again, or remove the pair"
        )
    if pair.sigma_px is not None and not (np.isfinite(pair.sigma_px) and pair.sigma_px > 0.0):
        raise InputError(
            f"pair {pair.id}: sigma_px is {pair.sigma_px:g}; a standard deviation must be finite and above zero, or None "
            "for the option's value"
        )


def _check_candidate(candidate: Candidate, name: str, *, with_noise: bool) -> None:
    position = candidate.position_radar_m
    if not np.isfinite(position).all():
        raise InputError(f"pair {name}: radar position {_numbers(position)} m is not finite; remove the pair")
    if near := too_near(position):
        raise InputError(f"pair {name}: radar position {_numbers(position)} m {near}")
    sigma = candidate.sigma_polar
    if with_noise and not (np.isfinite(sigma).all() and (sigma > 0.0).all()):
        raise InputError(
            f"pair {name}: sigma_polar is {_numbers(sigma)}; the standard deviations of range [m], azimuth and elevation "
            "[rad] must be finite and above zero"
        )


def _numbers(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in values.tolist()) + ")"
